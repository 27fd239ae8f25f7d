"""The free rotor: elliptic functions, closed forms of special tops, and the identities that any motion obeys."""

import math

import mpmath
import numpy as np
import pytest

from fieldsim.dynamics.rigid.rotor import PANEL, free_rotor
from fieldsim.numerics.elliptic import jacobi_functions
from fieldsim.numerics.quaternion import matrices

# Inverse moments, descending, and angular momenta: about each axis and next to it, at random, on the separatrix.
TOPS = {
    "any": (2.0, 1.1, 0.7),
    "flat": (1.5, 1.5, 0.8),
    "long": (3.0, 1.0, 1.0),
    "almost long": (3.0, 1.0 + 1e-12, 1.0),
    "sphere": (1.3, 1.3, 1.3),
}
MOMENTA = {
    "any": (0.3, -0.5, 0.8),
    "first": (1.0, 0.0, 0.0),
    "second": (0.0, -1.0, 0.0),
    "third": (0.0, 0.0, -1.0),
    "flip": (1e-6, 1.0, 1e-7),
    "separatrix": (math.sqrt(0.4), 0.3, math.sqrt(0.9)),
}


def moved(m, a, t):
    """m after a time t and the matrix of the turn Q."""
    out = np.array(free_rotor(*map(float, m), *a, float(t)))
    return out[:3], matrices(out[3:])


@pytest.mark.parametrize("k2", [0.0, 1e-9, 0.4, 0.999, 1.0])
def test_jacobi_functions(k2):
    for t in (1e-3, 0.1, PANEL):
        for scale, found in zip("snd", jacobi_functions(t, 1.0, k2), strict=True):
            exact = float(mpmath.ellipfun({"s": "sn", "n": "cn", "d": "dn"}[scale], t, m=k2))
            assert found == pytest.approx(exact, rel=1e-15), (t, scale)


@pytest.mark.parametrize("m", MOMENTA.values(), ids=MOMENTA)
@pytest.mark.parametrize("a", TOPS.values(), ids=TOPS)
def test_what_free_motion_keeps(a, m):
    for t in (0.01, 1.0, 30.0, -30.0):
        end, q = moved(m, a, t)
        # 30 units of time are some 100 panels, each of a few roundings.
        np.testing.assert_allclose(np.dot(a, end**2), np.dot(a, np.square(m)), rtol=1e-13)
        np.testing.assert_allclose(q @ end, m, atol=2e-15)
        half, to_half = moved(m, a, 0.4 * t)
        rest, from_half = moved(half, a, 0.6 * t)
        np.testing.assert_allclose(rest, end, atol=1e-9 if m == MOMENTA["flip"] else 2e-13)
        np.testing.assert_allclose(to_half @ from_half, q, atol=1e-9 if m == MOMENTA["flip"] else 2e-13)


@pytest.mark.parametrize("m", MOMENTA.values(), ids=MOMENTA)
@pytest.mark.parametrize("a", TOPS.values(), ids=TOPS)
def test_it_turns_with_the_angular_velocity(a, m):
    t, h = 0.7, 1e-4
    end, q = moved(m, a, t)
    rate = q.T @ (moved(m, a, t + h)[1] - moved(m, a, t - h)[1]) / (2 * h)
    spin = np.array([rate[2, 1], rate[0, 2], rate[1, 0]])
    # The central difference errs by h^2 / 6 times the third derivative, below 10.
    np.testing.assert_allclose(spin, a * end, atol=3e-8)


def test_a_symmetric_top_precesses_evenly():
    a, m, t = np.array(TOPS["flat"]), np.array(MOMENTA["any"]), 12.3
    _, q = moved(m, a, t)
    body = rotation((0, 0, 1), (a[2] - a[0]) * m[2] * t)
    np.testing.assert_allclose(q, rotation(m, a[0] * np.linalg.norm(m) * t) @ body, atol=2e-14)


def rotation(axis, angle):
    axis = np.array(axis) / np.linalg.norm(axis)
    return matrices(np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)]))


@pytest.mark.parametrize("aside", [0.3, 1e-3, 1e-6])
def test_dzhanibekov_flips_come_at_the_analytic_period(aside):
    """Spinning about the middle axis a body flips every 2 K(k) / lambda."""
    a = np.array(TOPS["any"])
    m = np.array([0.5 * aside, 1.0, aside])
    p = (a[1] - a[2]) * ((a[0] - a[2]) * m[2] ** 2 + (a[0] - a[1]) * m[1] ** 2)
    n = (a[0] - a[1]) * ((a[0] - a[2]) * m[0] ** 2 + (a[1] - a[2]) * m[1] ** 2)
    small, large = mpmath.mpf(min(p, n)), mpmath.mpf(max(p, n))
    flip = 2 * float(mpmath.ellipk(small / large) / mpmath.sqrt(large))
    end, _ = moved(m, a, flip)
    # The component about which it does not turn over stays; errors of rounding grow as 1 / aside towards the flip.
    keeps = 0 if n > p else 2
    expected = -m
    expected[keeps] = m[keeps]
    np.testing.assert_allclose(end, expected, atol=1e-15 / aside + 1e-14)


def test_no_angular_momentum_no_turn():
    assert free_rotor(0.0, 0.0, 0.0, 2.0, 1.0, 0.5, 3.0) == (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def test_numba_and_python_agree():
    args = (*MOMENTA["any"], *TOPS["any"], 5.0)
    np.testing.assert_allclose(free_rotor.numba(*args), free_rotor(*args), atol=1e-14)
