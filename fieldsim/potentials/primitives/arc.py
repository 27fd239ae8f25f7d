"""Circular arcs."""

import dataclasses
import math

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.row import ANGLE, CENTER, FIRST, NORMAL, RADIUS


@dataclasses.dataclass(frozen=True)
class Arc(Primitive):
    """A circular arc about `center` in the plane across `normal`.

    start: direction of the first point (its part across `normal` counts); angle: in (0, 2 pi], right-handed about
    `normal`. An arc of 2 pi is a Circle to rounding (the double 2 pi is 2.4e-16 short of the turn, and counts as such).
    """

    center: tuple[float, float, float]
    normal: tuple[float, float, float]
    start: tuple[float, float, float]
    radius: float
    angle: float

    dimension = 1
    points = ("center",)
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
    def measure(self) -> float:
        """The length, radius times angle."""
        return self.radius * self.angle

    @property
    def box(self):
        """Least and greatest coordinates of the whole circle."""
        reach = self.radius * np.sqrt(np.maximum(0.0, 1.0 - np.square(self.normal)))
        return np.subtract(self.center, reach), np.add(self.center, reach)

    def pack(self, row):
        """Write radius, angle, centre, start and normal into an element row."""
        row[RADIUS], row[ANGLE] = self.radius, self.angle
        row[CENTER] = self.center
        row[FIRST] = self.start
        row[NORMAL] = self.normal


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
