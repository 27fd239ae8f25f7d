"""Triangles."""

import dataclasses

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.row import AREA, CORNER_A, CORNER_B, CORNER_C, EDGE, NORMAL, SIZE


@dataclasses.dataclass(frozen=True)
class Triangle(Primitive):
    """A flat triangle. Its normal is right-handed about a, b, c."""

    a: tuple[float, float, float]
    b: tuple[float, float, float]
    c: tuple[float, float, float]

    dimension = 2
    points = ("a", "b", "c")

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

    def pack(self, row):
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
