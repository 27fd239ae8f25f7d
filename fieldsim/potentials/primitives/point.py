"""Points."""

import dataclasses

from fieldsim import validate
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.row import POINT


@dataclasses.dataclass(frozen=True)
class Point(Primitive):
    """A point source."""

    position: tuple[float, float, float]

    measure = 1.0
    dimension = 0
    points = ("position",)

    def _checked(self):
        return {"position": validate.vector("Point", "position", self.position)}

    def pack(self, row):
        """Write the position into an element row."""
        row[POINT] = self.position
