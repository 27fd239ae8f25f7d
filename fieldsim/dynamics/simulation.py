"""Simulations: particles moved through the fields of a world's bodies."""

import functools
import warnings

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.integrators import Leapfrog
from fieldsim.dynamics.mutual import MutualGravity
from fieldsim.dynamics.rigid import FreeBodies
from fieldsim.dynamics.rigid_diagnostics import Wrenches, wrenches
from fieldsim.dynamics.sources import Sources, field_and_gradient, upload
from fieldsim.dynamics.steps import Balls, contact_kernel, leapfrog_kernel, release_kernel
from fieldsim.dynamics.surfaces import Surfaces
from fieldsim.errors import FieldsimError, FieldsimWarning, InputError
from fieldsim.launch import device_named, launch
from fieldsim.world.motion import pose_at
from fieldsim.world.world import Snapshot

# A launch spans at most so many steps, and so many particle-steps and moving elements.
LAUNCH_STEPS = 256
LAUNCH_WORK = 2_000_000
LAUNCH_ROWS = 65_536


class Simulation:
    """A world's free bodies and particles in motion; bodies pull particles, not particles bodies.

    integrator: `Leapfrog(dt)`. time: where it starts. device: "cpu" (default), "cuda", ...; threads: CPU threads (all
    cores unless told). State is float64. The same inputs give the same bytes, whatever the number of threads.
    """

    def __init__(self, world, integrator=None, *, time: float = 0.0, device=None, threads: int | None = None):
        self.world = world
        self.integrator = Leapfrog() if integrator is None else integrator
        if not isinstance(self.integrator, Leapfrog):
            raise InputError(f"Simulation: integrator is {integrator!r}; give fs.Leapfrog(dt)")
        self.time = validate.number("Simulation", "time", time)
        self.device = device_named(device)
        self.threads = threads
        self.steps_done = 0
        self._free = FreeBodies(world, self.time)
        self._gravity = Sources(world, "gravity", self.time, self._free.poses)
        self._mutual = MutualGravity(world, self.device, threads)
        self._sizes = [len(particles) for particles in world.particles]
        self._x = self._upload([particles.positions for particles in world.particles])
        self._v = self._upload([particles.velocities for particles in world.particles])
        self._bounces = wp.zeros(len(self._x), dtype=wp.int32, device=self.device)
        self._surfaces = Surfaces(world, self.time, self._free.poses) if any(p.contact for p in world.particles) else ()
        if self._surfaces:
            self._release()
        self._still = upload(self._gravity, np.array([self.time]), self.device)
        _, self._a = field_and_gradient(self._gravity, self._still, self._x, threads=threads)

    @functools.cached_property
    def _balls(self):
        """The particles as contact sees them."""
        sets = self.world.particles
        balls = Balls()
        radii = np.repeat([p.radius for p in sets], self._sizes)
        restitutions = np.repeat([p.contact.restitution if p.contact else -1.0 for p in sets], self._sizes)
        balls.radii = wp.array(radii, dtype=wp.float64, device=self.device)
        balls.restitutions = wp.array(restitutions, dtype=wp.float64, device=self.device)
        balls.grain = self._surfaces.grain
        return balls

    def _release(self):
        """Particles that start inside a surface are moved out of it, with a warning."""
        inside = wp.empty(len(self._x), dtype=wp.int32, device=self.device)
        # Two equal stages: the world as it is now, standing still.
        surfaces = self._surfaces.upload(np.array([self.time, self.time]), self.device)
        kernel = release_kernel(self._surfaces.sources.kinds_used)
        inputs, outputs = [surfaces, self._balls], [self._x, inside]
        launch(kernel, len(self._x), inputs, outputs, device=self.device, threads=self.threads)
        count = int(inside.numpy().sum())
        if count:
            warnings.warn(
                f"{count} of {len(self._x)} particles start inside a surface and were moved out of it; "
                "start them farther away or give them contact=None",
                FieldsimWarning,
                stacklevel=3,
            )

    def _upload(self, sets):
        everything = np.concatenate(sets) if sets else np.zeros((0, 3))
        return wp.array(everything, dtype=wp.vec3d, device=self.device)

    def _sets(self, array):
        """Copies on the host, one (N, 3) array per set of particles."""
        return np.split(array.numpy().copy(), np.cumsum(self._sizes)[:-1]) if self._sizes else []

    @property
    def positions(self) -> list[np.ndarray]:
        """Positions, world frame, (N, 3) per set of particles."""
        return self._sets(self._x)

    @property
    def velocities(self) -> list[np.ndarray]:
        """Velocities, world frame, (N, 3) per set of particles."""
        return self._sets(self._v)

    def advance(self, until: float) -> None:
        """Run to the time `until` in equal steps, at most the integrator's dt long, the last landing on it exactly."""
        until = validate.number("Simulation.advance", "until", until)
        if until < self.time:
            raise InputError(f"Simulation.advance: until is {until:g}, before the present time {self.time:g}")
        count, dt = self.integrator.steps(until - self.time)
        start = self.time
        if len(self._x) or self._free:
            for first in range(0, count, self._steps_per_launch):
                stages = np.arange(first, min(first + self._steps_per_launch, count) + 1)
                self._leap(start + dt * stages, dt)
                self.time = start + dt * float(stages[-1])
        self.time = until
        self._refuse_nonsense()

    def _refuse_nonsense(self):
        for index, (x, v) in enumerate(zip(self.positions, self.velocities, strict=True)):
            bad = np.flatnonzero(~np.isfinite(x + v).all(axis=1))
            if bad.size:
                raise FieldsimError(
                    f"at time {self.time:g} particle {bad[0]} of set {index} is at {tuple(x[bad[0]].tolist())} with "
                    f"velocity {tuple(v[bad[0]].tolist())} ({bad.size} such particles); "
                    "soften what they fall into, or shorten dt"
                )

    @property
    def _steps_per_launch(self):
        """Launches are kept short enough for small tables and a prompt answer to Ctrl-C."""
        by_work = LAUNCH_WORK // max(1, len(self._x) * (len(self._gravity) + len(self._mutual)))
        by_rows = LAUNCH_ROWS // max(1, len(self._gravity.moving_kinds))
        return max(1, min(LAUNCH_STEPS, by_work, by_rows))

    def _leap(self, times, dt):
        steps = len(times) - 1
        if self._free:
            self._free.leap(times, dt, self.integrator)
        gravity = upload(self._gravity, times, self.device, self._still) if self._gravity.moving else self._still
        if self._mutual:
            self._mutual.leap(self._x, self._v, steps, dt, self.integrator, gravity, self._gravity.kinds_used)
            self.steps_done += steps * len(self._x)
            return
        state = [self._x, self._v, self._a]
        if self._surfaces:
            kernel = contact_kernel(self._gravity.kinds_used, self._surfaces.sources.kinds_used)
            surfaces = self._surfaces.upload(times, self.device)
            inputs, state = [steps, wp.float64(dt), gravity, surfaces, self._balls], [*state, self._bounces]
        else:
            kernel = leapfrog_kernel(self._gravity.kinds_used)
            inputs = [steps, wp.float64(dt), gravity]
        launch(kernel, len(self._x), inputs, state, device=self.device, grain=16, threads=self.threads)
        self.steps_done += steps * len(self._x)

    @property
    def bounces(self) -> int:
        """Number of contacts made so far by all particles: bounces and landings."""
        return int(self._bounces.numpy().sum())

    @property
    def bounce_counts(self) -> list[np.ndarray]:
        """Contacts made so far, (N,) int32 per set of particles."""
        return self._sets(self._bounces)

    @property
    def bodies(self) -> FreeBodies:
        """The free bodies: their state, energies, momenta and wrenches."""
        return self._free

    def wrenches(self) -> Wrenches:
        """Forces and torques of every body on every free one, now, world frame."""
        return wrenches(self._free)

    def snapshot(self) -> Snapshot:
        """The present moment."""
        free = self._free.present
        poses = tuple(free.get(i) or pose_at(body.motion, self.time) for i, body in enumerate(self.world.bodies))
        return Snapshot(self.world, self.time, poses, tuple(self.positions), tuple(self.velocities))

    def snapshots(self, times):
        """Advance to each of the increasing `times` in turn and yield the snapshot there."""
        for time in times:
            self.advance(time)
            yield self.snapshot()
