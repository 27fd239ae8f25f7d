"""Special functions against mpmath over log-uniform arguments, on every target."""

import functools
import math

import mpmath
import numba
import numpy as np
import pytest
import warp as wp

from fieldsim.numerics.bessel import bessel_scaled
from fieldsim.numerics.elementary import exp_slope, log1p
from fieldsim.numerics.elliptic import carlson_d_pair, elliptic_dv
from fieldsim.numerics.sine_integrals import sine_powers
from fieldsim.portable import portable, real

# Accepted errors in units of the target's rounding.
ULPS = {
    "log1p": 4,
    "exp_slope": 4,
    "elliptic_d": 8,
    # P and log(m1) Q have opposite signs in V.
    "elliptic_v": 20,
    "bessel_i0": 8,
    # I0 - I1 is formed below x = 16, where I0 / (I0 - I1) reaches 32.
    "bessel_difference": 120,
    "bessel_slope": 8,
    "sin2": 20,
    "sin4": 60,
    "carlson_near": 16,
    "carlson_far": 16,
}
EPS = {"warp64": 2.0**-52, "numba": 2.0**-52, "warp32": 2.0**-23}


@portable
def everything(x: real, y: real, m1: real):
    d, v = elliptic_dv(m1)
    i0, difference, slope = bessel_scaled(x)
    sin2, sin4 = sine_powers(math.sin(y), math.cos(y), y)
    near, far = carlson_d_pair(x, x + m1, x + real(1.0))
    return log1p(x), exp_slope(x), d, v, i0, difference, slope, sin2, sin4, near, far


def exactly(x, y, m1):
    """The same in 40 digits and more."""
    with mpmath.workdps(100):
        x, y, m1 = mpmath.mpf(x), mpmath.mpf(y), mpmath.mpf(m1)
        m = 1 - m1
        k, e = mpmath.ellipk(m), mpmath.ellipe(m)
        d = (k - e) / m if m else mpmath.pi / 4
        v = (k - (1 + m1) * d) / m if m else 3 * mpmath.pi / 16
        scale = mpmath.exp(-x)
        i0, i1 = scale * mpmath.besseli(0, x), scale * mpmath.besseli(1, x)
        s, c = mpmath.sin(y), mpmath.cos(y)
        sin2 = (y - s * c) / 2
        sin4 = (3 * sin2 - s**3 * c) / 4
        near, far = mpmath.elliprd(x, x + 1, x + m1), mpmath.elliprd(x, x + m1, x + 1)
        values = mpmath.log(1 + x), -mpmath.expm1(-x) / x, d, v, i0, i0 - i1, i1 / x, sin2, sin4, near, far
        return [float(value) for value in values]


@functools.cache
def arguments():
    """x in 1e-9..1e5, y in 1e-4..pi, m1 in 1e-30..1, as numbers that float32 holds; and what mpmath makes of them."""
    rng = np.random.default_rng(5)
    x = np.concatenate([10 ** rng.uniform(-9, 5, 200), rng.uniform(0, 40, 200)])
    y = np.concatenate([10 ** rng.uniform(-4, 0, 200), rng.uniform(0, math.pi, 200)])
    m1 = np.concatenate([10 ** rng.uniform(-30, 0, 199), rng.uniform(0, 1, 200), [1.0]])
    asked = np.array([x, y, m1]).astype(np.float32).astype(float)
    return asked, np.array([exactly(*column) for column in asked.T]).T


def computed(target, asked):
    result = np.full((len(ULPS), asked.shape[1]), np.nan)
    if target == "numba":
        run = everything.numba
        table = numba.njit(lambda a: [run(a[0, i], a[1, i], a[2, i]) for i in range(a.shape[1])])
        return np.array(table(asked)).T
    scalar = wp.float64 if target == "warp64" else wp.float32
    function = everything.warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def run_all(asked: wp.array(dtype=scalar, ndim=2), result: wp.array(dtype=scalar, ndim=2)):
        i = wp.tid()
        a, b, c, d, e, f, g, h, p, q, r = function(asked[0, i], asked[1, i], asked[2, i])
        result[0, i] = a
        result[1, i] = b
        result[2, i] = c
        result[3, i] = d
        result[4, i] = e
        result[5, i] = f
        result[6, i] = g
        result[7, i] = h
        result[8, i] = p
        result[9, i] = q
        result[10, i] = r

    out = wp.array(result, dtype=scalar, ndim=2, device="cpu")
    inputs = [wp.array(asked, dtype=scalar, ndim=2, device="cpu"), out]
    wp.launch(run_all, asked.shape[1], inputs, device="cpu")
    return out.numpy().astype(float)


@pytest.mark.parametrize("target", EPS)
def test_functions_meet_mpmath(target):
    asked, exact = arguments()
    error = np.abs(computed(target, asked) / exact - 1).max(axis=1) / EPS[target]
    accepted = np.array(list(ULPS.values()))
    assert (error <= accepted).all(), dict(zip(ULPS, error, strict=True))


def test_special_arguments():
    d, v = elliptic_dv(1.0)
    assert d == pytest.approx(math.pi / 4, rel=1e-15)
    assert v == pytest.approx(3 * math.pi / 16, rel=1e-15)
    assert bessel_scaled(0.0) == (1.0, 1.0, 0.5)
    assert bessel_scaled(math.inf) == (0.0, 0.0, 0.0)
    assert log1p(0.0) == 0.0
    assert log1p(math.inf) == math.inf
    assert log1p(-0.25) == pytest.approx(math.log(0.75), rel=1e-15)
    assert exp_slope(0.0) == 1.0
    assert exp_slope(1000.0) == 1e-3
