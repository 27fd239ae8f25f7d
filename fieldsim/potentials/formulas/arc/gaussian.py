"""Partial arcs under the Gaussian: the integral of exp(-2 k sin^2 v) over the half angle v (see `frame`).

The range of v, folded by symmetry to lie about a positive middle, is cut off where its rest no longer counts and
integrated in panels of sixteen Gauss-Legendre nodes in tan((v - middle) / 2): positive terms, one exponential each. Of
a peak of which one side or both lie in the range up to the cut, these sides are a Bessel function's halves.
"""

import math

from fieldsim.numerics.angles import arctangent, sine_cosine
from fieldsim.numerics.bessel import bessel_scaled
from fieldsim.numerics.constants import HALF_PI, QUARTER_PI
from fieldsim.numerics.elementary import exp_moment, exp_slope
from fieldsim.numerics.precision import is_single
from fieldsim.numerics.quadrature import legendre_16
from fieldsim.portable import portable, real
from fieldsim.potentials.kernels.gaussian import EXPONENT_LIMIT

# Below this exponent everything is 0, in float64 as well.
NOTHING = -1000.0


@portable
def _cut():
    """The fall of the exponent after which a range's rest is lost in rounding."""
    if is_single():
        return real(16.0)
    return real(34.0)


@portable
def _panel_count(width: real, k2: real, fall: real):
    """The size of a range in units of what a panel's rule integrates to rounding.

    Measured: sixteen nodes take a fall by half of the cut, of which a panel may have twice its share, and
    width^2 (k2 + 4.2) up to 12.5 (the 4.2 is for the poles of tan).
    """
    limit = real(12.5)
    if is_single():
        limit = real(38.0)
    return max(width * math.sqrt((k2 + real(4.2)) / limit), real(4.0) * fall / _cut())


@portable
def _exponentials(a: real, b: real):
    """exp(-16 (a + b)) and exp(-16 (a - b)) for |a| < 0.6, |b| < 0.85: to 16 ulp, without a library's call.

    Interpolated at Chebyshev nodes: exp(-a) within 0.2 (float64) to 1e-16, sinh(b) and cosh(b) to 2e-16.
    """
    a2 = a * a
    a4 = a2 * a2
    p = (real(1.0) - a) + (real(0.49999999999993106) - real(0.1666666666666604) * a) * a2
    p += (real(0.041666666680455246) - real(0.008333333334586702) * a) * a4
    p += (
        (real(0.0013888879237562068) - real(0.00019841261068212815) * a)
        + (real(2.4829158194718903e-05) - real(2.758238177342681e-06) * a) * a2
    ) * (a4 * a2)
    u = b * b
    u2 = u * u
    u4 = u2 * u2
    even = (real(1.0) + real(0.4999999999999885) * u) + (
        real(0.04166666666694457) + real(0.001388888886363854) * u
    ) * u2
    even += ((real(2.4801598224388045e-05) + real(2.755489471928407e-07) * u) + real(2.114334873542576e-09) * u2) * u4
    odd = (real(1.0) + real(0.1666666666666659) * u) + (
        real(0.00833333333335184) + real(0.0001984126982445441) * u
    ) * u2
    odd += ((real(2.7557326498437485e-06) + real(2.5050493522294654e-08) * u) + real(1.6236649375399021e-10) * u2) * u4
    odd *= b
    minus = p * (even - odd)
    plus = p * (even + odd)
    minus *= minus
    plus *= plus
    minus *= minus
    plus *= plus
    minus *= minus
    plus *= plus
    return minus * minus, plus * plus


