"""Integrals of powers of 1 / (q^2 + d^2) along a line: what rational kernels on segments are made of."""

import math

from fieldsim.portable import portable, real


@portable
def _sixth_power(u: real):
    """(Integral of sin^6 from 0 to an angle up to pi/2) / (sin^6 t), t = tan(angle / 2), for u = t^2 in 0..1.

    (1 + u)^6 times its logarithm is all that is singular here, and at u = -1 only: a polynomial (Chebyshev
    interpolation in 60 digits) has a relative error of 2.4e-17. In Estrin's order.
    """
    u2 = u * u
    u4 = u2 * u2
    low = (real(0.2857142857142857) + real(0.15873015873015606) * u) + (real(0.043290043290217926) + real(0.003330003325473308) * u) * u2
    middle = (real(-0.00022200016026329873) + real(3.9176001590602615e-05) * u) + (real(-1.0306868912688369e-05) + real(3.4263688271028705e-06) * u) * u2
    high = (real(-1.3178691209748158e-06) + real(5.400394664116728e-07) * u) + (real(-2.1143526822636583e-07) + real(6.869200469389338e-08) * u) * u2
    return low + (middle + (high + (real(-1.5420143321889157e-08) + real(1.7150918820417508e-09) * u) * u4) * u4) * u4


@portable
def inverse_powers(lo: real, length: real, d2: real, i_lo: real, i_hi: real):
    """Integrals of (q^2 + d2)^-k over q = lo..lo + length for k = 1, 2, 3, 4; |lo| <= hi = lo + length.

    i_lo, i_hi: the integrand of k = 1 at the ends, finite. Relative error < 1e-15 sqrt(k), inf on a line without d2.
    With q = d tan(phi) they are integrals of even powers of cos(phi), and these, in the difference t of the two phi's
    and the product of their cosines, come down to the integrals z of sin^2, sin^4, sin^6 from 0 to t: each follows from
    the next by a sum of positive terms, in which d cancels. No branch: beyond a right angle the supplement is taken.
    """
    root = math.sqrt(i_lo) * math.sqrt(i_hi)
    turn = length * root
    cos = (d2 + lo * (lo + length)) * root
    square = turn * turn
    sin2 = d2 * square
    versed = real(1.0) / (real(1.0) + abs(cos))
    beside = turn * abs(cos)
    z6 = turn * versed * _sixth_power(sin2 * versed * versed)
    z4 = (real(6.0) * sin2 * z6 + beside) / real(5.0)
    z2 = (real(4.0) * sin2 * z4 + beside) / real(3.0)
    z0 = real(2.0) * sin2 * z2 + beside
    # Over the half turn: 1 / d^2, pi / d and so on.
    half = real(0.0)
    sign = real(1.0)
    if cos < real(0.0):
        half = real(1.0) / d2
        sign = -real(1.0)
    turns = real(math.pi) * math.sqrt(half)
    one = turns + sign * z0
    turns *= half
    z2 = real(0.5) * turns + sign * square * z2
    turns *= half
    z4 = real(0.375) * turns + sign * square * square * z4
    turns *= half
    z6 = real(0.3125) * turns + sign * square * square * square * z6
    rise = cos + length * turn
    root2 = root * root
    return (
        one,
        root * turn + z2,
        root2 * turn * rise + z4,
        root2 * root * turn * (rise * rise - sin2 / real(3.0)) + z6,
    )
