"""Triangles."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.primitives.base import Primitive, Volume, above, row_corners
from fieldsim.potentials.primitives.plane import plane_distance, plane_foot
from fieldsim.potentials.primitives.quadrature import simplex, simplex_needed
from fieldsim.potentials.row import AREA, CORNER_A, CORNER_B, CORNER_C, EDGE, NORMAL, POSITIONS, SIZE, normal_of
from fieldsim.types import Timed, VectorLike

# The first columns of corners.
_A, _B, _C = CORNER_A.start, CORNER_B.start, CORNER_C.start


@portable
def _beside_edge(x: real, y: real, z: real, rows: Table, i: int, p: int, q: int):
    """Squared distance to the edge between the corners in columns p.. and q.., and the point's side of it.

    The side is positive on the inner one, in the plane.
    """
    nx, ny, nz = normal_of(rows, i)
    dx = x - rows[i, p]
    dy = y - rows[i, p + 1]
    dz = z - rows[i, p + 2]
    ex = rows[i, q] - rows[i, p]
    ey = rows[i, q + 1] - rows[i, p + 1]
    ez = rows[i, q + 2] - rows[i, p + 2]
    side = nx * (ey * dz - ez * dy) + ny * (ez * dx - ex * dz) + nz * (ex * dy - ey * dx)
    along = (dx * ex + dy * ey + dz * ez) / (ex * ex + ey * ey + ez * ez)
    along = min(max(along, real(0.0)), real(1.0))
    dx -= along * ex
    dy -= along * ey
    dz -= along * ez
    return dx * dx + dy * dy + dz * dz, side


@portable
def triangle_distance(x: real, y: real, z: real, rows: Table, i: int):
    """Distance to a triangle."""
    ab, side_ab = _beside_edge(x, y, z, rows, i, _A, _B)
    bc, side_bc = _beside_edge(x, y, z, rows, i, _B, _C)
    ca, side_ca = _beside_edge(x, y, z, rows, i, _C, _A)
    if min(side_ab, min(side_bc, side_ca)) >= real(0.0):
        return plane_distance(x, y, z, rows, i)
    return math.sqrt(min(ab, min(bc, ca)))


@portable
def _edge_foot(x: real, y: real, z: real, rows: Table, i: int, p: int, q: int):
    """The nearest point of the edge between the corners in columns p.. and q.., and its squared distance."""
    ex = rows[i, q] - rows[i, p]
    ey = rows[i, q + 1] - rows[i, p + 1]
    ez = rows[i, q + 2] - rows[i, p + 2]
    along = (x - rows[i, p]) * ex + (y - rows[i, p + 1]) * ey + (z - rows[i, p + 2]) * ez
    along = min(max(along / (ex * ex + ey * ey + ez * ez), real(0.0)), real(1.0))
    fx = rows[i, p] + along * ex
    fy = rows[i, p + 1] + along * ey
    fz = rows[i, p + 2] + along * ez
    return fx, fy, fz, (x - fx) * (x - fx) + (y - fy) * (y - fy) + (z - fz) * (z - fz)


@portable
def triangle_foot(x: real, y: real, z: real, rows: Table, i: int):
    """The nearest point of a triangle."""
    _ab, side_ab = _beside_edge(x, y, z, rows, i, _A, _B)
    _bc, side_bc = _beside_edge(x, y, z, rows, i, _B, _C)
    _ca, side_ca = _beside_edge(x, y, z, rows, i, _C, _A)
    if min(side_ab, min(side_bc, side_ca)) >= real(0.0):
        return plane_foot(x, y, z, rows, i)
    fx, fy, fz, least = _edge_foot(x, y, z, rows, i, _A, _B)
    gx, gy, gz, other = _edge_foot(x, y, z, rows, i, _B, _C)
    if other < least:
        fx, fy, fz, least = gx, gy, gz, other
    gx, gy, gz, other = _edge_foot(x, y, z, rows, i, _C, _A)
    if other < least:
        fx, fy, fz, least = gx, gy, gz, other
    return fx, fy, fz


class Flat:
    """What triangles and faces share: a row of three corners and their normal."""

    volume = Volume.PRISM
    straight = True
    nearby = math.pi
    corners = 3
    beside = above

    @staticmethod
    def row_middle(row: np.ndarray) -> np.ndarray:
        """The corners' mean."""
        return row[POSITIONS].reshape(3, 3).mean(axis=0)

    @staticmethod
    def row_box(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Around the corners."""
        corners = row_corners(rows, 3)
        return corners.min(axis=1), corners.max(axis=1)

    @staticmethod
    def row_places(rows: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """From the first corner u of the way towards the second and v towards the third."""
        first = rows[:, CORNER_A]
        return first + u * (rows[:, CORNER_B] - first) + v * (rows[:, CORNER_C] - first)


@dataclasses.dataclass(frozen=True)
class Triangle(Flat, Primitive):
    """A flat triangle. Its normal is right-handed about a, b, c."""

    a: tuple[float, float, float]
    b: tuple[float, float, float]
    c: tuple[float, float, float]

    if TYPE_CHECKING:

        def __init__(self, a: Timed[VectorLike], b: Timed[VectorLike], c: Timed[VectorLike]) -> None: ...

    points = ("a", "b", "c")
    dimension = 2
    distance = triangle_distance
    feet = (triangle_foot,)
    second_unit = 2  # its area

    def _checked(self):
        corners = {name: validate.vector("Triangle", name, getattr(self, name)) for name in "abc"}
        self._refuse_extremes(corners)
        a, b, c = (np.array(corner) for corner in corners.values())
        edges = np.array([b - a, c - b, a - c])
        size = np.linalg.norm(edges, axis=1).max()
        # What rounding of coordinates can fake is not an area.
        rounding = 4 * np.finfo(float).eps * max(size, np.abs([a, b, c]).max())
        if not np.linalg.norm(np.cross(edges[0], edges[1])) > rounding * size:
            raise InputError(
                f"Triangle: a, b and c are {a.tolist()}, {b.tolist()} and {c.tolist()}, on one line, without area; "
                "move one of them, or use Segment"
            )
        return corners

    @property
    def measure(self) -> float:
        """The area."""
        a, b, c = np.array([self.a, self.b, self.c])
        return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a)))

    def pack(self, row: np.ndarray) -> None:
        """Write size (the longest edge), area, corners, direction from a to b and normal into an element row."""
        a, b, c = np.array([self.a, self.b, self.c])
        row[SIZE] = max(np.linalg.norm(b - a), np.linalg.norm(c - b), np.linalg.norm(a - c))
        row[AREA] = self.measure
        row[CORNER_A], row[CORNER_B], row[CORNER_C] = self.a, self.b, self.c
        row[EDGE] = (b - a) / np.linalg.norm(b - a)
        # The normal from the corner whose edges are the most nearly perpendicular.
        normal = max(
            (
                np.cross(v - u, w - u) / (np.linalg.norm(v - u) * np.linalg.norm(w - u))
                for u, v, w in ((a, b, c), (b, c, a), (c, a, b))
            ),
            key=np.linalg.norm,
        )
        row[NORMAL] = normal / np.linalg.norm(normal)

    def mass_points(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss's rule in Duffy's coordinates."""
        return simplex([self.a, self.b, self.c], count)[:2]

    def mass_points_needed(self, clearance: float, digits: float) -> float:
        """By its longest edge."""
        return simplex_needed([self.a, self.b, self.c], clearance, digits)

    @staticmethod
    def row_measure(rows: np.ndarray) -> np.ndarray:
        """The areas."""
        return rows[..., AREA]
