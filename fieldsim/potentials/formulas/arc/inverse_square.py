"""Arcs under the inverse-square kernel: arctangents throughout; notation as in `frame`."""

import math

from fieldsim.numerics.constants import COS_30, TAU
from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.arc.powers import arc_powers

# What the double 2 pi lacks to a full turn.
GAP = 2.4492935982947064e-16


@portable
def inverse_square_arc(
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
    """Jet for `arc_jet`. Relative error < 1e-13 off the wire; on a bare wire F is inf and the derivatives are 0.

    The offset from a source point is (inner cos^2 v + outer sin^2 v, -2 R sin v cos v, z), so that F and its
    derivatives are integrals of `arc_powers`, all in units of far2.
    """
    if angle >= real(TAU):
        turn = real(0.0)
    outer = rho + radius
    height2 = z * z + softening * softening
    near2 = inner * inner + height2
    far2 = outer * outer + height2
    per = real(1.0) / far2
    m = near2 * per
    inverse = real(0.0)
    if m > real(0.0):
        inverse = far2 / near2
    at_end = m * c0 * c0 + s0 * s0 == real(0.0) or m * c1 * c1 + s1 * s1 == real(0.0)
    if at_end or (m == real(0.0) and s0 * s1 <= real(0.0)):
        zero = real(0.0)
        return real(math.inf), zero, zero, zero, zero, zero, zero, zero, zero, zero
    cosine, sine, cc, ss, h0, h1, one, cos2, sin2, swing, cos4, both, sin4, _cos6 = arc_powers(
        m, inverse, c0, s0, c1, s1, turn
    )
    pull = inner * cos2 + outer * sin2
    if cosine < real(COS_30):
        # The pulls of a wide arc cancel around its axis: theirs as a circle, and that of the gap.
        across = inner * outer
        pull = one * rho * (across + height2) + sine * (m * cc - ss) * radius * (across - height2)
        pull *= inverse * per
    # Integrals over the sixth power of d, of cos^3 sin and of cos sin^3.
    cos3_sin = real(0.5) * swing * (c0 * c0 * h0 + c1 * c1 * h1)
    cos_sin3 = real(0.5) * swing * (s0 * s0 * h0 + s1 * s1 * h1)
    a = real(0.0)
    b = real(0.0)
    if near2 > real(0.0):
        a = inner / math.sqrt(near2)
        b = z / math.sqrt(near2)
    ring = real(4.0) * radius * per
    force = ring * per
    isotropic = -force * (cos2 + sin2)
    push = real(4.0) * force
    twist = -push * per * real(2.0) * radius
    return (
        real(0.5) * ring * one,
        -force * pull,
        force * real(2.0) * radius * swing,
        z * isotropic,
        isotropic + push * (a * a * cos4 + per * outer * (real(2.0) * inner * both + outer * sin4)),
        isotropic + push * per * real(4.0) * radius * radius * both,
        isotropic + push * (b * b * cos4 + per * z * z * (real(2.0) * both + sin4)),
        twist * (inner * cos3_sin + outer * cos_sin3),
        push * (a * b * cos4 + per * z * (real(2.0) * rho * both + outer * sin4)),
        twist * z * (cos3_sin + cos_sin3),
    )


@portable
def inverse_square_open_arc(
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
    """As `inverse_square_arc`, but the double 2 pi, which it takes for a closed circle, leaves a gap of 2.4e-16.

    At the centre of the ring, where all else cancels, the gap's missing pull is the whole gradient.
    """
    f, fa, fb, fn, faa, fbb, fnn, fab, fan, fbn = inverse_square_arc(
        rho, inner, z, radius, angle, c0, s0, c1, s1, turn, versine, softening, fold
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
