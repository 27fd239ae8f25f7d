"""Quadrature: tables against mpmath, and what portables are served of them, on every target."""

import mpmath
import numpy as np
import on_targets
import pytest

from fieldsim.numerics import quadrature
from fieldsim.numerics.quadrature import (
    gauss_legendre,
    legendre_4,
    legendre_8,
    legendre_12,
    legendre_16,
    legendre_24,
    unit_jacobi_6,
    unit_legendre_6,
    unit_legendre_8,
)
from fieldsim.portable import portable, real


def exact_rule(guesses, beta):
    """Nodes near the guesses and their weights on 0..1, for the weight (1 + beta) s^beta, beta 0 or 1, in 40 digits."""
    with mpmath.workdps(40):

        def polynomial(t):
            return mpmath.jacobi(len(guesses), 0, beta, t)

        near = [2 * mpmath.mpf(x) - 1 for x in guesses]
        roots = [mpmath.findroot(polynomial, (t - 1e-8, t + 2e-8)) for t in near]
        # Christoffel's numbers.
        weights = [(1 + beta) / ((1 - t * t) * mpmath.diff(polynomial, t) ** 2) for t in roots]
        return [((1 + t) / 2, w) for t, w in zip(roots, weights, strict=True)]


@pytest.mark.parametrize("count", quadrature.LEGENDRE)
def test_legendre(count):
    """Correctly rounded: the nearest float64 to each node and weight."""
    positive = [x for x, _w in quadrature.LEGENDRE[count]]
    exact = exact_rule([0.5 + 0.5 * x for x in (*positive, *(-x for x in positive))], 0)[: len(positive)]
    with mpmath.workdps(40):
        assert list(quadrature.LEGENDRE[count]) == [(float(2 * x - 1), float(2 * w)) for x, w in exact]


@pytest.mark.parametrize("count", quadrature.UNIT_LEGENDRE)
def test_legendre_on_the_unit_interval(count):
    table = list(quadrature.UNIT_LEGENDRE[count])
    assert table == [(float(x), float(w)) for x, w in exact_rule([x for x, _w in table], 0)]


@pytest.mark.parametrize("count", quadrature.UNIT_JACOBI)
def test_jacobi(count):
    table = list(quadrature.UNIT_JACOBI[count])
    assert table == [(float(x), float(w)) for x, w in exact_rule([x for x, _w in table], 1)]


@pytest.mark.parametrize("count", [2, 8, 24])
def test_any_order(count):
    nodes, weights = gauss_legendre(count)
    exact = np.array([[float(x), float(w)] for x, w in exact_rule(nodes.tolist(), 0)]).T
    np.testing.assert_allclose([nodes, weights], exact, rtol=0, atol=1e-15)
    nodes, weights = gauss_legendre(count, -2.0, 4.0)
    np.testing.assert_allclose(weights @ nodes, 6.0, rtol=1e-14)


@portable
def integrals(a: real, b: real, c: real):
    """Of x^6 over -1..1 and of s^6, s^7 s over 0..1, by all the rules that are exact for it."""
    four = real(0.0)
    eight = real(0.0)
    twelve = real(0.0)
    sixteen = real(0.0)
    many = real(0.0)
    unit_six = real(0.0)
    unit_eight = real(0.0)
    jacobi = real(0.0)
    for k in range(2):
        x, w = legendre_4(k)
        four += real(2.0) * w * x * x * x * x * x * x
    for k in range(4):
        x, w = legendre_8(k)
        eight += real(2.0) * w * x * x * x * x * x * x
    for k in range(6):
        x, w = legendre_12(k)
        twelve += real(2.0) * w * x * x * x * x * x * x
        x, w = unit_legendre_6(k)
        unit_six += w * x * x * x * x * x * x
        x, w = unit_jacobi_6(k)
        jacobi += w * x * x * x * x * x * x
    for k in range(8):
        x, w = legendre_16(k)
        sixteen += real(2.0) * w * x * x * x * x * x * x
        x, w = unit_legendre_8(k)
        unit_eight += w * x * x * x * x * x * x
    for k in range(12):
        x, w = legendre_24(k)
        many += real(2.0) * w * x * x * x * x * x * x
    return four, eight, twelve, sixteen, many, unit_six, unit_eight, jacobi


@pytest.mark.parametrize("target", on_targets.EPS)
def test_rules_integrate_polynomials(target):
    found = on_targets.computed(target, integrals, np.zeros((3, 1)))[:, 0]
    exact = np.array([2 / 7] * 5 + [1 / 7] * 2 + [1 / 4])
    assert (np.abs(found / exact - 1) <= 8 * on_targets.EPS[target]).all(), found / exact - 1
