"""The field of sources: Warp functions of a place and a stage, and sums at given points."""

import functools
from typing import Any

import numpy as np
import warp as wp

from fieldsim.launch import launch
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


@functools.cache
def pulls_at(kinds_used, lanes: int):
    """Warp function (points, stages, stage) -> the gradients at a group of points, both (3, lanes) as in `groups`."""
    matrix = wp.types.matrix((3, lanes), wp.float64)
    field = field_at(kinds_used)

    @wp.func
    def pulls(points: matrix, stages: Stages, stage: int):
        found = matrix()
        for k in range(wp.int32(lanes)):  # no constant, for which Warp would write the loop out
            _f, g = field(wp.vec3d(points[0, k], points[1, k], points[2, k]), stages, stage)
            for c in range(3):
                found[c, k] = g[c]
        return found

    return pulls


@functools.cache
def bends_at(kinds_used, lanes: int):
    """Warp function (points, stages, stage) -> (gradients (3, lanes), Hessians (6, lanes)) at a group of points.

    A Hessian's rows: xx, yy, zz, xy, xz, yz.
    """
    matrix = wp.types.matrix((3, lanes), wp.float64)
    six = wp.types.matrix((6, lanes), wp.float64)
    hessian = hessian_at(kinds_used)

    @wp.func
    def bends(points: matrix, stages: Stages, stage: int):
        found = matrix()
        bent = six()
        for k in range(wp.int32(lanes)):
            g, h = hessian(wp.vec3d(points[0, k], points[1, k], points[2, k]), stages, stage)
            for c in range(3):
                found[c, k] = g[c]
                bent[c, k] = h[c, c]
            bent[3, k] = h[0, 1]
            bent[4, k] = h[0, 2]
            bent[5, k] = h[1, 2]
        return found, bent

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
