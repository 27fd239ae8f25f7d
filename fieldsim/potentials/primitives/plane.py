"""Infinite planes."""

import dataclasses

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.row import NORMAL, POINT


@dataclasses.dataclass(frozen=True)
class Plane(Primitive):
    """The infinite plane through `point` with the given normal (of any length)."""

    point: tuple[float, float, float]
    normal: tuple[float, float, float]

    dimension = 2
    points = ("point",)
    directions = ("normal",)

    def _checked(self):
        return {
            "point": validate.vector("Plane", "point", self.point),
            "normal": validate.direction("Plane", "normal", self.normal),
        }

    @property
    def measure(self) -> float:
        """Raises InputError: mass cannot be spread over an infinite area."""
        raise InputError(
            f"{self!r} is of infinite area, where no mass can be spread; give fs.rectangle(...) or fs.disc(...)"
        )

    @property
    def box(self):
        """A plane has none: raises InputError."""
        raise InputError(f"{self}: a plane has no end; clip it with a triangle, or leave it out")

    def pack(self, row):
        """Write point and normal into an element row."""
        row[POINT] = self.point
        row[NORMAL] = self.normal
