"""Infinite planes."""

import dataclasses
import math
import typing
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.primitives.base import Primitive, Volume
from fieldsim.potentials.row import NORMAL, POINT, normal_of, point_of
from fieldsim.types import Timed, VectorLike


@portable
def plane_distance(x: real, y: real, z: real, rows: Table, i: int):
    """Distance to a plane."""
    px, py, pz = point_of(rows, i)
    dx = x - px
    dy = y - py
    dz = z - pz
    nx, ny, nz = normal_of(rows, i)
    return abs(dx * nx + dy * ny + dz * nz)


@portable
def plane_foot(x: real, y: real, z: real, rows: Table, i: int):
    """The nearest point of a plane."""
    px, py, pz = point_of(rows, i)
    nx, ny, nz = normal_of(rows, i)
    height = (x - px) * nx + (y - py) * ny + (z - pz) * nz
    return x - height * nx, y - height * ny, z - height * nz


@dataclasses.dataclass(frozen=True)
class Plane(Primitive):
    """The infinite plane through `point` with the given normal (of any length)."""

    point: tuple[float, float, float]
    normal: tuple[float, float, float]

    if TYPE_CHECKING:

        def __init__(self, point: Timed[VectorLike], normal: Timed[VectorLike]) -> None: ...

    points = ("point",)
    directions = ("normal",)
    dimension = 2
    volume = Volume.SLAB
    distance = plane_distance
    feet = (plane_foot,)
    straight = True
    endless = True
    nearby = math.pi
    corners = 1

    def _checked(self):
        return {
            "point": validate.vector("Plane", "point", self.point),
            "normal": validate.direction("Plane", "normal", self.normal),
        }

    @property
    def measure(self) -> float:
        """Raises InputError: mass cannot be spread over an infinite area."""
        self._refuse_mass()

    @property
    def box(self) -> typing.NoReturn:
        """A plane has none: raises InputError."""
        raise InputError(f"{self}: a plane has no end; clip it with a triangle, or leave it out")

    def pack(self, row: np.ndarray) -> None:
        """Write point and normal into an element row."""
        row[POINT] = self.point
        row[NORMAL] = self.normal

    def beside(self, radius: float) -> np.ndarray:
        """Above its point."""
        return np.add(self.point, radius * np.array(self.normal))

    def mass_points(self, count: int) -> typing.NoReturn:
        """Raises InputError, as `measure`."""
        self._refuse_mass()

    def mass_points_needed(self, clearance: float, digits: float) -> typing.NoReturn:
        """Raises InputError, as `measure`."""
        self._refuse_mass()

    def _refuse_mass(self) -> typing.NoReturn:
        raise InputError(
            f"{self!r} is of infinite area, where no mass can be spread; give fs.rectangle(...) or fs.disc(...)"
        )

    @staticmethod
    def row_measure(rows: np.ndarray) -> np.ndarray:
        """Infinite."""
        return np.full(rows.shape[:-1], math.inf)

    @staticmethod
    def row_middle(row: np.ndarray) -> np.ndarray:
        """Its point."""
        return row[POINT]

    @staticmethod
    def row_box(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """All of space."""
        return np.full((len(rows), 3), -math.inf), np.full((len(rows), 3), math.inf)

    @staticmethod
    def row_places(rows: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Its point: no parameters from 0 to 1 would cover it."""
        return rows[:, POINT]
