"""Clausen's integral, portable: what the inverse square law over a triangle is made of."""

import math

from fieldsim.numerics.constants import TAU
from fieldsim.portable import portable, real

LN_2 = math.log(2.0)
# Where the expansion about 0 hands over to the one about pi.
SPLIT = 1.7


@portable
def clausen(x: real):
    """Cl2(x) = Im Li2(e^ix) = -integral from 0 to x of log|2 sin(u/2)| du, for |x| <= 2 pi.

    Absolute error < 4e-16 (near 2 pi that of x times its logarithm; float32: 7e-7), relative error < 1e-15 near 0 and
    near pi. Odd and of period 2 pi; the expansions about 0 and pi (Lewin 1981, 4.3), power series economised in
    50-digit arithmetic.
    """
    y = abs(x)
    sign = real(1.0)
    if x < real(0.0):
        sign = -sign
    if y > real(math.pi):
        y = real(TAU) - y
        sign = -sign
    if y <= real(0.0):
        return real(0.0)
    # Both expansions, rather than a branch that a processor mispredicts; their parts do not wait for each other.
    u = y * y
    u2 = u * u
    u4 = u2 * u2
    p = (
        real(0.013888888888888885)
        + real(6.944444444465524e-05) * u
        + (real(7.873519763000808e-07) + real(1.1482220553753795e-08) * u) * u2
    )
    p += (
        real(1.8978302057221917e-10)
        + real(3.3914404535293387e-12) * u
        + (real(6.207137077446365e-14) + real(1.5826034437200918e-15) * u) * u2
    ) * u4
    z = real(math.pi) - y
    w = z * z
    w2 = w * w
    w4 = w2 * w2
    q = (
        real(0.041666666666666685)
        + real(0.0010416666666646908) * w
        + (real(4.9603174641060076e-05) + real(2.9279648851808713e-06) * w) * w2
    )
    q += (
        real(1.9415491499569878e-07)
        + real(1.3868623776777464e-08) * w
        + (real(1.0472778054393931e-09) + real(7.884722984885826e-11) * w) * w2
    ) * w4
    q += (real(8.128334611366381e-12) + real(3.507933047288945e-14) * w + real(1.3158422302489123e-13) * w2) * (w4 * w4)
    value = z * (real(LN_2) - w * q)
    if y < real(SPLIT):
        value = y * (real(1.0) - math.log(y) + u * p)
    return sign * value
