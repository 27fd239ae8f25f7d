"""Functions of groups of points in lanes: as Python, for any width, and called by Warp kernels."""

import numpy as np
import pytest
import warp as wp

from fieldsim import PortableError
from fieldsim.portable import Indices, Table, portable, real
from fieldsim.portable.lanes.functions import TABLES, group_function


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


@portable
def looked_up(x: real, rows: Table, picks: Indices, count: int):
    total = real(0.0)
    for k in range(count):
        total += rows[picks[k], 1] * x
    if x > real(0.0):
        total -= rows[int(x), 0]
    return total


@pytest.mark.parametrize("lanes", [None, 1])
@pytest.mark.parametrize("width", [1, 8])
def test_each_point_may_have_a_table_of_its_own(width, lanes):
    function = group_function(looked_up, wp.float64, ("rows 1", TABLES, "indices", "int"), (0,), width, lanes)
    matrix = wp.types.matrix((1, width), wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(
        points: matrix,
        tables: wp.array3d(dtype=wp.float64),
        picks: wp.array(dtype=wp.int32),
        found: wp.array(dtype=matrix),
    ):
        found[0] = function(points, tables, picks, 3)

    rng = np.random.default_rng(2)
    x, values = rng.uniform(-2.9, 2.9, (1, width)), rng.normal(size=(3, 2, width))
    tables = wp.array(values, dtype=wp.float64).transpose((2, 0, 1))
    found = wp.zeros(1, dtype=matrix)
    wp.launch(evaluate, 1, inputs=[matrix(*x[0]), tables, wp.array(PICKS, dtype=wp.int32)], outputs=[found])
    expected = [looked_up(x[0, lane], values[..., lane], PICKS, 3) for lane in range(width)]
    np.testing.assert_allclose(found.numpy()[0, 0], expected, rtol=1e-14)


def test_inputs_that_do_not_fit_are_refused():
    with pytest.raises(PortableError, match="has 6 arguments; inputs gives 5"):
        group_function(weighted, wp.float64, ("rows 2", "table", "indices", "int"), (0,), 8)
