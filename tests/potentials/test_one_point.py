"""Single points: answered at once, and as among many."""

import concurrent.futures
import copy
import math

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.potentials.one_point import place_of

FIELD = fs.Field([fs.Segment((-1, 0, 0), (1, 0.5, 0.25)), fs.Point((0.3, -0.2, 0.1))], fs.Newtonian(0.1), [1.0, -0.5])
POINTS = np.random.default_rng(5).normal(size=(40, 3))


def test_a_single_point_is_answered_as_among_many():
    value, gradient = FIELD.value_and_gradient(POINTS)
    hessian = FIELD.hessian(POINTS)
    for k, point in enumerate(POINTS):
        for given in (point, tuple(point), point.tolist(), list(point)):
            assert FIELD.value(given) == value[k]
            np.testing.assert_array_equal(FIELD.gradient(given), gradient[k])
            np.testing.assert_array_equal(FIELD.hessian(given), hessian[k])
    assert type(FIELD.value(POINTS[0])) is float


def test_results_are_the_callers_own():
    first = FIELD.gradient(POINTS[0])
    kept = first.copy()
    FIELD.gradient(POINTS[1])
    np.testing.assert_array_equal(first, kept)
    first += 1.0
    np.testing.assert_array_equal(FIELD.gradient(POINTS[0]), kept)


def test_threads_do_not_mix_their_points():
    field = copy.deepcopy(FIELD)
    expected = FIELD.value(POINTS)
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        for _ in range(10):
            assert list(pool.map(field.value, POINTS)) == expected.tolist()


def test_fields_that_were_asked_are_copied():
    FIELD.value(POINTS[0])
    assert copy.deepcopy(FIELD).value(POINTS[0]) == FIELD.value(POINTS[0])


def test_a_bare_source_and_overflow_are_told_apart():
    bare = fs.Field(fs.Point((1, 2, 3)), fs.Newtonian())
    assert bare.value((1, 2, 3)) == math.inf
    assert (bare - bare).value((1.0, 2.0, 3.5)) == 0.0
    with pytest.raises(fs.InputError, match=r"its value at \(1.0, 2.0, 3.0\) is \[nan\]"):
        (bare - bare).value((1, 2, 3))


@pytest.mark.parametrize(
    "point",
    [(1.0, math.nan, 0.0), (1.0, 2.0), (1e200, 0.0, 0.0), (True, 0.0, 0.0), "xyz", ((1, 2, 3),), (10**400, 0, 0)],
)
def test_what_is_not_plainly_a_point_is_looked_at_closely(point):
    assert place_of(point, 1e100) is None


@pytest.mark.parametrize("point", [(1, 2.0, np.float64(3.0)), [1, 2, 3], np.array([1.0, 2.0, 3.0])])
def test_what_plainly_is_one(point):
    assert place_of(point, 1e100) == (1.0, 2.0, 3.0)
