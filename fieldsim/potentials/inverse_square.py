"""The inverse-square kernel 1 / (r^2 + softening^2) on points, segments, arcs and circles: arctangents throughout."""

import math

from fieldsim.portable import portable, real
from fieldsim.potentials.arc import Arc
from fieldsim.potentials.arc_angles import arctangent, sine_cosine
from fieldsim.potentials.arc_jet import arc_jet, ring_offset
from fieldsim.potentials.cells import register
from fieldsim.potentials.circle import TAU, Circle, circle_jet
from fieldsim.potentials.kernels import InverseSquare
from fieldsim.potentials.line_integrals import inverse_powers
from fieldsim.potentials.point import Point, point_jet
from fieldsim.potentials.segment import Segment, segment_jet
from fieldsim.potentials.special import sine_powers

COS_30 = math.sqrt(0.75)
# What the double 2 pi lacks to a full turn.
GAP = 2.4492935982947064e-16


@portable
def inverse_square_point(r2: real, softening: real, fold: real):
    """h(r), h' / r and h'' - h' / r. At an unsoftened source: +inf and slopes 0."""
    d2 = r2 + softening * softening
    if d2 == real(0.0):
        return real(math.inf), real(0.0), real(0.0)
    h = real(1.0) / d2
    return h, -real(2.0) * h * h, real(8.0) * (r2 / d2) * h * h


@portable
def _angle_powers(turn: real, product: real, d: real):
    """An angle t (0..pi) over d, and the integrals from 0 to t of sin^2 and of sin^4 over d^3; none is lost as d -> 0.

    turn = sin(t) / d, product = cos(t).
    """
    sin = d * turn
    if product > real(0.0) and real(1.0) + sin * sin == real(1.0):
        cube = turn * turn * turn
        return turn, cube / real(3.0), real(0.2) * sin * sin * cube
    angle = arctangent(sin, product)
    square, fourth = sine_powers(sin, product, angle)
    return angle / d, square / d / d / d, fourth / d / d / d


@portable
def inverse_square_segment(lo: real, rho2: real, length: real, softening: real, fold: real):
    """Local derivatives for `segment_jet`. Relative error < 1e-14 off the wire.

    On a bare wire F is inf and the derivatives are 0.
    """
    hi = lo + length
    d2 = rho2 + softening * softening
    if lo * lo + d2 == real(0.0) or (d2 == real(0.0) and lo <= real(0.0)):
        return real(math.inf), real(0.0), real(0.0), real(0.0), real(0.0), real(0.0)
    root, ends, far, one, two, three, _four = inverse_powers(lo, length, d2)
    along = -(length * root) * ((lo + hi) * root)
    along_along = -real(2.0) * (lo * along * ends + length * far * far)
    mixed = -real(2.0) * math.sqrt(rho2) * along * ends
    return one, along, -real(2.0) * two, along_along, mixed, real(8.0) * rho2 * three


@portable
def inverse_square_arc(
    rho: real, inner: real, z: real, radius: real, angle: real, c0: real, s0: real, softening: real, fold: real
):
    """Jet for `arc_jet`. Relative error < 1e-13 off the wire; on a bare wire F is inf and the derivatives are 0.

    With N^2, M^2 the squared distances (softened) of the circle's nearest and farthest points and the eccentric angle
    tan(psi) = (M / N) tan(v), d^2 = N^2 cos^2 v + M^2 sin^2 v makes dv / d^2 = dpsi / (N M), cos^2 v / d^2 =
    cos^2 psi / N^2 and sin^2 v / d^2 = sin^2 psi / M^2; the offset from a source point is
    (inner cos^2 v + outer sin^2 v, -2 R sin v cos v, z). So F and its derivatives are integrals of 1, of squares and of
    fourth powers of cos(psi), sin(psi) over a range t, all elementary.
    """
    half = real(0.5) * angle
    sin_quarter, cos_quarter = sine_cosine(real(0.5) * half)
    turn = real(2.0) * sin_quarter * cos_quarter
    versine = real(2.0) * sin_quarter * sin_quarter
    if angle >= real(TAU):
        turn = real(0.0)
    outer = rho + radius
    height2 = z * z + softening * softening
    near2 = inner * inner + height2
    far2 = outer * outer + height2
    near = math.sqrt(near2)
    far = math.sqrt(far2)
    c1 = c0 - (c0 * versine + s0 * turn)
    s1 = s0 - (s0 * versine - c0 * turn)
    d0 = near2 * c0 * c0 + far2 * s0 * s0
    d1 = near2 * c1 * c1 + far2 * s1 * s1
    root = real(1.0)
    if d0 > real(0.0) and d1 > real(0.0):
        root = real(1.0) / (math.sqrt(d0) * math.sqrt(d1))
    cos = (near2 * c0 * c1 + far2 * s0 * s1) * root
    if d0 == real(0.0) or d1 == real(0.0) or (near == real(0.0) and cos <= real(0.0)):
        zero = real(0.0)
        return real(math.inf), zero, zero, zero, zero, zero, zero, zero, zero, zero
    # sin(t) / (N M), t / (N M), and integrals from 0 to t of sin^2 and of sin^4 over (N M)^3.
    turn *= root
    t, square, fourth = _angle_powers(turn, cos, near * far)
    # Integrals over v of cos^2, sin^2 and sin cos over d^4.
    cc = c0 * c1 * root
    ss = s0 * s1 * root
    cos2 = cc * turn + far2 * square
    sin2 = ss * turn + near2 * square
    swing = real(0.5) * turn * (s0 * c1 + c0 * s1) * root
    pull = inner * cos2 + outer * sin2
    if cos < real(COS_30):
        # The pulls of a wide arc cancel around its axis: theirs as a circle, and that of the gap.
        across = inner * outer
        circle = t * rho * (across + height2)
        gap = turn * (near2 * cc - far2 * ss) * radius * (across - height2)
        pull = (circle + gap) / near2 / far2
    # Integrals of the fourth powers over d^6, that of cos^4 times N^2.
    cos4 = near2 * cc * turn * (cc * cos + far2 * turn * turn) + far2 * fourth
    both = (cos2 - cos4) / far2
    sin4 = ss * turn * (ss * cos + near2 * turn * turn) + near2 / far2 * fourth
    cos3_sin = real(0.5) * swing * (c0 * c0 / d0 + c1 * c1 / d1)
    cos_sin3 = real(0.5) * swing * (s0 * s0 / d0 + s1 * s1 / d1)
    a = real(0.0)
    b = real(0.0)
    if near > real(0.0):
        a = inner / near
        b = z / near
    ring = real(4.0) * radius
    push = ring * real(4.0)
    isotropic = -ring * (cos2 + sin2)
    return (
        ring * real(0.5) * t,
        -ring * pull,
        ring * real(2.0) * radius * swing,
        z * isotropic,
        isotropic + push * (a * a * cos4 + real(2.0) * inner * outer * both + outer * outer * sin4),
        isotropic + push * real(4.0) * radius * radius * both,
        isotropic + push * (b * b * cos4 + z * z * (real(2.0) * both + sin4)),
        -push * real(2.0) * radius * (inner * cos3_sin + outer * cos_sin3),
        push * (a * b * cos4 + z * (real(2.0) * rho * both + outer * sin4)),
        -push * real(2.0) * radius * z * (cos3_sin + cos_sin3),
    )


