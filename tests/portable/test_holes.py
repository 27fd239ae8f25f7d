"""Holes of portable functions: named where they are not filled, and filled only with what fits."""

import pytest
import warp as wp

from fieldsim.errors import PortableError
from fieldsim.portable import hole, portable, real

inner_of_two = hole("x, y")
FACTOR = hole()


@portable
def squared(x: real):
    return x * x


@portable
def with_holes(x: real):
    return real(FACTOR) * inner_of_two(x, x)


@portable
def product(x: real, y: real):
    return x * y


def test_filled_holes_compute():
    filled = with_holes.bind(inner_of_two=product, FACTOR=3.0)
    assert filled(2.0) == filled.numba(2.0) == 12.0


@pytest.mark.parametrize("use", [lambda f: f(2.0), lambda f: f.numba(2.0), lambda f: f.warp(wp.float32)])
def test_a_hole_that_is_not_filled_is_named(use):
    with pytest.raises(PortableError, match=r"with_holes has 'inner_of_two', a hole for a function of \(x, y\), not"):
        use(with_holes.bind(FACTOR=3.0))
    with pytest.raises(PortableError, match=r"with_holes has 'FACTOR', a hole for a number, not filled; use bind"):
        use(with_holes.bind(inner_of_two=product))


def test_a_hole_is_no_function():
    with pytest.raises(PortableError, match=r"hole for a function of \(x, y\) is not filled"):
        inner_of_two(1.0, 2.0)


@portable
def swapped(y: real, x: real):
    return x / y


@pytest.mark.parametrize(
    ("name", "value"),
    [("inner_of_two", squared), ("inner_of_two", swapped), ("inner_of_two", 1.0), ("FACTOR", squared), ("FACTOR", "3")],
)
def test_what_fills_a_hole_fits_it(name, value):
    with pytest.raises(
        PortableError, match=rf"^{name} of portable function .*with_holes is a hole for a .* does not fit"
    ):
        with_holes.bind(**{name: value})
