"""Partial arcs, in their local invariants.

The query point lies at distance rho from the axis and height z above the plane. A source point at angle u from the
query's azimuth is seen over the half angle v = u / 2: with near2 = (rho - R)^2 + z^2 and far2 = (rho + R)^2 + z^2

    d^2 = near2 cos^2 v + far2 sin^2 v,        F = 2 R integral of h(d) dv from v0 to v1 = v0 + angle / 2.

The ends enter as cosines and sines (c0, s0), (c1, s1) of v0 and v1, in products that keep their digits for the shortest
arcs and next to the ends; `half` = v1 - v0, `turn` = sin(half), `versine` = 1 - cos(half). A kernel's function returns
the jet in the frame of `arc_jet`, made of integrals of products of the offset from a source point to the query,

    (inner cos^2 v + outer sin^2 v, -2 R sin v cos v, z),        inner = rho - R, outer = rho + R.

Odd in v, integrals of sin v cos v are differences of end values, as dF/dphi = R (h(d0) - h(d1)) is; what they have in
common is d1^2 - d0^2 = 4 R rho turn sin(v0 + v1). Squares of inner and z, which are at most near2, multiply integrals
of cos^4 v, so that each product keeps its digits next to the wire.
"""

import math

from fieldsim.numerics.angles import arctangent
from fieldsim.numerics.constants import HALF_PI, TAU, THIRD
from fieldsim.numerics.elliptic import carlson_d_trio
from fieldsim.portable import hole, portable, real
from fieldsim.potentials.formulas.arc.circle import cauchy_circle, gaussian_circle, newtonian_circle
from fieldsim.potentials.formulas.arc.gaussian import gaussian_arc
from fieldsim.potentials.formulas.arc.jet import arc_jet, plain_ends, plain_offset, ring_offset, sharp_ends
from fieldsim.potentials.formulas.arc.powers import arc_powers
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.registry import register


@portable
def cauchy_arc(
    rho: real,
    inner: real,
    z: real,
    radius: real,
    c0: real,
    s0: real,
    c1: real,
    s1: real,
    half: real,
    turn: real,
    versine: real,
    s: real,
    fold: real,
):
    """Jet of the Cauchy kernel, in the frame of `arc_jet`. Relative error < 1e-13.

    Its integrals are `arc_powers` with 1 + s^2 (near2, far2) in the place of near2 and far2.
    """
    s2 = s * s
    outer = rho + radius
    near = real(1.0) + s2 * (inner * inner + z * z)
    far = real(1.0) + s2 * (outer * outer + z * z)
    per = real(1.0) / far
    inverse = far / near
    m = near * per
    _cosine, _sine, _cc, _ss, h0, h1, _one, cos2, sin2, swing, cos4, both, sin4, cos6 = arc_powers(
        m, inverse, c0, s0, c1, s1, turn
    )
    scale = real(2.0) * radius * per * per
    push = -real(4.0) * s2 * per * scale
    swing *= -radius * push
    # The force's integrals are over d^6, with a factor m, those that the Hessian has beside them over d^8, with m^2.
    push *= inverse
    both *= m
    sin4 *= m
    along = cos4 + real(2.0) * both + sin4
    cos4_sin2 = m * (cos4 - cos6)
    cos2_sin4 = m * (both - cos4_sin2)
    sin6 = m * (sin4 - cos2_sin4)
    near_near = cos6 + cos4_sin2
    near_far = cos4_sin2 + cos2_sin4
    far_far = cos2_sin4 + sin6
    bend = -real(6.0) * s2 * per * inverse
    radial = inner * inner * near_near + outer * (real(2.0) * inner * near_far + outer * far_far)
    mixed = inner * near_near + real(2.0) * rho * near_far + outer * far_far
    height = near_near + real(2.0) * near_far + far_far
    t0 = h0 * (real(2.0) * h0 + h1)
    t1 = h1 * (real(2.0) * h1 + h0)
    twist = -real(2.0) * s2 * per * swing
    return (
        scale * (cos2 + sin2),
        push * (inner * cos4 + real(2.0) * rho * both + outer * sin4),
        swing * (h0 + h1),
        push * z * along,
        push * (along + bend * radial),
        push * (along + bend * real(4.0) * radius * radius * near_far),
        push * (along + bend * z * z * height),
        twist * (inner * (c0 * c0 * t0 + c1 * c1 * t1) + outer * (s0 * s0 * t0 + s1 * s1 * t1)),
        push * bend * z * mixed,
        twist * z * (t0 + t1),
    )


