"""Integrals of powers of 1 / (q^2 + d^2) along a line: what rational kernels on segments are made of."""

import math

from fieldsim.numerics.constants import HALF_PI, THIRD, TWO_THIRDS
from fieldsim.numerics.sine_integrals import sixth_power
from fieldsim.portable import portable, real

FIVE_SIXTHS = 5 / 6


@portable
def inverse_powers(lo: real, length: real, d2: real):
    """Integrals of h = 1 / (q^2 + d2) and of its powers over q = lo..hi = lo + length, |lo| <= hi.

    Returns (sqrt(h_lo h_hi), h_lo + h_hi, h_hi) from the ends, and the integrals of h, h^2, h^3, h^4, each with a
    relative error < 5e-15: inf on the line without d2, but undefined at an end of it.
    With q = d tan(phi) they are integrals of even powers of cos(phi), and these, in the difference t of the two phi's
    and the product of their cosines, come down to the integrals of sin^2, sin^4, sin^6 from 0 to t: each follows from
    the next by a sum of positive terms, in which d cancels. No branch: beyond a right angle the supplement is taken.
    """
    hi = lo + length
    lo2 = d2 + lo * lo
    hi2 = d2 + hi * hi
    product = math.sqrt(lo2) * math.sqrt(hi2)
    dot = d2 + lo * hi
    root = real(1.0) / product
    turn = length * root
    cos = dot * root
    square = turn * turn
    sin2 = d2 * square
    # Beyond a right angle the supplement, taken from the half turn's pi / d and so on.
    reach = length
    half = real(0.0)
    if dot < real(0.0):
        reach = -length
        half = real(1.0) / d2
    halving = reach / (product + abs(dot))
    # Six times the integral of sin^6, five times that of sin^4, ..., without powers of `turn`.
    beside = turn * cos
    six = halving * sixth_power(d2 * halving * halving)
    five = sin2 * six + beside
    three = real(0.8) * sin2 * five + beside
    half_turn = real(HALF_PI) * math.sqrt(half)
    half_turn3 = half_turn * half
    half_turn5 = real(0.75) * half_turn3 * half
    rise = cos + length * turn
    root2 = root * root
    return (
        root,
        (lo2 + hi2) * root * root,
        lo2 * root * root,
        real(2.0) * half_turn + (real(TWO_THIRDS) * sin2 * three + beside),
        half_turn3 + (real(THIRD) * square * three + root * turn),
        half_turn5 + (real(0.2) * square * square * five + root2 * turn * rise),
        real(FIVE_SIXTHS) * half_turn5 * half
        + (square * square * square * six / real(6.0) + root2 * root * turn * (rise * rise - real(THIRD) * sin2)),
    )
