"""Straight segments."""

import dataclasses
import math

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.row import AXIS, END, LENGTH, START


@dataclasses.dataclass(frozen=True)
class Segment(Primitive):
    """A straight segment between two different points."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]

    dimension = 1
    points = ("start", "end")

    def _checked(self):
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

    def pack(self, row):
        """Write length, ends and axis into an element row."""
        row[LENGTH] = self.measure
        row[START] = self.start
        row[END] = self.end
        row[AXIS] = np.subtract(self.end, self.start) / self.measure


def _plain(point):
    return "(" + ", ".join(f"{x:g}" for x in point) + ")"
