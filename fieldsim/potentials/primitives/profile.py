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
import typing
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.row import COEFFICIENTS, OWN, PEAK, PROFILE_DEGREE, PROFILE_SHAPE, peak_of
from fieldsim.types import RealLike, Timed, VectorLike

SHAPES = ("along", "hat", "sine")
# What a row holds, and enough: in powers of u a wave of degree 12 between -1 and 1 (Chebyshev's) has coefficients up to
# 2e8, whose sum is good to 1e-7 only; more of them would say less.
DEGREE = 12
# Where a profile is looked at, and how much it may exceed what is seen there: by Markov's inequality a polynomial of
# degree 12 changes by less than 2 * 12^2 of its maximum over half a step.
_PROBES = np.linspace(0.0, 1.0, 1001)
_BETWEEN = 1.2


@dataclasses.dataclass(frozen=True)
class Profile:
    """p(u) = sum of coefficients[k] s^k, s = u ("along"), 1 - |2 u - 1| ("hat") or sin^2(pi u) ("sine").

    Up to 13 coefficients; p is accurate to rounding of its largest term. Raises InputError for another shape, more
    coefficients, or none that are finite.
    """

    coefficients: tuple[float, ...]
    shape: str = "along"

    if TYPE_CHECKING:

        def __init__(self, coefficients: Sequence[RealLike] | np.ndarray, shape: str = ...) -> None: ...

    def __post_init__(self):
        validate.choice("Profile", "shape", self.shape, SHAPES)
        remedy = f"give a list of 1 to {DEGREE + 1} numbers"
        given = validate.listed("Profile", "coefficients", self.coefficients, remedy)
        if not 1 <= len(given) <= DEGREE + 1:
            raise InputError(f"Profile: coefficients has {len(given)} numbers; {remedy}")
        validate.numbers("Profile", "coefficients", self.coefficients, shape=(None,), remedy=remedy)
        checked = tuple(validate.number("Profile", f"coefficients[{k}]", c) for k, c in enumerate(given))
        object.__setattr__(self, "coefficients", checked)

    def pack(self, row: np.ndarray) -> None:
        """Write shape and coefficients into an element row."""
        row[OWN] = 0.0
        row[PROFILE_SHAPE], row[PROFILE_DEGREE] = SHAPES.index(self.shape), len(self.coefficients) - 1
        row[COEFFICIENTS][: len(self.coefficients)] = self.coefficients


def constant(factor: RealLike = 1.0) -> Profile:
    """The same factor everywhere."""
    return Profile((validate.number("constant", "factor", factor),))


def linear(start: RealLike = 0.0, end: RealLike = 1.0) -> Profile:
    """From `start` evenly to `end`."""
    start, end = validate.number("linear", "start", start), validate.number("linear", "end", end)
    return Profile((start, end - start))


def hat(ends: RealLike = 0.0, middle: RealLike = 1.0) -> Profile:
    """From `ends` evenly up to `middle` and down again."""
    ends, middle = validate.number("hat", "ends", ends), validate.number("hat", "middle", middle)
    return Profile((ends, middle - ends), "hat")


def sine(ends: RealLike = 0.0, middle: RealLike = 1.0) -> Profile:
    """The factor ends + (middle - ends) sin^2(pi u)."""
    ends, middle = validate.number("sine", "ends", ends), validate.number("sine", "middle", middle)
    return Profile((ends, middle - ends), "sine")


def polynomial(*coefficients: RealLike) -> Profile:
    """The factor c0 + c1 u + c2 u^2 + ..., up to u^12."""
    return Profile(tuple(validate.number("polynomial", f"coefficients[{k}]", c) for k, c in enumerate(coefficients)))


@portable
def peak(x: real, y: real, z: real, rows: Table, i: int):
    """Where a row's profile is greatest."""
    return peak_of(rows, i)


