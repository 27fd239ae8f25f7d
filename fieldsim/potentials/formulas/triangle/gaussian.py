"""Triangles under the Gaussian, edge by edge; interfaces as in `edges`.

In units of 1/a, F = exp(-z^2) / a^2 times half the sum over the edges of the integral of d (1 - exp(-d^2 - t^2)) /
(d^2 + t^2) dt, and F_z = -2 a^2 z F. That integrand is smooth everywhere, and over a short edge twelve Gauss-Legendre
nodes give it and the field of the edge from the same exponentials; over a long one it is two of Owen's T.
"""

import math

from fieldsim.numerics.owen import BEYOND, line_of_sight, tail, wedge
from fieldsim.numerics.quadrature import legendre_12
from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.segment.gaussian import gaussian_segment
from fieldsim.potentials.formulas.triangle.edges import triangle_formula
from fieldsim.potentials.kernels import Gaussian
from fieldsim.potentials.kernels.gaussian import EXPONENT_LIMIT

# In units of 1/a: farther outside than OUTSIDE the angles are left out, which sum up to nothing and would drown what is
# left of thin triangles. Edges shorter than SHORT, on which the exponent falls by less than FALL, take twelve nodes;
# up to NEAR outside, where the poles of the angles are too close for that, 24.
OUTSIDE = 1.0
NEAR = 2.2
SHORT = 2.1
FALL = 9.0
# Below this (1 - exp(-u)) / u is taken from its series.
SMALL = 1e-3


@portable
def _slope(u: real):
    """(1 - exp(-u)) / u for small u."""
    return real(1.0) - u * (real(0.5) - u * (real(1.0) / real(6.0) - u * (real(1.0) / real(24.0) - u / real(120.0))))


@portable
def _pair(node: real, weight: real, middle: real, half: real, x2: real, whole: real, exponent: real):
    """The share of the nodes t = middle -+ node half in two integrals over t.

    They are of exp(exponent - u) and (whole - exp(exponent - u)) / u, u = x^2 + t^2.
    """
    near = middle - half * node
    far = middle + half * node
    u = x2 + near * near
    v = x2 + far * far
    e = math.exp(min(exponent - u, real(EXPONENT_LIMIT)))
    e_far = math.exp(min(exponent - v, real(EXPONENT_LIMIT)))
    part = ((whole - e) * v + (whole - e_far) * u) / (u * v)
    if u < real(SMALL):
        part = _slope(u) + (whole - e_far) / v
        if v < real(SMALL):
            part = _slope(u) + _slope(v)
    elif v < real(SMALL):
        part = (whole - e) / u + _slope(v)
    return weight * (e + e_far), weight * part


@portable
def _short_edge(lo: real, width: real, x2: real, whole: real, exponent: real):
    """Those integrals over t = lo..lo + width; twelve nodes are exact to rounding up to a width of SHORT."""
    half = real(0.5) * width
    middle = lo + half
    e = real(0.0)
    part = real(0.0)
    for k in range(6):
        node, weight = legendre_12(k)
        more, more_part = _pair(node, weight, middle, half, x2, whole, exponent)
        e += more
        part += more_part
    return half * e, half * part


@portable
def gaussian_edge(d: real, lo: real, length: real, z: real, a: real, fold: real, outside: real):
    """Outside the triangle's vicinity the sums of angles cancel exactly and are left out."""
    x = a * abs(d)
    start = a * lo
    width = a * length
    level = fold - a * a * z * z
    peak = math.exp(min(level, real(EXPONENT_LIMIT)))
    far = a * outside > real(OUTSIDE)
    near = far and a * outside < real(NEAR)
    short = width < real(SHORT) and width * (real(2.0) * start + width) < real(FALL)
    q = real(0.0)
    s = real(0.0)
    if short and not near:
        if far:
            s, q = _short_edge(start, width, x * x, real(0.0), level)
        else:
            s, q = _short_edge(start, width, x * x, real(1.0), real(0.0))
            s *= peak
            q *= peak
        q *= x
        s /= a
    elif far and (short or start >= real(BEYOND)):
        s, q = tail(x, start, width)
        drop = math.exp(min(level - x * x - start * start, real(EXPONENT_LIMIT)))
        s *= drop / a
        q *= -drop
    else:
        s, _along, _across, _ll, _lr, _rr = gaussian_segment(lo, d * d + z * z, length, a, fold)
        if far:
            if x > real(0.0):
                exponent, q = line_of_sight(x, start, width)
                q *= -math.exp(min(level + exponent, real(EXPONENT_LIMIT)))
        else:
            q = wedge(x, start + width)
            if lo > real(0.0):
                q -= wedge(x, start)
            else:
                q += wedge(x, -start)
            q *= peak
    if d < real(0.0):
        q = -q
    rise = math.exp(min(level - x * x - (start + width) * (start + width), real(EXPONENT_LIMIT))) - math.exp(
        min(level - x * x - start * start, real(EXPONENT_LIMIT))
    )
    nil = real(0.0)
    return s, rise, -a * a * s, q, nil, nil, nil, real(1.0), nil, real(1.0), nil, real(1.0), nil


@portable
def gaussian_total(
    q_1: real,
    q_2: real,
    q_3: real,
    q_4: real,
    angle_1: real,
    angle_2: real,
    angle_3: real,
    z: real,
    a: real,
    fold: real,
    outside: real,
    trace: real,
):
    """(F, F_z, F_zz)."""
    f = real(0.5) * q_1 / (a * a)
    u = a * z
    return f, -u * q_1 / a, (real(2.0) * u * u - real(1.0)) * q_1


@portable
def gaussian_far(away: real, size: real, a: real):
    """Points a side where the triangle is so small in units of 1/a that it sees no more than a polynomial."""
    if a * size < real(0.25):
        return 6
    return 0


@portable
def gaussian_gone(away: real, size: real, a: real):
    """Whether the Gaussian underflows all over the triangle, even one folded by 256."""
    return a * (math.sqrt(away) - size) > real(34.0)


gaussian_triangle_jet = triangle_formula(Gaussian, gaussian_edge, gaussian_total, gaussian_far, gaussian_gone)
