"""Textures: colours that vary over a surface, solid ones and pictures.

A solid texture varies with the place in a body's frame, as if the body were carved from the stuff. A picture is wrapped
around each primitive by itself, and where primitives melt together so do their pictures, each by the weight of its
field (Sherstyuk 1999, 4.2.5): there are no seams.
"""

import dataclasses
import functools
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.types import ColorLike, PathLike, RealLike, Vector, VectorLike, WholeLike
from fieldsim.world.color import color_rgb
from fieldsim.world.pixels import Pixels


class Texture:
    """What a material may have in place of a colour."""

    # Its number in the renderer's tables; 0 is a plain colour.
    kind: ClassVar[int]

    @property
    def rgb(self) -> Vector:
        """One linear colour that stands for it."""
        raise NotImplementedError


@dataclasses.dataclass(frozen=True)
class SolidTexture(Texture):
    """From `color` to `other` (see `color_rgb`), with features of the size `scale`, in the body's units."""

    color: ColorLike = "bone"
    other: ColorLike = "ink"
    scale: float = 0.2

    if TYPE_CHECKING:

        def __init__(self, color: ColorLike = ..., other: ColorLike = ..., scale: RealLike = ...) -> None: ...

    def __post_init__(self):
        name = type(self).__name__
        for field in ("color", "other"):
            color_rgb(name, getattr(self, field), field=field)
        validate.fields(self, validate.number, "scale", above=0.0)
        if hasattr(self, "turbulence"):
            validate.fields(self, validate.number, "turbulence", at_least=0.0)
        if hasattr(self, "seed"):
            validate.fields(self, validate.whole, "seed")

    @property
    def rgb(self) -> Vector:
        """Its first colour."""
        return color_rgb(type(self).__name__, self.color)


@dataclasses.dataclass(frozen=True)
class Checker(SolidTexture):
    """Cubes of the two colours in turn, `scale` across."""

    if TYPE_CHECKING:

        def __init__(self, color: ColorLike = ..., other: ColorLike = ..., scale: RealLike = ...) -> None: ...

    kind = 1


@dataclasses.dataclass(frozen=True)
class Clouds(SolidTexture):
    """Four octaves of noise, the largest `scale` across."""

    seed: int = 0

    if TYPE_CHECKING:

        def __init__(
            self,
            color: ColorLike = ...,
            other: ColorLike = ...,
            scale: RealLike = ...,
            seed: WholeLike = ...,
        ) -> None: ...

    kind = 2


@dataclasses.dataclass(frozen=True)
class Marble(SolidTexture):
    """Layers across x, `scale` apart, folded by noise: the more so, the greater `turbulence`."""

    turbulence: float = 1.0
    seed: int = 0

    if TYPE_CHECKING:

        def __init__(
            self,
            color: ColorLike = ...,
            other: ColorLike = ...,
            scale: RealLike = ...,
            turbulence: RealLike = ...,
            seed: WholeLike = ...,
        ) -> None: ...

    kind = 3


@dataclasses.dataclass(frozen=True)
class Wood(SolidTexture):
    """Rings about the z axis, `scale` apart, uneven by `turbulence`."""

    turbulence: float = 0.3
    seed: int = 0

    if TYPE_CHECKING:

        def __init__(
            self,
            color: ColorLike = ...,
            other: ColorLike = ...,
            scale: RealLike = ...,
            turbulence: RealLike = ...,
            seed: WholeLike = ...,
        ) -> None: ...

    kind = 4


# What strings stand for, beside colours.
NAMED = {"checker": Checker, "clouds": Clouds, "marble": Marble, "wood": Wood}


@dataclasses.dataclass(frozen=True, eq=False)
class ImageTexture(Texture):
    """A picture wrapped around each primitive, or around a hard shape.

    image: a path, or an array (H, W, 3), uint8 or sRGB floats in 0..1 (see `Pixels`). repeat: how often it fits, along
    (u, v). u runs to the right of the picture and v down, as seen from outside:

    | on | u | v |
    |---|---|---|
    | Point, Ball, Ellipsoid | longitude about z, east; the picture's middle at +x | latitude, from the north |
    | Segment, Capsule, Cylinder | along, from the start to the end | around the axis |
    | Arc, Circle | along, from the start to the end | around the tube; the picture's middle at the outer equator |
    | Triangle | in its plane, from its first corner; a picture per unit of length | likewise |
    | Plane, Ground | in its plane, from its point; a picture per unit of length | likewise |
    | Box | across each face, those at the sides upright | down it |
    | TriangleSurface | as on a ball about the middle of its box | |

    Beyond the ends of a segment or an arc its first and last column continue. Axes within the plane of a triangle or a
    plane depend on its normal alone, so that triangles about one corner (`fs.rectangle`, `fs.disc`) share a picture.
    All this is in the frame of the body, which carries its texture along.
    """

    image: PathLike | np.ndarray
    repeat: tuple[float, float] = (1.0, 1.0)

    if TYPE_CHECKING:

        def __init__(self, image: PathLike | np.ndarray, repeat: VectorLike = ...) -> None: ...

    kind = 5

    def __post_init__(self):
        remedy = "give two numbers (u, v) above 0"
        repeat = validate.numbers("ImageTexture", "repeat", self.repeat, shape=(2,), remedy=remedy)
        if not (repeat > 0.0).all():
            raise InputError(f"ImageTexture: repeat is {tuple(repeat.tolist())}; {remedy}")
        object.__setattr__(self, "repeat", tuple(repeat.tolist()))
        self.pixels  # noqa: B018 - checks the image

    @functools.cached_property
    def pixels(self) -> Pixels:
        """The picture."""
        return Pixels("ImageTexture", self.image)

    @property
    def rgb(self) -> Vector:
        """Its mean colour."""
        return self.pixels.mean
