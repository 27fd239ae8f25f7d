"""The field of sources: Warp functions of a place and a stage, and sums at given points."""

import functools
from typing import Any

import numpy as np
import warp as wp

from fieldsim.launch import launch
from fieldsim.portable.lanes.functions import group_function
from fieldsim.potentials import registry
from fieldsim.sources.elements import Sources
from fieldsim.sources.stages import Stages


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

    @wp.func
    def both(p: wp.vec3d, stages: Stages, stage: int):
        f, g = still(p, stages, stage)
        f_moving, g_moving = changing(p, stages, stage)
        return f + f_moving, g + g_moving

    if not moving_kinds:
        return still
    return both if fixed_kinds else changing


# What a sum over elements takes: points, rows, kinds, the first row and how many.
_SUM = ("rows 3", "table", "indices", "int", "int")


@functools.cache
def _sums_at(kinds_used, lanes: int, sums, outputs):
    """Warp function (points, stages, stage) -> results of sums over all elements at a group of points.

    sums: of a tuple of kinds, such as `registry.field_sum`. A GPU's group is one point, which its scalar code serves.
    """
    fixed_kinds, moving_kinds = kinds_used
    matrix = wp.types.matrix((3, lanes), wp.float64)
    fixed, moving = (group_function(sums(kinds), wp.float64, _SUM, outputs, lanes) for kinds in kinds_used)

    @wp.func
    def still(points: matrix, stages: Stages, stage: int):
        return fixed(points, stages.rows, stages.kinds, 0, stages.kinds.shape[0])

    @wp.func
    def changing(points: matrix, stages: Stages, stage: int):
        return moving(points, stages.moving_rows, stages.moving_kinds, stage * stages.moving, stages.moving)

    @wp.func
    def both(points: matrix, stages: Stages, stage: int):
        return still(points, stages, stage) + changing(points, stages, stage)

    if not moving_kinds:
        return still
    return both if fixed_kinds else changing


def pulls_at(kinds_used, lanes: int):
    """Warp function (points, stages, stage) -> the gradients at a group of points, both (3, lanes)."""
    return _sums_at(kinds_used, lanes, registry.field_sum, (1, 2, 3))


def jets_at(kinds_used, lanes: int):
    """Warp function (points, stages, stage) -> gradients and Hessians at a group of points, (9, lanes).

    Rows: x, y, z, xx, yy, zz, xy, xz, yz.
    """
    return _sums_at(kinds_used, lanes, registry.jet_sum, tuple(range(1, 10)))


@functools.cache
def bends_at(kinds_used, lanes: int):
    """Warp function (points, stages, stage) -> (gradients (3, lanes), Hessians (6, lanes)) at a group of points.

    A Hessian's rows: xx, yy, zz, xy, xz, yz.
    """
    matrix = wp.types.matrix((3, lanes), wp.float64)
    six = wp.types.matrix((6, lanes), wp.float64)
    jets = jets_at(kinds_used, lanes)

    @wp.func
    def bends(points: matrix, stages: Stages, stage: int):
        found = jets(points, stages, stage)
        gradients = matrix()
        hessians = six()
        for c in range(3):
            gradients[c] = found[c]
        for c in range(6):
            hessians[c] = found[c + 3]
        return gradients, hessians

    return bends


@wp.func
def bent_along(bends: Any, vectors: Any):
    """Hessians (6, lanes) times vectors (3, lanes): how the gradients differ along these."""
    x = vectors[0]
    y = vectors[1]
    z = vectors[2]
    found = vectors
    found[0] = wp.cw_mul(bends[0], x) + wp.cw_mul(bends[3], y) + wp.cw_mul(bends[4], z)
    found[1] = wp.cw_mul(bends[3], x) + wp.cw_mul(bends[1], y) + wp.cw_mul(bends[5], z)
    found[2] = wp.cw_mul(bends[4], x) + wp.cw_mul(bends[5], y) + wp.cw_mul(bends[2], z)
    return found


@functools.cache
def jet_at(kinds_used):
    """Warp function (point, stages, stage) -> (F, gradient, Hessian) of the given formulas at one stage."""
    fixed_kinds, moving_kinds = kinds_used
    fixed = registry.jet_sum(fixed_kinds).warp(wp.float64)
    moving = registry.jet_sum(moving_kinds).warp(wp.float64)

    @wp.func
    def still(p: wp.vec3d, stages: Stages, stage: int):
        f, x, y, z, xx, yy, zz, xy, xz, yz = fixed(
            p[0], p[1], p[2], stages.rows, stages.kinds, 0, stages.kinds.shape[0]
        )
        return f, wp.vec3d(x, y, z), wp.mat33d(xx, xy, xz, xy, yy, yz, xz, yz, zz)

    @wp.func
    def changing(p: wp.vec3d, stages: Stages, stage: int):
        first = stage * stages.moving
        f, x, y, z, xx, yy, zz, xy, xz, yz = moving(
            p[0], p[1], p[2], stages.moving_rows, stages.moving_kinds, first, stages.moving
        )
        return f, wp.vec3d(x, y, z), wp.mat33d(xx, xy, xz, xy, yy, yz, xz, yz, zz)

    @wp.func
    def both(p: wp.vec3d, stages: Stages, stage: int):
        f, g, h = still(p, stages, stage)
        f_moving, g_moving, h_moving = changing(p, stages, stage)
        return f + f_moving, g + g_moving, h + h_moving

    if not moving_kinds:
        return still
    return both if fixed_kinds else changing


@functools.cache
def hessian_at(kinds_used):
    """Warp function (point, stages, stage) -> (gradient, Hessian) of the given formulas at one stage."""
    jet = jet_at(kinds_used)

    @wp.func
    def hessian(p: wp.vec3d, stages: Stages, stage: int):
        _f, g, h = jet(p, stages, stage)
        return g, h

    return hessian


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
