"""Compensated arithmetic against exact arithmetic, on every target."""

from fractions import Fraction

import numpy as np
import on_targets
import pytest
import warp as wp

from fieldsim import launch
from fieldsim.numerics.compensated import (
    fast_two_sum,
    half_digits,
    pair_product,
    pair_sum,
    split,
    split_at,
    two_difference,
    two_product,
    two_sum,
)
from fieldsim.numerics.precision import is_single
from fieldsim.numerics.running_sums import added, exactly_added, product_rest
from fieldsim.portable import portable, real


@portable
def sums(a: real, b: real, c: real):
    s, s_low = two_sum(a, b)
    d, d_low = two_difference(a, b)
    f, f_low = fast_two_sum(max(abs(a), abs(b)), min(abs(a), abs(b)))
    high, low = split_at(c, half_digits() * real(1024.0))
    return s, s_low, d, d_low, f, f_low, high, low


@portable
def products(a: real, b: real, c: real):
    p, p_low = two_product(a, b)
    q, q_low = two_product(b, c)
    s, s_low = pair_sum(p, p_low, q, q_low)
    t, t_low = pair_product(p, p_low, q, q_low)
    high, low = split(a)
    if is_single():
        low = -low
    return p, p_low, s, s_low, t, t_low, high, low


@pytest.fixture(scope="module")
def asked():
    """Numbers of both signs, 1e-3..1e3."""
    rng = np.random.default_rng(8)
    return on_targets.exactly_held(*(10 ** rng.uniform(-3, 3, (3, 300)) * rng.choice([-1, 1], (3, 300))))


def exact_columns(numbers):
    return [[Fraction(float(x)) for x in row] for row in numbers]


@pytest.mark.parametrize("target", on_targets.EPS)
def test_sums_are_exact(target, asked):
    a, b, c = exact_columns(asked)
    s, s_low, d, d_low, f, f_low, high, low = exact_columns(on_targets.computed(target, sums, asked))
    grid = 2**3 if target == "warp32" else 2**17
    for i in range(len(a)):
        assert s[i] + s_low[i] == a[i] + b[i]
        assert d[i] + d_low[i] == a[i] - b[i]
        assert f[i] + f_low[i] == abs(a[i]) + abs(b[i])
        assert high[i] + low[i] == c[i]
        # A multiple of the rounding just below 1024 times half the digits.
        assert (high[i] * grid).denominator == 1


@pytest.mark.parametrize("target", on_targets.EPS)
def test_products_and_pairs(target, asked):
    a, b, c = exact_columns(asked)
    p, p_low, s, s_low, t, t_low, high, low = exact_columns(on_targets.computed(target, products, asked))
    u2 = Fraction(on_targets.EPS[target] / 2) ** 2
    for i in range(len(a)):
        first, second = a[i] * b[i], b[i] * c[i]
        assert p[i] + p_low[i] == first
        assert abs(s[i] + s_low[i] - (first + second)) <= 4 * u2 * (abs(first) + abs(second))
        assert abs(t[i] + t_low[i] - first * second) <= 8 * u2 * abs(first * second)
        assert high[i] + (-low[i] if target == "warp32" else low[i]) == a[i]
        assert abs(low[i]) <= abs(a[i]) / 2**11


@wp.kernel(module="unique", enable_backward=False)
def _running(start: int, steps: wp.array(dtype=wp.vec3d), found: wp.array(dtype=wp.vec3d)):
    fast = wp.vec3d()
    fast_rest = wp.vec3d()
    exact = wp.float64(0.0)
    exact_rest = wp.float64(0.0)
    for i in range(steps.shape[0]):
        fast, fast_rest = added(fast, fast_rest, steps[i])
        exact, exact_rest = exactly_added(exact, exact_rest, steps[i][0])
    found[start] = fast
    found[1] = fast_rest
    found[2] = wp.vec3d(exact, exact_rest, wp.float64(0.0))
    found[3] = product_rest(wp.float64(0.1), steps[0])


def test_running_sums():
    """A hundred thousand equal steps: the sum with its rest to 1e-24 of it, one rounding of each rest."""
    steps = np.full((100_000, 3), [0.1, 1e-3, -7.3])
    found = wp.full(4, np.nan, dtype=wp.vec3d, device="cpu")
    launch.launch(_running, 1, [wp.array(steps, dtype=wp.vec3d, device="cpu")], [found], device="cpu")
    fast, rest, (exact, exact_rest, _), low = found.numpy()
    for k in range(3):
        true = 100_000 * Fraction(steps[0, k])
        assert abs(Fraction(fast[k]) + Fraction(rest[k]) - true) <= Fraction(1e-24) * abs(true)
        assert Fraction(0.1 * steps[0, k]) + Fraction(low[k]) == Fraction(0.1) * Fraction(steps[0, k])
    assert abs(Fraction(exact) + Fraction(exact_rest) - 100_000 * Fraction(0.1)) <= Fraction(1e-20)
