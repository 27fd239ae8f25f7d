"""Faces of a solid's surface: what is within is the source."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.base import Primitive, row_corners
from fieldsim.potentials.primitives.quadrature import simplex, simplex_needed
from fieldsim.potentials.primitives.triangle import Flat, Triangle
from fieldsim.potentials.row import CORNER_A, KERNEL_WIDTH, SOLID_REACH, TO_CENTER
from fieldsim.types import RealLike, Timed, VectorLike


@dataclasses.dataclass(frozen=True)
class Face(Flat, Primitive):
    """One flat face of a closed surface, right-handed about the outside; a sum over all its faces is a solid's field.

    Alone it has no meaning. All faces of a solid share `center`, any point near its middle, and `reach`, about the
    distance of its farthest corner; otherwise their sum is not the solid's field. Its measure is the (signed) volume
    between it and the centre, so that the measures of all faces add up to the solid's volume.
    It takes the Newtonian kernel without softening (a solid's field is finite everywhere).
    """

    a: tuple[float, float, float]
    b: tuple[float, float, float]
    c: tuple[float, float, float]
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    reach: float = 1.0

    if TYPE_CHECKING:

        def __init__(
            self,
            a: Timed[VectorLike],
            b: Timed[VectorLike],
            c: Timed[VectorLike],
            center: Timed[VectorLike] = ...,
            reach: Timed[RealLike] = ...,
        ) -> None: ...

    points = ("a", "b", "c", "center")
    dimension = 3
    # Its field is that of what lies behind it, or its part of it.
    distance = None
    feet = ()
    second_unit = 1  # its reach

    def _checked(self):
        try:
            triangle = Triangle(self.a, self.b, self.c)
        except InputError as reason:
            raise InputError(str(reason).replace("Triangle:", "Face:").replace(", or use Segment", "")) from None
        return {
            "a": triangle.a,
            "b": triangle.b,
            "c": triangle.c,
            "center": validate.vector("Face", "center", self.center),
            "reach": validate.number("Face", "reach", self.reach, above=0.0),
        }

    @property
    def measure(self) -> float:
        """The volume between the face and the centre, negative where the centre lies outside the face's plane."""
        a, b, c = np.array([self.a, self.b, self.c]) - self.center
        return float(np.dot(a, np.cross(b, c)) / 6.0)

    def pack(self, row: np.ndarray) -> None:
        """Write size, reach, corners, the offset of the centre from a, and the normal into an element row."""
        if row[KERNEL_WIDTH] != 0.0:
            raise InputError(
                f"Face: the kernel has softening {row[KERNEL_WIDTH]:g}; a solid takes Newtonian() without softening"
            )
        triangle = Triangle(self.a, self.b, self.c)
        triangle.pack(row)
        row[SOLID_REACH] = self.reach
        row[TO_CENTER] = np.subtract(self.center, self.a)

    def mass_points(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss's rule in Duffy's coordinates, of the tetrahedron between the face and the centre."""
        return simplex([self.center, self.a, self.b, self.c], count)[:2]

    def mass_points_needed(self, clearance: float, digits: float) -> float:
        """By its longest edge."""
        return simplex_needed([self.a, self.b, self.c], clearance, digits)

    @staticmethod
    def row_measure(rows: np.ndarray) -> np.ndarray:
        """The signed volumes between faces and centre."""
        center = rows[:, CORNER_A] + rows[:, TO_CENTER]
        a, b, c = np.moveaxis(row_corners(rows, 3) - center[:, None], 1, 0)
        return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
