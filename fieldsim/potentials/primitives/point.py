"""Points."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.primitives.base import Primitive, Volume
from fieldsim.potentials.row import POINT, point_of
from fieldsim.types import Timed, VectorLike


@portable
def point_distance(x: real, y: real, z: real, rows: Table, i: int):
    """Distance to a point."""
    px, py, pz = point_of(rows, i)
    dx = x - px
    dy = y - py
    dz = z - pz
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@portable
def point_foot(x: real, y: real, z: real, rows: Table, i: int):
    """The point."""
    return point_of(rows, i)


@dataclasses.dataclass(frozen=True)
class Point(Primitive):
    """A point source."""

    position: tuple[float, float, float]

    if TYPE_CHECKING:

        def __init__(self, position: Timed[VectorLike]) -> None: ...

    points = ("position",)
    dimension = 0
    measure = 1.0
    volume = Volume.BALL
    distance = point_distance
    feet = (point_foot,)
    straight = False
    nearby = 1.0
    corners = 1
    along_rays = "points"

    def _checked(self):
        return {"position": validate.vector("Point", "position", self.position)}

    def pack(self, row: np.ndarray) -> None:
        """Write the position into an element row."""
        row[POINT] = self.position

    def beside(self, radius: float) -> np.ndarray:
        """Above it."""
        return np.add(self.position, (0.0, 0.0, radius))

    def mass_points(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Itself."""
        return np.array([self.position]), np.ones(1)

    def mass_points_needed(self, clearance: float, digits: float) -> float:
        """One."""
        return 1.0

    @staticmethod
    def row_measure(rows: np.ndarray) -> np.ndarray:
        """1 each."""
        return np.ones(rows.shape[:-1])

    @staticmethod
    def row_middle(row: np.ndarray) -> np.ndarray:
        """The point."""
        return row[POINT]

    @staticmethod
    def row_box(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The point, twice."""
        return rows[:, POINT], rows[:, POINT]

    @staticmethod
    def row_places(rows: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The point, whatever the parameters."""
        return rows[:, POINT]
