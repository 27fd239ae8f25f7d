"""Constants of the 15th-order Gauss-Radau method, computed exactly and rounded once.

Within a step of length h the acceleration is a polynomial of s in 0..1, in Newton's form over the eight nodes s_k,

    a(s) = a_0 + sum over k of g_k N_k(s),        N_k(s) = (s - s_0) (s - s_1) ... (s - s_k),        k = 0..6,

and in powers, a(s) = a_0 + sum of b_k s^(k+1). Everhart 1985; Rein & Spiegel 2015.
"""

import math
from fractions import Fraction

import numpy as np
import warp as wp

ORDER = 7
# The Gauss-Radau nodes: zeros of (P_7 + P_8)(2 s - 1), P the Legendre polynomials. They are rounded here, and all else
# is computed for the rounded ones, as the smallest constant errors add up over millions of steps.
NODES = tuple(
    Fraction(float(digits))
    for digits in (
        "0",
        "0.056262560536922146465652191032311",
        "0.18024069173689236498757994280918",
        "0.35262471711316963737390777017124",
        "0.54715362633055538300144855765235",
        "0.73421017721541053152321060830661",
        "0.88532094683909576809035976293249",
        "0.97752061356128750189117450042915",
    )
)


def _newton():
    """Coefficients of N_k in powers: row k holds those of s^1 .. s^7 (N_k has no constant term)."""
    rows, polynomial = [], [Fraction(1)]
    for node in NODES[:-1]:
        shifted, scaled = [Fraction(0), *polynomial], [*(-node * c for c in polynomial), Fraction(0)]
        polynomial = [a + b for a, b in zip(shifted, scaled, strict=True)]
        rows.append([*polynomial[1:], *[Fraction(0)] * ORDER][:ORDER])
    return rows


def _integral_twice(row, s):
    return sum(c * s ** (k + 3) / ((k + 2) * (k + 3)) for k, c in enumerate(row))


def _matrix(rows):
    return np.array([[float(c) for c in row] for row in rows])


_NEWTON = _newton()
# POWERS[k][j]: coefficient of s^(j+1) in N_k; b_j = sum over k of POWERS[k][j] g_k.
POWERS = _matrix(_NEWTON)
# DIVIDE[n][k]: 1 / (s_(n+1) - s_k), for the divided differences.
DIVIDE = _matrix(
    [[1 / (NODES[n + 1] - NODES[k]) if k <= n else Fraction(0) for k in range(ORDER)] for n in range(ORDER)]
)
# OFFSETS[n][k]: double integral of N_k from 0 to node n + 1, so that the offset of a node is h^2 times its sum with g.
OFFSETS = _matrix([[_integral_twice(row, node) for row in _NEWTON] for node in NODES[1:]])
# BACK[k][j]: g_j = sum over k of BACK[k][j] b_k, the inverse of POWERS.


def _inverse(rows):
    """Inverse of a lower triangular matrix."""
    result = [[Fraction(int(i == j)) for j in range(ORDER)] for i in range(ORDER)]
    for i in range(ORDER):
        for j in range(i):
            result[i] = [a - rows[i][j] * b for a, b in zip(result[i], result[j], strict=True)]
    return result


BACK = _matrix(_inverse(_NEWTON))


def _weights():
    """Single and double integrals over the step of the polynomials that are 1 at one node and 0 at the others."""
    single, double = [], []
    for n, node in enumerate(NODES[1:], 1):
        polynomial = [Fraction(1)]
        for k, other in enumerate(NODES):
            if k != n:
                pairs = zip([Fraction(0), *polynomial], [*(-other * c for c in polynomial), Fraction(0)], strict=True)
                polynomial = [(a + b) / (node - other) for a, b in pairs]
        single.append(sum(c / (k + 1) for k, c in enumerate(polynomial)))
        double.append(sum(c / ((k + 1) * (k + 2)) for k, c in enumerate(polynomial)))
    return single, double


_SINGLE, _DOUBLE = _weights()
# Velocity gained in a step: h times a_0 + sum of SPEED (a_n - a_0); SPEED_REST: what rounding took from SPEED.
SPEED = [float(w) for w in _SINGLE]
SPEED_REST = [float(w - Fraction(float(w))) for w in _SINGLE]
# The way made: h v + h^2 times a_0 / 2 + sum of WAY (a_n - a_0).
WAY = [float(w) for w in _DOUBLE]
# BINOMIALS[k][j]: weight of b_j in the k-th coefficient of a polynomial shifted by 1.
BINOMIALS = np.array([[float(math.comb(j + 1, k + 1)) for j in range(ORDER)] for k in range(ORDER)])
STEP_NODES = [float(node) for node in NODES[1:]]

Series = wp.types.matrix(shape=(ORDER, 3), dtype=wp.float64)
