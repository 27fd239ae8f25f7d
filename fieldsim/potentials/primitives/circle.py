"""Full circles."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.potentials.primitives.arc import Arc, Turn, box_of, points_around
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.row import ANGLE, CENTER, FIRST, NORMAL, RADIUS
from fieldsim.types import RealLike, Timed, VectorLike


@dataclasses.dataclass(frozen=True)
class Circle(Turn, Primitive):
    """A full circle about `center`, in the plane across `normal`: an Arc of 2 pi."""

    center: tuple[float, float, float]
    normal: tuple[float, float, float]
    radius: float

    if TYPE_CHECKING:

        def __init__(
            self,
            center: Timed[VectorLike],
            normal: Timed[VectorLike],
            radius: Timed[RealLike],
        ) -> None: ...

    directions = ("normal",)
    part = Arc
    along_rays = "rings"

    def _checked(self):
        return {
            "center": validate.vector("Circle", "center", self.center),
            "normal": validate.direction("Circle", "normal", self.normal),
            "radius": validate.number("Circle", "radius", self.radius, above=0.0),
        }

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest coordinates of the whole circle."""
        return box_of(self.center, self.normal, self.radius)

    @property
    def measure(self) -> float:
        """The circumference."""
        return math.tau * self.radius

    def pack(self, row: np.ndarray) -> None:
        """Write radius, angle, centre, some start and the normal into an element row."""
        row[RADIUS], row[ANGLE] = self.radius, math.tau
        row[CENTER] = self.center
        row[FIRST] = self._start
        row[NORMAL] = self.normal

    @property
    def _start(self):
        """Some unit direction (3,) across the normal."""
        normal = np.array(self.normal)
        start = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        return start / np.linalg.norm(start)

    def mass_points(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Evenly spaced points, the best rule for what closes."""
        return points_around(self, self._start, 2 * math.pi * (np.arange(count) / count)), np.full(count, 1.0 / count)

    def mass_points_needed(self, clearance: float, digits: float) -> float:
        """By the rule for periodic integrands: n points err by exp(-n eta), sinh(eta) = clearance / radius."""
        return digits / math.asinh(clearance / self.radius)
