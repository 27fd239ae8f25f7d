"""A kernel's law on arrays of squared distances."""

import functools

import numpy as np
import warp as wp

from fieldsim.launch import launch


@functools.cache
def _law_kernel(law):
    """Kernel (squares, width; h, slopes, bends): a law at squared distances."""
    law = law.warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate_law(
        start: int,
        squares: wp.array(dtype=wp.float64),
        width: wp.float64,
        h: wp.array(dtype=wp.float64),
        slopes: wp.array(dtype=wp.float64),
        bends: wp.array(dtype=wp.float64),
    ):
        i = start + wp.tid()
        value, slope, bend = law(squares[i], width, wp.float64(0.0), wp.float64(1.0))
        h[i] = value
        slopes[i] = slope
        bends[i] = bend

    return evaluate_law


def law_and_slopes(kernel, squares: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """h, dh/d(r^2) and d2h/d(r^2)^2 of a kernel at squared distances (...)."""
    flat = np.ascontiguousarray(squares, dtype=float).ravel()
    found = np.empty((3, flat.size))
    arrays = [wp.array(ptr=a.ctypes.data, shape=a.shape, dtype=wp.float64, device="cpu") for a in (flat, *found)]
    kernel_of_law = _law_kernel(type(kernel).law)
    launch(kernel_of_law, flat.size, [arrays[0], wp.float64(kernel.width)], arrays[1:], device="cpu", threads=1)
    h, slopes, bends = (part.reshape(np.shape(squares)) for part in found)
    return h, slopes, bends


def law_values(kernel, squares: np.ndarray) -> np.ndarray:
    """Values of a kernel at squared distances (...)."""
    return law_and_slopes(kernel, squares)[0]