@portable
def _pair(total: real, square: real, fourth: real, t: real, weight: real, cos2: real, sin2: real, rate: real):
    """The sums with two nodes' worth of an exponential, and that times g and g^2, added.

    v = c +- d, t = tan(d / 2); the exponential is exp(-16 rate g), g = sin^2 v - sin^2 c = sin^2 d cos 2c +-
    sin d cos d sin 2c; cos2 and sin2: the cosine and sine of 2c.
    """
    share = real(1.0) / (real(1.0) + t * t)
    sin = real(2.0) * t * share
    rise = sin * sin * cos2
    lean = sin * (real(1.0) - t * t) * share * sin2
    high, low = _exponentials(rate * rise, rate * lean)
    weight *= share
    both = weight * (high + low)
    skew = weight * (high - low)
    square += both * rise + skew * lean
    fourth += both * (rise * rise + lean * lean) + real(2.0) * skew * rise * lean
    return total + both, square, fourth


@portable
def _panel(sin: real, cos: real, reach: real, k2: real, top: real, lift: real):
    """Integrals of exp(lift - k2 (sin^2 v - top)), times 1, sin^2 v and sin^4 v.

    Over 2 atan(reach) to both sides of a middle of given sine and cosine.
    """
    cos2 = (cos - sin) * (cos + sin)
    sin2 = real(2.0) * sin * cos
    rate = real(0.0625) * k2
    j = real(0.0)
    js = real(0.0)
    jss = real(0.0)
    for k in range(8):
        node, weight = legendre_16(k)
        j, js, jss = _pair(j, js, jss, reach * node, weight, cos2, sin2, rate)
    square = sin * sin
    scale = real(2.0) * reach * math.exp(lift - k2 * (square - top))
    return scale * j, scale * (js + square * j), scale * (jss + square * (real(2.0) * js + square * j))


@portable
def _panels(start: real, width: real, k2: real, top: real, lift: real, fall: real):
    """As `_panel`, over start..start + width, within -pi/2..pi.

    fall: the exponent's from an end, where it has no peak; of both ends, where it falls and rises again.
    """
    j = real(0.0)
    js = real(0.0)
    jss = real(0.0)
    count = 0
    if width > real(0.0):
        count = int(_panel_count(width, k2, fall)) + 1
    step = width / real(max(count, 1))
    sin, cos = sine_cosine(real(0.25) * step)
    for k in range(count):
        middle = start + (real(k) + real(0.5)) * step
        sin_c, cos_c = sine_cosine(min(middle, real(math.pi) - middle))
        p, ps, pss = _panel(sin_c, cos_c, sin / cos, k2, top, lift)
        j += p
        js += ps
        jss += pss
    return j, js, jss


@portable
def _range_integrals(low: real, width: real, k2: real, top: real, lift: real, fall: real):
    """As `_panel`, over low..low + width, low in -pi/2..pi/2 and the middle in 0..pi/2; top: the least sin^2 v there.

    At most two stretches count: around the peak at 0, whose sides, where the range has all of them, are halves of a
    full turn, and around the one at pi. A stretch without cuts keeps its width's last digit.
    """
    high = low + width
    edge = real(math.pi)
    square = top + _cut() / k2
    if square < real(1.0):
        edge = arctangent(math.sqrt(square), math.sqrt(real(1.0) - square))
    begin = low
    end = min(high, edge)
    sides = real(0.0)
    if low <= -edge:
        sides += real(1.0)
        begin = real(0.0)
    if low <= real(0.0) and high >= edge:
        sides += real(1.0)
        end = real(0.0)
    j = real(0.0)
    js = real(0.0)
    jss = real(0.0)
    if sides > real(0.0):
        i0, difference, slope = bessel_scaled(real(0.5) * k2)
        scale = sides * math.exp(lift)
        j = real(HALF_PI) * scale * i0
        js = real(QUARTER_PI) * scale * difference
        jss = real(QUARTER_PI) * scale * (difference - real(0.5) * slope)
    stretches = 1
    if square < real(1.0) and high > real(math.pi) - edge:
        stretches = 2
    for k in range(stretches):
        if k == 1:
            begin = max(low, real(math.pi) - edge)
            end = high
        stretch = max(end - begin, real(0.0))
        if begin == low and end == high:
            stretch = width
        p, ps, pss = _panels(begin, stretch, k2, top, lift, fall)
        j += p
        js += ps
        jss += pss
    return j, js, jss


