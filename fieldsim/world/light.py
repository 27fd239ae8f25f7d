"""Lights and backgrounds."""

import dataclasses
import functools
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.types import ColorLike, PathLike, RealLike, VectorLike, WholeLike
from fieldsim.world.color import color_rgb
from fieldsim.world.pixels import Pixels

# Rays towards a light, at most: one pixel with more would delay the answer to Ctrl-C.
MOST_SAMPLES = 1 << 14


@dataclasses.dataclass(frozen=True, kw_only=True)
class Light:
    """What lights share: a colour, an intensity, and whether they cast shadows.

    Brightness does not fall with distance. samples: rays at most towards a light with an extent, whose shadows are
    soft, from 1 to 16384.
    """

    color: ColorLike = "white"
    intensity: float = 1.0
    shadows: bool = True
    samples: int = 16

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            color: ColorLike = ...,
            intensity: RealLike = ...,
            shadows: bool = ...,
            samples: WholeLike = ...,
        ) -> None: ...

    def __post_init__(self):
        color_rgb(type(self).__name__, self.color)
        validate.fields(self, validate.number, "intensity", at_least=0.0)
        validate.fields(self, validate.flag, "shadows")
        validate.fields(self, validate.whole, "samples", at_least=1, at_most=MOST_SAMPLES)

    @property
    def rgb(self) -> tuple[float, float, float]:
        """Linear RGB times intensity."""
        red, green, blue = color_rgb(type(self).__name__, self.color)
        return self.intensity * red, self.intensity * green, self.intensity * blue


@dataclasses.dataclass(frozen=True)
class PointLight(Light):
    """A light at a position. radius: of the ball that shines, which softens shadows; 0: a point."""

    position: tuple[float, float, float]
    radius: float = dataclasses.field(default=0.0, kw_only=True)

    if TYPE_CHECKING:

        def __init__(
            self,
            position: VectorLike,
            *,
            color: ColorLike = ...,
            intensity: RealLike = ...,
            shadows: bool = ...,
            samples: WholeLike = ...,
            radius: RealLike = ...,
        ) -> None: ...

    def __post_init__(self):
        super().__post_init__()
        validate.fields(self, validate.number, "radius", at_least=0.0)
        validate.fields(self, validate.vector, "position")


@dataclasses.dataclass(frozen=True)
class DirectionalLight(Light):
    """A light from far away. direction: the way its rays travel; angle: across which it is seen, in degrees.

    The sun is seen across half a degree; larger angles soften shadows.
    """

    direction: tuple[float, float, float]
    angle: float = dataclasses.field(default=0.0, kw_only=True)

    if TYPE_CHECKING:

        def __init__(
            self,
            direction: VectorLike,
            *,
            color: ColorLike = ...,
            intensity: RealLike = ...,
            shadows: bool = ...,
            samples: WholeLike = ...,
            angle: RealLike = ...,
        ) -> None: ...

    def __post_init__(self):
        super().__post_init__()
        validate.fields(self, validate.number, "angle", at_least=0.0, below=180.0)
        validate.fields(self, validate.direction, "direction")


@dataclasses.dataclass(frozen=True, eq=False)
class Background:
    """What rays that hit nothing see: a gradient from `bottom` (straight down, -z) to `top`, with a share of stars.

    stars: 0 (none) to 1 (dense). image: a picture of all that is around instead, a path or an array (see `Pixels`):
    longitudes across and latitudes down, +z at its top, its middle at +x, +y to the left of it. turn: angle about z by
    which it is turned [rad]; intensity: factor on its brightness. The background also tints the ambient light.
    """

    top: ColorLike = "#1b2440"
    bottom: ColorLike = "#05060c"
    stars: float = 0.3
    image: PathLike | np.ndarray | None = None
    turn: float = 0.0
    intensity: float = 1.0

    if TYPE_CHECKING:

        def __init__(
            self,
            top: ColorLike = ...,
            bottom: ColorLike = ...,
            stars: RealLike = ...,
            image: PathLike | np.ndarray | None = ...,
            turn: RealLike = ...,
            intensity: RealLike = ...,
        ) -> None: ...

    def __post_init__(self):
        color_rgb("Background", self.top, field="top")
        color_rgb("Background", self.bottom, field="bottom")
        validate.fields(self, validate.number, "turn")
        validate.fields(self, validate.number, "stars", "intensity", at_least=0.0)
        self.pixels  # noqa: B018 - checks the image

    @functools.cached_property
    def pixels(self) -> Pixels | None:
        """The picture, or None for a gradient."""
        return None if self.image is None else Pixels("Background", self.image)

    @property
    def rgb_above(self) -> np.ndarray:
        """Linear colour that comes from above, (3,): of a gradient its top's, of a picture the upper half's mean."""
        return self.intensity * (_rgb(self.top) if self.pixels is None else _half_mean(self.pixels, 1.0))

    @property
    def rgb_below(self) -> np.ndarray:
        """Linear colour that comes from below, (3,)."""
        return self.intensity * (_rgb(self.bottom) if self.pixels is None else _half_mean(self.pixels, -1.0))


def _rgb(color):
    return np.array(color_rgb("Background", color))


def _half_mean(pixels, side):
    """Mean of a picture's half, as seen from its middle."""
    rows = pixels.linear.mean(axis=1, dtype=float)
    polar = np.pi * (np.arange(len(rows)) + 0.5) / len(rows)
    weights = np.where(side * np.cos(polar) > -1e-12, np.sin(polar), 0.0)
    return (weights @ rows) / weights.sum()


@dataclasses.dataclass(frozen=True)
class Fog:
    """What dims things with distance: e^(-density distance) of their light is left.

    color: what takes its place; None: what is behind them of the background, into which they fade.
    """

    density: float = 0.1
    color: ColorLike | None = None

    if TYPE_CHECKING:

        def __init__(self, density: RealLike = ..., color: ColorLike | None = ...) -> None: ...

    def __post_init__(self):
        validate.fields(self, validate.number, "density", at_least=0.0)
        if self.color is not None:
            color_rgb("Fog", self.color)


DEFAULT_LIGHTS = (
    DirectionalLight(direction=(-0.5, 0.6, -0.8), color="#fff4e6", intensity=0.95),
    DirectionalLight(direction=(0.8, -0.2, 0.4), color="#8fb0ff", intensity=0.25, shadows=False),
)
