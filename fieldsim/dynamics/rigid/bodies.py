"""Free bodies of a simulation: their state on the host, moved launch by launch by one kernel on the CPU.

The few bodies are moved by one thread. Their poses at every stage place the rows of elements that particles feel (see
`sources`), on the particles' device.
"""

import contextlib
import dataclasses
import math
import warnings

import numpy as np
import warp as wp

from fieldsim.arrays import kept, read_only
from fieldsim.copies import Uncopied
from fieldsim.dynamics.bare_sources import refuse_bodies_on_sources
from fieldsim.dynamics.refusals import refuse_method
from fieldsim.dynamics.rigid.body import FreeBody, free_body
from fieldsim.dynamics.rigid.kernel import RigidSplitting, energy_kernel, pair_kernel, rigid_kernel
from fieldsim.dynamics.rigid.loss_tables import KEPT_OF_LOSSES, KEPT_OF_TOUCHES, losses_of, touches_of
from fieldsim.dynamics.rigid.losses import Losses
from fieldsim.dynamics.rigid.start import refuse_overlaps, refuse_unequal_pulls
from fieldsim.dynamics.rigid.tables import (
    HOST,
    grains_of,
    host_array,
    masses_of,
    prescribed_tables,
    rigid_state,
    set_stiffness,
    shells_of,
    that_feel,
)
from fieldsim.dynamics.rigid.thin import ThinSurfaces
from fieldsim.dynamics.rigid.touches import Touches
from fieldsim.dynamics.rigid.track import Track
from fieldsim.dynamics.state import restored_if_broken_off
from fieldsim.errors import FieldsimError, FieldsimWarning
from fieldsim.launch import launch
from fieldsim.numerics import quaternion
from fieldsim.sources.elements import Sources
from fieldsim.world.motion import Pose

# Steps must be shorter than this share of 1 / (angular frequency of contact).
RESOLVED = 0.5
# Room for so many points that touch, and more where surfaces have more.
SPARE = 64

# What of a body's state follows which fields of `Rigid`.
_PLACE, _TURNING = ("position", "rotation"), ("rotation", "angular_velocity")
_GIVERS = {"x": _PLACE, "x_rest": _PLACE, "q": ("rotation",), "p": ("velocity",), "p_rest": ("velocity",)}
_GIVERS |= dict.fromkeys(("spin", "spin_rest", "e", "e_rest"), _TURNING)


