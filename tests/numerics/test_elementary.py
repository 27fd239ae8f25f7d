"""Logarithm, exponential, error and Bessel functions against mpmath over log-uniform arguments, on every target."""

import functools
import math

import mpmath
import numpy as np
import on_targets
import pytest

from fieldsim.numerics.bessel import bessel_scaled
from fieldsim.numerics.elementary import exp_moment, exp_slope, log1p
from fieldsim.numerics.error_functions import erfcx
from fieldsim.portable import portable, real

ACCEPTED = {
    "log1p": (4, 4),
    "exp_slope": (4, 4),
    "exp_moment": (4, 4),
    "erfcx": (4, 4),
    "bessel_i0": (8, 8),
    # I0 - I1 is formed below x = 16, where I0 / (I0 - I1) reaches 32.
    "bessel_difference": (120, 120),
    "bessel_slope": (8, 8),
}


@portable
def functions(x: real, y: real, z: real):
    i0, difference, slope = bessel_scaled(x)
    return log1p(x), exp_slope(x), exp_moment(x), erfcx(x), i0, difference, slope, real(0.0)


def true(x):
    with mpmath.workdps(60):
        x = mpmath.mpf(x)
        scale = mpmath.exp(-x)
        i0, i1 = scale * mpmath.besseli(0, x), scale * mpmath.besseli(1, x)
        # Above 1e3 exp(x^2) erfc(x) is its asymptotic series to 1e-22.
        u = 1 / (2 * x * x)
        tail = (1 - u + 3 * u**2 - 15 * u**3) / (x * mpmath.sqrt(mpmath.pi))
        scaled = mpmath.exp(x * x) * mpmath.erfc(x) if x < 1e3 else tail
        return on_targets.relative(
            mpmath.log(1 + x), -mpmath.expm1(-x) / x, (1 - (1 + x) * scale) / x**2, scaled, i0, i0 - i1, i1 / x
        )


@functools.cache
def arguments():
    rng = np.random.default_rng(5)
    asked = on_targets.exactly_held(np.concatenate([10 ** rng.uniform(-9, 5, 200), rng.uniform(0, 40, 200)]))
    return asked, [true(x) for x in asked[0]]


@pytest.mark.parametrize("target", on_targets.EPS)
def test_functions_meet_mpmath(target):
    on_targets.check(target, functions, *arguments(), ACCEPTED)


def test_special_arguments():
    assert bessel_scaled(0.0) == (1.0, 1.0, 0.5)
    assert bessel_scaled(math.inf) == (0.0, 0.0, 0.0)
    assert log1p(0.0) == 0.0
    assert log1p(math.inf) == math.inf
    assert log1p(-0.25) == pytest.approx(math.log(0.75), rel=1e-15)
    assert exp_slope(0.0) == 1.0
    assert exp_slope(1000.0) == 1e-3
    assert exp_moment(0.0) == 0.5
    assert erfcx(0.0) == pytest.approx(1.0, rel=1e-15)
