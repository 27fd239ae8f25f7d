"""Partial arcs under the Gaussian: the integral of exp(-2 k sin^2 v) over the half angle v (see `arc`).

The range of v is cut where the exponent turns (at multiples of pi/2) into at most two monotone pieces, each taken from
its high end down, and whole quarters, which are Bessel functions. A piece is cut off where its rest no longer counts
and integrated by Gauss-Legendre nodes in tan((v - middle) / 2): positive terms, one exponential each.
"""

import math

from fieldsim.portable import portable, real
from fieldsim.potentials.point import EXPONENT_LIMIT
from fieldsim.potentials.special import bessel_scaled, exp_slope

HALF_PI = math.pi / 2
QUARTER_PI = math.pi / 4
# Up to this k a Gauss-Legendre rule spans a whole quarter; beyond, it shows its two ends apart.
BROAD = 12.0
# Added to 1, it is lost in float32 but not in float64.
TINY = 1e-10
# Below this exponent everything is 0, in float64 as well.
NOTHING = -1000.0


@portable
def _pair(
    total: real, square: real, node: real, weight: real, reach: real, sin_c: real, cos_c: real, k2: real, top: real
):
    """(total, square) with two nodes' worth of exp(-k2 (sin^2 v - top)), and that times sin^2 v, added."""
    t = reach * node
    share = real(1.0) / (real(1.0) + t * t)
    sin = real(2.0) * t * share * cos_c
    middle = (real(1.0) - t * t) * share * sin_c
    high = (middle + sin) * (middle + sin)
    low = (middle - sin) * (middle - sin)
    high_part = weight * share * math.exp(-k2 * (high - top))
    low_part = weight * share * math.exp(-k2 * (low - top))
    return total + high_part + low_part, square + high_part * high + low_part * low


@portable
def _cut():
    """The fall of the exponent after which a piece's rest is lost in rounding."""
    if real(1.0) + real(TINY) == real(1.0):
        return real(16.0)
    return real(34.0)


@portable
def _piece(start: real, stop: real, width: real, k2: real):
    """Integrals of exp(-k2 (sin^2 v - sin^2 start)), and of that times sin^2 v, over start..stop in 0..pi/2.

    width: stop - start, to its own last digit.
    """
    sin_start = math.sin(start)
    top = sin_start * sin_start
    if k2 * (real(1.0) - top) > _cut():
        cut = math.asin(math.sqrt(top + _cut() / k2))
        if cut < stop:
            stop = cut
            width = stop - start
    reach = math.tan(real(0.25) * width)
    middle = real(0.5) * (start + stop)
    sin_c = math.sin(middle)
    cos_c = math.cos(middle)
    j = real(0.0)
    js = real(0.0)
    if real(1.0) + real(TINY) == real(1.0):
        j, js = _pair(j, js, real(0.1252334085114689), real(0.24914704581340277), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.3678314989981802), real(0.2334925365383548), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.5873179542866175), real(0.20316742672306592), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.7699026741943047), real(0.16007832854334622), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.9041172563704749), real(0.10693932599531843), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.9815606342467192), real(0.04717533638651183), reach, sin_c, cos_c, k2, top)
    else:
        j, js = _pair(j, js, real(0.06405689286260563), real(0.12793819534675216), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.1911188674736163), real(0.1258374563468283), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.3150426796961634), real(0.12167047292780339), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.4337935076260451), real(0.1155056680537256), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.5454214713888396), real(0.10744427011596563), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.6480936519369755), real(0.09761865210411388), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.7401241915785544), real(0.08619016153195327), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.820001985973903), real(0.0733464814110803), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.8864155270044011), real(0.05929858491543678), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.9382745520027328), real(0.04427743881741981), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.9747285559713095), real(0.028531388628933663), reach, sin_c, cos_c, k2, top)
        j, js = _pair(j, js, real(0.9951872199970213), real(0.0123412297999872), reach, sin_c, cos_c, k2, top)
    return real(2.0) * reach * j, real(2.0) * reach * js