@portable
def _extremes(c0: real, s0: real, c1: real, s1: real, k2: real, spread: real):
    """sin^2 v at the end where the exponent is greatest and where it is greatest of all, and its fall over the range.

    The range starts at v0 <= 0 and has the peak, v = 0, if v1 >= 0.
    """
    low_square = s0 * s0
    if spread < real(0.0):
        low_square = s1 * s1
    top = low_square
    drop = k2 * abs(spread)
    if s1 >= real(0.0):
        top = real(0.0)
        drop = real(0.0)
    elif c0 < real(0.0) and c1 > real(0.0):
        drop = real(2.0) * k2 * (real(1.0) - top)
    return low_square, top, min(drop, real(2.0) * _cut())


@portable
def gaussian_arc(
    rho: real,
    inner: real,
    z: real,
    radius: real,
    angle: real,
    c0: real,
    s0: real,
    c1: real,
    s1: real,
    turn: real,
    versine: real,
    a: real,
    fold: real,
):
    """Jet of exp(fold - a^2 r^2), in the frame of `arc_jet`, its exponent clamped at EXPONENT_LIMIT.

    Error 1e-13 of the value and of the force's scale, 2 a^2 (rho + R) times the value, wherever the arc's nearest point
    counts (the exponent is not below -100): the pulls of two ends alike cancel in part.
    """
    half = real(0.5) * angle
    a2 = a * a
    base = fold - a2 * (inner * inner + z * z)
    if base < real(NOTHING):
        zero = real(0.0)
        return zero, zero, zero, zero, zero, zero, zero, zero, zero, zero
    k2 = real(4.0) * a2 * rho * radius
    spread = turn * (s0 * c1 + c0 * s1)
    fall = k2 * abs(spread)
    low_square, top, drop = _extremes(c0, s0, c1, s1, k2, spread)
    if base - k2 * top < real(NOTHING):
        zero = real(0.0)
        return zero, zero, zero, zero, zero, zero, zero, zero, zero, zero
    lift = min(base - k2 * top, real(EXPONENT_LIMIT))
    if _panel_count(half, k2, drop) < real(1.0):
        # One panel, whose middle needs no angle.
        cos = math.sqrt(real(1.0) - real(0.5) * versine)
        sin = real(0.5) * turn / cos
        j, js, jss = _panel(s0 * cos + c0 * sin, c0 * cos - s0 * sin, sin / (real(1.0) + cos), k2, top, lift)
    else:
        # From v0 without its turn by pi, so that a start close to it keeps its digits, to a middle in 0..pi/2.
        low = arctangent(-s0, abs(c0))
        if c0 >= real(0.0):
            low = -low
        if low + real(0.5) * half > real(HALF_PI):
            low -= real(math.pi)
        low = max(low, -(low + half))
        j, js, jss = _range_integrals(low, half, k2, top, lift, drop)
    f = real(2.0) * radius * j
    push = -real(4.0) * a2 * radius
    across = push * (inner * j + real(2.0) * radius * js)
    # exp(E0) - exp(E1) of the ends' exponents, from their difference.
    high = math.exp(min(base - k2 * low_square, real(EXPONENT_LIMIT)))
    # Integrals of sin v cos v and of sin^3 v cos v with the exponential, from its higher end.
    swing = real(0.5) * spread * exp_slope(fall) * high
    swing_s = low_square * swing + real(0.5) * spread * abs(spread) * exp_moment(fall) * high
    twice = real(2.0) * a2
    scale = -real(2.0) * radius * twice
    ring = real(2.0) * radius
    twist = scale * twice * ring
    return (
        f,
        across,
        -scale * ring * swing,
        push * z * j,
        scale * (j - twice * (inner * inner * j + ring * (real(2.0) * inner * js + ring * jss))),
        scale * (j - twice * ring * ring * (js - jss)),
        scale * (j - twice * z * z * j),
        twist * (inner * swing + ring * swing_s),
        -scale * twice * z * (inner * j + ring * js),
        twist * z * swing,
    )
