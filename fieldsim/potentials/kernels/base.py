"""What a convolution kernel h(r) declares, once, in its own file: all that the rest of fieldsim knows of it.

A kernel is a frozen dataclass with one field, its width, and class attributes, the *traits*:

- `law(r2, width, fold, times)`: portable; h, dh/d(r^2) and times * d2h/d(r^2)^2 at the squared distance r2. Points pass
  times = r2, which keeps their second derivatives finite where d2h/d(r^2)^2 alone overflows; others pass 1. fold is 0
  but for kernels that fold.
- `inverse(level, width)`: where h falls to a level, NumPy; 0 where h is nowhere above it.
- `width_of(radius, b)`: the width from the radius R and the blobbiness B = -b of a material (`potentials.calibration`).
- `line`, `plane`: the field of a whole line and plane, at a distance: a `Whole`, `Diverges` or `FINITE`.
- what its family adds: an inverse power (`PowerLaw`), an end (`Compact`), or, of neither, the methods of `Kernel`.

To add a kernel, write its file: a law, a class with its traits, and `register` for each primitive it is known on (see
`formulas.point.register_points` and `formulas.segment.quadrature.register_segments`, which serve any law). A class that
lacks a trait fails when it is defined. Radau, rigid bodies, contact, bounds, all solvers and calibration then know it.
"""

import dataclasses
import inspect
import math
import typing
from collections.abc import Callable
from typing import Any

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.portable import Portable
from fieldsim.potentials.primitives.base import LEAST, MOST


@dataclasses.dataclass(frozen=True)
class Whole:
    """The field of a whole line or plane: factor(width) times a profile, of the distance from it, that begins at 1.

    inverse(ratio, width): the distance where the profile falls to a ratio. (Unsoftened, it begins at infinity.)
    """

    factor: Callable
    inverse: Callable


@dataclasses.dataclass(frozen=True)
class Diverges:
    """The field of a whole line or plane is infinite.

    slope(strength, softening): of a plane, the greatest slope of its field, which is finite relative to a gauge.
    """

    slope: Callable | None = None


@dataclasses.dataclass(frozen=True)
class Finite:
    """The field of a whole line or plane is finite, and not needed in closed form."""


FINITE = Finite()

_WHOLES = (Whole, Diverges, Finite)
# What a trait is: the number of arguments of a function, or types; and what to give.
_ARGUMENTS = {
    "law": (4, "the portable function (r2, width, fold, times) -> (h, dh/d(r^2), times d2h/d(r^2)^2)"),
    "inverse": (2, "the static method (level, width) -> the distance where h falls to the level"),
    "width_of": (2, "the static method (radius, b) -> the width for a material's radius and blobbiness -b"),
    "log_bend": (1, "the static method (width) -> the greatest -(log h)'' along any ray"),
    "scale_of": (1, "the static method (width) -> the length over which h changes"),
}
_TYPES = {
    "line": (_WHOLES, "Whole(factor, inverse), Diverges() or FINITE"),
    "plane": (_WHOLES, "Whole(factor, inverse), Diverges(slope) or FINITE"),
    "reciprocal": ((bool,), "True where the width is the reciprocal of a length"),
    "power": ((int,), "the m of h ~ (r^2 + softening^2)^(-m/2), a whole number"),
    "steepest": ((int, float), "the greatest slope of sqrt h, in 1 / radius"),
    "sharpest": ((int, float), "the greatest |h''| and |h'| / r, in 1 / radius^2"),
    "root_bend": ((int, float), "the greatest -(sqrt h)'' along any ray, in 1 / radius^2"),
    "square": ((int,), "a whole number, of h = w^2 (square + cube w) / over"),
    "cube": ((int,), "a whole number, of h = w^2 (square + cube w) / over"),
    "over": ((int,), "a whole number, of h = w^2 (square + cube w) / over"),
}


