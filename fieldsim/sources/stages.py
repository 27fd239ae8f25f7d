"""The elements of all bodies in one role, laid out for launches that span many steps.

A *stage* is a moment at which forces are evaluated: the nodes of each step of a launch (leapfrog: start and end).
Bodies that neither move nor deform share one table of rows for all stages; the rows of the others are computed for
every stage on the host. All rows are in the world's frame, so that kernels know nothing of bodies and poses.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.errors import InputError
from fieldsim.launch import launch
from fieldsim.numerics import quaternion
from fieldsim.numerics.rotations import about_axis
from fieldsim.potentials import registry
from fieldsim.potentials.elements import Elements, concatenate, place
from fieldsim.potentials.row import ROW_WIDTH
from fieldsim.world.motion import IDENTITY, Spin

ROLES = {
    "gravity": lambda body, time: body.gravity_elements(time),
    "surface": lambda body, time: body.surface_elements(time),
}


@wp.struct
class Stages:
    """Elements during one launch, on its device.

    rows (N, >= WIDTH), kinds (N,): of the bodies that stay as they are. moving_rows (stages * moving, >= WIDTH),
    moving_kinds: of the others, stage after stage, `moving` rows each. sweep (stages,): see `contact`.
    """

    rows: wp.array2d(dtype=wp.float64)
    kinds: wp.array(dtype=wp.int32)
    moving_rows: wp.array2d(dtype=wp.float64)
    moving_kinds: wp.array(dtype=wp.int32)
    moving: int
    sweep: wp.array(dtype=wp.float64)


class Sources:
    """What a world's bodies contribute in one role ("gravity" or "surface").

    free: function (index of a free body, times) -> its rotation matrices (stages, 3, 3) and positions (stages, 3),
    default where they start. prescribed: leave the free bodies out.
    """

    def __init__(self, world, role: str, time: float, free=None, *, prescribed: bool = False):
        self._elements = ROLES[role]
        self._free = free
        bodies = [(index, body) for index, body in enumerate(world.bodies) if not (prescribed and body.free)]
        self._changing = [
            (index, body)
            for index, body in bodies
            if (body.moving or body.deforming) and len(self._elements(body, time))
        ]
        still = [body for _, body in bodies if not (body.moving or body.deforming)]
        self.fixed = concatenate(self._placed(body, time) for body in still).grouped()[0]
        shapes = [self._elements(body, time) for _, body in self._changing]
        self.moving_kinds = concatenate(shapes).kinds
        self._shapes = shapes

    @property
    def kinds_used(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The formulas of the still and of the changing elements: the key under which code is compiled."""
        return self.fixed.kinds_used, tuple(np.unique(self.moving_kinds).tolist())

    @property
    def moving(self) -> bool:
        """Whether some element moves or deforms."""
        return len(self.moving_kinds) > 0

    def __len__(self) -> int:
        return len(self.fixed) + len(self.moving_kinds)

    def rows_at(self, times: np.ndarray) -> np.ndarray:
        """Rows of the changing elements, (stages, elements, WIDTH)."""
        parts = [
            _rows_of(index, body, shape, self._elements, times, self.poses_of)
            for (index, body), shape in zip(self._changing, self._shapes, strict=True)
        ]
        return np.concatenate(parts, axis=1) if parts else np.zeros((len(times), 0, ROW_WIDTH))

    def poses_of(self, index, body, times) -> tuple[np.ndarray, np.ndarray]:
        """Rotation matrices (stages, 3, 3) and positions (stages, 3) of a body at the given times."""
        return self._free(index, times) if body.free and self._free else _poses(body, times)

    def poses_at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (stages, elements, 3, 3) and positions (stages, elements, 3) of the changing elements' bodies."""
        rotations, positions = [np.zeros((len(times), 0, 3, 3))], [np.zeros((len(times), 0, 3))]
        for (index, body), shape in zip(self._changing, self._shapes, strict=True):
            turned, moved = self.poses_of(index, body, times)
            rotations.append(np.repeat(turned[:, None], len(shape), axis=1))
            positions.append(np.repeat(moved[:, None], len(shape), axis=1))
        return np.concatenate(rotations, axis=1), np.concatenate(positions, axis=1)

    def _placed(self, body, time):
        local = self._elements(body, time)
        pose = body.pose_at(time)
        return Elements(place(local.rows, pose.matrix, np.array(pose.position)), local.kinds, local.order)


