"""Every compiled target of the chart, evaluating element i at point i: all cells in one kernel, compiled once."""

import functools

import numba
import numpy as np
import reference_cases  # noqa: F401 - fills the chart
import warp as wp

from fieldsim import launch
from fieldsim.potentials import cells


def evaluate(target, elements, points):
    """F (N,) and its gradient (N, 3) of element i alone at points[i], in float64; outputs start as NaN."""
    value = np.full(len(points), np.nan)
    gradient = np.full((len(points), 3), np.nan)
    if target == "numba":
        _numba()(points, elements.rows, elements.kinds, value, gradient)
        return value, gradient
    scalar = wp.float64 if target == "warp64" else wp.float32
    vector = wp.types.vector(3, scalar)
    outputs = wp.array(value, dtype=scalar, device="cpu"), wp.array(gradient, dtype=vector, device="cpu")
    inputs = [
        wp.array(points, dtype=vector, device="cpu"),
        wp.array(elements.rows, dtype=scalar, device="cpu"),
        wp.array(elements.kinds, dtype=wp.int32, device="cpu"),
    ]
    launch.launch(_warp(scalar), len(points), inputs, outputs, device="cpu")
    return tuple(out.numpy().astype(float) for out in outputs)


def _all_kinds():
    return tuple(sorted(cell.kind for cell in cells.CELLS.values()))


@functools.cache
def _warp(scalar):
    vector = wp.types.vector(3, scalar)
    element = cells.element_field(_all_kinds()).warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def one_each(
        start: int,
        points: wp.array(dtype=vector),
        rows: wp.array(dtype=scalar, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        value: wp.array(dtype=scalar),
        gradient: wp.array(dtype=vector),
    ):
        i = start + wp.tid()
        p = points[i]
        f, gx, gy, gz = element(p[0], p[1], p[2], rows, kinds, i)
        value[i] = f
        gradient[i] = vector(gx, gy, gz)

    return one_each


@functools.cache
def _numba():
    element = cells.element_field(_all_kinds()).numba

    @numba.njit(error_model="numpy")
    def one_each(points, rows, kinds, value, gradient):
        for i in range(len(points)):
            f, gx, gy, gz = element(points[i, 0], points[i, 1], points[i, 2], rows, kinds, i)
            value[i] = f
            gradient[i, 0] = gx
            gradient[i, 1] = gy
            gradient[i, 2] = gz

    return one_each
