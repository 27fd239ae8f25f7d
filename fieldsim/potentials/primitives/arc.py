"""Circular arcs."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.numerics.quadrature import gauss_legendre
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.primitives.base import Primitive, Volume, above
from fieldsim.potentials.primitives.quadrature import interval_needed
from fieldsim.potentials.row import ANGLE, CENTER, FIRST, NORMAL, RADIUS, center_of, first_of, normal_of
from fieldsim.types import RealLike, Timed, VectorLike

# Nearer to the axis than this share of the radius a point has no direction from it; from this angle on an arc is whole.
ON_AXIS = 1e-14
WHOLE = math.tau * (1.0 - 1e-12)


@portable
def arc_distance(x: real, y: real, z: real, rows: Table, i: int):
    """Distance to an arc or a circle."""
    sx, sy, sz = first_of(rows, i)
    nx, ny, nz = normal_of(rows, i)
    px, py, pz = center_of(rows, i)
    dx = x - px
    dy = y - py
    dz = z - pz
    radius = rows[i, RADIUS]
    half = real(0.5) * rows[i, ANGLE]
    height = dx * nx + dy * ny + dz * nz
    p = dx * sx + dy * sy + dz * sz
    q = dx * (ny * sz - nz * sy) + dy * (nz * sx - nx * sz) + dz * (nx * sy - ny * sx)
    rho = math.sqrt(p * p + q * q)
    if rows[i, ANGLE] >= real(WHOLE):
        return math.sqrt((rho - radius) * (rho - radius) + height * height)
    cosine = math.cos(half)
    sine = math.sin(half)
    # Turned so that the arc's middle lies at (1, 0), and to its upper half.
    u = p * cosine + q * sine
    v = abs(q * cosine - p * sine)
    if u >= rho * cosine:
        # Beside the arc, not beyond an end.
        return math.sqrt((rho - radius) * (rho - radius) + height * height)
    du = u - radius * cosine
    dv = v - radius * sine
    return math.sqrt(du * du + dv * dv + height * height)


@portable
def _around(rows: Table, i: int, cosine: real, sine: real):
    """The point of a row's whole circle at an angle from its start."""
    sx, sy, sz = first_of(rows, i)
    nx, ny, nz = normal_of(rows, i)
    px, py, pz = center_of(rows, i)
    p = rows[i, RADIUS] * cosine
    q = rows[i, RADIUS] * sine
    return (
        px + p * sx + q * (ny * sz - nz * sy),
        py + p * sy + q * (nz * sx - nx * sz),
        pz + p * sz + q * (nx * sy - ny * sx),
    )


@portable
def _direction(x: real, y: real, z: real, rows: Table, i: int):
    """Cosine and sine of a point's angle from the start of a row's circle; on its axis, of the arc's middle."""
    sx, sy, sz = first_of(rows, i)
    nx, ny, nz = normal_of(rows, i)
    px, py, pz = center_of(rows, i)
    dx = x - px
    dy = y - py
    dz = z - pz
    p = dx * sx + dy * sy + dz * sz
    q = dx * (ny * sz - nz * sy) + dy * (nz * sx - nx * sz) + dz * (nx * sy - ny * sx)
    rho = math.sqrt(p * p + q * q)
    if rho <= real(ON_AXIS) * rows[i, RADIUS]:
        half = real(0.5) * rows[i, ANGLE]
        return math.cos(half), math.sin(half)
    return p / rho, q / rho


@portable
def arc_foot(x: real, y: real, z: real, rows: Table, i: int):
    """The nearest point of an arc or a circle."""
    cosine, sine = _direction(x, y, z, rows, i)
    if rows[i, ANGLE] >= real(WHOLE):
        return _around(rows, i, cosine, sine)
    half = real(0.5) * rows[i, ANGLE]
    c = math.cos(half)
    s = math.sin(half)
    # Turned so that the arc's middle lies at (1, 0).
    if cosine * c + sine * s >= c:
        return _around(rows, i, cosine, sine)
    if sine * c - cosine * s >= real(0.0):
        return _around(rows, i, c * c - s * s, real(2.0) * s * c)
    return _around(rows, i, real(1.0), real(0.0))


