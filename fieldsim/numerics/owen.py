"""Owen's T function, portable, in the scaled forms that Gaussians over triangles need.

T(h, a) = 1/(2 pi) integral from 0 to a of exp(-h^2 (1 + x^2) / 2) / (1 + x^2) dx. With X = h / sqrt(2) and Y = a X it
is exp(-X^2) / (2 pi) times G(X, Y), the integral from 0 to Y of exp(-t^2) X / (X^2 + t^2) dt: a Gaussian seen from a
line at distance X. Swapping X and Y (Owen 1956) keeps the peak X / (X^2 + t^2) wider than the range, and 24
Gauss-Legendre nodes then suffice everywhere.
"""

import math

from fieldsim.numerics.constants import HALF_PI, SQRT_2, TAU
from fieldsim.numerics.error_functions import erfcx
from fieldsim.numerics.quadrature import legendre_24
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

    Relative error < 1e-13 (float32: 5e-6) for start >= BEYOND, for start = 0 and width <= x, and farther than 1 from 0
    for width < 2.1.
    """
    reach = min(width, real(CUT) / (start + math.sqrt(start * start + real(CUT))))
    half = real(0.5) * reach
    x2 = x * x
    e = real(0.0)
    part = real(0.0)
    for k in range(12):
        node, weight = legendre_24(k)
        more, more_part = _pair(node, weight, half, start, x2)
        e += more
        part += more_part
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
    (x, y), and vanishes with x and y; wedge(x, y) + wedge(y, x) = pi / 2 erf(x) erf(y). In float32 the error is < 3e-7.
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

    x > 0; lo + width >= |lo|. Relative error < 1e-13 for lo <= 0, for lo >= BEYOND and for width > 2, also where the
    integral underflows; else of the integral from 0 to lo + width.
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
    """Owen's T(h, a) for any h and a. Absolute error < 2.2e-16 (float32: 1.2e-7), relative error < 1e-13 for a <= 1."""
    x = abs(h) / real(SQRT_2)
    y = x * abs(a)
    if x == real(0.0):
        return math.atan(a) / real(TAU)
    t = math.exp(-x * x) * _scaled(x, y) / real(TAU)
    if a < real(0.0):
        t = -t
    return t
