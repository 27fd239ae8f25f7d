"""Profiles: a factor along a segment or an arc that swells and thins the surface around it (Sherstyuk 1999, 3.3.4).

The factor p(u) on the field depends on the query point's own place along the primitive: u runs from 0 at the start to
1 at the end, by arc length for the nearest point of a segment, by angle around the axis for an arc, and stays 0 or 1
beyond the ends. It is no density: the field is F = p(u(x)) * (the primitive's field at x), as smooth as that but

- on the planes across the ends: continuous there, its gradient only where p'(0) = p'(1) = 0 (`sine`, `constant`);
- on a hat's middle plane: continuous;
- for an arc, on its axis and on the half-plane opposite its middle (for a full turn: through its start), where u jumps:
  a jump unless p(0) = p(1). On the axis itself u = 1/2.

Value, gradient and Hessian are those of the product; on the planes above derivatives of u count as 0.
"""

import dataclasses
import math

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.portable import Table, portable, real
from fieldsim.potentials import cells
from fieldsim.potentials.arc import Arc
from fieldsim.potentials.segment import Segment

SHAPES = ("along", "hat", "sine")
# What a row holds, and enough: in powers of u a wave of degree 12 between -1 and 1 (Chebyshev's) has coefficients up to
# 2e8, whose sum is good to 1e-7 only; more of them would say less.
DEGREE = 12


@dataclasses.dataclass(frozen=True)
class Profile:
    """p(u) = sum of coefficients[k] s^k, s = u ("along"), 1 - |2 u - 1| ("hat") or sin^2(pi u) ("sine").

    Up to 13 coefficients; p is accurate to rounding of its largest term. Raises InputError for another shape, more
    coefficients, or none that are finite.
    """

    coefficients: tuple[float, ...]
    shape: str = "along"

    def __post_init__(self):
        validate.choice("Profile", "shape", self.shape, SHAPES)
        remedy = f"give a list of 1 to {DEGREE + 1} numbers"
        given = validate.listed("Profile", "coefficients", self.coefficients, remedy)
        if not 1 <= len(given) <= DEGREE + 1:
            raise InputError(f"Profile: coefficients has {len(given)} numbers; {remedy}")
        validate.numbers("Profile", "coefficients", self.coefficients, shape=(None,), remedy=remedy)
        checked = tuple(validate.number("Profile", f"coefficients[{k}]", c) for k, c in enumerate(given))
        object.__setattr__(self, "coefficients", checked)

    def pack(self, row) -> None:
        """Write shape and coefficients into an element row."""
        row[cells.OWN] = 0.0
        row[20:22] = SHAPES.index(self.shape), len(self.coefficients) - 1
        row[22 : 22 + len(self.coefficients)] = self.coefficients


def constant(factor=1.0) -> Profile:
    """The same factor everywhere."""
    return Profile((validate.number("constant", "factor", factor),))


def linear(start=0.0, end=1.0) -> Profile:
    """From `start` evenly to `end`."""
    start, end = validate.number("linear", "start", start), validate.number("linear", "end", end)
    return Profile((start, end - start))


def hat(ends=0.0, middle=1.0) -> Profile:
    """From `ends` evenly up to `middle` and down again."""
    ends, middle = validate.number("hat", "ends", ends), validate.number("hat", "middle", middle)
    return Profile((ends, middle - ends), "hat")


def sine(ends=0.0, middle=1.0) -> Profile:
    """The factor ends + (middle - ends) sin^2(pi u)."""
    ends, middle = validate.number("sine", "ends", ends), validate.number("sine", "middle", middle)
    return Profile((ends, middle - ends), "sine")


def polynomial(*coefficients) -> Profile:
    """The factor c0 + c1 u + c2 u^2 + ..., up to u^12."""
    return Profile(tuple(validate.number("polynomial", f"coefficients[{k}]", c) for k, c in enumerate(coefficients)))


@dataclasses.dataclass(frozen=True)
class ProfiledSegment(Segment):
    """A segment whose field is multiplied by a profile along it."""

    carries_mass = False
    profile: Profile = Profile((1.0,))

    def _checked(self):
        return {**super()._checked(), "profile": _profile(self)}

    def pack(self, row):
        """Write the segment and its profile into an element row."""
        super().pack(row)
        self.profile.pack(row)


@dataclasses.dataclass(frozen=True)
class ProfiledArc(Arc):
    """An arc whose field is multiplied by a profile along it."""

    carries_mass = False
    profile: Profile = Profile((1.0,))

    def _checked(self):
        return {**super()._checked(), "profile": _profile(self)}

    def pack(self, row):
        """Write the arc and its profile into an element row."""
        super().pack(row)
        self.profile.pack(row)


def profiled(primitive, profile: Profile) -> ProfiledSegment | ProfiledArc:
    """A Segment or an Arc with a profile along it."""
    for plain, kind in ((Segment, ProfiledSegment), (Arc, ProfiledArc)):
        if type(primitive) is plain:
            validate.instance("profiled", "profile", profile, Profile, "give one such as fs.profile.linear(1, 0)")
            values = {field.name: getattr(primitive, field.name) for field in dataclasses.fields(primitive)}
            return kind(**values, profile=profile)
    remedy = "give a fs.Segment or a fs.Arc (an Arc of 2 pi for a Circle)"
    raise InputError(f"profiled: primitive is {validate.shown(primitive)}, which has no profiles; {remedy}")


def _profile(primitive):
    remedy = "give one such as fs.profile.linear(1, 0)"
    return validate.instance(type(primitive).__name__, "profile", primitive.profile, Profile, remedy)