@portable
def newtonian_arc(
    rho: real,
    inner: real,
    z: real,
    radius: real,
    c0: real,
    s0: real,
    c1: real,
    s1: real,
    half: real,
    turn: real,
    versine: real,
    softening: real,
    fold: real,
):
    """Jet of 1/sqrt(r^2 + softening^2), in the frame of `arc_jet`. Relative error < 1e-13.

    On a bare wire F is inf and the derivatives are 0.

    With all lengths in units of far = sqrt(far2) and m1 = near2 / far2, Carlson's integral between two limits becomes
    F = 4 R R_F(p, p + m1, p + 1), p = (d0 d1 + m1 c0 c1 + s0 s1) / versine (0 for the full circle). Its derivatives by
    near2 and far2 are the integrals of cos^2 v / d^3 and sin^2 v / d^3 that the force needs: sums of positive terms.
    Of the second derivatives, by both gives the integral of cos^2 v sin^2 v / d^5, again without cancellation; what
    the fourth powers have beside it follows from d^2 = near2 cos^2 v + far2 sin^2 v.
    """
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
    p = real(0.0)
    if cos > real(0.0):
        p = (n + cos) * per_versine
    elif n > real(0.0):
        p = turn * per_versine * turn * (m1 / (n - cos))
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
    # Six times the derivative by both, of Carlson's integral and of p (p_near p_far = (sum_sin p / 2 n)^2).
    step = sum_sin * per_n
    both = step * step * p * real(0.125) - real(0.5) * m1 * rise * rise * half_per
    both += real(0.5) * (p_far * (p_near + real(1.0)) / y + p_near * (p_far + real(1.0)) / z1)
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
def _end_product(x0: real, x1: real, squares: real, n: real, difference: real):
    """(x0 d1 + x1 d0)^2 from its squares' sum and from `difference` = x0^2 d1^2 - x1^2 d0^2, without cancellation."""
    if x0 * x1 >= real(0.0):
        return squares + real(2.0) * x0 * x1 * n
    return difference * difference / (squares - real(2.0) * x0 * x1 * n)


# The kernel on an arc and on a full circle, and whether the latter serves for the former.
arc = hole("rho, inner, z, radius, c0, s0, c1, s1, half, turn, versine, width, fold")
circle = hole("rho, inner, z, radius, width, fold")
hollow = hole("rho, radius, width")


@portable
def _local(
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
    width: real,
    fold: real,
):
    """Jet for `arc_jet`.

    Close to the axis, where the pulls of a nearly full arc cancel, it is the full circle less the short rest.
    """
    half = real(0.5) * angle
    zero = real(0.0)
    inside = hollow(rho, radius, width)
    whole = half > real(HALF_PI) and (inside or angle >= real(TAU))
    if whole:
        # The rest, from the arc's end to its start, is seen over v1 - pi..v0 or, from its azimuths, v1..v0 + pi.
        side = real(1.0)
        if s1 > zero:
            side = -side
        c = side * c1
        s = side * s1
        c1 = -side * c0
        s1 = -side * s0
        c0 = c
        s0 = s
        versine = turn * turn / versine
        half = arctangent(turn, real(1.0) - versine)
    f = zero
    fa = zero
    fb = zero
    fn = zero
    faa = zero
    fbb = zero
    fnn = zero
    fab = zero
    fan = zero
    fbn = zero
    # One call for both, so that compilers inline it and drop what is not asked for.
    if not whole or (inside and turn > zero):
        f, fa, fb, fn, faa, fbb, fnn, fab, fan, fbn = arc(
            rho, inner, z, radius, c0, s0, c1, s1, half, turn, versine, width, fold
        )
    if whole:
        g, across, gn, gaa, gnn, gan = circle(rho, inner, z, radius, width, fold)
        f = g - f
        fa = across * rho - fa
        fb = -fb
        fn = gn - fn
        faa = gaa - faa
        fbb = across - fbb
        fnn = gnn - fnn
        fab = -fab
        fan = gan - fan
        fbn = -fbn
    return f, fa, fb, fn, faa, fbb, fnn, fab, fan, fbn


@portable
def _hollow(rho: real, radius: real, width: real):
    """Whether a query is so close to the axis that all of the circle counts alike."""
    return rho < real(0.25) * radius


@portable
def _gaussian_hollow(rho: real, radius: real, a: real):
    """As `_hollow`: the Gaussian also asks that it varies little around the circle."""
    return rho < real(0.25) * radius and real(2.0) * a * a * rho * radius < real(1.0)


for _kernel, _arc, _circle, _inside, _offset, _ends in (
    (Cauchy, cauchy_arc, cauchy_circle, _hollow, plain_offset, plain_ends),
    (Gaussian, gaussian_arc, gaussian_circle, _gaussian_hollow, plain_offset, plain_ends),
    (Newtonian, newtonian_arc, newtonian_circle, _hollow, ring_offset, sharp_ends),
):
    _kernel_jet = _local.bind(arc=_arc, circle=_circle, hollow=_inside)
    _jet = arc_jet.bind(kernel=_kernel_jet, offset=_offset, ends=_ends)
    register(_kernel, Arc, _jet)
