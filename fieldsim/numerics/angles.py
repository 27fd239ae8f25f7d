"""Sines, cosines and arctangents without branches, calls or reduction of large arguments, portable.

A partial arc needs half a dozen of them per query; library functions were most of its cost, and the closed
forms of triangles are mostly made of arctangents. The polynomials interpolate at Chebyshev nodes (60-digit arithmetic);
the errors of the fits are before rounding.
"""

import math

from fieldsim.numerics.constants import HALF_PI, QUARTER_PI, TAN_PI_8
from fieldsim.portable import portable, real

# pi / 2 in three parts, the first two exact in float32 and short: their differences from angles close by are exact.
HALF_PI_HIGH = 201 / 128
HALF_PI_MIDDLE = 507 / 2**20
HALF_PI_LOW = 3.139164786504813e-07


@portable
def sine_cosine(x: real):
    """Sine and cosine of x in [-pi/2, pi/2], each to 2 ulp of its type, the cosine down to 1e-22. Fits: 3e-17."""
    a = abs(x)
    turned = a > real(QUARTER_PI)
    if turned:
        a = ((real(HALF_PI_HIGH) - a) + real(HALF_PI_MIDDLE)) + real(HALF_PI_LOW)
    u = a * a
    u2 = u * u
    p = (-real(0.16666666666666666) + real(0.008333333333330948) * u) + (
        (-real(0.00019841269836758574) + real(2.755731610255244e-06) * u)
        + (-real(2.5051131845003624e-08) + real(1.5918129294866608e-10) * u) * u2
    ) * u2
    q = (real(0.041666666666666664) - real(0.0013888888888887398) * u) + (
        (real(2.480158729876569e-05) - real(2.7557317271729793e-07) * u)
        + (real(2.08761462684032e-09) - real(1.1382632425521717e-11) * u) * u2
    ) * u2
    sin = a + a * u * p
    cos = real(1.0) - (real(0.5) * u - u2 * q)
    swap = sin
    if turned:
        sin = cos
        cos = swap
    return math.copysign(sin, x), cos


@portable
def arctangent_and_rest(y: real, x: real):
    """The angle of (x, y), as `arctangent`, and (atan(t) - t) / t^3 of t = y / x, where 0 <= t <= tan(pi / 8).

    The smaller over the larger coordinate, turned by pi / 4 where it exceeds tan(pi / 8); then a polynomial in t^2
    whose parts do not wait for each other. Relative error of the rest 3 ulp; for other t it is another number.
    """
    a = abs(x)
    b = abs(y)
    low = min(b, a)
    high = max(b, a)
    # Two rotations by reflection: to at most pi / 4, then by pi / 4 to at most pi / 8.
    top = low
    bottom = high
    base = real(0.0)
    if low > real(TAN_PI_8) * high:
        top = low - high
        bottom = low + high
        base = real(QUARTER_PI)
    if bottom == real(0.0):
        bottom = real(1.0)
    t = top / bottom
    u = t * t
    u2 = u * u
    u4 = u2 * u2
    p = real(-0.3333333333333333) + real(0.1999999999999552) * u
    p += (real(-0.14285714284666542) + real(0.11111111015256361) * u) * u2
    q = real(-0.09090904578123903) + real(0.07692183190826087) * u
    q += (real(-0.06664511447381948) + real(0.0585814891280221) * u) * u2
    r = real(-0.0508544973794026) + real(0.03923165829558719) * u - real(0.01917688711906226) * u2
    p += (q + r * u4) * u4
    angle = base + (t + t * u * p)
    if b > a:
        angle = real(HALF_PI) - angle
    if x < real(0.0):
        angle = real(math.pi) - angle
    if y < real(0.0):
        angle = -angle
    return angle, p


@portable
def arctangent(y: real, x: real):
    """The angle of (x, y) in [-pi, pi], both finite: atan2(y, x), but 0 at the origin whatever the signs of zeros.

    Relative error 3 ulp of its type; the fit's is 7e-18.
    """
    angle, _rest = arctangent_and_rest(y, x)
    return angle


@portable
def turned(x: real, y: real, turns: real, by_x: real, by_y: real):
    """(x, y) turned by the angle of (by_x, by_y), not scaled, and `turns`, the times that a sum of angles passed pi.

    This lets several angles share one arctangent: their sum is `arctangent(y, x) + 2 pi turns`.
    """
    size = abs(by_x) + abs(by_y)
    cos = real(1.0)
    sin = real(0.0)
    if size > real(0.0):
        size = real(1.0) / size
        cos = by_x * size
        sin = by_y * size
    up = x * sin + y * cos
    # Twice pi exactly is a whole turn as well: a foot on an edge, seen by that edge and by the other two.
    if min(y, sin) >= real(0.0) and (up < real(0.0) or (up == real(0.0) and max(x, cos) < real(0.0))):
        turns += real(1.0)
    if max(y, sin) < real(0.0) and up >= real(0.0):
        turns -= real(1.0)
    return x * cos - y * sin, up, turns
