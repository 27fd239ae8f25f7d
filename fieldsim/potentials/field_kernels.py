"""Warp kernels that evaluate fields at points: in lanes on CPUs, a point a thread on CUDA."""

import functools

import warp as wp

from fieldsim.portable.lanes.kernels import lanes_kernel
from fieldsim.potentials import registry

# Value, gradient and the Hessian's rows, by their places in a jet.
RESULTS = (0,), (1, 2, 3), (4, 7, 8, 7, 5, 9, 8, 9, 6)
INPUTS = ("points", "table", "indices", "int", "int")


def in_lanes(order: int, kinds_used: tuple[int, ...], scalar):
    """The kernel (start, points, rows, kinds, first, count, *results) for CPUs.

    It sums elements first..first + count - 1; order: of the highest derivative.
    """
    total = registry.field_sum if order < 2 else registry.jet_sum
    return lanes_kernel(total(kinds_used), scalar, INPUTS, RESULTS[: order + 1])


@functools.cache
def _value_kernel(kinds_used, scalar):
    """The Warp kernel that evaluates fields of the given formulas at points."""
    total = registry.field_sum(kinds_used).warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate_value(
        start: int,
        points: wp.array(dtype=wp.types.vector(3, scalar)),
        rows: wp.array(dtype=scalar, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        value: wp.array(dtype=scalar),
    ):
        i = start + wp.tid()
        p = points[i]
        f, _fx, _fy, _fz = total(p[0], p[1], p[2], rows, kinds, 0, kinds.shape[0])
        value[i] = f

    return evaluate_value


@functools.cache
def _gradient_kernel(kinds_used, scalar):
    """As `_value_kernel`, with the gradient."""
    vector = wp.types.vector(3, scalar)
    total = registry.field_sum(kinds_used).warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate_gradient(
        start: int,
        points: wp.array(dtype=vector),
        rows: wp.array(dtype=scalar, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        value: wp.array(dtype=scalar),
        gradient: wp.array(dtype=vector),
    ):
        i = start + wp.tid()
        p = points[i]
        f, fx, fy, fz = total(p[0], p[1], p[2], rows, kinds, 0, kinds.shape[0])
        value[i] = f
        gradient[i] = vector(fx, fy, fz)

    return evaluate_gradient


@functools.cache
def _hessian_kernel(kinds_used, scalar):
    """As `_value_kernel`, with gradient and Hessian."""
    vector = wp.types.vector(3, scalar)
    matrix = wp.types.matrix((3, 3), scalar)
    total = registry.jet_sum(kinds_used).warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate_hessian(
        start: int,
        points: wp.array(dtype=vector),
        rows: wp.array(dtype=scalar, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        value: wp.array(dtype=scalar),
        gradient: wp.array(dtype=vector),
        hessian: wp.array(dtype=matrix),
    ):
        i = start + wp.tid()
        p = points[i]
        f, fx, fy, fz, xx, yy, zz, xy, xz, yz = total(p[0], p[1], p[2], rows, kinds, 0, kinds.shape[0])
        value[i] = f
        gradient[i] = vector(fx, fy, fz)
        hessian[i] = matrix(xx, xy, xz, xy, yy, yz, xz, yz, zz)

    return evaluate_hessian


# By the order of the highest derivative.
KERNELS = (_value_kernel, _gradient_kernel, _hessian_kernel)