@dataclasses.dataclass(frozen=True)
class Kernel:
    """A radial function h(r); `width` is the one parameter that formulas take. See the module's text."""

    law: typing.ClassVar[Portable]
    line: typing.ClassVar[Whole | Diverges | Finite]
    plane: typing.ClassVar[Whole | Diverges | Finite]
    # Whether the width is the reciprocal of a length; whether h is exp(fold - width^2 r^2).
    reciprocal: typing.ClassVar[bool] = False
    folds: typing.ClassVar[bool] = False
    # What a family declares: see there. unit: how many powers of length h is the reciprocal of.
    power: typing.ClassVar[int] = 0
    unit: typing.ClassVar[int] = 0
    compact: typing.ClassVar[bool] = False

    # Whether it is only what others are made of; what those must declare.
    abstract: typing.ClassVar[bool] = True
    traits: typing.ClassVar[tuple[str, ...]] = (
        *("law", "inverse", "width_of", "line", "plane", "reciprocal"),
        *("log_bend", "scale_of"),
    )

    def __init_subclass__(cls, abstract: bool = False, **options):
        super().__init_subclass__(**options)
        cls.abstract = abstract
        if not abstract:
            for trait in cls.traits:
                _check(cls, trait)

    def __post_init__(self):
        for field in dataclasses.fields(self):
            limit = {"at_least": 0.0} if field.name == "softening" else {"above": 0.0}
            value = validate.number(type(self).__name__, field.name, getattr(self, field.name), **limit)
            # A softening that small is none.
            if value > MOST or (value < LEAST and field.name != "softening"):
                raise InputError(
                    f"{type(self).__name__}: {field.name} is {value:g}, whose powers no number holds; give one from "
                    f"{LEAST:g} to {MOST:g}, in another unit"
                )
            object.__setattr__(self, field.name, value)

    @staticmethod
    def inverse(level: Any, width: Any, /) -> Any:
        """Where h falls to a level; 0 where it is nowhere above. Arrays."""
        raise NotImplementedError

    @staticmethod
    def width_of(radius: float, b: float, /) -> float:
        """The width, from the radius R and the blobbiness -b of a material."""
        raise NotImplementedError

    @staticmethod
    def log_bend(width: Any, /) -> Any:
        """The greatest -(log h)'' along any ray."""
        raise NotImplementedError

    @staticmethod
    def scale_of(width: Any, /) -> Any:
        """The length over which h changes."""
        raise NotImplementedError

    @property
    def width(self) -> float:
        """The kernel's parameter, as packed into element rows."""
        (field,) = dataclasses.fields(self)
        return getattr(self, field.name)

    @classmethod
    def whole(cls, dimension: int) -> Whole | Diverges | Finite:
        """What is known of the field of a point (finite), a whole line, or a whole plane (and of what is solid)."""
        return (FINITE, cls.line, cls.plane, cls.plane)[dimension]

    def calibrated(self, radius: float, dimension: int) -> tuple[float, float] | None:
        """(strength, fold) that put F = 1 at `radius` from a point, line or plane; None: by its field at `radius`."""
        return None

    @property
    def short_reach(self) -> float:
        """How far beyond its centre it pulls, where a step might leap over that; inf for a field without end."""
        return math.inf


@dataclasses.dataclass(frozen=True)
class PowerLaw(Kernel, abstract=True):
    """h = (r^2 + softening^2)^(-power / 2), of unit `power`; with a reciprocal width 1 / softening, 1 in the middle."""

    traits = ("law", "inverse", "width_of", "line", "plane", "reciprocal", "power")

    def __init_subclass__(cls, abstract: bool = False, **options):
        super().__init_subclass__(abstract=abstract, **options)
        if not abstract:
            cls.unit = 0 if cls.reciprocal else cls.power
            if cls.power < 1 or cls.unit > 2:
                raise InputError(
                    f"{cls.__name__}: power is {cls.power}; give 1 or 2, or a whole number and a reciprocal width"
                )

    @classmethod
    def softening_of(cls, width: float) -> float:
        """The softening, from the width."""
        return 1.0 / width if cls.reciprocal else width

    @classmethod
    def scale_of(cls, width: float) -> float:
        """The length over which h changes: the softening."""
        return cls.softening_of(width)

    @staticmethod
    def log_bend(width: float) -> float:
        """0: these bend as power / (distance^2 + softening^2), which is bounded where that is known."""
        return 0.0


@dataclasses.dataclass(frozen=True)
class Compact(Kernel, abstract=True):
    """A kernel that ends at its radius, the width: 0 from there on, with its first derivative."""

    steepest: typing.ClassVar[float]
    sharpest: typing.ClassVar[float]
    root_bend: typing.ClassVar[float]
    compact = True
    line = plane = FINITE
    # It changes over this share of its radius as a Gaussian does over 1 / a: less than their half maxima compare.
    share: typing.ClassVar[float] = 0.4
    traits = ("law", "inverse", "width_of", "line", "plane", "steepest", "sharpest", "root_bend")

    @classmethod
    def scale_of(cls, width: float) -> float:
        """The length over which h changes."""
        return cls.share * width

    @property
    def short_reach(self) -> float:
        """See `Kernel.short_reach`."""
        return self.width


def half_maximum(radius: float, b: float) -> float:
    """Where the Gaussian of a material has half its maximum: R sqrt(ln 2 / b)."""
    return radius * math.sqrt(math.log(2.0) / b)


def distance(square):
    """The root of a square that may be negative, which is none: NumPy."""
    return np.sqrt(np.maximum(square, 0.0))


def _count(function) -> int:
    """How many arguments a function takes."""
    return len(inspect.signature(getattr(function, "function", function)).parameters)


def _check(kernel, trait):
    """Raise InputError for a trait that is missing or of a wrong shape."""
    value: Any = getattr(kernel, trait, None)
    if trait in _ARGUMENTS:
        count, remedy = _ARGUMENTS[trait]
        # What `Kernel` itself has is only the place.
        missing = value is None or value is getattr(Kernel, trait, None)
        fits = isinstance(value, Portable) if trait == "law" else callable(value)
        fits = fits and _count(value) == count
    else:
        types, remedy = _TYPES[trait]
        missing, fits = value is None, isinstance(value, types)
    if missing:
        raise InputError(f"{kernel.__name__}: the kernel declares no {trait!r}; give {remedy}")
    if not fits:
        raise InputError(f"{kernel.__name__}: {trait} is {validate.shown(value)}; give {remedy}")