class FreeBodies(Uncopied):
    """All free bodies of a world. len() is their number; they count in the world's order.

    state: what moves them, as the kernel keeps it on the host; its forces and torques are those of the last
    `potential_energy()`.
    """

    _remedy = "copy what it gives, such as bodies.centers"

    def __init__(self, world, time: float):
        self.world = world = world.frozen()
        self.starts: list[FreeBody] = [free_body(i, body) for i, body in enumerate(world.bodies) if body.free]
        self._number = {start.index: b for b, start in enumerate(self.starts)}
        if not self.starts:
            return
        self.time = time
        self._gravity = Sources(world, "gravity", time, prescribed=True)
        self._surfaces = Sources(world, "surface", time, prescribed=True)
        self._masses = masses_of(self.starts)
        self.state = rigid_state(self.starts)
        # Without stiffness at first, as it follows from the energy of the start.
        self._shells = shells_of(self.starts, [0.0] * len(self))
        self._shells.grains = grains_of(self.starts, self._surfaces, time)
        self._thin = ThinSurfaces(world, max(self._shells.spacing.numpy()))
        self._prepare_losses()
        refuse_unequal_pulls(self.starts)
        poses = world.at(time).poses
        refuse_overlaps(world, self.starts, poses, time, [start.index for start in self.starts])
        refuse_bodies_on_sources(world, poses, time, self.starts)
        self._set_stiffness()
        self._stand()

    def _set_stiffness(self):
        """Set the stiffness of contacts from the present energy."""
        budget = self.kinetic_energies.sum() + abs(self.potential_energy())
        surfaces = [body for body in self.world.bodies if body.surface is not None]
        self.stiffnesses = [start.stiffness(budget) if start.shell else 0.0 for start in self.starts]
        set_stiffness(self._shells, self.starts, self.stiffnesses)
        # Alone a surface meets nothing.
        hardest = zip(self.starts, self.stiffnesses, strict=True) if len(surfaces) > 1 else ()
        self._highest_frequency = max((s.highest_frequency(k, budget) for s, k in hardest if k), default=0.0)
        self._warned = False

    def _prepare_losses(self):
        """Friction and damping, and room for what touches, where some body has them; else nothing is listed."""
        self._touches, self._losses = Touches(), Losses()
        self.lossy = any(start.motion.loses for start in self.starts)
        if self.lossy:
            # A point touches few bodies at a time; a point of what is prescribed, few free ones.
            capacity = SPARE + 2 * (len(self._shells.points) + len(self._thin))
            self._losses = losses_of(self.starts, capacity, HOST)
            ranges = [start.radius if start.shell else 0.0 for start in self.starts]
            self._touches = touches_of(ranges, capacity, HOST)

    def _stand(self):
        """Keep the bodies' present poses only."""
        self._track = self._tracked([self.time], self.state.x.numpy()[None], self.state.q.numpy()[None])

    def moved(self, index: int, motion: dict) -> FreeBody:
        """Body `index` of the world as if it started now, with the given fields of its `Rigid`."""
        b, pose = self._number[index], self.present[index]
        start, turn = self.starts[b], Pose(rotation=motion.get("rotation", pose.rotation))
        # Spin about an axis without a moment of inertia is a rounding error.
        axes = (turn.matrix @ start.frame.matrix)[:, ~start.idle]
        now = {"position": pose.position, "rotation": pose.rotation, "velocity": self.momenta[b] / start.mass}
        now["angular_velocity"] = axes @ (axes.T @ self.angular_velocities[b])
        return start.moved(**now | motion)

    def refuse_place(self, start: FreeBody, poses, time: float) -> None:
        """Raise InputError where a body would start in another one or on a bare source; poses: of all bodies then."""
        starts = [start if other.index == start.index else other for other in self.starts]
        refuse_overlaps(self.world, starts, poses, time, [start.index])
        refuse_bodies_on_sources(self.world, poses, time, starts)

    def put(self, start: FreeBody, given, time: float) -> None:
        """Let a body go on from `time`, now, as it starts, in what the fields of `Rigid` that are `given` say."""
        b = self._number[start.index]
        self.starts[b], self.time = start, time
        fresh = rigid_state([start])
        for name, givers in _GIVERS.items():
            if any(giver in given for giver in givers):
                getattr(self.state, name).numpy()[b] = getattr(fresh, name).numpy()[0]
        if self.lossy:  # what touches is met anew
            self._touches.counts.zero_()
        self._set_stiffness()
        self._stand()

    def poses_with(self, time: float, moved=None) -> tuple[Pose, ...]:
        """The poses of all the world's bodies at `time`, now, but for those of `moved`, by index."""
        known = self.present | (moved or {})
        return tuple(known.get(i) or body.pose_at(time) for i, body in enumerate(self.world.bodies))

    def __len__(self) -> int:
        return len(self.starts)

    # Motion

    @property
    def evaluations(self) -> int:
        """Evaluations of an element that a stage takes, about: each one's with each other's."""
        if not self:
            return 0
        own = len(self._masses.kinds) + len(self._shells.kinds)
        return own * (own + len(self._gravity) + len(self._surfaces))

    @property
    def kinds_used(self):
        """Kinds that occur: of gravity and of surfaces, each of the prescribed bodies' and the free ones' elements."""
        masses, shells = (tuple(np.unique(t.kinds.numpy()).tolist()) for t in (self._masses, self._shells))
        return (self._gravity.kinds_used, masses), (self._surfaces.kinds_used, shells)

    def leap(self, times, dt: float, method) -> None:
        """Move from times[0] to times[-1], the stages of whole steps of length dt."""
        times = np.asarray(times)
        refuse_method("Simulation", method, self.world)
        stages, steps = len(times), (len(times) - 1) // len(method.drifts)
        self._warn_of_stiffness(dt)
        state = self.state
        for name, count, dtype in (
            ("places", stages, wp.vec3d),
            ("turns", stages, wp.quatd),
            ("speeds", steps + 1, wp.vec3d),
            ("rates", steps + 1, wp.vec3d),
        ):
            setattr(state, name, wp.empty((count, len(self)), dtype=dtype, device=HOST))
        inputs = [
            steps,
            wp.float64(dt),
            _splitting(method),
            *prescribed_tables(self._gravity, self._surfaces, times, self.lossy),
            self._thin.table(times, HOST),
            self._masses,
            self._shells,
            self._touches,
            self._losses,
        ]
        launch(rigid_kernel(*self.kinds_used, self.lossy), 1, inputs, [state], device=HOST, threads=1)
        self.time = float(times[-1])
        speeds, rates = state.speeds.numpy(), state.rates.numpy()
        self._track = self._tracked(times, state.places.numpy(), state.turns.numpy(), speeds, rates)
        self._refuse_nonsense()
        self._refuse_crowd()

    @contextlib.contextmanager
    def whole(self):
        """Within the block the bodies move whole: where it is broken off, they are as before it."""
        if not self:
            yield
            return
        before = self.time, self._track
        arrays = [getattr(self.state, name) for name in _GIVERS]
        if self.lossy:
            arrays += [getattr(self._touches, name) for name in KEPT_OF_TOUCHES]
            arrays += [getattr(self._losses, name) for name in KEPT_OF_LOSSES]
        try:
            with restored_if_broken_off(arrays):
                yield
        except BaseException:
            self.time, self._track = before
            raise

    def _warn_of_stiffness(self, dt):
        frequency = self._highest_frequency
        if frequency * dt > RESOLVED and not self._warned:
            self._warned = True
            warnings.warn(
                f"free bodies: the hardest contact that their energy allows swings at {frequency:.3g} radians per "
                f"unit of time, too fast for dt = {dt:.3g}; give dt below {RESOLVED / frequency:.2g}, or a lower "
                "Rigid(stiffness=...)",
                FieldsimWarning,
                stacklevel=5,
            )

    def _refuse_nonsense(self):
        x, p, spin = self.state.x.numpy(), self.state.p.numpy(), self.state.spin.numpy()
        bad = np.flatnonzero(~np.isfinite([x, p, spin]).all(axis=(0, 2)))
        if bad.size:
            start = self.starts[bad[0]]
            raise FieldsimError(
                f"at time {self.time:g} {start.name} is at {tuple(x[bad[0]].tolist())} with angular momentum "
                f"{tuple(spin[bad[0]].tolist())}; soften what it falls into, give it a surface, or shorten dt"
            )

    def _refuse_crowd(self):
        if self.lossy and (most := int(self._touches.counts.numpy().max())) > (room := len(self._touches.places)):
            raise FieldsimError(
                f"at time {self.time:g} {most} points of surfaces touch, and there is room for {room}; give the free "
                "bodies a higher Rigid(stiffness=...), so that they lie less deep in each other"
            )

    # Poses

    def _tracked(self, times, places, turns, speeds=None, rates=None):
        back = np.array([start.frame.rotation for start in self.starts]) * (1.0, -1.0, -1.0, -1.0)
        rotations = quaternion.product(turns[..., [3, 0, 1, 2]], np.broadcast_to(back, (*turns.shape[:-1], 4)))
        centers = np.array([start.frame.position for start in self.starts])
        return Track(np.asarray(times), places, rotations, centers, speeds, rates)

    def poses(self, index: int, times) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (stages, 3, 3), positions (stages, 3) of body `index` at times of the latest launch."""
        rotations, positions = self._track.at(self._number[index], np.asarray(times))
        return quaternion.matrices(rotations), positions

    @property
    def present(self) -> dict[int, Pose]:
        """The poses now, by index among the world's bodies."""
        found = {}
        for start in self.starts:
            rotations, positions = self._track.at(self._number[start.index], self._track.times[-1:])
            found[start.index] = Pose(tuple(positions[0].tolist()), tuple(rotations[0].tolist()))
        return found

    # State, world frame: copies to read only

    def _rows(self, name):
        return kept(getattr(self.state, name).numpy()) if self.starts else read_only(np.zeros((0, 3)))

    @property
    def masses(self) -> np.ndarray:
        """Masses (B,)."""
        return read_only(np.array([start.mass for start in self.starts]))

    @property
    def centers(self) -> np.ndarray:
        """Centres of mass (B, 3)."""
        return self._rows("x")

    @property
    def momenta(self) -> np.ndarray:
        """Momenta (B, 3)."""
        return self._rows("p")

    @property
    def spins(self) -> np.ndarray:
        """Angular momenta about the centres of mass (B, 3), in the world's frame."""
        return self._rows("spin")

    @property
    def angular_velocities(self) -> np.ndarray:
        """Angular velocities (B, 3), radians per unit of time, in the world's frame."""
        if not self.starts:
            return self.spins
        turns = quaternion.matrices(self.state.q.numpy()[:, [3, 0, 1, 2]])
        local = np.einsum("bji,bj->bi", turns, self.spins)
        return read_only(np.einsum("bij,bj->bi", turns, self._masses.inverse.numpy() * local))

    @property
    def lost(self) -> float:
        """The energy that friction and damping have taken from all free bodies so far."""
        return float(self._losses.lost.numpy()[0]) if self.starts and self.lossy else 0.0

    @property
    def kinetic_energies(self) -> np.ndarray:
        """Of motion and rotation, (B,)."""
        translation = 0.5 * np.sum(self.momenta**2, axis=1) / self.masses
        return read_only(translation + 0.5 * np.sum(self.spins * self.angular_velocities, axis=1))

    def accelerations(self) -> np.ndarray:
        """Of the centres of mass, now, (B, 3)."""
        self.potential_energy()
        return read_only(self.state.force.numpy() / self.masses[:, None])

    @property
    def pairs(self) -> int:
        """How many pairs of a mass point and an element of gravity a stage sums."""
        return len(self._masses.points) * (len(self._gravity) + len(self._masses.kinds))

    @property
    def longest_step(self) -> float:
        """The longest step that resolves the hardest contact that their energy allows; inf where there is none."""
        return RESOLVED / self._highest_frequency if self.starts and self._highest_frequency else math.inf

    def as_bodies(self) -> list:
        """The world's bodies with the free ones started as they move now."""
        bodies, poses = list(self.world.bodies), self.present
        velocities, turning = self.momenta / self.masses[:, None], self.angular_velocities
        for b, start in enumerate(self.starts):
            pose, k = poses[start.index], self.stiffnesses[b] or None
            # Rounding turns what has no inertia.
            axes = (pose.matrix @ start.frame.matrix)[:, ~start.idle]
            state = {"velocity": velocities[b], "angular_velocity": axes @ axes.T @ turning[b], "stiffness": k}
            motion = dataclasses.replace(start.motion, position=pose.position, rotation=pose.rotation, **state)
            bodies[start.index] = dataclasses.replace(start.body, motion=motion)
        return bodies

    def potential_energy(self) -> float:
        """Of all free bodies in the gravity and the contacts of the prescribed ones and of each other, now."""
        if not self.starts:
            return 0.0
        return self._acting(self._gravity, self._surfaces, self._masses, self._shells)

    def _acting(self, gravity, surfaces, masses, shells, thin=None):
        """The potential energy now; sets forces and torques. thin: whose points alone press, default all's."""
        energy = wp.empty(1, dtype=wp.float64, device=HOST)
        now = np.array([self.time])
        points = self._thin.table(now, HOST, thin)
        inputs = [*prescribed_tables(gravity, surfaces, now), points, masses, shells, self.state]
        launch(energy_kernel(*self.kinds_used), 1, inputs, [energy], device=HOST, threads=1)
        return float(energy.numpy()[0])

    def wrenches(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces and torques about their centres of mass (S, B, 3), world frame, of all bodies of the world, now."""
        count = len(self)
        found = np.zeros((2, len(self.world.bodies), count, 3))
        if not count:
            return read_only(found[0]), read_only(found[1])
        pairs = [wp.empty((count, count), dtype=wp.vec3d, device=HOST) for _ in range(3)]
        (_, masses), (_, shells) = self.kinds_used
        launch(pair_kernel(masses, shells), count**2, [self._masses, self._shells, self.state], pairs, device=HOST)
        forces, torques, backs = (array.numpy() for array in pairs)
        free = [start.index for start in self.starts]
        found[0, free] = forces.swapaxes(0, 1) - forces
        found[1, free] = torques.swapaxes(0, 1) + backs
        feeling = that_feel(self._masses, self._shells)
        for index, body in enumerate(self.world.bodies):
            if not body.free and (body.gravity is not None or body.surface is not None):
                alone = self.world.replace(bodies=[body], particles=[])
                gravity, surfaces = (
                    Sources(alone, role, self.time, prescribed=True) for role in ("gravity", "surface")
                )
                self._acting(gravity, surfaces, *feeling, index)
                found[:, index] = self.state.force.numpy(), self.state.torque.numpy()
        return read_only(found[0]), read_only(found[1])


def _splitting(method) -> RigidSplitting:
    """The shares of a method's steps."""
    splitting = RigidSplitting()
    splitting.kicks = host_array(method.kicks, wp.float64)
    splitting.drifts = host_array(method.drifts, wp.float64)
    return splitting
