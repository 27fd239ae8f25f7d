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

import dataclasses
import math

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.portable import portable, real
from fieldsim.potentials.arc_angles import arctangent, sine_cosine
from fieldsim.potentials.arc_gaussian import gaussian_arc
from fieldsim.potentials.arc_jet import arc_jet, plain_offset, ring_offset
from fieldsim.potentials.carlson import carlson_d_trio
from fieldsim.potentials.cells import register
from fieldsim.potentials.circle import TAU, cauchy_circle, gaussian_circle, newtonian_circle
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.primitive import Primitive
from fieldsim.potentials.special import sine_powers, sine_sixth


@dataclasses.dataclass(frozen=True)
class Arc(Primitive):
    """A circular arc about `center` in the plane across `normal`.

    start: direction of the first point (its part across `normal` counts); angle: in (0, 2 pi], right-handed about
    `normal`. An arc of 2 pi is a Circle to rounding (the double 2 pi is 2.4e-16 short of the turn, and counts as such).
    """

    center: tuple[float, float, float]
    normal: tuple[float, float, float]
    start: tuple[float, float, float]
    radius: float
    angle: float

    dimension = 1
    points = ("center",)
    directions = ("normal", "start")

    def _checked(self):
        normal = validate.direction("Arc", "normal", self.normal)
        angle = validate.number("Arc", "angle", self.angle, above=0.0)
        # A sum such as 3 * (tau / 3) may exceed the turn by rounding.
        if angle > TAU * (1.0 + 1e-12):
            raise InputError(f"Arc: angle is {angle:g}; give radians in (0, 2 pi]")
        return {
            "center": validate.vector("Arc", "center", self.center),
            "normal": normal,
            "start": _across(normal, validate.direction("Arc", "start", self.start)),
            "radius": validate.number("Arc", "radius", self.radius, above=0.0),
            "angle": min(angle, TAU),
        }

    @property
    def measure(self) -> float:
        """The length, radius times angle."""
        return self.radius * self.angle

    @property
    def box(self):
        """Least and greatest coordinates of the whole circle."""
        reach = self.radius * np.sqrt(np.maximum(0.0, 1.0 - np.square(self.normal)))
        return np.subtract(self.center, reach), np.add(self.center, reach)

    def pack(self, row):
        """Write radius, angle, centre, start and normal into an element row."""
        row[2:4] = self.radius, self.angle
        row[5:8] = self.center
        row[14:17] = self.start
        row[17:20] = self.normal


