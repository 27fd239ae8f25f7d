"""Owen's T function, portable, in the scaled forms that Gaussians over triangles need.

T(h, a) = 1/(2 pi) integral from 0 to a of exp(-h^2 (1 + x^2) / 2) / (1 + x^2) dx. With X = h / sqrt(2) and Y = a X it
is exp(-X^2) / (2 pi) times G(X, Y), the integral from 0 to Y of exp(-t^2) X / (X^2 + t^2) dt: a Gaussian seen from a
line at distance X. Swapping X and Y (Owen 1956) keeps the peak X / (X^2 + t^2) wider than the range, and 24
Gauss-Legendre nodes then suffice everywhere.
"""

import math

from fieldsim.numerics.constants import HALF_PI, SQRT_2, TAU
from fieldsim.numerics.error_functions import erfcx
from fieldsim.portable import portable, real

# exp(-CUT) is beneath rounding.
CUT = 38.0
# Beyond this Gaussian tails are taken from their own quadrature, and not as differences.
BEYOND = 1.0


@portable
def _pair(node: real, weight: real, half: real, start: real, x2: real):
    """Two Gauss-Legendre nodes, +-node, of `tail`."""
    t = half * (real(1.0) - node)
    q = start + t
    e = weight * math.exp(-t * (start + q))
    u = x2 + q * q
    t = half * (real(1.0) + node)
    q = start + t
    e_far = weight * math.exp(-t * (start + q))
    v = x2 + q * q
    return e + e_far, (e * v + e_far * u) / (u * v)


@portable
def tail(x: real, start: real, width: real):
    """exp(start^2) times the integrals from start to start + width of exp(-t^2) and exp(-t^2) x / (x^2 + t^2) dt.

    Relative error < 1e-13 for start >= BEYOND, for start = 0 and width <= x, and farther than 1 from 0 for width < 2.1.
    """
    reach = min(width, real(CUT) / (start + math.sqrt(start * start + real(CUT))))
    half = real(0.5) * reach
    x2 = x * x
    e_1, part_1 = _pair(real(0.06405689286260563), real(0.12793819534675216), half, start, x2)
    e_2, part_2 = _pair(real(0.1911188674736163), real(0.1258374563468283), half, start, x2)
    e_3, part_3 = _pair(real(0.3150426796961634), real(0.12167047292780339), half, start, x2)
    e_4, part_4 = _pair(real(0.4337935076260451), real(0.1155056680537256), half, start, x2)
    e_5, part_5 = _pair(real(0.5454214713888396), real(0.10744427011596563), half, start, x2)
    e_6, part_6 = _pair(real(0.6480936519369755), real(0.09761865210411388), half, start, x2)
    e_7, part_7 = _pair(real(0.7401241915785544), real(0.08619016153195327), half, start, x2)
    e_8, part_8 = _pair(real(0.820001985973903), real(0.0733464814110803), half, start, x2)
    e_9, part_9 = _pair(real(0.8864155270044011), real(0.05929858491543678), half, start, x2)
    e_10, part_10 = _pair(real(0.9382745520027328), real(0.04427743881741981), half, start, x2)
    e_11, part_11 = _pair(real(0.9747285559713095), real(0.028531388628933663), half, start, x2)
    e_12, part_12 = _pair(real(0.9951872199970213), real(0.0123412297999872), half, start, x2)
    e = e_1 + e_2 + e_3 + e_4 + e_5 + e_6 + e_7 + e_8 + e_9 + e_10 + e_11 + e_12
    part = part_1 + part_2 + part_3 + part_4 + part_5 + part_6 + part_7 + part_8 + part_9 + part_10 + part_11 + part_12
    return half * e, half * x * part


@portable
def peaked(x: real, start: real, width: real):
    """The second of those integrals."""
    _e, part = tail(x, start, width)
    return part


@portable
def wedge(x: real, y: real):
    """Integral from 0 to y of (1 - exp(-x^2 - t^2)) x / (x^2 + t^2) dt for x, y >= 0. Absolute error < 5e-16.

    It is atan(y / x) - 2 pi T(sqrt(2) x, y / x), twice the integral of exp(-r^2) over the triangle (0, 0), (x, 0),
    (x, y), and vanishes with x and y; wedge(x, y) + wedge(y, x) = pi / 2 erf(x) erf(y).
    """
    long = max(x, y)
    short = min(x, y)
    if long == real(0.0):
        return real(0.0)
    inner = math.atan(short / long)
    if long * long < real(CUT):
        inner -= math.exp(-long * long) * peaked(long, real(0.0), short)
    if y > x:
        return real(HALF_PI) * math.erf(x) * math.erf(y) - inner
    return inner


@portable
def _scaled(x: real, y: real):
    """G(x, y) of the module's text, for x > 0, y >= 0."""
    if y <= x:
        return peaked(x, real(0.0), y)
    drop = math.exp(-(y - x) * (y + x))
    rest = real(0.0)
    if drop > real(0.0):
        rest = drop * (real(HALF_PI) * math.erf(x) * erfcx(y) - peaked(y, real(0.0), x))
    return real(HALF_PI) * erfcx(x) + rest


@portable
def line_of_sight(x: real, lo: real, width: real):
    """(exponent, q): exp(exponent) q is the integral from lo to lo + width of exp(-x^2 - t^2) x / (x^2 + t^2) dt.

    x > 0; lo + width >= |lo|. Relative error < 1e-13, also where the integral underflows.
    """
    if lo >= real(BEYOND):
        return -x * x - lo * lo, peaked(x, lo, width)
    if x == real(0.0):
        return real(0.0), real(0.0)
    near = _scaled(x, abs(lo))
    if lo > real(0.0):
        near = -near
    return -x * x, _scaled(x, lo + width) + near


@portable
def owen_t(h: real, a: real):
    """Owen's T(h, a) for any h and a. Absolute error < 1e-16, relative error < 1e-13 for a <= 1."""
    x = abs(h) / real(SQRT_2)
    y = x * abs(a)
    if x == real(0.0):
        return math.atan(a) / real(TAU)
    t = math.exp(-x * x) * _scaled(x, y) / real(TAU)
    if a < real(0.0):
        t = -t
    return t
