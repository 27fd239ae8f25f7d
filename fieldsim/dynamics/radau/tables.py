"""Constants of the 15th-order Gauss-Radau method, computed exactly and rounded once.

Within a step of length h the acceleration is the polynomial of s in 0..1 through its values at the eight nodes s_0 = 0,
.., s_7. It is held as a series of eight columns: in powers, a(s) = sum of b_k s^k, or by its first value and the
differences of the others from it, (a_0, a_1 - a_0, .., a_7 - a_0). All that is wanted of it is a weighted sum: row k of
a table of weights is what column k of a series contributes to each column of the result.
Everhart 1985; Rein & Spiegel 2015.
"""

import math
from fractions import Fraction

import numpy as np

PLACES = 8
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


def _through(place):
    """Powers of the polynomial that is 1 at one node and 0 at the others; for the first node that of a constant."""
    if place == 0:
        return [Fraction(int(k == 0)) for k in range(PLACES)]
    polynomial = [Fraction(1)]
    for other in (node for k, node in enumerate(NODES) if k != place):
        span = NODES[place] - other
        pairs = zip([Fraction(0), *polynomial], [*(-other * c for c in polynomial), Fraction(0)], strict=True)
        polynomial = [(a + b) / span for a, b in pairs]
    return polynomial


def _way(polynomial, s):
    """Double integral from 0 to s."""
    return sum(c * s ** (k + 2) / ((k + 1) * (k + 2)) for k, c in enumerate(polynomial))


def _speed(polynomial):
    """Integral from 0 to 1."""
    return sum(c / (k + 1) for k, c in enumerate(polynomial))


def _derivative(polynomial, order):
    """Derivative at 1."""
    return sum(c * math.perm(k, order) for k, c in enumerate(polynomial))


def _with_rest(weight):
    """A weight, and what rounding takes from it."""
    return weight, weight - Fraction(float(weight))


def _table(rows):
    return np.array([[float(c) for c in row] for row in rows])


_POWERS = [[Fraction(int(k == j)) for j in range(PLACES)] for k in range(PLACES)]
_DIFFERENCES = [_through(place) for place in range(PLACES)]
# From differences to powers.
IN_POWERS = _table(_DIFFERENCES)
# From differences, and from powers, to offsets of the nodes, in units of h^2.
WAYS = _table([[_way(p, node) for node in NODES] for p in _DIFFERENCES])
WAYS_OF_POWERS = _table([[_way(p, node) for node in NODES] for p in _POWERS])
# From powers to powers from the end of the step on, of a step of the same length.
AHEAD = _table([[math.comb(j, k) for k in range(PLACES)] for j in range(PLACES)])
# From differences to what a step ends with, by column: the way less h v, in units of h^2, and what rounding took from
# its weights; the speed gained without a_0's part, in units of h, and the same of it; the acceleration and its first
# three derivatives.
COLUMNS = WAY, WAY_REST, SPEED, SPEED_REST, PULL, FIRST, SECOND, THIRD = range(PLACES)
_SPEEDS = [Fraction(0), *(_speed(p) for p in _DIFFERENCES[1:])]
ENDS = _table(
    [
        [*_with_rest(_way(p, 1)), *_with_rest(speed), *(_derivative(p, order) for order in range(4))]
        for p, speed in zip(_DIFFERENCES, _SPEEDS, strict=True)
    ]
)
