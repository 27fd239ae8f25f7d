"""Functions of groups of points in lanes: as Python, for any width, and called by Warp kernels."""

import numpy as np
import pytest
import warp as wp

from fieldsim import PortableError
from fieldsim.portable import Indices, Table, portable, real
from fieldsim.portable.lanes.functions import group_function


@portable
def weighted(x: real, y: real, rows: Table, picks: Indices, count: int, scale: real):
    total = real(0.0)
    for k in range(count):
        if x > rows[picks[k], 0]:
            total += scale * rows[picks[k], 1] * y
    return total, x - y


ROWS = np.array([[0.5, 2.0], [-0.5, 3.0], [0.0, 5.0]])
PICKS = np.array([2, 0, 1], dtype=np.int32)


@pytest.mark.parametrize("width", [1, 8, 16])
def test_a_group_is_as_its_points_alone(width):
    function = group_function(weighted, wp.float64, ("rows 2", "table", "indices", "int", "real"), (1, 0), width)
    matrix = wp.types.matrix((2, width), wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(
        points: wp.array(dtype=matrix),
        rows: wp.array2d(dtype=wp.float64),
        picks: wp.array(dtype=wp.int32),
        found: wp.array(dtype=matrix),
    ):
        i = wp.tid()
        found[i] = function(points[i], rows, picks, 3, wp.float64(0.25))

    points = np.random.default_rng(1).normal(size=(3, 2, width))
    given = [wp.array(points, dtype=matrix), wp.array(ROWS, dtype=wp.float64), wp.array(PICKS, dtype=wp.int32)]
    found = wp.zeros(3, dtype=matrix)
    wp.launch(evaluate, 3, inputs=given, outputs=[found])
    for group, results in zip(points, found.numpy(), strict=True):
        for point, result in zip(group.T, results.T, strict=True):
            total, difference = weighted(*point, ROWS, PICKS, 3, 0.25)
            np.testing.assert_allclose(result, [difference, total], rtol=1e-15, atol=1e-16)


def test_inputs_that_do_not_fit_are_refused():
    with pytest.raises(PortableError, match="has 6 arguments; inputs gives 5"):
        group_function(weighted, wp.float64, ("rows 2", "table", "indices", "int"), (0,), 8)
