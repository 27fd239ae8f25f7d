"""Full circles."""

import dataclasses
import math

import numpy as np

from fieldsim import validate
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.row import ANGLE, CENTER, FIRST, NORMAL, RADIUS


@dataclasses.dataclass(frozen=True)
class Circle(Primitive):
    """A full circle about `center`, in the plane across `normal`: an Arc of 2 pi."""

    center: tuple[float, float, float]
    normal: tuple[float, float, float]
    radius: float

    dimension = 1
    points = ("center",)
    directions = ("normal",)

    def _checked(self):
        return {
            "center": validate.vector("Circle", "center", self.center),
            "normal": validate.direction("Circle", "normal", self.normal),
            "radius": validate.number("Circle", "radius", self.radius, above=0.0),
        }

    @property
    def measure(self) -> float:
        """The circumference."""
        return math.tau * self.radius

    @property
    def box(self):
        """Least and greatest coordinates of the whole circle."""
        reach = self.radius * np.sqrt(np.maximum(0.0, 1.0 - np.square(self.normal)))
        return np.subtract(self.center, reach), np.add(self.center, reach)

    def pack(self, row):
        """Write radius, angle, centre, some start and the normal into an element row."""
        normal = np.array(self.normal)
        start = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        row[RADIUS], row[ANGLE] = self.radius, math.tau
        row[CENTER] = self.center
        row[FIRST] = start / np.linalg.norm(start)
        row[NORMAL] = normal
