"""Warp kernels that sum, at each point, the elements of its list exactly."""

import functools

import numpy as np
import warp as wp

from fieldsim.launch import launch
from fieldsim.potentials import registry


@functools.cache
def _value_kernel(kinds_used):
    """Kernel (points, lists, begin, ranges, rows, kinds; value): the sums over ranges of rows."""
    total = registry.field_sum(kinds_used).warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def sum_values(
        start: int,
        points: wp.array(dtype=wp.vec3d),
        lists: wp.array(dtype=wp.int32),
        begin: wp.array(dtype=wp.int32),
        ranges: wp.array(dtype=wp.int32, ndim=2),
        rows: wp.array(dtype=wp.float64, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        value: wp.array(dtype=wp.float64),
    ):
        i = start + wp.tid()
        p = points[i]
        f = wp.float64(0.0)
        for k in range(begin[lists[i]], begin[lists[i] + 1]):
            f_k, _x, _y, _z = total(p[0], p[1], p[2], rows, kinds, ranges[k, 0], ranges[k, 1] - ranges[k, 0])
            f = f + f_k
        value[i] = f

    return sum_values


@functools.cache
def _gradient_kernel(kinds_used):
    """As `_value_kernel`, with the gradient."""
    total = registry.field_sum(kinds_used).warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def sum_gradients(
        start: int,
        points: wp.array(dtype=wp.vec3d),
        lists: wp.array(dtype=wp.int32),
        begin: wp.array(dtype=wp.int32),
        ranges: wp.array(dtype=wp.int32, ndim=2),
        rows: wp.array(dtype=wp.float64, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        value: wp.array(dtype=wp.float64),
        gradient: wp.array(dtype=wp.vec3d),
    ):
        i = start + wp.tid()
        p = points[i]
        f = wp.float64(0.0)
        slope = wp.vec3d()
        for k in range(begin[lists[i]], begin[lists[i] + 1]):
            f_k, x, y, z = total(p[0], p[1], p[2], rows, kinds, ranges[k, 0], ranges[k, 1] - ranges[k, 0])
            f = f + f_k
            slope = slope + wp.vec3d(x, y, z)
        value[i] = f
        gradient[i] = slope

    return sum_gradients


@functools.cache
def _hessian_kernel(kinds_used):
    """As `_value_kernel`, with gradient and Hessian."""
    total = registry.jet_sum(kinds_used).warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def sum_hessians(
        start: int,
        points: wp.array(dtype=wp.vec3d),
        lists: wp.array(dtype=wp.int32),
        begin: wp.array(dtype=wp.int32),
        ranges: wp.array(dtype=wp.int32, ndim=2),
        rows: wp.array(dtype=wp.float64, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        value: wp.array(dtype=wp.float64),
        gradient: wp.array(dtype=wp.vec3d),
        hessian: wp.array(dtype=wp.mat33d),
    ):
        i = start + wp.tid()
        p = points[i]
        f = wp.float64(0.0)
        slope = wp.vec3d()
        bend = wp.mat33d()
        for k in range(begin[lists[i]], begin[lists[i] + 1]):
            f_k, x, y, z, xx, yy, zz, xy, xz, yz = total(
                p[0], p[1], p[2], rows, kinds, ranges[k, 0], ranges[k, 1] - ranges[k, 0]
            )
            f = f + f_k
            slope = slope + wp.vec3d(x, y, z)
            bend = bend + wp.mat33d(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        value[i] = f
        gradient[i] = slope
        hessian[i] = bend

    return sum_hessians


# By the order of the highest derivative.
KERNELS = (_value_kernel, _gradient_kernel, _hessian_kernel)
SHAPES = ((), (3,), (3, 3))


def near_sums(points, lists, begin, ranges, tables, kinds_used, order, threads=None) -> list[np.ndarray]:
    """Value and derivatives up to `order` at points (N, 3) of the rows in their lists; see `near_lists`.

    tables: rows and kinds as Warp arrays on the CPU.
    """
    kernel = KERNELS[order](kinds_used)
    dtypes = wp.float64, wp.vec3d, wp.mat33d
    found = [wp.empty(len(points), dtype=dtype, device="cpu") for dtype in dtypes[: order + 1]]
    given = [wp.from_numpy(np.ascontiguousarray(points), dtype=wp.vec3d, device="cpu")]
    given += [wp.from_numpy(np.ascontiguousarray(a), dtype=wp.int32, device="cpu") for a in (lists, begin, ranges)]
    launch(kernel, len(points), [*given, *tables], found, device="cpu", threads=threads, grain=16)
    return [array.numpy() for array in found]
