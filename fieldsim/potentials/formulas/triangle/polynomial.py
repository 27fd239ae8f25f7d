"""Triangles under the quartic and the soft object's kernel: polynomials in y = 1 - r^2 / R^2, h = c2 y^2 + c3 y^3.

The support cuts a disc out of the plane, and a chord out of each edge. Outside the chord H - H(|z|) is a constant times
an angle; inside it is a polynomial in t. Interfaces as in `edges`.
"""

import math

from fieldsim.numerics.constants import THIRD
from fieldsim.numerics.quadrature import legendre_4
from fieldsim.portable import hole, portable, real
from fieldsim.potentials.formulas.triangle.edges import triangle_formula
from fieldsim.potentials.formulas.triangle.support import angles_between, chord, compact_gone

# h = c2 y^2 + c3 y^3.
c2 = hole()
c3 = hole()


@portable
def _node(t: real, weight: real, square: real, per_r2: real, y0: real):
    """A quadrature node's share of the integrals of h, h' and of (Y - Y0), (h - h0), (h' - h0') over y - y0; Y' = h."""
    y = (square - t * t) * per_r2
    h = (real(c2) + real(c3) * y) * y * y
    slope = (real(2.0) * real(c2) + real(3.0) * real(c3) * y) * y
    squares = y0 * y0 + (y0 + y) * y
    cubes = (y0 + y) * (y0 * y0 + y * y)
    f = real(c2) * squares * real(THIRD) + real(0.25) * real(c3) * cubes
    f_1 = real(c2) * (y0 + y) + real(c3) * squares
    f_2 = real(2.0) * real(c2) + real(3.0) * real(c3) * (y0 + y)
    return weight * h, weight * slope, weight * f, weight * f_1, weight * f_2


@portable
def polynomial_edge(d: real, lo: real, length: real, z: real, radius: real, fold: real, outside: real):
    """Four Gauss-Legendre nodes are exact: degree 6 in t."""
    per_r2 = real(1.0) / (radius * radius)
    disc = (radius - z) * (radius + z)
    if disc <= real(0.0):
        nil = real(0.0)
        one = real(1.0)
        return nil, nil, nil, nil, nil, nil, nil, one, nil, one, nil, one, nil
    square = disc - d * d
    hi = lo + length
    start, end = chord(lo, hi, square)
    middle = real(0.5) * (start + end)
    half = real(0.5) * (end - start)
    y0 = disc * per_r2
    near, more = legendre_4(0)
    far, less = legendre_4(1)
    near *= half
    more *= half
    far *= half
    less *= half
    s_a, t_a, f_a, g_a, h_a = _node(middle - far, less, square, per_r2, y0)
    s_b, t_b, f_b, g_b, h_b = _node(middle - near, more, square, per_r2, y0)
    s_c, t_c, f_c, g_c, h_c = _node(middle + near, more, square, per_r2, y0)
    s_d, t_d, f_d, g_d, h_d = _node(middle + far, less, square, per_r2, y0)
    y_lo = max((square - lo * lo) * per_r2, real(0.0))
    y_hi = max((square - hi * hi) * per_r2, real(0.0))
    drop = y_hi - y_lo
    if y_lo > real(0.0) and y_hi > real(0.0):
        drop = -length * (lo + hi) * per_r2
    along = drop * (real(c2) * (y_lo + y_hi) + real(c3) * (y_lo * y_lo + y_lo * y_hi + y_hi * y_hi))
    cos, sin = angles_between(d, lo, start, end, hi)
    return (
        s_a + s_b + s_c + s_d,
        along,
        -per_r2 * (t_a + t_b + t_c + t_d),
        real(0.5) * d * (f_a + f_b + f_c + f_d),
        real(0.5) * d * (g_a + g_b + g_c + g_d),
        real(0.5) * d * (h_a + h_b + h_c + h_d),
        end - start,
        cos,
        sin,
        real(1.0),
        real(0.0),
        real(1.0),
        real(0.0),
    )


@portable
def polynomial_total(
    q_1: real,
    q_2: real,
    q_3: real,
    q_4: real,
    angle_1: real,
    angle_2: real,
    angle_3: real,
    z: real,
    radius: real,
    fold: real,
    outside: real,
    trace: real,
):
    """(F, F_z, F_zz); exactly 0 where the disc misses the triangle."""
    r2 = radius * radius
    y0 = (radius - z) * (radius + z) / r2
    if y0 <= real(0.0) or (outside > real(0.0) and q_4 == real(0.0)):
        return real(0.0), real(0.0), real(0.0)
    turn = real(0.5) * r2 * angle_1
    f = q_1 + turn * (real(c2) * real(THIRD) + real(0.25) * real(c3) * y0) * y0 * y0 * y0
    slope = -real(2.0) * (q_2 + turn * (real(c2) + real(c3) * y0) * y0 * y0) / r2
    curve = real(4.0) * (q_3 + turn * (real(2.0) * real(c2) + real(3.0) * real(c3) * y0) * y0) / r2
    return f, z * slope, slope + curve * (z / radius) * (z / radius)


@portable
def polynomial_far(away: real, size: real, radius: real):
    """Points a side where all of a small triangle lies within the support: 16 are exact in degree 6."""
    if math.sqrt(away) + size < radius and radius > real(4.0) * size:
        return 4
    return 0


def polynomial_triangle_jet(kernel):
    """The jet of a triangle under a kernel that is h = c2 y^2 + c3 y^3."""
    c2, c3 = kernel.coefficients()
    return triangle_formula(
        kernel,
        polynomial_edge.bind(c2=c2, c3=c3, _node=_node.bind(c2=c2, c3=c3)),
        polynomial_total.bind(c2=c2, c3=c3),
        polynomial_far,
        compact_gone,
    )
