"""Segments whose density changes linearly from end to end."""

import dataclasses

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.row import END_DENSITY, START_DENSITY


@dataclasses.dataclass(frozen=True)
class TaperedSegment(Segment):
    """A segment of linear density: `start_density` at its start, evenly changing to `end_density` at its end.

    Densities are per length and multiply the field's strength; neither may be negative, one may be 0. Its measure is
    their integral, so that a mass spread over a skeleton follows the density. It takes the Newtonian kernel.
    """

    start_density: float = 1.0
    end_density: float = 0.0

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

    def pack(self, row):
        """Write the segment and its densities into an element row."""
        Segment(self.start, self.end).pack(row)
        row[START_DENSITY], row[END_DENSITY] = self.start_density, self.end_density
