"""Simulations: particles moved through the fields of a world's bodies."""

import contextlib
import functools
import math
from collections.abc import Iterable, Iterator

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.copies import Uncopied
from fieldsim.dynamics.auto import Auto, Choice, IntegratorLike, choose, integrator_of, warn_of_caveat
from fieldsim.dynamics.bare_sources import refuse_particles_on_sources
from fieldsim.dynamics.contact.event_detection import Motion
from fieldsim.dynamics.contact.events import contact_particles
from fieldsim.dynamics.contact.particle_state import WRITTEN
from fieldsim.dynamics.contact.readings import ContactReadings
from fieldsim.dynamics.contact.release import released
from fieldsim.dynamics.contact.surfaces import ground_at, surfaces_touched
from fieldsim.dynamics.diagnostics.followed import Watched
from fieldsim.dynamics.integrators.propagator import StepTables
from fieldsim.dynamics.integrators.splittings import Splitting, moments
from fieldsim.dynamics.manoeuvres import free_index, motion_given, restart, rows_given, rows_of_set, warn_of_choice
from fieldsim.dynamics.radau.radau import Radau, RadauRun
from fieldsim.dynamics.radau.shared_run import run_of
from fieldsim.dynamics.refusals import refuse_method, refuse_mixture, refuse_other_matter
from fieldsim.dynamics.rigid.bodies import FreeBodies
from fieldsim.dynamics.rigid.diagnostics import Wrenches, wrenches
from fieldsim.dynamics.splitting.groups import lanes_of, launch_groups
from fieldsim.dynamics.splitting.kernels import contact_kernel, splitting_kernel
from fieldsim.dynamics.splitting.method import method_of
from fieldsim.dynamics.splitting.mutual_gravity import MutualGravity
from fieldsim.dynamics.state import (
    State,
    columns,
    refuse_nonsense,
    restored_if_broken_off,
    split_by_sets,
    state_of,
    state_of_sets,
)
from fieldsim.errors import InputError
from fieldsim.launch import checked_threads, device_named
from fieldsim.sources.elements import Sources
from fieldsim.sources.field import field_and_gradient
from fieldsim.sources.stages import Stages, upload
from fieldsim.types import ArrayLike, RealLike, VectorLike, WholeLike
from fieldsim.world.contact import Status
from fieldsim.world.snapshot import Snapshot
from fieldsim.world.world import World, given_world

# A launch spans at most so many steps, and so many particle-steps and moving elements.
LAUNCH_STEPS = 8192
LAUNCH_WORK = 2_000_000
LAUNCH_ROWS = 65_536
# Where the field of the surfaces changes by more, something that rested has lost its ground.
GROUND = 1e-3