@portable
def inverse_square_circle(rho: real, inner: real, z: real, radius: real, softening: real, fold: real):
    """Local derivatives for `circle_jet`. Relative error 1e-14 off the wire, as `inverse_square_arc`, t being pi.

    On a bare wire F is inf and the derivatives are 0, as they are where they overflow next to it.
    """
    outer = rho + radius
    height2 = z * z + softening * softening
    near2 = inner * inner + height2
    if near2 == real(0.0):
        zero = real(0.0)
        return real(math.inf), zero, zero, zero, zero, zero
    i_near = real(1.0) / near2
    i_far = real(1.0) / (outer * outer + height2)
    f = real(math.pi) * real(2.0) * radius * math.sqrt(i_near) * math.sqrt(i_far)
    across = -real(2.0) * f * ((inner * outer + height2) * i_near * i_far)
    isotropic = -f * (i_near + i_far)
    # Squares of offsets, which are at most near2, with the fourth power of the cosine.
    a = inner * i_near
    b = z * i_near
    c = outer * i_far
    d = z * i_far
    radial = f * (real(3.0) * a * a + real(2.0) * a * c + real(3.0) * c * c)
    along = f * (real(3.0) * b * b + real(2.0) * b * d + real(3.0) * d * d)
    mixed = f * (real(3.0) * a * b + a * d + b * c + real(3.0) * c * d)
    if not abs(across + radial + along + isotropic) < real(math.inf):
        zero = real(0.0)
        return f, zero, zero, zero, zero, zero
    return f, across, z * isotropic, isotropic + radial, isotropic + along, mixed


@portable
def inverse_square_open_arc(
    rho: real, inner: real, z: real, radius: real, angle: real, c0: real, s0: real, softening: real, fold: real
):
    """As `inverse_square_arc`, but the double 2 pi, which it takes for a closed circle, leaves a gap of 2.4e-16.

    At the centre of the ring, where all else cancels, the gap's missing pull is the whole gradient.
    """
    f, fa, fb, fn, faa, fbb, fnn, fab, fan, fbn = inverse_square_arc(
        rho, inner, z, radius, angle, c0, s0, softening, fold
    )
    if angle == real(TAU) and rho < real(0.25) * radius:
        across = rho - radius * (c0 * c0 - s0 * s0)
        beside = -real(2.0) * radius * s0 * c0
        d2 = across * across + beside * beside + z * z + softening * softening
        pull = real(2.0) * real(GAP) * radius / d2 / d2
        fa += pull * across
        fb += pull * beside
        fn += pull * z
    return f, fa, fb, fn, faa, fbb, fnn, fab, fan, fbn


register(InverseSquare, Point, point_jet.bind(kernel=inverse_square_point))
register(InverseSquare, Segment, segment_jet.bind(kernel=inverse_square_segment))
register(InverseSquare, Arc, arc_jet.bind(kernel=inverse_square_open_arc))
register(InverseSquare, Circle, circle_jet.bind(kernel=inverse_square_circle, ring_offset=ring_offset))
