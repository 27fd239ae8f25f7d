"""Simulations: particles moved through the fields of a world's bodies."""

import functools
import math
import warnings

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.arrays import kept
from fieldsim.copies import Uncopied
from fieldsim.dynamics.auto import Auto, Choice, choose, integrator_of
from fieldsim.dynamics.bare import refuse_particles_on_sources
from fieldsim.dynamics.events import Events, balls_of, events_of
from fieldsim.dynamics.integrators import moments
from fieldsim.dynamics.mutual import MutualGravity
from fieldsim.dynamics.radau import Radau, RadauRun
from fieldsim.dynamics.refusals import refuse_method, refuse_mixture
from fieldsim.dynamics.rigid import FreeBodies
from fieldsim.dynamics.rigid_diagnostics import Wrenches, wrenches
from fieldsim.dynamics.sources import Sources, Stages, field_and_gradient, upload
from fieldsim.dynamics.state import state_of
from fieldsim.dynamics.steps import LANES, contact_kernel, method_of, release_kernel, splitting_kernel
from fieldsim.dynamics.surfaces import Surfaces
from fieldsim.errors import FieldsimError, FieldsimWarning, InputError
from fieldsim.launch import device_named, launch
from fieldsim.world.contact import Status
from fieldsim.world.world import Snapshot, World

# A launch spans at most so many steps, and so many particle-steps and moving elements.
LAUNCH_STEPS = 256
LAUNCH_WORK = 2_000_000
LAUNCH_ROWS = 65_536