class Simulation(ContactReadings, Watched, Uncopied):
    """A world's free bodies and particles in motion; bodies pull particles, not particles bodies.

    integrator: default `Leapfrog()`; "auto" is `Auto()`, which is replaced by its `choice`. time: of the start.
    device: "cpu" (default), "cuda", ...; threads: CPU threads (default all cores). State is float64, with
    compensated summation. The same inputs give the same bytes, whatever the number of threads.
    log: how many events at surfaces are kept of each particle, the latest (see `contact.events`). pull_tolerance: the
    largest error of accelerations of particles by each other over the root mean square of all; 0: exact sums; default
    exact for up to 20,000 that pull, 1e-6 for more.
    """

    _remedy = "copy its world and make another Simulation, or keep simulation.snapshot()"

    def __init__(
        self,
        world: World,
        integrator: IntegratorLike | None = None,
        *,
        time: RealLike = 0.0,
        device: str | None = None,
        threads: WholeLike | None = None,
        log: WholeLike = 4,
        pull_tolerance: RealLike | None = None,
    ):
        # Checked at every call: whether the world has changed since. What was added later would move nothing.
        self._given, self.world = world, given_world("Simulation", world)
        world = self.world
        self._time = validate.number("Simulation", "time", time)
        self.device = device_named(device)
        self.threads = threads = checked_threads("Simulation", threads)
        log = validate.whole("Simulation", "log", log, at_least=1)
        self.choice: Choice | None = None
        self.integrator = integrator_of("Simulation", integrator)
        refuse_mixture("Simulation", world)
        self._steps_done = 0
        self._watchers, self._sums, self._ledgers = [], [], []
        self._free = FreeBodies(world, self.time)
        self._gravity = Sources(world, "gravity", self.time, self._free.poses)
        self._mutual = MutualGravity(world, self.device, threads, pull_tolerance)
        self._sizes = [len(particles) for particles in world.particles]
        self._state = state_of_sets(world.particles, self.device)
        self._surfaces = surfaces_touched(world, self.time, self._free.poses)
        grain = self._surfaces.grain if self._surfaces else math.inf
        # Whether anything can happen to a particle but free motion.
        self._eventful = bool(self._surfaces) or world.escape_radius is not None
        kept = log if self._eventful else 0
        self._balls = contact_particles(world.particles, world.escape_radius, grain, kept, self.device)
        self._motions = wp.zeros(self._count if self._eventful else 0, dtype=Motion, device=self.device)
        self._state.x = self._released(self._state.x)
        refuse_particles_on_sources(world, world.at(self.time).poses, self.time, self.positions)
        if isinstance(self.integrator, Auto):
            options = {"time": self.time, "device": device, "threads": threads}
            self.choice = choose(self.integrator, world, self.time, functools.partial(Simulation, **options))
            self.integrator = self.choice.integrator
            warn_of_caveat(self.choice)
        refuse_method("Simulation", self.integrator, world)
        self._mutual.choose_sums(self.integrator)
        self._method = self.integrator
        self.radau: RadauRun | None = None
        if isinstance(self.integrator, Radau):
            start = self._state.x, self._state.v, self.time, self._mutual
            self.radau = run_of(self.integrator, world, self._gravity, *start, threads=threads)
        self._still = upload(self._gravity, np.array([self.time]), self.device)
        self._state.a = self._pull(self._state.x)

    @property
    def _splitting(self) -> StepTables:
        """The method, where it takes steps in common."""
        assert isinstance(self.integrator, Splitting)
        return self.integrator

    @property
    def _count(self):
        """Number of particles."""
        return len(self._state.x)

    def _released(self, x, which=True):
        """Positions x (N,) with those of the particles `which` that lie inside a surface moved out, with a warning."""
        return released(self._surfaces, self._balls, x, self.time, which, threads=self.threads)

    def _sets(self, array):
        """Copies on the host to read only, one (N, 3) array per set of particles."""
        return split_by_sets(array, self._sizes)

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
        """Raise InputError where the world's bodies or particles, or the method, are no longer those of the start."""
        if self.integrator is not self._method:
            raise InputError(
                f"Simulation: its integrator was {self._method} and is now {self.integrator!r}; make another Simulation"
            )
        now = self._given.frozen()
        if now is not self.world:
            refuse_other_matter("Simulation", self.world, now)
            self.world = now  # which differs in what is only seen

    def advance(self, until: RealLike) -> None:
        """Run to the time `until` in equal steps, at most the integrator's dt long, the last landing on it exactly.

        Broken off under way, by Ctrl-C or by a function that fails, it is at a time before, and may go on from there.
        """
        until = validate.number("Simulation.advance", "until", until)
        if until < self.time:
            raise InputError(
                f"Simulation.advance: until is {until:g}, before the present time {self.time:g}; give a later one"
            )
        self._refuse_changes()
        if self.radau:
            self._state.x, self._state.v = self.radau.flown(until, self._balls)
        else:
            self._march(until)
        self._time = until
        finer = "" if self.radau else ", or shorten dt"
        refuse_nonsense(until, self.positions, self.velocities, f"soften what they fall into{finer}")

    @property
    def steps_done(self) -> int:
        """Particle-steps taken so far."""
        return self.radau.steps if self.radau else self._steps_done

    def _march(self, until):
        """Equal steps to the time `until`."""
        count, dt = self._splitting.steps(until - self.time)
        if count and dt < (grain := np.spacing(max(abs(until), abs(self.time)))):
            raise InputError(
                f"Simulation.advance: dt is {dt:g}, too short for times about {until:g}, which are {grain:.2g} apart; "
                "let the run start at an earlier time, or give a longer dt"
            )
        start = self.time
        self._balls.begin = start
        if self._count or self._free:
            for first in range(0, count, self._steps_per_launch):
                steps = np.arange(first, min(first + self._steps_per_launch, count))
                self._balls.first = first
                with self._free.whole(), restored_if_broken_off(self._written()):
                    self._leap(steps, start, dt)
                    self._time = start + dt * float(steps[-1] + 1)

    def _written(self):
        """The arrays that steps write, but for the free bodies'."""
        balls = [*(getattr(self._balls, name) for name in WRITTEN), self._motions] if self._eventful else []
        return [*(getattr(self._state, name) for name in columns(State)), *balls, *self._sums]

    @property
    def _steps_per_launch(self):
        """Launches are kept short enough for small tables and a prompt answer to Ctrl-C."""
        stages = len(self._splitting.drifts)
        touched = len(self._surfaces) if self._surfaces else 0
        each = max(1, len(self._gravity) + len(self._mutual) + touched)
        by_work = LAUNCH_WORK // ((max(1, self._count) * each + self._free.evaluations) * stages)
        by_rows = LAUNCH_ROWS // (max(1, len(self._gravity.moving_kinds)) * stages)
        return max(1, min(LAUNCH_STEPS, by_work, by_rows))

    def _leap(self, steps, start, dt):
        """Take consecutive `steps`, counted from the time `start`: first the free bodies, then what flies past them."""
        for watcher in self._watchers:
            watcher(self._gravity, self._state, steps, start, dt)
        nodes = start + dt * moments(steps, self._splitting.nodes)
        if self._free:
            self._free.leap(nodes, dt, self._splitting)
        self._fly(steps, start, dt, self._gravity_at(nodes))
        self._steps_done += len(steps) * self._count

    def _fly(self, steps, start, dt, gravity):
        """Launch consecutive `steps` of all particles; gravity: the bodies' tables at the stages of all of them."""
        integrator, kinds = self._splitting, self._gravity.kinds_used
        if self._mutual:
            return self._mutual.leap(self._state, len(steps), dt, integrator, gravity, kinds)
        code = any(integrator.gradients), lanes_of(self.device)
        inputs = [len(steps), method_of(integrator, dt, self.device), gravity]
        if self._eventful:
            parts = np.linspace(0.0, 1.0, integrator.evaluations + 1)
            times = start + dt * moments(steps, parts)
            near = gravity if np.array_equal(parts, integrator.nodes) else self._gravity_at(times)
            touched, surfaces = ((), ()), Stages()
            if self._surfaces:
                touched, surfaces = self._surfaces.sources.kinds_used, self._surfaces.upload(times, self.device)
            kernel = contact_kernel(kinds, touched, *code)
            inputs += [near, surfaces, self._balls, self._motions]
        else:
            kernel = splitting_kernel(kinds, *code)
        launch_groups(kernel, self._count, inputs, [self._state], device=self.device, threads=self.threads)

    # Manoeuvres

    def set_particles(
        self,
        index: WholeLike = 0,
        *,
        positions: ArrayLike | None = None,
        velocities: ArrayLike | None = None,
        spins: ArrayLike | None = None,
    ) -> None:
        """Give particles other positions, velocities or spins now: a manoeuvre, between two calls of `advance`.

            simulation.set_particles(0, velocities=simulation.velocities[0] + (0, 0.1, 0))

        index: of the set of particles. Each (N, 3), world frame; what is not given stays. Particles whose rows are
        what they were go on as if nothing had happened. The others start anew from here, as in a Simulation that begins
        now: with fresh steps and sums, and moving, also where they had rested, were absorbed or had escaped; within a
        surface they are moved out of it, with a warning. What they made so far, bounces and events, is kept.

        An `EnergyLog` takes into account what the manoeuvre gives. Raises InputError, and changes nothing, for what
        does not fit the set, and for a place on a bare source.
        """
        who = "Simulation.set_particles"
        self._refuse_changes()
        rows = rows_of_set(who, self._sizes, index)
        now = {"positions": self._state.x, "velocities": self._state.v, "spins": self._balls.spins}
        given = {"positions": positions, "velocities": velocities, "spins": spins}
        arrays, changed = rows_given(who, now, rows, given)
        x = self._released(wp.array(arrays["positions"], dtype=wp.vec3d, device=self.device), changed)
        refuse_particles_on_sources(self.world, self._free.poses_with(self.time), self.time, self._sets(x))
        with self._manoeuvre():
            self._restart(changed, x.numpy(), arrays["velocities"], arrays["spins"])

    def set_body(
        self,
        index: WholeLike,
        *,
        position: VectorLike | None = None,
        rotation: VectorLike | None = None,
        velocity: VectorLike | None = None,
        angular_velocity: VectorLike | None = None,
    ) -> None:
        """Give a free body another place, turn or motion now: a manoeuvre, between two calls of `advance`.

            simulation.set_body(1, velocity=(0, 0.5, 0))

        index: among the world's bodies. The others are as in `Rigid`; what is not given stays. Contacts get the
        stiffness that the energy of now asks for (see `Rigid`). Particles stay where they are: what rested on the body
        starts anew, and where it comes over particles they are moved out of its surface, with a warning.

        An `EnergyLog` takes into account what the manoeuvre gives. Raises InputError, and changes nothing, for a body
        that does not move freely, and where it would lie in another one or on a bare source.
        """
        who = "Simulation.set_body"
        self._refuse_changes()
        index = free_index(who, self.world, index)
        motion = {"position": position, "rotation": rotation, "velocity": velocity}
        given = motion_given(who, **motion, angular_velocity=angular_velocity)
        start = self._free.moved(index, given)
        poses = self._free.poses_with(self.time, {index: start.body.motion})
        if "position" in given or "rotation" in given:
            self._free.refuse_place(start, poses, self.time)
            refuse_particles_on_sources(self.world, poses, self.time, self.positions)
        with self._manoeuvre():
            before, ground = self._state.x.numpy().copy(), ground_at(self._surfaces, self._state.x, self.time)
            self._free.put(start, given, self.time)
            x = self._released(wp.clone(self._state.x)).numpy()
            resting = np.isin(self._balls.states.numpy(), (Status.RESTING, Status.ABSORBED))
            now = ground_at(self._surfaces, self._state.x, self.time)
            changed = (x != before).any(axis=1) | resting & (np.abs(now - ground) > GROUND)
            self._restart(changed, x, self._state.v.numpy(), self._balls.spins.numpy())
            self._state.a = self._pull(self._state.x)

    def _restart(self, changed, positions, velocities, spins):
        """Let the particles `changed` (N,) start anew from here; arrays (N, 3) of all."""
        fresh = state_of(positions, velocities, self.device)
        fresh.a = self._pull(fresh.x)
        restart(self._state, self._balls, self._motions, changed, fresh, spins)
        if self._mutual:
            self._state.a = fresh.a  # those that stay feel those that do not
        if self.radau:
            self.radau.restart(changed, fresh.x, fresh.v, self.time)

    def _pull(self, x):
        """Accelerations of the particles at x, now."""
        gravity = self._gravity_at(np.array([self.time]))
        if self._mutual:
            return self._mutual.accelerations(x, gravity, self._gravity.kinds_used)
        return field_and_gradient(self._gravity, gravity, x, threads=self.threads)[1]

    @contextlib.contextmanager
    def _manoeuvre(self):
        """What happens within is a manoeuvre: diagnostics that follow the motion are notified."""
        before = [ledger.measured() for ledger in self._ledgers]
        yield
        for ledger, measured in zip(self._ledgers, before, strict=True):
            ledger.manoeuvred(measured)
        if self.choice and not self.radau:
            warn_of_choice(self.integrator)

    def _gravity_at(self, times):
        """Gravity's tables of a launch whose stages are at `times`."""
        return upload(self._gravity, times, self.device, self._still) if self._gravity.moving else self._still

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
        self._refuse_changes()
        return wrenches(self._free)

    def snapshot(self) -> Snapshot:
        """The present moment."""
        self._refuse_changes()
        return Snapshot(self.world, self.time, self._free.poses_with(self.time), self.positions, self.velocities)

    def snapshots(self, times: Iterable[RealLike]) -> Iterator[Snapshot]:
        """Advance to each of the increasing `times` in turn and yield the snapshot there.

        A run that fails under way has yielded the snapshots before.
        """
        times = validate.iterator("Simulation.snapshots", "times", times, "give a list of times")
        return (self._snapshot_at(time) for time in times)

    def _snapshot_at(self, time):
        self.advance(time)
        return self.snapshot()
