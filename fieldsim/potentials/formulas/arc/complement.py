"""Arcs near their axis: the full circle less the short rest, where the pulls of a nearly full arc cancel."""

from fieldsim.numerics.angles import arctangent
from fieldsim.numerics.constants import HALF_PI, TAU
from fieldsim.portable import hole, portable, real
from fieldsim.potentials.formulas.arc.frame import ARC

# The kernel on an arc and on a full circle, and whether the latter serves for the former.
arc = hole(ARC)
circle = hole("rho, inner, z, radius, width, fold")
hollow = hole("rho, radius, width")


@portable
def with_complement(
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
    zero = real(0.0)
    inside = hollow(rho, radius, width)
    whole = real(0.5) * angle > real(HALF_PI) and (inside or angle >= real(TAU))
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
        angle = real(2.0) * arctangent(turn, real(1.0) - versine)
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
    # One call for both, so that compilers inline it and drop unused results.
    if not whole or (inside and turn > zero):
        f, fa, fb, fn, faa, fbb, fnn, fab, fan, fbn = arc(
            rho, inner, z, radius, angle, c0, s0, c1, s1, turn, versine, width, fold
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
def near_axis(rho: real, radius: real, width: real):
    """Whether a query is so close to the axis that the integrand is constant along the circle."""
    return rho < real(0.25) * radius


@portable
def near_axis_gaussian(rho: real, radius: real, a: real):
    """As `near_axis`: for the Gaussian, whose integrand must vary little around the circle, too."""
    return rho < real(0.25) * radius and real(2.0) * a * a * rho * radius < real(1.0)
