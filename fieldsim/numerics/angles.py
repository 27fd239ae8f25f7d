"""Sines, cosines and arctangents on the ranges that arcs need: without branches or reduction of large arguments.

A partial arc asks for half a dozen of them per query, where libraries' functions were most of its cost. The
polynomials interpolate at Chebyshev nodes (60-digit arithmetic); the errors quoted are before rounding.
"""

import math

from fieldsim.portable import portable, real

HALF_PI = math.pi / 2
QUARTER_PI = math.pi / 4
# pi / 2 in three parts, the first two exact in float32 and short: their differences from angles close by are exact.
HALF_PI_HIGH = 201 / 128
HALF_PI_MIDDLE = 507 / 2**20
HALF_PI_LOW = 3.139164786504813e-07
# tan(pi / 8).
EIGHTH = math.sqrt(2.0) - 1.0


@portable
def sine_cosine(x: real):
    """Sine and cosine of x in [-pi/2, pi/2], each to 2 ulp, the cosine down to 1e-22. Fits: 3e-17."""
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
def arctangent(y: real, x: real):
    """The angle of (x, y), y >= 0, in [0, pi] (nan at the origin). Relative error 3 ulp, fit 5e-17."""
    a = abs(x)
    low = min(y, a)
    high = max(y, a)
    # Two rotations by reflection: to at most pi / 4, then by pi / 4 to at most pi / 8.
    base = real(0.0)
    if low > real(EIGHTH) * high:
        base = real(QUARTER_PI)
    part = low
    whole = high
    if base > real(0.0):
        part = low - high
        whole = low + high
    t = part / whole
    u = t * t
    u2 = u * u
    u4 = u2 * u2
    p = (-real(0.3333333333333333) + real(0.1999999999999552) * u) + (
        -real(0.14285714284666542) + real(0.11111111015256361) * u
    ) * u2
    p += (
        (-real(0.09090904578123903) + real(0.07692183190826087) * u)
        + (-real(0.06664511447381948) + real(0.0585814891280221) * u) * u2
        + ((-real(0.0508544973794026) + real(0.03923165829558719) * u) - real(0.01917688711906226) * u2) * u4
    ) * u4
    angle = base + (t + t * u * p)
    if y > a:
        angle = real(HALF_PI) - angle
    if x < real(0.0):
        angle = real(math.pi) - angle
    return angle
