"""What every primitive of a skeleton shares: frozen fields that may be functions of time, and declared traits.

A subclass declares once, in its own file, all that the rest of the package knows of it; no other file keeps a table of
primitives. Functions that start with `row_` are static and take packed rows (see `potentials.row`), by which the many
elements of a scene are looked at together.
"""

import dataclasses
import enum
import functools
import typing

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.portable import Portable
from fieldsim.potentials.row import NORMAL, POSITIONS, ROW_WIDTH
from fieldsim.types import RealLike, VectorLike

# Lengths within which fields are right to rounding: their fourth powers are numbers.
LEAST, MOST = 1e-60, validate.FARTHEST


class Volume(enum.IntEnum):
    """What lies within a distance of a primitive: its bounding volume, and the solid it is drawn as when drawn hard.

    The renderer knows each volume once: how a ray pierces it, how it is drawn, how a picture lies around it. It reads
    where the volume is from columns of the row, which `pack` writes (see `potentials.row`).
    """

    BALL = 0  # around POINT
    CAPSULE = 1  # from START to END
    TUBE = 2  # around an arc: CENTER, FIRST, NORMAL, RADIUS, ANGLE
    PRISM = 3  # around a triangle, with round edges: CORNER_A, CORNER_B, CORNER_C, NORMAL, AREA
    SLAB = 4  # on both sides of the plane through POINT across NORMAL


# Types of the traits that are values.
_TYPES = {
    "points": tuple,
    "dimension": int,
    "volume": Volume,
    "distance": Portable | None,
    "feet": tuple,
    "straight": bool,
    "nearby": int | float,
    "corners": int,
}