def _across(normal, start):
    """The unit direction of `start`'s part across `normal`; raises InputError when there is none."""
    n = np.array(normal)
    across = np.array(start) - np.dot(start, n) * n
    size = np.linalg.norm(across)
    if size < 1e-9:
        raise InputError(f"Arc: start {start} is parallel to normal {normal}; give a direction across the normal")
    # Once more: for a start close to the normal, rounding left a part along it.
    across = across / size
    across = across - np.dot(across, n) * n
    return tuple((across / np.linalg.norm(across)).tolist())


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

    With q, Q = 1 + s^2 (near2, far2) and the eccentric angle tan(psi) = sqrt(Q / q) tan(v), 1 / (1 + s^2 d^2) is
    (Q cos^2 psi + q sin^2 psi) / (q Q) and dv shrinks with it: F and its slopes are integrals of cos^2 psi, cos^4 psi
    and so on from psi0 to psi1, taken about the middle of that range as sums of positive terms.
    """
    s2 = s * s
    outer = rho + radius
    far = real(1.0) + s2 * (outer * outer + z * z)
    r = (real(1.0) + s2 * (inner * inner + z * z)) / far
    root = math.sqrt(r)
    e0 = r * c0 * c0 + s0 * s0
    e1 = r * c1 * c1 + s1 * s1
    n = math.sqrt(e0) * math.sqrt(e1)
    sum_sin = s0 * c1 + c0 * s1
    # Half the range of psi: its cosine, sine and itself.
    cos = r * c0 * c1 + s0 * s1
    if cos > real(0.0):
        cos_half = math.sqrt(real(0.5) * (n + cos) / n)
        sin_half = real(0.5) * root * turn / (n * cos_half)
    else:
        sin_half = math.sqrt(real(0.5) * (n - cos) / n)
        cos_half = real(0.5) * root * turn / (n * sin_half)
    swept = arctangent(sin_half, cos_half)
    # Squares of the cosine and sine of the middle of the range.
    cos = r * c0 * c1 - s0 * s1
    if cos > real(0.0):
        a = real(0.5) * (n + cos) / n
        b = real(0.25) * r * sum_sin * sum_sin / (a * n * n)
    else:
        b = real(0.5) * (n - cos) / n
        a = real(0.25) * r * sum_sin * sum_sin / (b * n * n)
    # Integrals over the range, about its middle: of sin^2, sin^4, cos^2, cos^4 and sin^2 cos^2.
    sin2, sin4 = sine_powers(sin_half, cos_half, swept)
    cos2 = swept - sin2
    both = sin2 - sin4
    cos4 = cos2 - both
    # The same of psi itself (all halved).
    cos2_psi = a * cos2 + b * sin2
    sin2_psi = b * cos2 + a * sin2
    cos4_psi = a * a * cos4 + real(6.0) * a * b * both + b * b * sin4
    sin4_psi = b * b * cos4 + real(6.0) * a * b * both + a * a * sin4
    both_psi = a * b * (swept - real(4.0) * both) + (a - b) * (a - b) * both
    scale = real(4.0) * radius / (r * root * far * far)
    push = -real(4.0) * s2 / far / r * scale
    along = cos4_psi + real(2.0) * r * both_psi + r * r * sin4_psi
    across = inner * cos4_psi + real(2.0) * rho * r * both_psi + outer * r * r * sin4_psi
    swing = real(4.0) * s2 * radius * radius / far * sum_sin * turn / (n * n) / (n * n) / far / far
    # The Hessian's integrals, of sixth powers: what goes with the offset's radial parts, both sides of it, squared.
    sin6 = sine_sixth(sin_half, cos_half, sin4)
    cos2_sin4 = sin4 - sin6
    cos4_sin2 = both - cos2_sin4
    cos6_psi = a * a * (a * (cos4 - cos4_sin2) + real(15.0) * b * cos4_sin2)
    cos6_psi += b * b * (b * sin6 + real(15.0) * a * cos2_sin4)
    cos4_sin2 = cos4_psi - cos6_psi
    cos2_sin4 = both_psi - cos4_sin2
    near_near = cos6_psi / r + cos4_sin2
    near_far = cos4_sin2 + r * cos2_sin4
    far_far = r * (cos2_sin4 + r * (sin4_psi - cos2_sin4))
    bend = -real(6.0) * s2 / far
    radial = inner * inner * near_near + outer * (real(2.0) * inner * near_far + outer * far_far)
    mixed = inner * near_near + real(2.0) * rho * near_far + outer * far_far
    height = near_near + real(2.0) * near_far + far_far
    t0 = (real(2.0) * e1 + e0) / e0
    t1 = (real(2.0) * e0 + e1) / e1
    twist = -real(2.0) * s2 / far * swing
    return (
        scale * (cos2_psi + r * sin2_psi),
        push * across,
        swing * (e0 + e1),
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
    far = math.sqrt(far2)
    m1 = near2 / far2
    e0 = m1 * c0 * c0 + s0 * s0
    e1 = m1 * c1 * c1 + s1 * s1
    d0 = math.sqrt(e0)
    d1 = math.sqrt(e1)
    n = d0 * d1
    cos = m1 * c0 * c1 + s0 * s1
    p = real(0.0)
    if cos > real(0.0):
        p = (n + cos) / versine
    elif n > real(0.0):
        p = turn / versine * turn * (m1 / (n - cos))
    if n == real(0.0) or p + m1 == real(0.0):
        zero = real(0.0)
        return real(math.inf), zero, zero, zero, zero, zero, zero, zero, zero, zero
    sum_sin = s0 * c1 + c0 * s1
    p_near = _end_product(c0, c1, c0 * c0 * e1 + c1 * c1 * e0, n, turn * sum_sin) / (real(2.0) * n * versine)
    p_far = _end_product(s0, s1, s0 * s0 * e1 + s1 * s1 * e0, n, m1 * turn * sum_sin) / (real(2.0) * n * versine)
    y = p + m1
    z1 = p + real(1.0)
    r_near, r_far, ratio = carlson_d_trio(p, y, z1)
    mixed = real(0.0)
    if p > real(0.0):
        mixed = real(1.0) / (math.sqrt(p) * math.sqrt(y) * math.sqrt(z1))
    f = real(4.0) * radius / far * (p * mixed + (m1 * r_near + r_far) / real(3.0))
    push = -real(4.0) / real(3.0) * radius / (far2 * far)
    j_near = r_near + real(3.0) * mixed * p_near
    j_far = r_far + real(3.0) * mixed * p_far
    swing = real(4.0) * radius * radius / far2 * sum_sin * turn / (n * (d0 + d1)) / far
    # Six times the derivative by both, of Carlson's integral and of p (p_near p_far = (sum_sin p / 2 n)^2).
    step = sum_sin / n
    rise = turn * step
    both = step * step * p / real(8.0) - m1 * rise * rise / (real(4.0) * n * versine)
    both += real(0.5) * (p_far * (p_near + real(1.0)) / y + p_near * (p_far + real(1.0)) / z1)
    both = real(6.0) * mixed * both + ratio
    near_near = real(3.0) * j_near - both
    far_far = real(3.0) * j_far - m1 * both
    isotropic = j_near + j_far
    radial = inner * inner / near2 * near_near + outer * (real(2.0) * inner * both + outer * far_far) / far2
    mixed_pull = inner * z / near2 * near_near + z * (real(2.0) * rho * both + outer * far_far) / far2
    height = z * z / near2 * near_near + z * z * (real(2.0) * both + far_far) / far2
    t0 = (d1 + real(2.0) * d0) / e0
    t1 = (d0 + real(2.0) * d1) / e1
    twist = -swing / (far2 * (d0 + d1))
    return (
        f,
        push * (inner * j_near + outer * j_far),
        swing,
        push * z * isotropic,
        push * (isotropic - radial),
        push * (isotropic - real(4.0) * radius * radius / far2 * both),
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


@portable
def _local(rho: real, inner: real, z: real, radius: real, angle: real, c0: real, s0: real, width: real, fold: real):
    """Jet for `arc_jet`.

    Close to the axis, where the pulls of a nearly full arc cancel, it is the full circle less the short rest.
    """
    half = real(0.5) * angle
    sin, cos = sine_cosine(real(0.5) * half)
    turn = real(2.0) * sin * cos
    versine = real(2.0) * sin * sin
    c1 = c0 - (c0 * versine + s0 * turn)
    s1 = s0 - (s0 * versine - c0 * turn)
    zero = real(0.0)
    inside = hollow(rho, radius, width)  # noqa: F821 - bound below
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
        f, fa, fb, fn, faa, fbb, fnn, fab, fan, fbn = arc(  # noqa: F821
            rho, inner, z, radius, c0, s0, c1, s1, half, turn, versine, width, fold
        )
    if whole:
        g, across, gn, gaa, gnn, gan = circle(rho, inner, z, radius, width, fold)  # noqa: F821
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


HALF_PI = math.pi / 2


@portable
def _hollow(rho: real, radius: real, width: real):
    """Whether a query is so close to the axis that all of the circle counts alike."""
    return rho < real(0.25) * radius


@portable
def _gaussian_hollow(rho: real, radius: real, a: real):
    """As `_hollow`: the Gaussian also asks that it varies little around the circle."""
    return rho < real(0.25) * radius and real(2.0) * a * a * rho * radius < real(1.0)


for _kernel, _arc, _circle, _inside, _offset in (
    (Cauchy, cauchy_arc, cauchy_circle, _hollow, plain_offset),
    (Gaussian, gaussian_arc, gaussian_circle, _gaussian_hollow, plain_offset),
    (Newtonian, newtonian_arc, newtonian_circle, _hollow, ring_offset),
):
    _jet = arc_jet.bind(kernel=_local.bind(arc=_arc, circle=_circle, hollow=_inside), ring_offset=_offset)
    register(_kernel, Arc, _jet)
