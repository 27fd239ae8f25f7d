"""Triangles under the metaball: u = r / R; h = 1 - 3 u^2 within u = 1/3, 3/2 (1 - u)^2 from there to u = 1.

The support cuts a disc out of the plane, and a chord out of each edge. Outside the chord H - H(|z|) is a constant times
an angle; inside it is a polynomial in t, for the outer piece with roots r = sqrt(g^2 + t^2), g^2 = d^2 + z^2.
Interfaces as in `edges`.
"""

import math

from fieldsim.numerics.constants import THIRD
from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.segment.newtonian import newtonian_segment
from fieldsim.potentials.formulas.triangle.edges import angles, triangle_formula
from fieldsim.potentials.formulas.triangle.frame import FAR
from fieldsim.potentials.formulas.triangle.support import angle_between, angles_between, chord, compact_gone
from fieldsim.potentials.kernels import Metaball
from fieldsim.potentials.kernels.metaball import law as metaball

# -H(0) / R^2 of the Metaball.
METABALL_CORE = 13 / 108


@portable
def metaball_levels(u2: real):
    """H / R^2 (0 at u = 1), h and R^2 dh/d(r^2) of the Metaball at u^2 = r^2 / R^2."""
    h, slope, _bend = metaball(u2, real(1.0), real(0.0), real(0.0))
    u = math.sqrt(u2)
    v = max(real(1.0) - u, real(0.0))
    level = -real(0.125) * v * v * v * (real(1.0) + real(3.0) * u)
    if real(3.0) * u <= real(1.0):
        level = real(0.5) * u2 - real(0.75) * u2 * u2 - real(METABALL_CORE)
    return level, h, slope


@portable
def _shell(d: real, start: real, end: real, z: real):
    """The outer piece of the Metaball over start..end on an edge, in units of R.

    Integrals over t of h and R^2 dh/d(r^2), and over the angle of H / R^2 and h but for terms in that angle and in
    `view`, of which vectors follow.
    """
    length = end - start
    if length <= real(0.0):
        nil = real(0.0)
        return nil, nil, nil, nil, real(1.0), nil, real(1.0), nil
    lo = start
    hi = end
    if abs(start) > abs(end):
        lo = -end
        hi = -start
    z2 = z * z
    g2 = d * d + z2
    r_lo = math.sqrt(g2 + lo * lo)
    r_hi = math.sqrt(g2 + hi * hi)
    log, _l, _r, _ll, _lr, _rr = newtonian_segment(lo, g2, length, real(0.0), real(0.0))
    root = real(0.5) * (hi * r_hi - lo * r_lo + g2 * log)
    square = length * (g2 + real(THIRD) * (lo * lo + lo * hi + hi * hi))
    s = real(1.5) * (length - real(2.0) * root + square)
    across = real(1.5) * (length - log)
    # Integrals over the angle of u, u^2, u^3 and u^4, but for those terms.
    u_3 = d * (root + z2 * log)
    u_4 = d * (square + z2 * length)
    f = real(0.75) * d * length - u_3 + real(0.375) * u_4
    f_1 = real(1.5) * d * (length - real(2.0) * log)
    turn_x, turn_y = angle_between(d, lo, hi)
    view_x, view_y, _rest_x, _rest_y = angles(d, lo, hi, z, g2)
    return s, across, f, f_1, turn_x, turn_y, view_x, view_y


@portable
def metaball_edge(d: real, lo: real, length: real, z: real, radius: real, fold: real, outside: real):
    """In units of R; the inner piece is a polynomial, so that the apices of the two cones never meet an edge."""
    w = abs(z) / radius
    if w >= real(1.0):
        nil = real(0.0)
        one = real(1.0)
        return nil, nil, nil, nil, nil, nil, nil, one, nil, one, nil, one, nil
    dist = d / radius
    start = lo / radius
    end = (lo + length) / radius
    g2 = dist * dist + w * w
    outer_start, outer_end = chord(start, end, (real(1.0) - w) * (real(1.0) + w) - dist * dist)
    inner_start, inner_end = chord(outer_start, outer_end, (real(THIRD) - w) * (real(THIRD) + w) - dist * dist)
    s, across, f, f_1, turn_x, turn_y, view_x, view_y = _shell(dist, outer_start, inner_start, w)
    s_b, across_b, f_b, f_1b, turn_u, turn_v, view_u, view_v = _shell(dist, inner_end, outer_end, w)
    inner = inner_end - inner_start
    squares = inner * real(THIRD) * (inner_start * inner_start + inner_start * inner_end + inner_end * inner_end)
    s += s_b + inner * (real(1.0) - real(3.0) * g2) - real(3.0) * squares
    across += across_b - real(3.0) * inner
    f += f_b + dist * (real(0.5) * inner - real(0.75) * (inner * (g2 + w * w) + squares))
    f_1 += f_1b - real(3.0) * dist * inner
    _level, h_lo, _slope = metaball_levels(g2 + start * start)
    _level, h_hi, _slope = metaball_levels(g2 + end * end)
    cos, sin = angles_between(dist, start, inner_start, inner_end, end)
    return (
        radius * s,
        h_hi - h_lo,
        across / radius,
        f,
        f_1,
        outer_end - outer_start,
        real(0.0),
        cos,
        sin,
        turn_x * turn_u - turn_y * turn_v,
        turn_x * turn_v + turn_y * turn_u,
        view_x * view_u - view_y * view_v,
        view_x * view_v + view_y * view_u,
    )


@portable
def metaball_total(
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
    """(F, F_z, F_zz); exactly 0 where the disc misses the triangle.

    The angles are those of the edges outside the inner disc, of their shells, and the shells' `view`.
    """
    if abs(z) >= radius or (outside > real(0.0) and q_3 == real(0.0)):
        return real(0.0), real(0.0), real(0.0)
    w = abs(z) / radius
    w2 = w * w
    level, h, slope = metaball_levels(w2)
    rise = w * (angle_2 - angle_3)
    f = q_1 - level * angle_1 - w2 * rise
    f -= real(0.125) * (real(1.0) - w2 * (real(6.0) + real(3.0) * w2)) * angle_2
    f_1 = q_2 - h * angle_1 - real(3.0) * rise + real(1.5) * (real(1.0) + w2) * angle_2
    f_2 = real(1.5) * (w2 * angle_2 - rise) - w2 * slope * angle_1
    return radius * radius * f, z * f_1, f_1 + real(2.0) * f_2


@portable
def metaball_far(away: real, size: real, radius: real):
    """Points a side where the triangle lies within the inner piece, of degree 2, or far out within the outer one."""
    middle = math.sqrt(away)
    if radius < real(4.0) * size:
        return 0
    if real(3.0) * (middle + size) < radius:
        return 2
    if middle > real(FAR) * size and real(3.0) * (middle - size) > radius and middle + size < radius:
        return 6
    return 0


metaball_triangle_jet = triangle_formula(Metaball, metaball_edge, metaball_total, metaball_far, compact_gone)