class Profiled:
    """What primitives with a profile along them share."""

    profiled = True
    along_rays = ""
    # Beside a foot the profile may be 0.
    inner = peak

    # The primitive without a profile.
    plain_kind: typing.ClassVar[typing.Any]

    def _checked(self: "ProfiledSegment | ProfiledArc"):
        remedy = "give one such as fs.profile.linear(1, 0)"
        profile = validate.instance(type(self).__name__, "profile", self.profile, Profile, remedy)
        return {**self.plain_kind._checked(self), "profile": profile}

    def plain(self: "ProfiledSegment | ProfiledArc") -> Segment | Arc:
        """The primitive without its profile."""
        kind = self.plain_kind
        return kind(**{field.name: getattr(self, field.name) for field in dataclasses.fields(kind)})

    def pack(self: "ProfiledSegment | ProfiledArc", row: np.ndarray) -> None:
        """Write the primitive and its profile into an element row."""
        self.plain_kind.pack(self, row)
        self.profile.pack(row)
        u = np.full((1, 1), _highest(self.profile))
        row[PEAK] = self.row_places(row[None], u, u)[0]

    @staticmethod
    def row_factor(rows: np.ndarray) -> float | np.ndarray:
        """No less than what the profiles multiply the field with, in size."""
        return _BETWEEN * np.abs(_sampled(rows)).max(axis=-1)

    @classmethod
    def row_factor_bend(cls, rows: np.ndarray) -> float | np.ndarray:
        """How sharply profiles bend log F: of the order of their greatest slope, relative and squared."""
        values = _sampled(rows)
        slope = np.abs(np.gradient(values, _PROBES, axis=-1)).max(axis=-1) / np.abs(values).max(axis=-1)
        # u changes by 2 / length along a hat, and on an arc faster nearer to its axis.
        return (4.0 * slope / cls.plain_kind.row_measure(rows)) ** 2


def _highest(profile):
    """Where along it a profile is greatest, u from 0 to 1."""
    u = _PROBES
    s = {"along": u, "hat": 1.0 - np.abs(2.0 * u - 1.0), "sine": np.sin(np.pi * u) ** 2}[profile.shape]
    return u[np.argmax(np.polynomial.polynomial.polyval(s, profile.coefficients))]


def _sampled(rows):
    """The polynomials of s at the probes, (..., probes)."""
    values = 0.0
    for k in reversed(range(COEFFICIENTS.start, COEFFICIENTS.stop)):
        values = values * _PROBES + rows[..., k, None]
    return values


@dataclasses.dataclass(frozen=True)
class ProfiledSegment(Profiled, Segment):
    """A segment whose field is multiplied by a profile along it."""

    profile: Profile = Profile((1.0,))

    if TYPE_CHECKING:

        def __init__(self, start: Timed[VectorLike], end: Timed[VectorLike], profile: Profile = ...) -> None: ...

    plain_kind = Segment


@dataclasses.dataclass(frozen=True)
class ProfiledArc(Profiled, Arc):
    """An arc whose field is multiplied by a profile along it."""

    profile: Profile = Profile((1.0,))

    if TYPE_CHECKING:

        def __init__(
            self,
            center: Timed[VectorLike],
            normal: Timed[VectorLike],
            start: Timed[VectorLike],
            radius: Timed[RealLike],
            angle: Timed[RealLike],
            profile: Profile = ...,
        ) -> None: ...

    plain_kind = Arc


_PROFILED = {kind.plain_kind: kind for kind in (ProfiledSegment, ProfiledArc)}


def profiled(primitive: Segment | Arc, profile: Profile) -> ProfiledSegment | ProfiledArc:
    """A Segment or an Arc with a profile along it."""
    kind = _PROFILED.get(type(primitive))
    if kind is None:
        remedy = "give a fs.Segment or a fs.Arc (an Arc of 2 pi for a Circle)"
        raise InputError(f"profiled: primitive is {validate.shown(primitive)}, which has no profiles; {remedy}")
    validate.instance("profiled", "profile", profile, Profile, "give one such as fs.profile.linear(1, 0)")
    values = {field.name: getattr(primitive, field.name) for field in dataclasses.fields(primitive)}
    return kind(**values, profile=profile)
