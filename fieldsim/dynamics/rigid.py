"""Free bodies of a simulation: their state on the host, moved launch by launch by one kernel on the CPU.

Few bodies in one thread: what comes out, their poses at every stage, places the rows that particles feel (see
`sources`), on whatever device these are.
"""

import dataclasses

import numpy as np
import warp as wp

from fieldsim.dynamics.inertia import NOTHING, MassProperties, mass_properties
from fieldsim.dynamics.mass_points import enough, mass_points
from fieldsim.dynamics.rigid_contact import Shells
from fieldsim.dynamics.rigid_gravity import Masses
from fieldsim.dynamics.rigid_steps import Rigids, Splitting, energy_kernel, rigid_kernel
from fieldsim.dynamics.sources import Sources, upload
from fieldsim.errors import FieldsimError, InputError
from fieldsim.launch import launch
from fieldsim.potentials import cells
from fieldsim.world.motion import Pose

# Relative error of the mass points' pull on what touches the body.
TOLERANCE = 1e-8
# Where a body has no surface, what comes nearer than this share of its size counts as touching.
NEAR = 0.25
HOST = "cpu"


@dataclasses.dataclass(frozen=True, eq=False)
class FreeBody:
    """One free body as it starts. index: among the world's bodies; frame: its principal frame in the body's frame.

    moments (3,), ascending; those that are none (see `Rigid`) replaced, as nothing turns there.
    """

    index: int
    name: str
    body: object
    mass: float
    moments: np.ndarray
    frame: Pose

    def elements(self, role) -> cells.Elements:
        """Its elements in the principal frame."""
        own = self.body.gravity_elements(0.0) if role == "gravity" else self.body.surface_elements(0.0)
        return cells.Elements(self._placed(own.rows), own.kinds, own.order)

    def _placed(self, rows):
        turn = self.frame.matrix.T
        return cells.place(rows, turn, -turn @ np.array(self.frame.position))

    def mass_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Mass points (n, 3) in the principal frame and their masses (n,)."""
        skeleton = self.body.skeleton
        clearance = 2.0 * self.body.surface.radius if self.body.surface else NEAR * _extent(skeleton)
        points, weights = mass_points(skeleton, [enough(p, clearance, TOLERANCE) for p in skeleton])
        return (points - self.frame.position) @ self.frame.matrix, self.mass * weights


def free_body(index, body) -> FreeBody:
    """The start of body `index`; raises InputError for mass properties that cannot be."""
    name = f"Body {index}" + (f" ({body.name})" if body.name else "")
    properties = mass_properties(body)
    moments, axes = properties.principal()
    if moments[0] <= NOTHING * moments[2] or moments[2] == 0.0:
        moments = _without_nothing(name, body, properties, moments, axes)
    frame = Pose(tuple(properties.center), _quaternion(axes))
    return FreeBody(index, name, body, properties.mass, moments, frame)


def _without_nothing(name, body, properties: MassProperties, moments, axes):
    """Moments of a point or a straight line, with any in the place of those that are none: nothing turns there."""
    scale = moments[2] if moments[2] > 0.0 else properties.mass
    spin = np.array(body.motion.matrix).T @ np.array(body.motion.angular_velocity)
    around = axes[:, moments <= NOTHING * scale].T @ spin
    if np.abs(around).max(initial=0.0) > 1e-9 * np.linalg.norm(spin):
        what = "a point" if moments[2] <= 0.0 else "a straight line"
        raise InputError(
            f"{name}: its mass lies on {what}, which has no inertia to spin about itself with; give its motion "
            "inertia='solid' or a matrix, or an angular_velocity without that part"
        )
    return np.where(moments <= NOTHING * scale, scale, moments)


def _extent(skeleton):
    points, _ = mass_points(skeleton, [8] * len(skeleton))
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def _quaternion(matrix):
    """Unit quaternion (w, x, y, z) of a rotation matrix (Bar-Itzhack 2000)."""
    m = matrix
    k = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [0.0, m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [0.0, 0.0, m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [0.0, 0.0, 0.0, m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    return tuple(np.linalg.eigh(k, UPLO="U")[1][:, -1].tolist())


def product(p, q) -> np.ndarray:
    """Products of quaternions (..., 4) as (w, x, y, z)."""
    p, q = np.asarray(p), np.asarray(q)
    scalar = p[..., :1] * q[..., :1] - np.sum(p[..., 1:] * q[..., 1:], axis=-1, keepdims=True)
    vector = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def matrices(q) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    w, v = q[..., :1, None], q[..., 1:]
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    return np.eye(3) + 2.0 * (w * cross + cross @ cross)


class FreeBodies:
    """All free bodies of a world. len() is their number; they count in the world's order."""

    def __init__(self, world, time: float):
        self.world = world
        self.starts = [free_body(i, body) for i, body in enumerate(world.bodies) if body.free]
        self._number = {start.index: b for b, start in enumerate(self.starts)}
        if not self.starts:
            return
        self.time = time
        self._gravity = Sources(world, "gravity", time, prescribed=True)
        self._surfaces = Sources(world, "surface", time, prescribed=True)
        self._masses = self._packed_masses()
        self._shells = self._packed_shells()
        self._state = self._started()
        self._track = self._present_track(time)

    def __len__(self) -> int:
        return len(self.starts)

    # What the kernels read

    def _packed_masses(self):
        masses = Masses()
        points, weights = zip(*(start.mass_points() for start in self.starts), strict=True)
        masses.mass = _array([start.mass for start in self.starts], wp.float64)
        masses.inverse = _array([1.0 / start.moments for start in self.starts], wp.vec3d)
        masses.points, masses.first_point = _array(np.concatenate(points), wp.vec3d), _firsts(points)
        masses.weights = _array(np.concatenate(weights), wp.float64)
        _pack_rows(masses, [start.elements("gravity") for start in self.starts])
        return masses

    def _packed_shells(self):
        shells = Shells()
        none = [np.zeros((0, 3))] * len(self)
        shells.points, shells.first_point = _array(np.concatenate(none), wp.vec3d), _firsts(none)
        shells.areas = _array([], wp.float64)
        shells.reach = _array(np.zeros(len(self)), wp.float64)
        _pack_rows(shells, [start.elements("surface") for start in self.starts])
        return shells

    def _started(self):
        state = Rigids()
        frames = np.array([start.frame.rotation for start in self.starts])
        bodies = [start.body.motion for start in self.starts]
        q = product([motion.rotation for motion in bodies], frames)
        centers = [np.array(m.position) + m.matrix @ s.frame.position for m, s in zip(bodies, self.starts, strict=True)]
        turns = matrices(q)
        spins = np.array([motion.angular_velocity for motion in bodies])
        local = np.einsum("bji,bj->bi", turns, spins)
        moments = np.array([start.moments for start in self.starts])
        state.x = _array(centers, wp.vec3d)
        state.p = _array([s.mass * np.array(m.velocity) for m, s in zip(bodies, self.starts, strict=True)], wp.vec3d)
        state.q = _array(q[:, [1, 2, 3, 0]], wp.quatd)
        state.spin = _array(np.einsum("bij,bj->bi", turns, moments * local), wp.vec3d)
        state.e = _array(0.5 * np.sum(moments * local**2, axis=1), wp.float64)
        state.e_rest = wp.zeros(len(self), dtype=wp.float64, device=HOST)
        for name in ("x_rest", "p_rest", "spin_rest", "force", "torque"):
            setattr(state, name, wp.zeros(len(self), dtype=wp.vec3d, device=HOST))
        return state

    @property
    def _kinds(self):
        """Kinds that occur: of gravity and of surfaces, each of the prescribed bodies' and the free ones' elements."""
        masses, shells = (tuple(np.unique(t.kinds.numpy()).tolist()) for t in (self._masses, self._shells))
        return (self._gravity.kinds_used, masses), (self._surfaces.kinds_used, shells)

    # Motion

    def leap(self, times, dt: float, method) -> None:
        """Move from times[0] to times[-1], the stages of whole steps of length dt."""
        stages = len(times)
        steps = (stages - 1) // len(method.drifts)
        state = self._state
        state.places = wp.empty((stages, len(self)), dtype=wp.vec3d, device=HOST)
        state.turns = wp.empty((stages, len(self)), dtype=wp.quatd, device=HOST)
        sources = [upload(role, times, HOST) for role in (self._gravity, self._surfaces)]
        inputs = [steps, wp.float64(dt), _splitting(method), *sources, self._masses, self._shells]
        launch(rigid_kernel(*self._kinds), 1, inputs, [state], device=HOST, threads=1)
        self.time = float(times[-1])
        self._track = np.array(times), *self._poses(state.places.numpy(), state.turns.numpy())
        self._refuse_nonsense()

    def _refuse_nonsense(self):
        x, p, spin = self._state.x.numpy(), self._state.p.numpy(), self._state.spin.numpy()
        bad = np.flatnonzero(~np.isfinite(x + p + spin).all(axis=1))
        if bad.size:
            start = self.starts[bad[0]]
            raise FieldsimError(
                f"at time {self.time:g} {start.name} is at {tuple(x[bad[0]].tolist())} with angular momentum "
                f"{tuple(spin[bad[0]].tolist())}; soften what it falls into, give it a surface, or shorten dt"
            )

    # Poses

    def _present_track(self, time):
        return np.array([time]), *self._poses(self._state.x.numpy()[None], self._state.q.numpy()[None])

    def _poses(self, places, turns):
        """Quaternions (stages, B, 4) and positions (stages, B, 3) of the bodies' frames, of centres and turns."""
        back = np.array([start.frame.rotation for start in self.starts]) * (1.0, -1.0, -1.0, -1.0)
        rotations = product(turns[..., [3, 0, 1, 2]], np.broadcast_to(back, (*turns.shape[:-1], 4)))
        centers = np.array([start.frame.position for start in self.starts])
        return rotations, places - np.einsum("sbij,bj->sbi", matrices(rotations), centers)

    def poses(self, index: int, times) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (stages, 3, 3), positions (stages, 3) of body `index` at a launch's stages, or now at any time."""
        at, rotations, positions = self._track
        b = self._number[index]
        rows = slice(None) if np.array_equal(at, times) else np.full(len(times), -1)
        return matrices(rotations[rows, b]), positions[rows, b]

    @property
    def present(self) -> dict[int, Pose]:
        """The poses now, by index among the world's bodies."""
        if not self.starts:
            return {}
        _, rotations, positions = self._track
        return {
            start.index: Pose(tuple(positions[-1, b].tolist()), tuple(rotations[-1, b].tolist()))
            for b, start in enumerate(self.starts)
        }

    # State, world frame

    @property
    def masses(self) -> np.ndarray:
        """Masses (B,)."""
        return self._masses.mass.numpy().copy()

    @property
    def centers(self) -> np.ndarray:
        """Centres of mass (B, 3)."""
        return self._state.x.numpy().copy()

    @property
    def momenta(self) -> np.ndarray:
        """Momenta (B, 3)."""
        return self._state.p.numpy().copy()

    @property
    def spins(self) -> np.ndarray:
        """Angular momenta about the centres of mass (B, 3), in the world's frame."""
        return self._state.spin.numpy().copy()

    @property
    def angular_velocities(self) -> np.ndarray:
        """Angular velocities (B, 3), radians per unit of time, in the world's frame."""
        turns = matrices(self._state.q.numpy()[:, [3, 0, 1, 2]])
        local = np.einsum("bji,bj->bi", turns, self.spins)
        return np.einsum("bij,bj->bi", turns, self._masses.inverse.numpy() * local)

    def potential_energy(self) -> float:
        """Of all free bodies in the gravity and the contacts of the prescribed ones and of each other, now."""
        energy = wp.empty(1, dtype=wp.float64, device=HOST)
        sources = [upload(role, np.array([self.time]), HOST) for role in (self._gravity, self._surfaces)]
        inputs = [*sources, self._masses, self._shells, self._state]
        launch(energy_kernel(*self._kinds), 1, inputs, [energy], device=HOST, threads=1)
        return float(energy.numpy()[0])


def _splitting(method) -> Splitting:
    """The shares of a method's steps; raises InputError for one that free bodies cannot be moved by."""
    if not hasattr(method, "kicks") or any(method.gradients):
        raise InputError(
            f"Simulation: {method!r} cannot move free bodies; give a splitting without force gradients, such as "
            "fs.Leapfrog(dt)"
        )
    splitting = Splitting()
    splitting.kicks = _array(method.kicks, wp.float64)
    splitting.drifts = _array(method.drifts, wp.float64)
    return splitting


def _array(values, dtype):
    return wp.array(np.asarray(values, dtype=float), dtype=dtype, device=HOST)


def _firsts(parts):
    """Where each part begins in all together, and the end of the last."""
    return wp.array(np.cumsum([0, *(len(part) for part in parts)]), dtype=wp.int32, device=HOST)


def _pack_rows(table, parts):
    """Elements of all bodies into a table's rows, kinds and first_row."""
    everything = cells.concatenate(parts)
    table.rows = wp.array(everything.rows, dtype=wp.float64, device=HOST)
    table.kinds = wp.array(everything.kinds, dtype=wp.int32, device=HOST)
    table.first_row = _firsts(parts)
