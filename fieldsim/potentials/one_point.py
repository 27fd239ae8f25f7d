"""A field at one point after another: a launch recorded once, so that a single point costs microseconds."""

import math
from typing import Any

import numpy as np
import warp as wp

from fieldsim import launch
from fieldsim.copies import ThreadLock
from fieldsim.potentials.field_kernels import host_results_of


def place_of(point: Any, farthest: float) -> tuple[float, float, float] | None:
    """The coordinates of what plainly is one point: three floats or whole numbers, of at most `farthest`.

    None for anything else, which may be points all the same, or wrong; that takes longer to say.
    """
    if type(point) is np.ndarray and point.shape == (3,) and point.dtype == np.float64:
        point = point.tolist()
    if type(point) not in (tuple, list) or len(point) != 3:
        return None
    for x in point:
        # No subclass but NumPy's float64, which is a float: others may mean something else, as truths do.
        if type(x) not in _PLAIN or not -farthest <= x <= farthest:
            return None
    x, y, z = point
    return float(x), float(y), float(z)


_PLAIN = (float, int, np.float64)


class OnePoint:
    """Value and derivatives up to an order at one point, by a kernel of (points, *tables, *results)."""

    def __init__(self, kernel, tables, order: int):
        self._lock = ThreadLock()
        self._place = np.empty((1, 3))
        self._results, results = host_results_of(order, 1)
        point = wp.array(self._place, dtype=wp.vec3d, device="cpu", copy=False)
        self._launch = launch.recorded(kernel, 1, [point, *tables], results, device="cpu")

    def __call__(self, place: tuple[float, float, float]) -> list[np.ndarray]:
        """Results (1, ...), arrays of their own."""
        with self._lock:
            self._place[0] = place
            self._launch()
            return [result.copy() for result in self._results]


def are_finite(results: list[np.ndarray]) -> bool:
    """Whether all numbers of a point's results are finite."""
    # A sum of squares is infinite or NaN where a part is; that it overflows by itself is looked at again.
    return all(math.isfinite(result.ravel() @ result.ravel()) for result in results)
