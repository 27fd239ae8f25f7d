"""Lights and backgrounds."""

import dataclasses

from fieldsim import validate
from fieldsim.world.color import color_rgb


@dataclasses.dataclass(frozen=True)
class Light:
    """What lights share: a colour, an intensity, and whether they cast shadows.

    Brightness does not fall with distance.
    """

    color: object = "white"
    intensity: float = 1.0
    shadows: bool = True

    def __post_init__(self):
        color_rgb(type(self).__name__, self.color)
        value = validate.number(type(self).__name__, "intensity", self.intensity, at_least=0.0)
        object.__setattr__(self, "intensity", value)

    @property
    def rgb(self) -> tuple[float, float, float]:
        """Linear RGB times intensity."""
        return tuple(self.intensity * c for c in color_rgb(type(self).__name__, self.color))


@dataclasses.dataclass(frozen=True, kw_only=True)
class PointLight(Light):
    """A light at a position."""

    position: tuple[float, float, float]

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "position", validate.vector("PointLight", "position", self.position))


@dataclasses.dataclass(frozen=True, kw_only=True)
class DirectionalLight(Light):
    """A light from far away. direction: the way its rays travel."""

    direction: tuple[float, float, float]

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "direction", validate.direction("DirectionalLight", "direction", self.direction))


@dataclasses.dataclass(frozen=True)
class Background:
    """What rays that hit nothing see: a gradient from `bottom` (straight down, -z) to `top`, with a share of stars.

    stars: 0 (none) to 1 (dense). The background also tints the ambient light.
    """

    top: object = "#1b2440"
    bottom: object = "#05060c"
    stars: float = 0.3

    def __post_init__(self):
        color_rgb("Background", self.top)
        color_rgb("Background", self.bottom)
        validate.number("Background", "stars", self.stars, at_least=0.0)


DEFAULT_LIGHTS = (
    DirectionalLight(direction=(-0.5, 0.6, -0.8), color="#fff4e6", intensity=0.95),
    DirectionalLight(direction=(0.8, -0.2, 0.4), color="#8fb0ff", intensity=0.25, shadows=False),
)