class Simulation(Uncopied):
    """A world's free bodies and particles in motion; bodies pull particles, not particles bodies.

    integrator: `Leapfrog()` unless told; "auto" is `Auto()`, in whose place comes its `choice`. time: where it starts.
    device: "cpu" (default), "cuda", ...; threads: CPU threads (all cores unless told). State is float64, with
    compensated summation. The same inputs give the same bytes, whatever the number of threads.
    log: how many events at surfaces are kept of each particle, the latest (see `events`).
    """

    _remedy = "copy its world and make another Simulation, or keep simulation.snapshot()"

    def __init__(
        self, world, integrator=None, *, time: float = 0.0, device=None, threads: int | None = None, log: int = 4
    ):
        self.world = validate.instance("Simulation", "world", world, World, "give a fs.World")
        # What moves here: what the world is given later would move nothing.
        self._parts = (*world.bodies, *world.particles)
        self._time = validate.number("Simulation", "time", time)
        self.device = device_named(device)
        self.threads = threads
        self.choice: Choice | None = None
        self.integrator = integrator_of("Simulation", integrator)
        refuse_mixture("Simulation", world)
        self._steps_done = 0
        self._watchers = []
        self._free = FreeBodies(world, self.time)
        self._gravity = Sources(world, "gravity", self.time, self._free.poses)
        self._mutual = MutualGravity(world, self.device, threads)
        self._sizes = [len(particles) for particles in world.particles]
        positions, velocities = ([getattr(p, name) for p in world.particles] for name in ("positions", "velocities"))
        self._state = state_of(
            *(np.concatenate([np.zeros((0, 3)), *sets]) for sets in (positions, velocities)), self.device
        )
        self._surfaces = self._surfaces_of(world)
        grain = self._surfaces.grain if self._surfaces else math.inf
        # Whether anything can happen to a particle but free motion.
        self._eventful = bool(self._surfaces) or world.escape_radius is not None
        kept = self._kept(log) if self._eventful else 0
        self._balls = balls_of(world.particles, world.escape_radius, grain, kept, self.device)
        if self._surfaces:
            self._release()
        refuse_particles_on_sources(world, world.at(self.time).poses, self.time, self.positions)
        if isinstance(self.integrator, Auto):
            options = {"time": self.time, "device": device, "threads": threads}
            self.choice = choose(self.integrator, world, self.time, functools.partial(Simulation, **options))
            self.integrator = self.choice.integrator
        refuse_method("Simulation", self.integrator, world)
        self.radau = None
        if isinstance(self.integrator, Radau):
            start = self._state.x, self._state.v, self.time
            self.radau = RadauRun(self.integrator, world, self._gravity, *start, threads=threads)
        self._still = upload(self._gravity, np.array([self.time]), self.device)
        _, self._state.a = field_and_gradient(self._gravity, self._still, self._state.x, threads=threads)

    @property
    def _count(self):
        """Number of particles."""
        return len(self._state.x)

    def _surfaces_of(self, world):
        """What particles may touch, or None."""
        touching = any(particles.contact for particles in world.particles)
        return Surfaces(world, self.time, self._free.poses) if touching else None

    @staticmethod
    def _kept(log):
        if not isinstance(log, int) or isinstance(log, bool) or log < 1:
            raise InputError(f"Simulation: log is {log!r}; give a whole number of events per particle, at least 1")
        return log

    def _release(self):
        """Particles that start inside a surface are moved out of it, with a warning."""
        inside = wp.empty(self._count, dtype=wp.int32, device=self.device)
        # Two equal stages: the world as it is now, standing still.
        surfaces = self._surfaces.upload(np.array([self.time, self.time]), self.device)
        kernel = release_kernel(self._surfaces.sources.kinds_used)
        inputs, outputs = [surfaces, self._balls], [self._state.x, inside]
        launch(kernel, self._count, inputs, outputs, device=self.device, threads=self.threads)
        count = int(inside.numpy().sum())
        if count:
            warnings.warn(
                f"{count} of {self._count} particles start inside a surface and were moved out of it; "
                "start them farther away or give them contact=None",
                FieldsimWarning,
                stacklevel=3,
            )

    def _sets(self, array):
        """Copies on the host to read only, one (N, 3) array per set of particles."""
        ends = np.cumsum(self._sizes)
        rows = array.numpy()
        return tuple(kept(rows[end - size : end]) for end, size in zip(ends, self._sizes, strict=True))

    @property
    def positions(self) -> tuple[np.ndarray, ...]:
        """Positions, world frame, (N, 3) per set of particles, copies to read only."""
        return self._sets(self._state.x)

    @property
    def velocities(self) -> tuple[np.ndarray, ...]:
        """Velocities, world frame, (N, 3) per set of particles, copies to read only."""
        return self._sets(self._state.v)

    @property
    def time(self) -> float:
        """The present time."""
        return self._time

    def _refuse_changes(self):
        """Raise InputError where the world's bodies or particles are no longer those that move."""
        now = (*self.world.bodies, *self.world.particles)
        if len(now) != len(self._parts) or any(one is not other for one, other in zip(now, self._parts, strict=True)):
            raise InputError(
                "Simulation: its world has been given or has lost bodies or particles since the Simulation was made; "
                "make another Simulation of it"
            )

    def advance(self, until: float) -> None:
        """Run to the time `until` in equal steps, at most the integrator's dt long, the last landing on it exactly."""
        until = validate.number("Simulation.advance", "until", until)
        if until < self.time:
            raise InputError(f"Simulation.advance: until is {until:g}, before the present time {self.time:g}")
        self._refuse_changes()
        if self.radau:
            self.radau.advance(until)
            self._state.x, self._state.v = self.radau.read(np.full(self._count, until))
        else:
            self._march(until)
        self._time = until
        self._refuse_nonsense()

    @property
    def steps_done(self) -> int:
        """Particle-steps taken so far."""
        return self.radau.steps if self.radau else self._steps_done

    def _march(self, until):
        """Equal steps to the time `until`."""
        count, dt = self.integrator.steps(until - self.time)
        start = self.time
        self._balls.begin = start
        if self._count or self._free:
            for first in range(0, count, self._steps_per_launch):
                steps = np.arange(first, min(first + self._steps_per_launch, count))
                self._balls.first = first
                self._leap(steps, start, dt)
                self._time = start + dt * float(steps[-1] + 1)

    def _refuse_nonsense(self):
        for index, (x, v) in enumerate(zip(self.positions, self.velocities, strict=True)):
            bad = np.flatnonzero(~np.isfinite([x, v]).all(axis=(0, 2)))
            if bad.size:
                finer = "" if self.radau else ", or shorten dt"
                raise FieldsimError(
                    f"at time {self.time:g} particle {bad[0]} of set {index} is at {tuple(x[bad[0]].tolist())} with "
                    f"velocity {tuple(v[bad[0]].tolist())} ({bad.size} such particles); "
                    f"soften what they fall into{finer}"
                )

    @property
    def _steps_per_launch(self):
        """Launches are kept short enough for small tables and a prompt answer to Ctrl-C."""
        stages = len(self.integrator.drifts)
        pulling = max(1, len(self._gravity) + len(self._mutual))
        by_work = LAUNCH_WORK // (max(1, self._count) * pulling * stages)
        by_rows = LAUNCH_ROWS // (max(1, len(self._gravity.moving_kinds)) * stages)
        return max(1, min(LAUNCH_STEPS, by_work, by_rows))

    def _leap(self, steps, start, dt):
        """Take consecutive `steps`, counted from the time `start`: first the free bodies, then what flies past them."""
        for watcher in self._watchers:
            watcher(self._gravity, self._state, steps, start, dt)
        nodes = start + dt * moments(steps, self.integrator.nodes)
        if self._free:
            self._free.leap(nodes, dt, self.integrator)
        self._fly(steps, start, dt, self._gravity_at(nodes))
        self._steps_done += len(steps) * self._count

    def _fly(self, steps, start, dt, gravity):
        """Launch consecutive `steps` of all particles; gravity: the bodies' tables at the stages of all of them."""
        integrator = self.integrator
        method = method_of(integrator, dt, self.device)
        options = {"device": self.device, "threads": self.threads}
        if self._mutual:
            self._mutual.leap(self._state, len(steps), dt, integrator, gravity, self._gravity.kinds_used)
        elif self._eventful:
            parts = np.linspace(0.0, 1.0, integrator.evaluations + 1)
            times = start + dt * moments(steps, parts)
            near = gravity if np.array_equal(parts, integrator.nodes) else self._gravity_at(times)
            kinds, surfaces = ((), ()), Stages()
            if self._surfaces:
                kinds, surfaces = self._surfaces.sources.kinds_used, self._surfaces.upload(times, self.device)
            kernel = contact_kernel(self._gravity.kinds_used, kinds, any(integrator.gradients))
            inputs = [len(steps), wp.float64(dt), method, gravity, near, surfaces, self._balls]
            launch(kernel, self._count, inputs, [self._state], grain=16, **options)
        else:
            together = not self.device.is_cuda
            kernel = splitting_kernel(self._gravity.kinds_used, any(integrator.gradients), together)
            groups = -(-self._count // LANES) if together else self._count
            launch(kernel, groups, [len(steps), method, gravity], [self._state], grain=2, **options)

    def watch(self, watcher) -> None:
        """Call `watcher(sources, state, steps, start, dt)` ahead of every launch of `steps` from time `start` on."""
        self._watchers.append(watcher)

    def _gravity_at(self, times):
        """Gravity's tables of a launch whose stages are at `times`."""
        return upload(self._gravity, times, self.device, self._still) if self._gravity.moving else self._still

    @property
    def bounces(self) -> int:
        """Number of contacts made so far by all particles: bounces and landings."""
        return int(self._balls.bounces.numpy().sum())

    @property
    def bounce_counts(self) -> tuple[np.ndarray, ...]:
        """Contacts made so far, (N,) int32 per set of particles."""
        return self._sets(self._balls.bounces)

    @property
    def states(self) -> tuple[np.ndarray, ...]:
        """What each particle does, (N,) int32 of `Status` per set of particles."""
        return self._sets(self._balls.states)

    @property
    def spins(self) -> tuple[np.ndarray, ...]:
        """Angular velocities of particles that roll, world frame, (N, 3) per set of particles."""
        return self._sets(self._balls.spins)

    def census(self) -> dict[str, int]:
        """How many particles are moving, resting, absorbed and escaped; together, all of them."""
        counts = np.bincount(self._balls.states.numpy(), minlength=len(Status))
        return {state.name.lower(): int(counts[state]) for state in Status}

    @property
    def events(self) -> Events:
        """What happened to the particles at surfaces so far: the latest `log` events of each."""
        return events_of(self._balls)

    @property
    def bodies(self) -> FreeBodies:
        """The free bodies: their state, energies, momenta and wrenches."""
        return self._free

    @property
    def mutual(self) -> MutualGravity:
        """The pull of the particles on each other."""
        return self._mutual

    def wrenches(self) -> Wrenches:
        """Forces and torques of every body on every free one, now, world frame."""
        return wrenches(self._free)

    def snapshot(self) -> Snapshot:
        """The present moment."""
        self._refuse_changes()
        free = self._free.present
        poses = tuple(free.get(i) or body.pose_at(self.time) for i, body in enumerate(self.world.bodies))
        return Snapshot(self.world, self.time, poses, self.positions, self.velocities)

    def snapshots(self, times):
        """Advance to each of the increasing `times` in turn and yield the snapshot there.

        A run that fails under way has yielded the snapshots before.
        """
        for time in times:
            self.advance(time)
            yield self.snapshot()
