"""Elliptic integrals and functions against mpmath over log-uniform arguments, on every target."""

import functools
import math

import mpmath
import numpy as np
import on_targets
import pytest

from fieldsim.numerics.elliptic import carlson_d_pair, carlson_d_trio, elliptic_dv, jacobi_functions
from fieldsim.portable import portable, real

ACCEPTED = {
    "elliptic_d": (8, 8),
    # P and log(m1) Q have opposite signs in V.
    "elliptic_v": (20, 20),
    "carlson_near": (16, 16),
    "carlson_far": (16, 16),
    "carlson_ratio": (20, 20),
    "jacobi_s": (4, 4),
    "jacobi_c": (4, 4),
    "jacobi_d": (4, 4),
}


@portable
def functions(x: real, t: real, m1: real):
    d, v = elliptic_dv(m1)
    near, far, ratio = carlson_d_trio(x, x + m1, x + real(1.0))
    s, c, n = jacobi_functions(t, real(1.0), m1)
    return d, v, near, far, ratio, s, c, n


def true(x, t, m1):
    with mpmath.workdps(100):
        x, t, m1 = mpmath.mpf(x), mpmath.mpf(t), mpmath.mpf(m1)
        m = 1 - m1
        k, e = mpmath.ellipk(m), mpmath.ellipe(m)
        d = (k - e) / m
        v = (k - (1 + m1) * d) / m
        near, far = mpmath.elliprd(x, x + 1, x + m1), mpmath.elliprd(x, x + m1, x + 1)
        ratio = (near - far) / m
        jacobi = [mpmath.ellipfun(name, t, m=m1) for name in ("sn", "cn", "dn")]
        return on_targets.relative(d, v, near, far, ratio, *jacobi)


@functools.cache
def arguments():
    """x in 1e-9..1e5, t in 1e-4..1/4, m1 in 1e-30..1."""
    rng = np.random.default_rng(5)
    x = np.concatenate([10 ** rng.uniform(-9, 5, 100), rng.uniform(0, 40, 100)])
    t = np.concatenate([10 ** rng.uniform(-4, -0.61, 100), rng.uniform(0, 0.25, 100)])
    m1 = np.concatenate([10 ** rng.uniform(-30, 0, 100), rng.uniform(0, 0.999, 100)])
    asked = on_targets.exactly_held(x, t, m1)
    return asked, [true(*column) for column in asked.T]


@pytest.mark.parametrize("target", on_targets.EPS)
def test_functions_meet_mpmath(target):
    on_targets.check(target, functions, *arguments(), ACCEPTED)


def test_special_arguments():
    d, v = elliptic_dv(1.0)
    assert d == pytest.approx(math.pi / 4, rel=1e-15)
    assert v == pytest.approx(3 * math.pi / 16, rel=1e-15)
    # R_D of equal arguments is x^(-3/2).
    assert carlson_d_pair(4.0, 4.0, 4.0) == pytest.approx((0.125, 0.125), rel=1e-15)
    assert jacobi_functions(0.0, 1.0, 0.5) == (0.0, 1.0, 1.0)


@pytest.mark.parametrize("x", [0.0, 1e-20, 1e-6, 0.3, 10.0, 1e8])
@pytest.mark.parametrize("gap", [1e-24, 1e-9, 1e-2, 0.5, 0.999999])
def test_carlson_ratio(x, gap):
    with mpmath.workdps(60):
        x, y, z = mpmath.mpf(x), mpmath.mpf(x + gap), mpmath.mpf(x + 1.0)
        exact = (mpmath.elliprd(x, z, y) - mpmath.elliprd(x, y, z)) / (z - y)
    _, _, ratio = carlson_d_trio(float(x), float(y), float(z))
    assert y == x or abs(ratio / exact - 1) < 4e-15