@dataclasses.dataclass(frozen=True)
class Primitive:
    """A piece of a skeleton. Any field may be a number (or vector) or a function of time giving one.

    A primitive whose fields are all plain values is *concrete*: it is checked when made, and only it can be packed.
    A subclass without one of the traits in REQUIRED is refused when its class is defined; the others have defaults.
    """

    REQUIRED: typing.ClassVar[dict[str, str]] = {
        "points": "the names of the fields that are positions, such as ('start', 'end')",
        "dimension": "0 for a point, 1 for a curve, 2 for a surface, 3 for a solid",
        "measure": "a property: its length, area or volume, or 1 for a point",
        "volume": "the Volume that all within a distance of it fills, such as Volume.CAPSULE",
        "distance": "a portable (x, y, z, rows, i) -> distance to row i's primitive; None where it bounds no field",
        "feet": "a tuple of portables (x, y, z, rows, i) -> the nearest point of row i's primitive; () if none",
        "straight": "whether it is a piece of a whole line or plane",
        "nearby": "the greatest measure of it within a distance of 1 of any point",
        "corners": "how many of a row's three positions are corners of it, 1 to 3",
        "_checked": "a method: its fields' values, checked and normalised",
        "pack": "a method (row) that writes its geometry into an element row",
        "row_measure": "a static function (rows (..., ROW_WIDTH)) -> its measures (...,)",
        "row_middle": "a static function (row (ROW_WIDTH,)) -> its middle (3,)",
        "row_box": "a static function (rows (N, ROW_WIDTH)) -> least and greatest coordinates, each (N, 3)",
        "row_places": "a static function (rows (N, ROW_WIDTH), u, v) -> its points (N, 3) at parameters from 0 to 1",
        "beside": "a method (radius) -> the point (3,) at that distance beside its middle",
        "mass_points": "a method (count) -> points (n, 3) and weights (n,) of sum 1, `count` along each dimension",
        "mass_points_needed": "a method (clearance, digits) -> how many along each dimension give its pull, see there",
    }

    # Names of the fields that are positions, and of those that are directions, in the frame of its body.
    points: typing.ClassVar[tuple[str, ...]]
    directions: typing.ClassVar[tuple[str, ...]] = ()
    dimension: typing.ClassVar[int]
    volume: typing.ClassVar[Volume]
    # None where the field is not bounded by the distance: such a primitive can neither be drawn soft nor touched.
    distance: typing.ClassVar[Portable | None]
    # The first gives the nearest point, the others points from where a search finds all that are nearest of those
    # around them; a convex primitive has one.
    feet: typing.ClassVar[tuple[Portable, ...]]
    # A portable like those: where a search for its surface goes that finds no field beside a foot; None: to the foot.
    inner: typing.ClassVar[Portable | None] = None
    # Whether it is a piece of a whole line or plane, so that its field is no more than theirs where `uniform`.
    straight: typing.ClassVar[bool]
    nearby: typing.ClassVar[float]
    corners: typing.ClassVar[int]
    # Whether it is all at the distance SIZE from the one position in its row.
    round: typing.ClassVar[bool] = False
    # Whether it has no end.
    endless: typing.ClassVar[bool] = False
    # Whether its density is 1 everywhere.
    uniform: typing.ClassVar[bool] = True
    # Whether a profile multiplies its field, which then is not that of a mass spread over it.
    profiled: typing.ClassVar[bool] = False
    # The power of length that a row's column ANGLE is in: 0 for an angle, 1 for a length, 2 for an area.
    second_unit: typing.ClassVar[int] = 0
    # The primitive that a part of a curve is, see `row_part`; None: parts of it are not known.
    part: typing.ClassVar[type["Primitive"] | None] = None
    # The closed form of its Gaussian field along a ray, of KINDS in `packet.gaussian_elements`; "" where there is none.
    along_rays: typing.ClassVar[str] = ""

    def __init_subclass__(cls, **options):
        super().__init_subclass__(**options)
        for name, what in cls.REQUIRED.items():
            # What only Primitive itself has is its declaration.
            if not any(name in vars(one) for one in cls.__mro__ if one is not Primitive):
                raise InputError(f"class {cls.__name__} lacks the trait {name!r}; define {name}, {what}")
            if name in _TYPES and not isinstance(getattr(cls, name), _TYPES[name]):
                raise InputError(f"class {cls.__name__}: {name} is {validate.shown(getattr(cls, name))}; give {what}")

    def __post_init__(self):
        if self.animated:
            return
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            values = self._checked()
        self._refuse_extremes(values)
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _refuse_extremes(self, values):
        """Raise InputError for lengths whose powers no float holds."""
        owner = type(self).__name__
        lengths = {k: v for k, v in values.items() if k not in self.directions and isinstance(v, float | tuple)}
        for name, value in lengths.items():
            if max(map(abs, value if isinstance(value, tuple) else (value,))) > MOST:
                raise InputError(
                    f"{owner}: {name} is {value}, and powers of such lengths overflow; give lengths of at most "
                    f"{MOST:g}, in another unit"
                )
        corners = [values[name] for name in self.points]
        size = values.get("radius", max(abs(x - y) for p in corners for x, y in zip(p, corners[0], strict=True)))
        if (len(corners) > 1 or "radius" in values) and size < LEAST:
            raise InputError(
                f"{owner}: its size is {size:g}, whose powers no number holds; give one of at least {LEAST:g}, in "
                "another unit"
            )

    @property
    def animated(self) -> bool:
        """Whether some field is a function of time."""
        return any(callable(getattr(self, field.name)) for field in dataclasses.fields(self))

    def at(self, time: RealLike) -> typing.Self:
        """The concrete primitive at `time`; itself where nothing is animated."""
        time = validate.number(type(self).__name__, "time", time)
        if not self.animated:
            return self
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        return validate.at_time(type(self).__name__, functools.partial(dataclasses.replace, self), values, time)

    def _checked(self) -> dict:
        """The fields' values, checked and normalised; raises InputError."""
        raise NotImplementedError

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest coordinates, each (3,); raises InputError for one without end."""
        corners = np.array([getattr(self, name) for name in self.points])
        return corners.min(axis=0), corners.max(axis=0)

    def turns_about(self, point: VectorLike, axis: VectorLike) -> bool:
        """Whether a turn about the line through `point` along the unit vector `axis` leaves all as it is.

        It does where all points lie on the line and all directions along it, as of a circle about it.
        """
        point = validate.vector("turns_about", "point", point)
        axis = validate.direction("turns_about", "axis", axis)
        offsets = np.array([getattr(self, name) for name in self.points]) - point
        along = [np.array(getattr(self, name)) for name in self.directions]
        size = 1e-12 * (np.abs(offsets).max() + np.abs(point).max())
        on_it = np.linalg.norm(np.cross(offsets, axis), axis=1).max() <= size
        return bool(on_it and all(np.linalg.norm(np.cross(way, axis)) <= 1e-12 for way in along))

    def plain(self) -> "Primitive":
        """The primitive without its profile."""
        return self

    @property
    def packed(self) -> np.ndarray:
        """Its geometry as an element row (ROW_WIDTH,), without kernel and strength."""
        row = np.zeros(ROW_WIDTH)
        self.pack(row)
        return row

    @property
    def measure(self) -> float:
        """Arc length, area, volume, or 1 for a point: what mass is spread over."""
        raise NotImplementedError

    def pack(self, row: np.ndarray) -> None:
        """Write the geometry into an element row (see `potentials.row`)."""
        raise NotImplementedError

    def beside(self, radius: float) -> np.ndarray:
        """The point (3,) at the distance `radius` beside its middle, where its field alone is measured."""
        raise NotImplementedError

    def mass_points(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, 3) and weights (n,), of sum 1, of a mass spread over it, `count` along each of its dimensions.

        Moments of the mass are exact as more are taken, polynomials up to the degree 2 count - 1 at once on all that
        is straight.
        """
        raise NotImplementedError

    def mass_points_needed(self, clearance: float, digits: float) -> float:
        """Mass points along each dimension that give its pull on what is `clearance` away to exp(-digits), relative."""
        raise NotImplementedError

    @staticmethod
    def row_measure(rows: np.ndarray) -> np.ndarray:
        """Measures (...,) of packed rows (..., ROW_WIDTH)."""
        raise NotImplementedError

    @staticmethod
    def row_middle(row: np.ndarray) -> np.ndarray:
        """The middle (3,) of a packed row (ROW_WIDTH,)."""
        raise NotImplementedError

    @staticmethod
    def row_box(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest coordinates, each (N, 3), of packed rows (N, ROW_WIDTH)."""
        raise NotImplementedError

    @staticmethod
    def row_places(rows: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Points (N, 3) of packed rows (N, ROW_WIDTH) at parameters (N, 1) from 0 to 1.

        u runs along a curve; on a triangle u and v, u + v <= 1, run along two edges. Places are continuous in u and v:
        meshes halve the parameters until pieces are shorter than the surface is deep.
        """
        raise NotImplementedError

    @classmethod
    def row_density(cls, rows: np.ndarray, u: np.ndarray) -> np.ndarray:
        """What of the measure of packed rows (N, ROW_WIDTH) of curves is at parameters (N, Q), per change of these."""
        return np.broadcast_to(cls.row_measure(rows)[:, None], u.shape)

    @staticmethod
    def row_part(rows: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Rows (N, ROW_WIDTH) of the parts of curves between parameters (N,) of `row_places`; of the class `part`."""
        raise NotImplementedError

    @staticmethod
    def row_crossing(rows: np.ndarray, axis: int, plane: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Parameters (N,) between begin and end (N,) where curves cross planes (N,) across an axis; nan: nowhere."""
        raise NotImplementedError

    @staticmethod
    def row_factor(rows: np.ndarray) -> float | np.ndarray:
        """No less than what a profile multiplies the field of packed rows (..., ROW_WIDTH) with, in size."""
        return 1.0

    @staticmethod
    def row_factor_bend(rows: np.ndarray) -> float | np.ndarray:
        """How sharply the profiles of packed rows (..., ROW_WIDTH) bend log F, in 1 / length^2."""
        return 0.0


def above(primitive: Primitive, radius: float) -> np.ndarray:
    """`Primitive.beside` of what has a normal: above its middle, along the normal."""
    row = primitive.packed
    return primitive.row_middle(row) + radius * row[NORMAL]


def row_corners(rows: np.ndarray, count: int) -> np.ndarray:
    """The first `count` positions of packed rows (N, ROW_WIDTH), (N, count, 3)."""
    return rows[:, POSITIONS].reshape(-1, 3, 3)[:, :count]
