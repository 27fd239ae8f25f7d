"""Triangles under the inverse-square kernel, edge by edge; interfaces as in `edges`, P as in `rational`.

Of F itself: half the integral of log(1 + (d^2 + t^2) / w^2) over the angle atan(t / d), Clausen's integrals.
"""

import math

from fieldsim.numerics.angles import arctangent
from fieldsim.numerics.clausen import clausen
from fieldsim.numerics.quadrature import legendre_12
from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.triangle.cubature import points_a_side
from fieldsim.potentials.formulas.triangle.edges import triangle_formula
from fieldsim.potentials.formulas.triangle.rational import THIN, strips
from fieldsim.potentials.kernels import InverseSquare

# InverseSquare takes the cubature from so many sizes.
FAR_INVERSE = 4.0


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


inverse_square_triangle_jet = triangle_formula(
    InverseSquare, inverse_square_edge, inverse_square_total, inverse_square_far
)
