"""Integrals of powers of 1 / (q^2 + d^2) along a line: what rational kernels on segments are made of."""

import math

from fieldsim.portable import portable, real

THIRD = 1 / 3
FOUR_THIRDS = 4 / 3


@portable
def _sixth_power(u: real):
    """(Integral of sin^6 from 0 to an angle up to pi/2) / (sin^6 t), t = tan(angle / 2), for u = t^2 in 0..1.

    (1 + u)^6 times its logarithm is all that is singular here, and at u = -1 only: a polynomial (Chebyshev
    interpolation in 60 digits) has a relative error of 2.4e-17. Short chains keep the processor's pipes full.
    """
    u2 = u * u
    u4 = u2 * u2
    a = real(0.2857142857142857) + real(0.15873015873015606) * u
    b = real(0.043290043290217926) + real(0.003330003325473308) * u
    c = real(-0.00022200016026329873) + real(3.9176001590602615e-05) * u
    d = real(-1.0306868912688369e-05) + real(3.4263688271028705e-06) * u
    e = real(-1.3178691209748158e-06) + real(5.400394664116728e-07) * u
    f = real(-2.1143526822636583e-07) + real(6.869200469389338e-08) * u
    g = real(-1.5420143321889157e-08) + real(1.7150918820417508e-09) * u
    return (a + b * u2) + u4 * ((c + d * u2) + u4 * (e + u2 * (f + u2 * g)))


@portable
def inverse_powers(lo: real, length: real, d2: real):
    """(h_lo, h_hi, I1, I2, I3, I4): h = 1 / (q^2 + d2) at the ends, and integrals of h^k over q = lo..lo + length.

    |lo| <= lo + length; not at an end without d2. Relative error < 2e-15, inf on the line without d2.
    With q = d tan(phi) they are integrals of even powers of cos(phi), and these, in the difference t of the two phi's
    and the product of their cosines, come down to the integrals z of sin^2, sin^4, sin^6 from 0 to t: each follows from
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
    z6 = halving * _sixth_power(d2 * halving * halving)
    z4 = real(1.2) * sin2 * z6 + real(0.2) * turn * cos
    z2 = real(FOUR_THIRDS) * sin2 * z4 + real(THIRD) * turn * cos
    z0 = real(2.0) * sin2 * z2 + turn * cos
    turns = real(math.pi) * math.sqrt(half)
    turns3 = turns * half
    turns5 = turns3 * half
    rise = cos + length * turn
    root2 = root * root
    return (
        hi2 * root * root,
        lo2 * root * root,
        turns + z0,
        real(0.5) * turns3 + (square * z2 + root * turn),
        real(0.375) * turns5 + (square * square * z4 + root2 * turn * rise),
        real(0.3125) * turns5 * half
        + (square * square * square * z6 + root2 * root * turn * (rise * rise - real(THIRD) * sin2)),
    )