@portable
def _a_third_on(x: real, y: real, z: real, rows: Table, i: int, way: real):
    """The point of a circle a third of it from the nearest one, right-handed for way = 1, else the other way."""
    cosine, sine = _direction(x, y, z, rows, i)
    turn = way * math.sqrt(real(0.75))
    return _around(rows, i, real(-0.5) * cosine - turn * sine, turn * cosine - real(0.5) * sine)


@portable
def arc_end_foot(x: real, y: real, z: real, rows: Table, i: int):
    """The end of an arc; of a whole circle, the point a third of it on from the nearest one."""
    if rows[i, ANGLE] >= real(WHOLE):
        return _a_third_on(x, y, z, rows, i, real(1.0))
    return _around(rows, i, math.cos(rows[i, ANGLE]), math.sin(rows[i, ANGLE]))


@portable
def arc_start_foot(x: real, y: real, z: real, rows: Table, i: int):
    """The start of an arc; of a whole circle, the point a third of it back from the nearest one."""
    if rows[i, ANGLE] >= real(WHOLE):
        return _a_third_on(x, y, z, rows, i, real(-1.0))
    return _around(rows, i, real(1.0), real(0.0))


def box_of(center, normal, radius) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coordinates of a whole circle."""
    reach = radius * np.sqrt(np.maximum(0.0, 1.0 - np.square(normal)))
    return np.subtract(center, reach), np.add(center, reach)


class Turn:
    """What arcs and circles share: a row of centre, start, normal, radius and angle."""

    points = ("center",)
    dimension = 1
    volume = Volume.TUBE
    distance = arc_distance
    # From afar across the hole both ends of an arc are nearer than what lies around them.
    feet = (arc_foot, arc_end_foot, arc_start_foot)
    straight = False
    nearby = math.tau
    corners = 1
    round = True
    beside = above

    @staticmethod
    def row_measure(rows: np.ndarray) -> np.ndarray:
        """The lengths, radius times angle."""
        return rows[..., RADIUS] * rows[..., ANGLE]

    @staticmethod
    def row_middle(row: np.ndarray) -> np.ndarray:
        """Halfway along it."""
        half = 0.5 * row[ANGLE]
        out = math.cos(half) * row[FIRST] + math.sin(half) * np.cross(row[NORMAL], row[FIRST])
        return row[CENTER] + row[RADIUS] * out

    @staticmethod
    def row_box(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Around the whole circles."""
        half = rows[:, RADIUS, None] * np.sqrt(np.maximum(0.0, 1.0 - rows[:, NORMAL] ** 2))
        return rows[:, CENTER] - half, rows[:, CENTER] + half

    @staticmethod
    def row_places(rows: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Around the centre from the start, u of the angle."""
        start, turn = rows[:, FIRST], u * rows[:, ANGLE, None]
        around = np.cos(turn) * start + np.sin(turn) * np.cross(rows[:, NORMAL], start)
        return rows[:, CENTER] + rows[:, RADIUS, None] * around

    @staticmethod
    def row_part(rows: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """See `Primitive.row_part`: arcs."""
        parts, turn = rows.copy(), (begin * rows[:, ANGLE])[:, None]
        start = rows[:, FIRST]
        parts[:, FIRST] = np.cos(turn) * start + np.sin(turn) * np.cross(rows[:, NORMAL], start)
        parts[:, ANGLE] *= end - begin
        return parts

    @staticmethod
    def row_crossing(rows: np.ndarray, axis: int, plane: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """See `Primitive.row_crossing`: the first one."""
        start = rows[:, FIRST]
        along = rows[:, RADIUS] * start[:, axis]
        across = rows[:, RADIUS] * np.cross(rows[:, NORMAL], start)[:, axis]
        # along cos(turn) + across sin(turn) = height, at the turns middle - half and middle + half.
        height, middle = plane - rows[:, CENTER][:, axis], np.arctan2(across, along)
        with np.errstate(divide="ignore", invalid="ignore"):
            half = np.arccos(height / np.hypot(along, across))
        found = np.full(len(rows), np.nan)
        for side in (-1.0, 1.0):
            for whole in (0.0, math.tau):
                u = (np.mod(middle + side * half, math.tau) + whole) / rows[:, ANGLE]
                found = np.where((u > begin) & (u < end), np.fmin(u, found), found)
        return found


@dataclasses.dataclass(frozen=True)
class Arc(Turn, Primitive):
    """A circular arc about `center` in the plane across `normal`.

    start: direction of the first point (its part across `normal` counts); angle: in (0, 2 pi], right-handed about
    `normal`. An arc of 2 pi is a Circle to rounding (the double 2 pi is 2.4e-16 short of the turn, and counts as such).
    """

    center: tuple[float, float, float]
    normal: tuple[float, float, float]
    start: tuple[float, float, float]
    radius: float
    angle: float

    if TYPE_CHECKING:

        def __init__(
            self,
            center: Timed[VectorLike],
            normal: Timed[VectorLike],
            start: Timed[VectorLike],
            radius: Timed[RealLike],
            angle: Timed[RealLike],
        ) -> None: ...

    directions = ("normal", "start")

    def _checked(self):
        owner = type(self).__name__
        normal = validate.direction(owner, "normal", self.normal)
        angle = validate.number(owner, "angle", self.angle, above=0.0)
        # A sum such as 3 * (tau / 3) may exceed the turn by rounding.
        if angle > math.tau * (1.0 + 1e-12):
            raise InputError(f"{owner}: angle is {angle:g}; give radians in (0, 2 pi]")
        return {
            "center": validate.vector(owner, "center", self.center),
            "normal": normal,
            "start": _across(owner, normal, validate.direction(owner, "start", self.start)),
            "radius": validate.number(owner, "radius", self.radius, above=0.0),
            "angle": min(angle, math.tau),
        }

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest coordinates of the whole circle."""
        return box_of(self.center, self.normal, self.radius)

    @property
    def measure(self) -> float:
        """The length, radius times angle."""
        return self.radius * self.angle

    def pack(self, row: np.ndarray) -> None:
        """Write radius, angle, centre, start and normal into an element row."""
        row[RADIUS], row[ANGLE] = self.radius, self.angle
        row[CENTER] = self.center
        row[FIRST] = self.start
        row[NORMAL] = self.normal

    def mass_points(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss's rule over the angle."""
        nodes, weights = gauss_legendre(count)
        start = np.array(self.start)
        return points_around(self, start / np.linalg.norm(start), self.angle * nodes), weights

    def mass_points_needed(self, clearance: float, digits: float) -> float:
        """The nearest singularity is over one of its points, at that distance."""
        return interval_needed(math.asinh(clearance / self.radius) / (0.5 * self.angle), digits)


Arc.part = Arc


def points_around(turn, start, angles) -> np.ndarray:
    """Points (n, 3) of an arc or a circle at angles (n,) from the unit direction `start` (3,)."""
    angles = angles[:, None]
    around = np.cos(angles) * start + np.sin(angles) * np.cross(np.array(turn.normal), start)
    return np.array(turn.center) + turn.radius * around


def _across(owner, normal, start):
    """The unit direction of `start`'s part across `normal`; raises InputError when there is none."""
    n = np.array(normal)
    across = np.array(start) - np.dot(start, n) * n
    size = np.linalg.norm(across)
    if size < 1e-9:
        raise InputError(f"{owner}: start {start} is parallel to normal {normal}; give a direction across the normal")
    # Once more: for a start close to the normal, rounding left a part along it.
    across = across / size
    across = across - np.dot(across, n) * n
    return tuple((across / np.linalg.norm(across)).tolist())