def _rows_of(index, body, shape, elements, times, poses_of):
    """Rows (stages, elements, WIDTH) of one moving or deforming body."""
    try:
        if body.deforming:
            local = np.stack([elements(body, time).rows for time in times])
        else:
            local = np.broadcast_to(shape.rows, (len(times), *shape.rows.shape))
        rotations, positions = poses_of(index, body, times)
        return place(local, rotations[:, None], positions[:, None])
    except InputError as reason:
        name = f" ({body.name})" if body.name else ""
        raise InputError(f"Body {index}{name}, between times {min(times):g} and {max(times):g}: {reason}") from None


def _poses(body, times):
    """Rotation matrices (stages, 3, 3) and positions (stages, 3) at the given times."""
    motion = body.motion
    if motion == IDENTITY:
        return np.broadcast_to(np.eye(3), (len(times), 3, 3)), np.zeros((len(times), 3))
    if isinstance(motion, Spin):
        return spin_poses(motion, times)
    poses = [body.pose_at(time) for time in times]
    rotations = quaternion.matrices(np.array([pose.rotation for pose in poses]))
    return rotations, np.array([pose.position for pose in poses])


def spin_poses(spin, times):
    """All times at once: spins are common, and pose by pose would cost more than the forces."""
    turns = about_axis(spin.axis, spin.phase + spin.rate * times)
    center = np.asarray(spin.center)
    return turns, center - turns @ center


def upload(sources: Sources, times: np.ndarray, device, fixed=None) -> Stages:
    """The tables of a launch whose stages are at `times`; `fixed`: an earlier upload to share the still rows with."""
    moving_rows = sources.rows_at(times)
    return tables(sources, sources.fixed.rows, moving_rows, device, fixed)


def tables(sources: Sources, fixed_rows, moving_rows, device, earlier=None, sweep=()) -> Stages:
    """`Stages` of given rows: fixed_rows (N, width), moving_rows (stages, M, width)."""
    stages = Stages()
    stages.moving = moving_rows.shape[1]
    if earlier is None:
        stages.rows = wp.array(fixed_rows, dtype=wp.float64, device=device)
        stages.kinds = wp.array(sources.fixed.kinds, dtype=wp.int32, device=device)
    else:
        stages.rows, stages.kinds = earlier.rows, earlier.kinds
    flat = moving_rows.reshape(-1, moving_rows.shape[-1])
    stages.moving_rows = wp.array(flat, dtype=wp.float64, device=device)
    stages.moving_kinds = wp.array(np.tile(sources.moving_kinds, len(moving_rows)), dtype=wp.int32, device=device)
    stages.sweep = wp.array(np.asarray(sweep, dtype=float), dtype=wp.float64, device=device)
    return stages


@functools.cache
def field_at(kinds_used):
    """Warp function (point, stages, stage) -> (F, gradient) of the given formulas at one stage."""
    fixed_kinds, moving_kinds = kinds_used
    fixed = registry.field_sum(fixed_kinds).warp(wp.float64)
    moving = registry.field_sum(moving_kinds).warp(wp.float64)

    @wp.func
    def still(p: wp.vec3d, stages: Stages, stage: int):
        f, x, y, z = fixed(p[0], p[1], p[2], stages.rows, stages.kinds, 0, stages.kinds.shape[0])
        return f, wp.vec3d(x, y, z)

    @wp.func
    def changing(p: wp.vec3d, stages: Stages, stage: int):
        first = stage * stages.moving
        f, x, y, z = moving(p[0], p[1], p[2], stages.moving_rows, stages.moving_kinds, first, stages.moving)
        return f, wp.vec3d(x, y, z)

    return _of_both(kinds_used, still, changing)