@portable
def _factor(u: real, rows: Table, i: int):
    """p(u) and its first two derivatives; beyond 0..1 and on its ends the derivatives are 0."""
    inside = u > real(0.0) and u < real(1.0)
    u = min(max(u, real(0.0)), real(1.0))
    s = u
    slope = real(1.0)
    bend = real(0.0)
    if rows[i, 20] == real(1.0):
        s = real(1.0) - abs(real(2.0) * u - real(1.0))
        slope = real(2.0)
        if u > real(0.5):
            slope = -real(2.0)
        if u == real(0.5):
            slope = real(0.0)
    if rows[i, 20] == real(2.0):
        sin = math.sin(real(math.pi) * u)
        cos = math.cos(real(math.pi) * u)
        s = sin * sin
        slope = real(2.0) * real(math.pi) * sin * cos
        bend = real(2.0) * real(math.pi) * real(math.pi) * (cos * cos - sin * sin)
    # Horner's scheme for the polynomial, its derivative and half its second derivative.
    degree = int(rows[i, 21])
    p = rows[i, 22 + degree]
    p1 = real(0.0)
    p2 = real(0.0)
    for k in range(degree):
        p2 = p2 * s + p1
        p1 = p1 * s + p
        p = p * s + rows[i, 21 + degree - k]
    if not inside:
        return p, real(0.0), real(0.0)
    return p, p1 * slope, real(2.0) * p2 * slope * slope + p1 * bend


@portable
def _along_segment(x: real, y: real, z: real, rows: Table, i: int):
    """u, its gradient, and its Hessian's six entries."""
    inverse = real(1.0) / rows[i, 2]
    gx = inverse * rows[i, 14]
    gy = inverse * rows[i, 15]
    gz = inverse * rows[i, 16]
    zero = real(0.0)
    u = (x - rows[i, 5]) * gx + (y - rows[i, 6]) * gy + (z - rows[i, 7]) * gz
    return u, gx, gy, gz, zero, zero, zero, zero, zero, zero


@portable
def _along_arc(x: real, y: real, z: real, rows: Table, i: int):
    """u, its gradient, and its Hessian's six entries; 1/2 and 0 on the axis."""
    sx = rows[i, 14]
    sy = rows[i, 15]
    sz = rows[i, 16]
    tx = rows[i, 18] * sz - rows[i, 19] * sy
    ty = rows[i, 19] * sx - rows[i, 17] * sz
    tz = rows[i, 17] * sy - rows[i, 18] * sx
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    p = dx * sx + dy * sy + dz * sz
    q = dx * tx + dy * ty + dz * tz
    rho2 = p * p + q * q
    zero = real(0.0)
    if rho2 == zero:
        return real(0.5), zero, zero, zero, zero, zero, zero, zero, zero, zero
    rho = math.sqrt(rho2)
    cos = p / rho
    sin = q / rho
    angle = rows[i, 3]
    # The azimuth from the start, cut on the far side of the arc's middle.
    turn = math.atan2(q, p)
    if turn < real(0.5) * angle - real(math.pi):
        turn += real(2.0) * real(math.pi)
    ax = cos * sx + sin * tx
    ay = cos * sy + sin * ty
    az = cos * sz + sin * tz
    inverse = real(1.0) / (rho * angle)
    bx = inverse * (cos * tx - sin * sx)
    by = inverse * (cos * ty - sin * sy)
    bz = inverse * (cos * tz - sin * sz)
    i_rho = real(1.0) / rho
    return (
        turn / angle,
        bx,
        by,
        bz,
        -real(2.0) * i_rho * ax * bx,
        -real(2.0) * i_rho * ay * by,
        -real(2.0) * i_rho * az * bz,
        -i_rho * (ax * by + ay * bx),
        -i_rho * (ax * bz + az * bx),
        -i_rho * (ay * bz + az * by),
    )


@portable
def profiled_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a profiled primitive from its own `jet` and its parameter `along` (bound below).

    On a bare wire: inf of the factor's sign, 0 where the factor is 0; infinite parts of derivatives are left out.
    """
    u, ux, uy, uz, uxx, uyy, uzz, uxy, uxz, uyz = along(x, y, z, rows, i)  # noqa: F821
    f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz = jet(x, y, z, rows, i)  # noqa: F821
    p, p1, p2 = _factor(u, rows, i)
    value = real(0.0)
    if p != real(0.0):
        value = p * f
    if not abs(f) < real(math.inf):
        f = real(0.0)
    s1 = p1 * f
    s2 = p2 * f
    return (
        value,
        p * fx + s1 * ux,
        p * fy + s1 * uy,
        p * fz + s1 * uz,
        p * fxx + real(2.0) * p1 * ux * fx + s2 * ux * ux + s1 * uxx,
        p * fyy + real(2.0) * p1 * uy * fy + s2 * uy * uy + s1 * uyy,
        p * fzz + real(2.0) * p1 * uz * fz + s2 * uz * uz + s1 * uzz,
        p * fxy + p1 * (ux * fy + uy * fx) + s2 * ux * uy + s1 * uxy,
        p * fxz + p1 * (ux * fz + uz * fx) + s2 * ux * uz + s1 * uxz,
        p * fyz + p1 * (uy * fz + uz * fy) + s2 * uy * uz + s1 * uyz,
    )


for _plain, _primitive, _along in (
    (Segment, ProfiledSegment, _along_segment),
    (Arc, ProfiledArc, _along_arc),
):
    for _kernel in [kernel for kernel, primitive in cells.CELLS if primitive is _plain]:
        _jet = profiled_jet.bind(jet=cells.CELLS[_kernel, _plain].jet, along=_along)
        cells.register(_kernel, _primitive, _jet)
