"""Arcs under the Newtonian kernel; notation as in `frame`.

With all lengths in units of far = sqrt(far2) and m1 = near2 / far2, Carlson's integral between two limits becomes
F = 4 R R_F(p, p + m1, p + 1), p = (d0 d1 + m1 c0 c1 + s0 s1) / versine (0 for the full circle). Its derivatives by
near2 and far2 are the integrals of cos^2 v / d^3 and sin^2 v / d^3 that the force needs: sums of positive terms.
Of the second derivatives, by both gives the integral of cos^2 v sin^2 v / d^5, again without cancellation; what the
fourth powers have beside it follows from d^2 = near2 cos^2 v + far2 sin^2 v.
"""

import math

from fieldsim.numerics.constants import THIRD
from fieldsim.numerics.elliptic import carlson_d_trio
from fieldsim.portable import portable, real


@portable
def newtonian_arc(
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
    softening: real,
    fold: real,
):
    """Jet of 1/sqrt(r^2 + softening^2) for `arc_jet`, to 1e-13; on a bare wire F is inf and the derivatives are 0."""
    outer = rho + radius
    height2 = z * z + softening * softening
    near2 = inner * inner + height2
    far2 = outer * outer + height2
    # Divisions wait for no root where a product with one can follow them.
    per = real(1.0) / far2
    per_far = math.sqrt(far2) * per
    per_versine = real(1.0) / versine
    m1 = near2 * per
    e0 = m1 * c0 * c0 + s0 * s0
    e1 = m1 * c1 * c1 + s1 * s1
    d0 = math.sqrt(e0)
    d1 = math.sqrt(e1)
    n = d0 * d1
    cos = m1 * c0 * c1 + s0 * s1
    p = _carlson_argument(n, cos, turn, per_versine, m1)
    if n == real(0.0) or p + m1 == real(0.0):
        zero = real(0.0)
        return real(math.inf), zero, zero, zero, zero, zero, zero, zero, zero, zero
    h0 = real(1.0) / e0
    h1 = real(1.0) / e1
    per_n = (d0 * h0) * (d1 * h1)
    half_per = real(0.5) * per_n * per_versine
    sum_sin = s0 * c1 + c0 * s1
    p_near = _end_product(c0, c1, c0 * c0 * e1 + c1 * c1 * e0, n, turn * sum_sin) * half_per
    p_far = _end_product(s0, s1, s0 * s0 * e1 + s1 * s1 * e0, n, m1 * turn * sum_sin) * half_per
    y = p + m1
    z1 = p + real(1.0)
    r_near, r_far, ratio = carlson_d_trio(p, y, z1)
    mixed = real(0.0)
    if p > real(0.0):
        mixed = real(1.0) / (math.sqrt(p) * math.sqrt(y) * math.sqrt(z1))
    scale = real(4.0) * radius * per_far
    f = scale * (p * mixed + (m1 * r_near + r_far) * real(THIRD))
    push = -scale * per * real(THIRD)
    j_near = r_near + real(3.0) * mixed * p_near
    j_far = r_far + real(3.0) * mixed * p_far
    rise = sum_sin * turn * per_n
    swing = scale * radius * per * rise / (d0 + d1)
    both = _by_both(sum_sin * per_n, p, m1, rise, half_per, p_near, p_far, y, z1)
    both = real(6.0) * mixed * both + ratio
    near_near = real(3.0) * j_near - both
    far_far = real(3.0) * j_far - m1 * both
    isotropic = j_near + j_far
    radial = inner * inner / near2 * near_near + outer * (real(2.0) * inner * both + outer * far_far) * per
    mixed_pull = inner * z / near2 * near_near + z * (real(2.0) * rho * both + outer * far_far) * per
    height = z * z / near2 * near_near + z * z * (real(2.0) * both + far_far) * per
    t0 = (d1 + real(2.0) * d0) * h0
    t1 = (d0 + real(2.0) * d1) * h1
    twist = -swing * per / (d0 + d1)
    return (
        f,
        push * (inner * j_near + outer * j_far),
        swing,
        push * z * isotropic,
        push * (isotropic - radial),
        push * (isotropic - real(4.0) * radius * radius * per * both),
        push * (isotropic - height),
        twist * (inner * (c0 * c0 * t0 + c1 * c1 * t1) + outer * (s0 * s0 * t0 + s1 * s1 * t1)),
        -push * mixed_pull,
        twist * z * (t0 + t1),
    )


@portable
def _carlson_argument(n: real, cos: real, turn: real, per_versine: real, m1: real):
    """p, from the product n of the ends' distances, without cancellation."""
    if cos > real(0.0):
        return (n + cos) * per_versine
    if n > real(0.0):
        return turn * per_versine * turn * (m1 / (n - cos))
    return real(0.0)


@portable
def _by_both(step: real, p: real, m1: real, rise: real, half_per: real, p_near: real, p_far: real, y: real, z1: real):
    """What the derivative by both near2 and far2 has of p's, where p_near p_far = (sum_sin p / 2 n)^2."""
    both = step * step * p * real(0.125) - real(0.5) * m1 * rise * rise * half_per
    return both + real(0.5) * (p_far * (p_near + real(1.0)) / y + p_near * (p_far + real(1.0)) / z1)


@portable
def _end_product(x0: real, x1: real, squares: real, n: real, difference: real):
    """(x0 d1 + x1 d0)^2 from its squares' sum and from `difference` = x0^2 d1^2 - x1^2 d0^2, without cancellation."""
    if x0 * x1 >= real(0.0):
        return squares + real(2.0) * x0 * x1 * n
    return difference * difference / (squares - real(2.0) * x0 * x1 * n)
