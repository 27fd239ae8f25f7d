"""Triangles under the Cauchy and the inverse-square kernel, edge by edge; interfaces as in `triangle_edges`.

They share P = integral of (rho^2 + zeta)^-2 over the triangle, rho within its plane and zeta = z^2 + 1/s^2 or
z^2 + softening^2: Cauchy is F = P / s^4, and the inverse square has dF/d(zeta) = -P.
"""

import math

from fieldsim.numerics.angles import arctangent, arctangent_and_rest
from fieldsim.numerics.clausen import clausen
from fieldsim.numerics.constants import COS_30
from fieldsim.numerics.quadrature import legendre_12, unit_legendre_6
from fieldsim.numerics.sine_integrals import sine_fourth_series
from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.triangle.cubature import points_a_side
from fieldsim.potentials.formulas.triangle.edges import formula
from fieldsim.potentials.kernels import Cauchy, InverseSquare
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.potentials.registry import register

COS_PI_8 = math.cos(math.pi / 8)
# Below this angle atan is taken from its series.
THIN = 1e-3
# InverseSquare takes the cubature from so many sizes.
FAR_INVERSE = 4.0
# ... and Cauchy.
FAR_CAUCHY = 5.0


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
def _atan_rest(x: real):
    """atan(x) - x for |x| <= 1/4, to relative rounding."""
    u = x * x
    p = real(1.0) / real(25.0)
    p = real(1.0) / real(23.0) - p * u
    p = real(1.0) / real(21.0) - p * u
    p = real(1.0) / real(19.0) - p * u
    p = real(1.0) / real(17.0) - p * u
    p = real(1.0) / real(15.0) - p * u
    p = real(1.0) / real(13.0) - p * u
    p = real(1.0) / real(11.0) - p * u
    p = real(1.0) / real(9.0) - p * u
    p = real(1.0) / real(7.0) - p * u
    p = real(1.0) / real(5.0) - p * u
    p = real(1.0) / real(3.0) - p * u
    return -x * u * p


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
        return d * both - d / g * mean * lean * both / (g + d) + _atan_rest(alpha) / (g * (g + d))
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


@portable
def cauchy_edge(d: real, lo: real, length: real, z: real, s: real, fold: real, outside: real):
    """All in units of F: s^-4 is taken in here."""
    i2 = real(1.0) / (s * s)
    zeta = z * z + i2
    g2 = d * d + zeta
    hi = lo + length
    _first, second, third, q_1, q_2, q_3 = strips(d, lo, length, zeta, outside)
    w_lo = i2 / (g2 + lo * lo)
    w_hi = i2 / (g2 + hi * hi)
    along = -s * s * length * (lo + hi) * w_lo * w_hi * (w_lo + w_hi)
    i4 = i2 * i2
    across = -real(2.0) * i4 * third
    nil = real(0.0)
    one = real(1.0)
    return i4 * second, along, across, i4 * q_1, i4 * q_2, i4 * q_3, nil, one, nil, one, nil, one, nil


@portable
def cauchy_total(
    q_1: real,
    q_2: real,
    q_3: real,
    q_4: real,
    angle_1: real,
    angle_2: real,
    angle_3: real,
    z: real,
    s: real,
    fold: real,
    outside: real,
    trace: real,
):
    """(F, F_z, F_zz)."""
    zeta = z * z + real(1.0) / (s * s)
    slope = real(2.0) * q_2 / zeta
    return q_1, z * slope, slope + real(4.0) * (z * z / zeta) * (q_3 / zeta)


@portable
def cauchy_far(away: real, size: real, s: real):
    """Points a side once distance or width exceeds FAR_CAUCHY sizes."""
    return points_a_side((away + real(1.0) / (s * s)) / (size * size), real(FAR_CAUCHY))


# Inverse square: half the integral of log(1 + (d^2 + t^2) / w^2) over the angle atan(t / d), Clausen's integrals.


