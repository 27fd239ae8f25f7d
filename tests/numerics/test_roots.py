"""Roots of polynomials against NumPy's."""

import numpy as np
import pytest
import warp as wp

from fieldsim import launch
from fieldsim.numerics.roots import Polynomial, cubic_root, first_rise


@wp.kernel(module="unique", enable_backward=False)
def _first_rises(start: int, polynomials: wp.array(dtype=Polynomial), found: wp.array(dtype=wp.float64)):
    i = start + wp.tid()
    found[i] = first_rise(polynomials[i])


def test_the_first_rise_of_polynomials_is_numpys():
    rng = np.random.default_rng(2)
    coefficients = rng.normal(size=(400, 7)) * 10.0 ** rng.uniform(-3, 3, (400, 7))
    # Of all degrees, also of degree 0.
    coefficients[np.arange(7) > rng.integers(0, 7, 400)[:, None]] = 0.0
    found = wp.full(400, np.nan, dtype=wp.float64, device="cpu")
    polynomials = wp.array(coefficients, dtype=Polynomial, device="cpu")
    launch.launch(_first_rises, 400, [polynomials], [found], device="cpu")
    hits = 0
    for own, c in zip(found.numpy(), coefficients, strict=True):
        p = np.polynomial.Polynomial(c)
        roots = p.roots()
        real = roots[np.abs(roots.imag) < 1e-9].real
        rising = real[(real > 0) & (real < 1) & (p.deriv()(real) > 0)]
        if len(rising):
            hits += 1
            assert own == pytest.approx(rising.min(), abs=1e-9)
        else:
            assert own > 1 - 2e-6 or own < 2e-6
    assert hits > 60


def _cubic(a, da, b, db, u):
    return a + u * (da + u * (3 * (b - a) - 2 * da - db + u * (da + db - 2 * (b - a))))


@wp.kernel(module="unique", enable_backward=False)
def _cubic_roots(start: int, cubics: wp.array(dtype=wp.vec4), found: wp.array(dtype=float)):
    i = start + wp.tid()
    found[i] = cubic_root(cubics[i][0], cubics[i][1], cubics[i][2], cubics[i][3])


def test_roots_of_cubics():
    rng = np.random.default_rng(3)
    a, b = -(10.0 ** rng.uniform(-3, 1, 1000)), 10.0 ** rng.uniform(-3, 1, 1000)
    slopes = rng.uniform(-4.0, 4.0, (2, 1000)) * (b - a)
    cubics = np.array([a, slopes[0], b, slopes[1]]).T.astype(np.float32)
    found = wp.full(1000, np.nan, dtype=float, device="cpu")
    launch.launch(_cubic_roots, 1000, [wp.array(cubics, dtype=wp.vec4, device="cpu")], [found], device="cpu")
    u = found.numpy().astype(float)
    a, da, b, db = cubics.astype(float).T
    left = np.abs(_cubic(a, da, b, db, u)) / (b - a)
    assert ((u >= 0) & (u <= 1)).all()
    assert np.median(left) < 1e-6
    assert np.quantile(left, 0.9) < 0.02
    assert left.max() < 0.3
