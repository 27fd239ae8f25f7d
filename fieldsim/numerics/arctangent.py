"""The angle of a vector, portable and without a call: what the closed forms of triangles are mostly made of."""

import math

from fieldsim.portable import portable, real

QUARTER_PI = math.pi / 4
HALF_PI = math.pi / 2
TAN_PI_8 = math.sqrt(2.0) - 1.0


@portable
def angle_and_rest(y: real, x: real):
    """atan2(y, x) for finite y and x, 0 for y = x = 0 whatever their signs, and (atan(t) - t) / t^3 of t = y / x.

    Relative errors < 3e-16; the second is another number where t is not within 0..tan(pi / 8). The smaller over the
    larger coordinate, turned by pi / 4 where it exceeds tan(pi / 8); then Chebyshev's series of (atan(t) - t) / t^3 in
    t^2, as a polynomial whose parts do not wait for each other.
    """
    a = abs(x)
    b = abs(y)
    low = b
    high = a
    if b > a:
        low = a
        high = b
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
    p = real(-0.3333333333333333) + real(0.19999999999995516) * u
    p += (real(-0.14285714284665682) + real(0.11111111015187018) * u) * u2
    q = real(-0.0909090457530649) + real(0.07692183125376892) * u
    q += (real(-0.06664510525508936) + real(0.05858140904866328) * u) * u2
    r = real(-0.050854078345894844) + real(0.03923044778479309) * u - real(0.019175404711104935) * u2
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
def angle_of(y: real, x: real):
    """The first of those."""
    angle, _rest = angle_and_rest(y, x)
    return angle


@portable
def turned(x: real, y: real, turns: real, by_x: real, by_y: real):
    """(x, y) turned by the angle of (by_x, by_y), not scaled, and `turns`, the times that a sum of angles passed pi.

    Many angles so take one arctangent: `angle_of(y, x) + 2 pi turns`.
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
