"""Owen's T and Clausen's integral against mpmath, on every target."""

import functools
import math

import mpmath
import numpy as np
import on_targets
import pytest

from fieldsim.numerics.clausen import clausen
from fieldsim.numerics.owen import line_of_sight, owen_t, tail, wedge
from fieldsim.portable import portable, real

# Errors of Owen's T, of the wedge and of Clausen's integral are absolute.
ACCEPTED = {
    "owen_t": (1, 1),
    "wedge": (2, 2),
    # Next to 2 pi the error is that of x times its logarithm.
    "clausen": (6, 6),
    "tail": (40, 40),
    "tail_seen": (40, 40),
    # Its range from 0 less that to `lo`, here.
    "line_of_sight": (450, 450),
}


@portable
def functions(h: real, a: real, x: real):
    whole, seen = tail(h, real(1.0) + a, h)
    exponent, q = line_of_sight(h, a - real(1.0), h + real(2.1))
    return owen_t(h, a), wedge(h, a), clausen(x), whole, seen, math.exp(exponent) * q, real(0.0), real(0.0)


def _integral(function, start, end, peak=1):
    """Of a Gaussian's share between two places; peak: the width of what stands out around 0."""
    around = [sign * peak * 8**k for sign in (-1, 1) for k in range(5)]
    cuts = [start, *(x for x in sorted([0, *around]) if start < x < end), end]
    return mpmath.quad(function, cuts)


def true(h, a, x):
    with mpmath.workdps(25):
        h, a, x = mpmath.mpf(h), mpmath.mpf(a), mpmath.mpf(x)
        angle = mpmath.atan(a)
        # With tan(angle) the integrand of Owen's T is smooth on a finite range.
        t = _integral(lambda v: mpmath.exp(-h * h / 2 / mpmath.cos(v) ** 2), 0, angle) / (2 * mpmath.pi)
        corner = _integral(lambda s: -mpmath.expm1(-h * h - s * s) * h / (h * h + s * s), 0, a)
        start, lo, width = 1 + a, a - 1, h + mpmath.mpf(2.1)
        whole = _integral(lambda s: mpmath.exp(start**2 - s * s), start, start + h)
        seen = _integral(lambda s: mpmath.exp(start**2 - s * s) * h / (h * h + s * s), start, start + h)
        sight = _integral(lambda s: mpmath.exp(-h * h - s * s) * h / (h * h + s * s), lo, lo + width, h)
        absolute = [(float(t), 1.0), (float(corner), 1.0), (float(mpmath.clsin(2, x)), 1.0)]
        return absolute + on_targets.relative(whole, seen, sight)


@functools.cache
def arguments():
    """h and a in 1e-3..3, x in -2 pi..2 pi, also close to 0."""
    rng = np.random.default_rng(2)
    h, a = 10 ** rng.uniform(-3, 0.47, (2, 60))
    x = np.concatenate([rng.uniform(-6.28, 6.28, 30), 10 ** rng.uniform(-12, 0, 30)])
    asked = on_targets.exactly_held(h, a, x)
    return asked, [true(*column) for column in asked.T]


@pytest.mark.parametrize("target", on_targets.EPS)
def test_functions_meet_mpmath(target):
    on_targets.check(target, functions, *arguments(), ACCEPTED)


def test_owen_t():
    rng = np.random.default_rng(2)
    for h, a in zip(10 ** rng.uniform(-3, 0.9, size=60), 10 ** rng.uniform(-3, 3, size=60), strict=True):
        with mpmath.workdps(30):
            half = mpmath.mpf(h) ** 2 / 2
            angle = mpmath.atan(a)
            # With x = tan(angle) the integrand is smooth on a finite range.
            cuts = [angle * mpmath.mpf(k) / 5 for k in range(6)]
            want = mpmath.quad(lambda t: mpmath.exp(-half / mpmath.cos(t) ** 2), cuts) / (2 * mpmath.pi)  # noqa: B023 - called at once
            assert abs(owen_t(h, a) - want) < 2e-16 + 1e-13 * want * (a <= 1)
    assert owen_t(0.0, 1.0) == 0.125
    assert owen_t(1.0, -0.5) == -owen_t(-1.0, 0.5)


def test_line_of_sight_beyond_an_edge():
    for x, lo, width in ((0.3, 1.2, 0.01), (1e-6, 3.0, 5.0), (20.0, 25.0, 1.0), (4.0, -0.5, 0.8), (2.0, 0.3, 40.0)):
        exponent, q = line_of_sight(x, lo, width)
        with mpmath.workdps(30):
            reach = min(mpmath.mpf(width), 12)
            cuts = [lo + reach * k / 40 for k in range(41)]
            want = mpmath.quad(lambda t: mpmath.exp(-x * x - t * t - exponent) * x / (x * x + t * t), cuts)  # noqa: B023
            assert abs(q / want - 1) < 2e-13


def test_clausen():
    for x in np.concatenate([np.linspace(-6.0, 6.0, 101), 10.0 ** np.arange(-12, 0), [1.6999, 1.7]]):
        assert abs(clausen(x) - mpmath.clsin(2, mpmath.mpf(x))) < 4e-16
