"""What triangles under the Cauchy and the inverse-square kernel share, edge by edge; interfaces as in `edges`.

They share P = integral of (rho^2 + zeta)^-2 over the triangle, rho within its plane and zeta = z^2 + 1/s^2 or
z^2 + softening^2: Cauchy is F = P / s^4, and the inverse square has dF/d(zeta) = -P.
"""

import math

from fieldsim.numerics.angles import arctangent, arctangent_and_rest
from fieldsim.numerics.constants import COS_30
from fieldsim.numerics.quadrature import unit_legendre_6
from fieldsim.numerics.sine_integrals import sine_fourth_series
from fieldsim.portable import portable, real

COS_PI_8 = math.cos(math.pi / 8)

# Below this angle atan is taken from its series.
THIN = 1e-3


@portable
def lorentzians(g2: real, lo: real, length: real):
    """Integrals of (g^2 + t^2)^-n, n = 1, 2, 3, over t = lo..lo + length. Relative error < 1e-13; 0 where they diverge.

    With t = g tan(phi), as in `cauchy_segment`, every power of g divided out while the angle is small.
    """
    hi = lo + length
    g = math.sqrt(g2)
    if g == real(0.0) and lo <= real(0.0):
        return real(0.0), real(0.0), real(0.0)
    root = real(1.0) / math.sqrt((g2 + lo * lo) * (g2 + hi * hi))
    per = real(1.0) / g
    cos = (g2 + lo * hi) * root
    turn = length * root  # sin(angle) / g
    sin = g * turn
    angle, rest = arctangent_and_rest(sin, cos)
    first = angle * per
    square = real(0.5) * (angle - sin * cos) * (per * per * per)
    if cos > real(COS_PI_8):
        tangent = turn / cos
        first = tangent * (real(1.0) + (g * tangent) * (g * tangent) * rest)
        square = real(0.5) * tangent * tangent * tangent * (rest + cos * cos)
    if cos < real(COS_30):
        fourth = (real(0.75) * square - real(0.25) * turn * turn * turn * cos) * (per * per)
    else:
        t = turn / (real(1.0) + cos)
        u = sin / (real(1.0) + cos)
        fourth = sine_fourth_series(u * u) * t * t * t * t * t
    return first, root * turn + square, root * turn * (root * cos + turn * turn) + fourth


@portable
def _mean_node(x: real):
    return x * x / (real(1.0) + x * x)


@portable
def far_strip(d: real, lo: real, length: real, zeta: real):
    """U = integral of d / ((d^2 + t^2) (g^2 + t^2)) over t = lo..lo + length, g^2 = d^2 + zeta, for d > 0.

    It is (A - (d / g) B) / zeta with the angles A and B of slopes t / d and t / g, which meet as zeta -> 0; the
    common part is taken out, in one of two ways: by one arctangent of the difference, or, where both angles are small,
    by their tangents and what is left.
    """
    hi = lo + length
    g2 = d * d + zeta
    g = math.sqrt(g2)
    base_d = d * d + lo * hi
    base_g = g2 + lo * hi
    lean = d * g - lo * hi
    if g * length < real(0.25) * base_d:
        alpha = d * length / base_d
        beta = g * length / base_g
        mean = real(0.0)
        gap = beta - alpha
        for k in range(6):
            node, weight = unit_legendre_6(k)
            mean += weight * _mean_node(alpha + node * gap)
        both = length / base_d / base_g
        _angle, rest = arctangent_and_rest(alpha, real(1.0))
        beyond = alpha * alpha * alpha * rest
        return d * both - d / g * mean * lean * both / (g + d) + beyond / (g * (g + d))
    across = length * lean / (g + d)
    down = base_d * base_g + d * g * length * length
    turn = real(0.0)
    if zeta > real(0.0):
        turn = arctangent(across * zeta, down) / zeta
    else:
        turn = across / down
    return arctangent(d * length, base_d) / (g * (g + d)) + d / g * turn


@portable
def strips(d: real, lo: real, length: real, zeta: real, outside: real):
    """The segment's integrals of (g^2 + t^2)^-1, -2, -3, and an edge's parts of P, zeta P_zeta and zeta^2 P_zeta,zeta.

    Inside the triangle and near it the parts are d / (2 zeta) times the first integral, and what follows; outside,
    these sum up to nothing as zeta -> 0, and what is left is summed instead.
    """
    first, second, third = lorentzians(d * d + zeta, lo, length)
    if outside > real(0.0) and outside * outside > zeta:
        part = real(0.0)
        if d != real(0.0):
            part = far_strip(abs(d), lo, length, zeta)
        if d < real(0.0):
            part = -part
        rest = part - d * second
        return first, second, third, -real(0.5) * part, real(0.5) * rest, zeta * d * third - rest
    if zeta == real(0.0):
        return first, second, third, real(0.0), real(0.0), real(0.0)
    part = d * first * (real(1.0) / zeta)
    return (
        first,
        second,
        third,
        real(0.5) * part,
        -real(0.5) * (d * second + part),
        zeta * d * third + d * second + part,
    )
