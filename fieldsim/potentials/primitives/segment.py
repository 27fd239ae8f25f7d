"""Straight segments."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.primitives.base import Primitive, Volume, row_corners
from fieldsim.potentials.primitives.quadrature import simplex, simplex_needed
from fieldsim.potentials.row import AXIS, END, LENGTH, START, axis_of, start_of
from fieldsim.types import Timed, VectorLike


@portable
def segment_distance(x: real, y: real, z: real, rows: Table, i: int):
    """Distance to a segment."""
    px, py, pz = start_of(rows, i)
    dx = x - px
    dy = y - py
    dz = z - pz
    ax, ay, az = axis_of(rows, i)
    along = dx * ax + dy * ay + dz * az
    along = min(max(along, real(0.0)), rows[i, LENGTH])
    dx -= along * ax
    dy -= along * ay
    dz -= along * az
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@portable
def segment_foot(x: real, y: real, z: real, rows: Table, i: int):
    """The nearest point of a segment."""
    px, py, pz = start_of(rows, i)
    ax, ay, az = axis_of(rows, i)
    along = (x - px) * ax + (y - py) * ay + (z - pz) * az
    along = min(max(along, real(0.0)), rows[i, LENGTH])
    return px + along * ax, py + along * ay, pz + along * az


@dataclasses.dataclass(frozen=True)
class Segment(Primitive):
    """A straight segment between two different points."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]

    if TYPE_CHECKING:

        def __init__(self, start: Timed[VectorLike], end: Timed[VectorLike]) -> None: ...

    points = ("start", "end")
    dimension = 1
    volume = Volume.CAPSULE
    distance = segment_distance
    feet = (segment_foot,)
    straight = True
    nearby = 2.0
    corners = 2
    along_rays = "segments"

    def _checked(self) -> dict:
        owner = type(self).__name__
        start = validate.vector(owner, "start", self.start)
        end = validate.vector(owner, "end", self.end)
        if math.dist(start, end) == 0.0:
            raise InputError(f"{owner}: start and end are both {_plain(start)}; give two different points or use Point")
        return {"start": start, "end": end}

    @property
    def measure(self) -> float:
        """The length."""
        return math.dist(self.start, self.end)

    def pack(self, row: np.ndarray) -> None:
        """Write length, ends and axis into an element row."""
        length = math.dist(self.start, self.end)
        row[LENGTH] = length
        row[START] = self.start
        row[END] = self.end
        row[AXIS] = np.subtract(self.end, self.start) / length

    def beside(self, radius: float) -> np.ndarray:
        """Beside its middle, across the axis."""
        row = self.packed
        axis = row[AXIS]
        aside = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        return self.row_middle(row) + radius * aside / np.linalg.norm(aside)

    def mass_points(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss's rule."""
        points, shares, _ = simplex([self.start, self.end], count)
        return points, shares / shares.sum()

    def mass_points_needed(self, clearance: float, digits: float) -> float:
        """By its length."""
        return simplex_needed([self.start, self.end], clearance, digits)

    @staticmethod
    def row_measure(rows: np.ndarray) -> np.ndarray:
        """The lengths."""
        return rows[..., LENGTH]

    @staticmethod
    def row_middle(row: np.ndarray) -> np.ndarray:
        """Halfway between the ends."""
        return 0.5 * (row[START] + row[END])

    @staticmethod
    def row_box(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Around both ends."""
        corners = row_corners(rows, 2)
        return corners.min(axis=1), corners.max(axis=1)

    @staticmethod
    def row_places(rows: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """From start to end, u of the way."""
        start = rows[:, START]
        return start + u * (rows[:, END] - start)

    @staticmethod
    def row_part(rows: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """See `Primitive.row_part`."""
        parts, way = rows.copy(), rows[:, END] - rows[:, START]
        parts[:, START] += begin[:, None] * way
        parts[:, END] -= (1.0 - end)[:, None] * way
        parts[:, LENGTH] *= end - begin
        return parts

    @staticmethod
    def row_crossing(rows: np.ndarray, axis: int, plane: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """See `Primitive.row_crossing`."""
        start, stop = rows[:, START][:, axis], rows[:, END][:, axis]
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (plane - start) / (stop - start)
        return np.where((u > begin) & (u < end), u, np.nan)


def _plain(point):
    return "(" + ", ".join(f"{x:g}" for x in point) + ")"


Segment.part = Segment
