"""What every primitive of a skeleton shares: frozen fields that may be functions of time."""

import dataclasses
import functools
import typing

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError

# Lengths within which fields are right to rounding: their fourth powers are numbers.
LEAST, MOST = 1e-60, validate.FARTHEST


@dataclasses.dataclass(frozen=True)
class Primitive:
    """A piece of a skeleton. Any field may be a number (or vector) or a function of time giving one.

    A primitive whose fields are all plain values is *concrete*: it is checked when made, and only it can be packed.
    points, directions: names of the fields that move along, and of those that only turn, with the frame they are in.
    """

    points: typing.ClassVar[tuple[str, ...]]
    directions: typing.ClassVar[tuple[str, ...]] = ()
    # Whether its field under 1/r is that of a mass spread over it.
    carries_mass: typing.ClassVar[bool] = True

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

    def at(self, time: float) -> "Primitive":
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

    def turns_about(self, point, axis) -> bool:
        """Whether a turn about the line through `point` along the unit vector `axis` leaves all as it is.

        It does where all points lie on the line and all directions along it: a Point, a Segment or a Circle there.
        """
        point = validate.vector("turns_about", "point", point)
        axis = validate.direction("turns_about", "axis", axis)
        offsets = np.array([getattr(self, name) for name in self.points]) - point
        along = [np.array(getattr(self, name)) for name in self.directions]
        size = 1e-12 * (np.abs(offsets).max() + np.abs(point).max())
        on_it = np.linalg.norm(np.cross(offsets, axis), axis=1).max() <= size
        return bool(on_it and all(np.linalg.norm(np.cross(way, axis)) <= 1e-12 for way in along))

    def pack(self, row) -> None:
        """Write the geometry into an element row (see `potentials.row`)."""
        raise NotImplementedError

    @property
    def measure(self) -> float:
        """Arc length, area, or 1 for a point: what mass is spread over."""
        raise NotImplementedError

    @property
    def dimension(self) -> int:
        """0 for a point, 1 for a curve, 2 for a surface."""
        raise NotImplementedError
