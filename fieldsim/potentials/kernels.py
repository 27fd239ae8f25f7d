"""Convolution kernels h(r), as frozen values. Lengths are in scene units."""

import dataclasses

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitive import LEAST, MOST


@dataclasses.dataclass(frozen=True)
class Kernel:
    """A radial function h(r); `width` is the one parameter that the cells' formulas take."""

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

    @property
    def width(self) -> float:
        """The kernel's parameter, as packed into element rows."""
        (field,) = dataclasses.fields(self)
        return getattr(self, field.name)


@dataclasses.dataclass(frozen=True)
class Cauchy(Kernel):
    """h(r) = 1 / (1 + s^2 r^2)^2 (Sherstyuk 1999, 2.3.1)."""

    s: float = 1.0


@dataclasses.dataclass(frozen=True)
class Gaussian(Kernel):
    """h(r) = exp(-a^2 r^2) (Blinn 1982)."""

    a: float = 1.0


@dataclasses.dataclass(frozen=True)
class Newtonian(Kernel):
    """h(r) = 1 / sqrt(r^2 + softening^2): gravity."""

    softening: float = 0.0


@dataclasses.dataclass(frozen=True)
class InverseSquare(Kernel):
    """h(r) = 1 / (r^2 + softening^2) (electrostatics of lines; Wyvill & van Overveld 1996)."""

    softening: float = 0.0


@dataclasses.dataclass(frozen=True)
class Metaball(Kernel):
    """h(r) = 1 - 3 u^2 for u <= 1/3, 3/2 (1 - u)^2 for u <= 1, then 0, with u = r / radius (Nishimura et al. 1985)."""

    radius: float = 1.0


@dataclasses.dataclass(frozen=True)
class SoftObject(Kernel):
    """h(r) = 1 - 22/9 u^2 + 17/9 u^4 - 4/9 u^6 for u <= 1, then 0, with u = r / radius (Wyvill et al. 1986)."""

    radius: float = 1.0


@dataclasses.dataclass(frozen=True)
class Quartic(Kernel):
    """h(r) = (1 - u^2)^2 for u <= 1, then 0, with u = r / radius."""

    radius: float = 1.0


# Kernels that end at their radius.
COMPACT = (Metaball, SoftObject, Quartic)
