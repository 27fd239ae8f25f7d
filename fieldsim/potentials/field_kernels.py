"""Warp kernels that evaluate fields at points, and the arrays that they write: in lanes on CPUs, on CUDA in threads."""

import numpy as np
import warp as wp

from fieldsim.portable.lanes.kernels import items_of, lanes_kernel
from fieldsim.portable.lanes.one_lane import one_lane_kernel
from fieldsim.potentials import registry

# Value, gradient and the Hessian's rows, by their places in a jet, and what each is at a point.
RESULTS = (0,), (1, 2, 3), (4, 7, 8, 7, 5, 9, 8, 9, 6)
SHAPES = (), (3,), (3, 3)
INPUTS = ("points", "table", "indices", "int", "int")


def in_lanes(order: int, kinds_used: tuple[int, ...], scalar):
    """The kernel (start, points, rows, kinds, first, count, *results) for CPUs, over groups of points.

    It sums elements first..first + count - 1; order: of the highest derivative.
    """
    return lanes_kernel(_total(order, kinds_used), scalar, INPUTS, RESULTS[: order + 1])


def in_threads(order: int, kinds_used: tuple[int, ...], scalar):
    """The same over single points, which serves CUDA."""
    return one_lane_kernel(_total(order, kinds_used), scalar, INPUTS, RESULTS[: order + 1])


def kernel_and_items(order: int, kinds_used: tuple[int, ...], scalar, count: int, device):
    """The kernel for a device, and how many items of a launch `count` points are."""
    if device.is_cpu:
        return in_lanes(order, kinds_used, scalar), items_of(count, scalar)
    return in_threads(order, kinds_used, scalar), count


def _total(order, kinds_used):
    return (registry.field_sum if order < 2 else registry.jet_sum)(kinds_used)


def dtypes_of(order: int, scalar) -> list:
    """Warp's types of value and derivatives up to `order`."""
    dtypes = (scalar, wp.vec3f, wp.mat33f) if scalar is wp.float32 else (scalar, wp.vec3d, wp.mat33d)
    return list(dtypes[: order + 1])


def results_of(order: int, count: int, scalar, device) -> list[wp.array]:
    """Arrays (count,) for value and derivatives up to `order`, not filled."""
    return [wp.empty(count, dtype=dtype, device=device) for dtype in dtypes_of(order, scalar)]


def host_results_of(order: int, count: int) -> tuple[list[np.ndarray], list[wp.array]]:
    """Arrays in float64 for value and derivatives at points, (count,), (count, 3) and so on; and as Warp sees them."""
    arrays = [np.empty((count, *shape)) for shape in SHAPES[: order + 1]]
    dtypes = dtypes_of(order, wp.float64)
    seen = zip(arrays, dtypes, strict=True)
    return arrays, [wp.array(array, dtype=dtype, device="cpu", copy=False) for array, dtype in seen]
