"""The operations that benchmarks/gpu.py counts."""

import math

import numpy as np

from benchmarks.gpu import Counted, counted, counted_mathematics, operations, operations_of_a_step
from fieldsim.potentials.field import Field
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.registry import field_sum


def test_each_operation_counts_once_and_signs_do_not():
    with counted_mathematics():
        x, y = Counted(3.0), Counted(4.0)
        square = y * y
        _unused = x / y
        result = -abs((2.0 * x - y / 1.0) + math.sqrt(x * x + square))
    assert result == -7.0
    assert operations([result]) == 8
    assert operations([result, square]) == 8
    assert operations([1.0]) == 0


def test_a_bare_point_takes_few_operations_and_a_ring_many():
    """By hand: three differences, five for r^2, a root, and some for 1 / r, its cube, the strength and the gradient."""
    elements = Field(Point((1.0, 2.0, 3.0)), Newtonian()).elements
    with counted_mathematics():
        place = map(Counted, (0.1, 0.2, 0.3))
        found = field_sum(elements.kinds_used)(*place, counted(elements.rows), elements.kinds, 0, 1)
    assert 15 <= operations(found) <= 30
    rng = np.random.default_rng(1)
    assert 100 < operations_of_a_step(rng.normal(size=(3, 3)), rng.normal(size=(3, 3))) < 500
