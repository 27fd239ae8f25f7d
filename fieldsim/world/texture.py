"""Solid textures: colours that vary with the place in a body's frame, as if it were carved from the stuff.

A texture blends two colours; where bodies melt together their textures melt as their colours do.
"""

import dataclasses
from typing import ClassVar

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.world.color import color_rgb


@dataclasses.dataclass(frozen=True)
class Texture:
    """From `color` to `other` (see `color_rgb`), with features of the size `scale`, in the body's units."""

    color: object = "bone"
    other: object = "ink"
    scale: float = 0.2

    kind: ClassVar[int]

    def __post_init__(self):
        name = type(self).__name__
        for field in ("color", "other"):
            color_rgb(name, getattr(self, field))
        object.__setattr__(self, "scale", validate.number(name, "scale", self.scale, above=0.0))
        if hasattr(self, "turbulence"):
            object.__setattr__(self, "turbulence", validate.number(name, "turbulence", self.turbulence, at_least=0.0))
        if hasattr(self, "seed") and (not isinstance(self.seed, int) or isinstance(self.seed, bool)):
            raise InputError(f"{name}: seed is {self.seed!r}; give a whole number")

    @property
    def row(self) -> tuple[float, ...]:
        """Kind, linear rgb of `other`, scale, turbulence, seed: as `textures` reads them; 7 numbers."""
        name = type(self).__name__
        return (
            float(self.kind),
            *color_rgb(name, self.other),
            self.scale,
            getattr(self, "turbulence", 0.0),
            float(getattr(self, "seed", 0) % 65536),
        )


@dataclasses.dataclass(frozen=True)
class Checker(Texture):
    """Cubes of the two colours in turn, `scale` across."""

    kind = 1


@dataclasses.dataclass(frozen=True)
class Clouds(Texture):
    """Four octaves of noise, the largest `scale` across."""

    seed: int = 0

    kind = 2


@dataclasses.dataclass(frozen=True)
class Marble(Texture):
    """Layers across x, `scale` apart, folded by noise: the more so, the greater `turbulence`."""

    turbulence: float = 1.0
    seed: int = 0

    kind = 3


@dataclasses.dataclass(frozen=True)
class Wood(Texture):
    """Rings about the z axis, `scale` apart, uneven by `turbulence`."""

    turbulence: float = 0.3
    seed: int = 0

    kind = 4
