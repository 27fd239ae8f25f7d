"""The cases of reference/fields.json as fieldsim's objects, and what error is accepted.

Accepted in float64, for the value and for the norm of the gradient's error:

- kernels with algebraic tails (Cauchy, Newtonian, inverse square): 1e-12 of the value, at any distance;
- kernels whose tails vanish (Gaussian, compact): 1e-12 of the value + 2e-15 S, with S = h(0) times the measure within
  reach: min(L, 2w) for a curve, min(A, pi w^2) for a surface, 1 for a point; w = 2/a or the support's radius; S/w for
  the gradient.

Below 1e-18 everything is accepted. In float32: 5e-6 of the field's own scale, |F| + S for the value and |grad F| + S/w
for the gradient, where w = 1/s for the Cauchy kernel. The inverse powers have no width: S = |F|, and w is the mean
distance, (measure / |F|)^(1/n) for r^-n: where the pulls of a ring cancel, single precision cannot know the small rest.
"""

import collections
import dataclasses
import functools
import json
import math
import pathlib

import numpy as np

from fieldsim.potentials.kernels import (
    Cauchy,
    Gaussian,
    InverseSquare,
    Kernel,
    Metaball,
    Newtonian,
    Quartic,
    SoftObject,
)
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.potentials.registry import FORMULAS, Formula

KERNELS = {
    "cauchy": lambda p: Cauchy(s=p["s"]),
    "gaussian": lambda p: Gaussian(a=p["a"]),
    "inverse": lambda p: Newtonian(softening=p["eps"]),
    "inverse_squared": lambda p: InverseSquare(softening=p["eps"]),
    "metaballs": lambda p: Metaball(radius=p["R"]),
    "soft_objects": lambda p: SoftObject(radius=p["R"]),
    "quartic": lambda p: Quartic(radius=p["R"]),
}
ALGEBRAIC = (Cauchy, InverseSquare, Newtonian)
PRIMITIVES = {
    "point": lambda p: Point(p["p"]),
    "segment": lambda p: Segment(p["a"], p["b"]),
    "arc": lambda p: Arc(p["center"], p["normal"], p["start"], p["radius"], p["angle"]),
    "circle": lambda p: Circle(p["center"], p["normal"], p["radius"]),
    "triangle": lambda p: Triangle(p["a"], p["b"], p["c"]),
    "plane": lambda p: Plane(p["point"], p["normal"]),
}


@dataclasses.dataclass(frozen=True)
class Case:
    """One query: F = value and grad F = gradient at `point`; `scale` is S, `width` w."""

    kernel: Kernel
    primitive: Primitive
    point: np.ndarray
    value: float
    gradient: np.ndarray
    mode: str
    scale: float
    width: float

    @property
    def value_accepted(self) -> float:
        floor = 0.0 if isinstance(self.kernel, ALGEBRAIC) else 2e-15 * self.scale
        return max(1e-18, 1e-12 * abs(self.value) + floor)

    @property
    def gradient_accepted(self) -> float:
        floor = 0.0 if isinstance(self.kernel, ALGEBRAIC) else 2e-15 * self.scale / self.width
        return max(1e-18, 1e-12 * np.linalg.norm(self.gradient) + floor)

    @property
    def value_accepted_single(self) -> float:
        return 5e-6 * (abs(self.value) + self.scale)

    @property
    def gradient_accepted_single(self) -> float:
        # At 0.02 from a wire of size 1 to 3 single precision knows the offset itself to 3e-6..1e-5.
        relative = 1e-5 if self.mode == "near" else 5e-6
        return relative * (np.linalg.norm(self.gradient) + self.scale / self.width)


@functools.cache
def reference() -> dict[Formula, list[Case]]:
    """All cases, by formula."""
    path = pathlib.Path(__file__).parent / "reference" / "fields.json"
    result = collections.defaultdict(list)
    for entry in json.loads(path.read_text())["cells"]:
        for raw in entry["cases"]:
            kernel = KERNELS[entry["kernel"]](raw["kernel"])
            for name in _names(entry["primitive"], raw):
                primitive = PRIMITIVES[name](raw["primitive"])
                result[FORMULAS[type(kernel), type(primitive)]].append(_case(kernel, primitive, raw))
    return dict(result)


def _names(name, raw):
    """A full arc is also a circle; but at its very centre the pull is that of the rounding of `start` alone."""
    full = raw["primitive"].get("angle", 0.0) > 2 * math.pi - 1e-12
    return (name, "circle") if full and raw["point"] != raw["primitive"]["center"] else (name,)


def _case(kernel, primitive, raw) -> Case:
    scale, width = scale_and_width(kernel, primitive, abs(raw["value"]))
    point, gradient = np.array(raw["point"]), np.array(raw["gradient"])
    return Case(kernel, primitive, point, raw["value"], gradient, raw["mode"], scale, width)


def scale_and_width(kernel, primitive, size):
    """(S, w) of a case whose value's size is given."""
    endless = isinstance(primitive, Plane)
    if isinstance(kernel, Newtonian | InverseSquare):
        if endless:
            return size + 2 * math.pi, 1.0
        return size, (primitive.measure / size) ** (1.0 if isinstance(kernel, Newtonian) else 0.5)
    width = {Gaussian: lambda k: 2.0 / k.a, Cauchy: lambda k: 1.0 / k.s}.get(type(kernel), lambda k: k.radius)(kernel)
    within = (1.0, 2.0 * width, math.pi * width**2)[primitive.dimension]
    return (within if endless else min(primitive.measure, within)), width