@portable
def _weigh(start: real, stop: real, width: real, k2: real, base: real):
    """Integrals of exp(base - k2 sin^2 v), clamped, and of that times sin^2 v, over start..stop in 0..pi/2."""
    sin = math.sin(start)
    exponent = base - k2 * sin * sin
    if exponent < real(NOTHING) or width <= real(0.0):
        return real(0.0), real(0.0)
    j, js = _piece(start, stop, width, k2)
    top = math.exp(min(exponent, real(EXPONENT_LIMIT)))
    return top * j, top * js


@portable
def _fall(start: real, stop: real, width: real, k2: real, base: real):
    """As `_weigh`, in two pieces where one rule would not do."""
    middle = real(QUARTER_PI)
    if k2 < real(BROAD) or start >= middle or stop <= middle:
        return _weigh(start, stop, width, k2, base)
    j, js = _weigh(start, middle, middle - start, k2, base)
    j_low, js_low = _weigh(middle, stop, stop - middle, k2, base)
    return j + j_low, js + js_low


@portable
def _from_peak(stop: real, k2: real, base: real):
    """As `_weigh` over 0..stop, stop <= pi / 2: directly, or as the whole quarter less a smaller rest."""
    sin = math.sin(stop)
    beyond = k2 * sin * sin > _cut()
    if stop <= real(QUARTER_PI) and not beyond:
        return _weigh(real(0.0), stop, stop, k2, base)
    i0, difference, _ = bessel_scaled(real(0.5) * k2)
    top = math.exp(min(base, real(EXPONENT_LIMIT)))
    j = real(HALF_PI) * top * i0
    js = real(QUARTER_PI) * top * difference
    if beyond:
        return j, js
    j_rest, js_rest = _weigh(stop, real(HALF_PI), real(HALF_PI) - stop, k2, base)
    return j - j_rest, js - js_rest


@portable
def _range_integrals(near: real, far: real, width: real, k2: real, base: real):
    """As `_weigh` over near..far; |near| <= far <= pi."""
    quarter = real(HALF_PI)
    if near >= quarter:
        return _fall(real(2.0) * quarter - far, real(2.0) * quarter - near, width, k2, base)
    if near >= real(0.0) and far <= quarter:
        return _fall(near, far, width, k2, base)
    if near >= real(0.0):
        j, js = _fall(near, quarter, quarter - near, k2, base)
    else:
        j, js = _from_peak(-near, k2, base)
        j_far, js_far = _from_peak(min(far, quarter), k2, base)
        j += j_far
        js += js_far
    if far > quarter:
        j_far, js_far = _fall(real(2.0) * quarter - far, quarter, far - quarter, k2, base)
        j += j_far
        js += js_far
    return j, js


@portable
def gaussian_arc(
    rho: real,
    z: real,
    radius: real,
    c0: real,
    s0: real,
    c1: real,
    s1: real,
    turn: real,
    versine: real,
    a: real,
    fold: real,
):
    """(F, dF/drho, dF/dphi / rho, dF/dz) of exp(fold - a^2 r^2), its exponent clamped at EXPONENT_LIMIT.

    Relative error 1e-13 wherever the arc's nearest point counts (the exponent is not below -100).
    """
    a2 = a * a
    inner = rho - radius
    base = fold - a2 * (inner * inner + z * z)
    if base < real(NOTHING):
        return real(0.0), real(0.0), real(0.0), real(0.0)
    k2 = real(4.0) * a2 * rho * radius
    # v runs from -before to after; mirrored so that the shorter way from the peak comes first.
    before = math.atan2(-s0, c0)
    width = math.atan2(turn, real(1.0) - versine)
    after = width - before
    j, js = _range_integrals(-min(before, after), max(before, after), width, k2, base)
    f = real(2.0) * radius * j
    push = -real(4.0) * a2 * radius
    across = push * (inner * j + real(2.0) * radius * js)
    # exp(E0) - exp(E1) of the ends' exponents, from their difference.
    high0 = base - k2 * s0 * s0
    high1 = base - k2 * s1 * s1
    per_rho = real(4.0) * a2 * radius * turn * (s0 * c1 + c0 * s1)
    slope = exp_slope(abs(per_rho) * rho) * math.exp(min(max(high0, high1), real(EXPONENT_LIMIT)))
    return f, across, radius * per_rho * slope, push * z * j