@portable
def _sector(t: real, d: real, g: real, zeta: real, log_wide: real, log_near: real):
    """Half the integral from 0 to theta = atan(t / d) of log((g^2 + d^2 tan^2) / scale^2), d > 0.

    Lambda(theta) = theta log(1 + k) + (theta - eta) / 2 log q - Cl2(2 theta) / 2 + (Cl2(2 (theta - eta)) +
    Cl2(2 (theta + eta))) / 4 is that for scale = g: k = d / g, q = (1 - k) / (1 + k), eta = atan(t / g); from Lewin's
    (1981, 5.5) Im Li2. log_wide: log((g + d) / scale); log_near: log(zeta / (g + d)^2) = log q.
    """
    theta = arctangent(t, d)
    eta = arctangent(t, g)
    # theta - eta, from its tangent where little is left of that.
    split = t * (zeta / (g + d)) / (d * g + t * t)
    if abs(split) < real(THIN):
        square = split * split
        split *= real(1.0) - square * (real(1.0) / real(3.0) - square * (real(1.0) / real(5.0)))
    else:
        split = theta - eta
    value = theta * log_wide - real(0.5) * clausen(real(2.0) * theta)
    value += real(0.25) * clausen(real(2.0) * (theta + eta))
    if split != real(0.0):
        value += split * log_near + real(0.25) * clausen(real(2.0) * split)
    return value


@portable
def _log_pair(node: real, weight: real, middle: real, half: real, d2: real, g2: real, per_scale2: real):
    """Two Gauss-Legendre nodes, +-node, of `_distant_logs`."""
    near = middle - half * node
    far = middle + half * node
    near *= near
    far *= far
    return weight * (math.log((g2 + near) * per_scale2) / (d2 + near) + math.log((g2 + far) * per_scale2) / (d2 + far))


@portable
def _distant_logs(d: real, lo: real, length: real, g2: real, scale: real):
    """Half the integral of log((g^2 + t^2) / scale^2) d / (d^2 + t^2) over t = lo..lo + length, lo > 0.6 length.

    Twelve Gauss-Legendre nodes are exact to rounding that far beyond an end, where the ends' terms would cancel.
    """
    half = real(0.5) * length
    middle = lo + half
    d2 = d * d
    k = real(1.0) / (scale * scale)
    total = real(0.0)
    for j in range(6):
        node, weight = legendre_12(j)
        total += _log_pair(node, weight, middle, half, d2, g2, k)
    return real(0.5) * d * half * total


@portable
def inverse_square_edge(d: real, lo: real, length: real, z: real, softening: real, fold: real, outside: real):
    """Of an edge that an unsoftened query point lies on, the infinite part of the slope is left out."""
    zeta = z * z + softening * softening
    g2 = d * d + zeta
    hi = lo + length
    first, second, _third, q_2, q_3, _q = strips(d, lo, length, zeta, outside)
    r2_lo = g2 + lo * lo
    along = real(0.0)
    if r2_lo > real(0.0):
        along = -(length / r2_lo) * ((lo + hi) / (g2 + hi * hi))
    scale = math.sqrt(zeta)
    if outside > scale:
        scale = outside
    value = real(0.0)
    if d != real(0.0) and lo > real(0.6) * length:
        value = _distant_logs(d, lo, length, g2, scale)
    elif d != real(0.0) and scale > real(0.0):
        x = abs(d)
        g = math.sqrt(g2)
        log_near = real(0.0)
        if zeta > real(0.0):
            log_near = math.log(math.sqrt(zeta) / (g + x))
        log_wide = -log_near
        if scale == outside:
            log_wide = math.log((g + x) / scale)
        value = _sector(hi, x, g, zeta, log_wide, log_near) - _sector(lo, x, g, zeta, log_wide, log_near)
        if d < real(0.0):
            value = -value
    one = real(1.0)
    nil = real(0.0)
    return first, along, -second, value, q_2, q_3, nil, one, nil, one, nil, one, nil


@portable
def inverse_square_total(
    q_1: real,
    q_2: real,
    q_3: real,
    q_4: real,
    angle_1: real,
    angle_2: real,
    angle_3: real,
    z: real,
    softening: real,
    fold: real,
    outside: real,
    trace: real,
):
    """On the unsoftened sheet F is inf, and F_z the mean of its two sides, 0."""
    w = math.sqrt(z * z + softening * softening)
    if w == real(0.0) and outside <= real(0.0):
        return real(math.inf), real(0.0), real(0.0)
    up = real(0.0)
    if w > real(0.0):
        up = z / w
    return q_1, -real(2.0) * z * q_2, -real(2.0) * q_2 - real(4.0) * up * up * q_3


@portable
def inverse_square_far(away: real, size: real, softening: real):
    """Points a side once distance or softening exceeds FAR_INVERSE sizes, from where 36 lose no more than edges do."""
    return points_a_side((away + softening * softening) / (size * size), real(FAR_INVERSE))


register(Cauchy, Triangle, formula(Cauchy, cauchy_edge, cauchy_total, cauchy_far))
register(InverseSquare, Triangle, formula(InverseSquare, inverse_square_edge, inverse_square_total, inverse_square_far))
