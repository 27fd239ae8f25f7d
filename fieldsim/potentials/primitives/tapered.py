"""Segments whose density changes linearly from end to end."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.quadrature import simplex
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.row import END_DENSITY, LENGTH, START_DENSITY
from fieldsim.types import RealLike, Timed, VectorLike


@dataclasses.dataclass(frozen=True)
class TaperedSegment(Segment):
    """A segment of linear density: `start_density` at its start, evenly changing to `end_density` at its end.

    Densities are per length and multiply the field's strength; neither may be negative, one may be 0. Its measure is
    their integral, so that a mass spread over a skeleton follows the density. It takes the Newtonian kernel.
    """

    start_density: float = 1.0
    end_density: float = 0.0

    if TYPE_CHECKING:

        def __init__(
            self,
            start: Timed[VectorLike],
            end: Timed[VectorLike],
            start_density: Timed[RealLike] = ...,
            end_density: Timed[RealLike] = ...,
        ) -> None: ...

    uniform = False
    along_rays = ""

    def _checked(self):
        densities = {
            name: validate.number("TaperedSegment", name, getattr(self, name), at_least=0.0)
            for name in ("start_density", "end_density")
        }
        if not any(densities.values()):
            raise InputError("TaperedSegment: start_density and end_density are both 0; give one above 0")
        return {**super()._checked(), **densities}

    @property
    def measure(self) -> float:
        """Length times mean density."""
        return 0.5 * (self.start_density + self.end_density) * super().measure

    def pack(self, row: np.ndarray) -> None:
        """Write the segment and its densities into an element row."""
        super().pack(row)
        row[START_DENSITY], row[END_DENSITY] = self.start_density, self.end_density

    def mass_points(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss's rule, weighted by the density."""
        points, shares, u = simplex([self.start, self.end], count)
        shares = shares * (self.start_density + u * (self.end_density - self.start_density))
        return points, shares / shares.sum()

    @staticmethod
    def row_measure(rows: np.ndarray) -> np.ndarray:
        """Lengths times mean densities."""
        return rows[..., LENGTH] * 0.5 * (rows[..., START_DENSITY] + rows[..., END_DENSITY])

    @classmethod
    def row_density(cls, rows: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Lengths times densities."""
        start, end = rows[:, START_DENSITY, None], rows[:, END_DENSITY, None]
        return rows[:, LENGTH, None] * (start + u * (end - start))

    @staticmethod
    def row_part(rows: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """See `Primitive.row_part`."""
        parts = Segment.row_part(rows, begin, end)
        change = rows[:, END_DENSITY] - rows[:, START_DENSITY]
        parts[:, START_DENSITY] += begin * change
        parts[:, END_DENSITY] -= (1.0 - end) * change
        return parts


TaperedSegment.part = TaperedSegment