@functools.cache
def hessian_at(kinds_used):
    """Warp function (point, stages, stage) -> (gradient, Hessian) of the given formulas at one stage."""
    fixed_kinds, moving_kinds = kinds_used
    fixed = registry.jet_sum(fixed_kinds).warp(wp.float64)
    moving = registry.jet_sum(moving_kinds).warp(wp.float64)

    @wp.func
    def still(p: wp.vec3d, stages: Stages, stage: int):
        _f, x, y, z, xx, yy, zz, xy, xz, yz = fixed(
            p[0], p[1], p[2], stages.rows, stages.kinds, 0, stages.kinds.shape[0]
        )
        return wp.vec3d(x, y, z), wp.mat33d(xx, xy, xz, xy, yy, yz, xz, yz, zz)

    @wp.func
    def changing(p: wp.vec3d, stages: Stages, stage: int):
        first = stage * stages.moving
        _f, x, y, z, xx, yy, zz, xy, xz, yz = moving(
            p[0], p[1], p[2], stages.moving_rows, stages.moving_kinds, first, stages.moving
        )
        return wp.vec3d(x, y, z), wp.mat33d(xx, xy, xz, xy, yy, yz, xz, yz, zz)

    return _of_both(kinds_used, still, changing)


def _of_both(kinds_used, still, changing):
    """The sum of two Warp functions of (point, stages, stage) with two results, or the one that has elements."""
    fixed_kinds, moving_kinds = kinds_used

    @wp.func
    def both(p: wp.vec3d, stages: Stages, stage: int):
        one, other = still(p, stages, stage)
        one_moving, other_moving = changing(p, stages, stage)
        return one + one_moving, other + other_moving

    if not moving_kinds:
        return still
    return both if fixed_kinds else changing


@functools.cache
def _field_kernel(kinds_used):
    field = field_at(kinds_used)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(
        start: int,
        points: wp.array(dtype=wp.vec3d),
        stages: Stages,
        value: wp.array(dtype=wp.float64),
        gradient: wp.array(dtype=wp.vec3d),
    ):
        i = start + wp.tid()
        f, g = field(points[i], stages, 0)
        value[i] = f
        gradient[i] = g

    return evaluate


def field_of_elements(elements, points) -> tuple[np.ndarray, np.ndarray]:
    """F (N,) and its gradient (N, 3) of packed elements at `points` (N, 3), in the elements' frame, on the host."""
    stages = Stages()
    stages.rows = wp.array(elements.rows, dtype=wp.float64, device="cpu")
    stages.kinds = wp.array(elements.kinds, dtype=wp.int32, device="cpu")
    points = wp.array(points, dtype=wp.vec3d, device="cpu")
    value = wp.empty(len(points), dtype=wp.float64, device="cpu")
    gradient = wp.empty(len(points), dtype=wp.vec3d, device="cpu")
    kernel = _field_kernel((elements.kinds_used, ()))
    launch(kernel, len(points), [points, stages], [value, gradient], device="cpu")
    return value.numpy(), gradient.numpy()


def field_and_gradient(sources: Sources, stages: Stages, points, *, threads=None):
    """Warp arrays F (N,) and gradient (N,) at `points` (N,) of vec3d, at the first stage."""
    value = wp.empty(len(points), dtype=wp.float64, device=points.device)
    gradient = wp.empty(len(points), dtype=wp.vec3d, device=points.device)
    launch(
        _field_kernel(sources.kinds_used),
        len(points),
        [points, stages],
        [value, gradient],
        device=points.device,
        threads=threads,
    )
    return value, gradient
