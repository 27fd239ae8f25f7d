"""The cases of reference/fields.json as fieldsim's objects, and what error is accepted.

Accepted in float64, for the value and for the norm of the gradient's error:

- kernels with algebraic tails: 1e-12 of the value, at any distance;
- kernels whose tails vanish (Gaussian): 1e-12 of the value + 2e-15 S, with S = h(0) min(L, 2w) for a curve of length L
  and h(0) for a point, w = 2/a; S/w for the gradient.

Below 1e-18 everything is accepted. In float32: 5e-6 of the field's own scale, |F| + S for the value and |grad F| + S/w
for the gradient, where w = 1/s for the Cauchy kernel; for the Newtonian, which has no width, w is the
mean distance L / |F| and S = |F|: where the pulls of a ring cancel, single precision cannot know the small rest.
"""

import collections
import dataclasses
import functools
import importlib
import json
import math
import pathlib
import pkgutil

import numpy as np

from fieldsim import potentials
from fieldsim.potentials.arc import Arc
from fieldsim.potentials.cells import CELLS, Cell
from fieldsim.potentials.circle import Circle
from fieldsim.potentials.kernels import Cauchy, Gaussian, Kernel, Newtonian
from fieldsim.potentials.point import Point
from fieldsim.potentials.primitive import Primitive
from fieldsim.potentials.segment import Segment

# The chart fills as the modules are imported; one that nobody imports here would go untested unseen.
for module in pkgutil.iter_modules(potentials.__path__):
    importlib.import_module(f"fieldsim.potentials.{module.name}")

KERNELS = {
    "cauchy": lambda p: Cauchy(s=p["s"]),
    "gaussian": lambda p: Gaussian(a=p["a"]),
    "inverse": lambda p: Newtonian(softening=p["eps"]),
}
PRIMITIVES = {
    "point": lambda p: Point(p["p"]),
    "segment": lambda p: Segment(p["a"], p["b"]),
    "arc": lambda p: Arc(p["center"], p["normal"], p["start"], p["radius"], p["angle"]),
    "circle": lambda p: Circle(p["center"], p["normal"], p["radius"]),
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
        floor = 2e-15 * self.scale if isinstance(self.kernel, Gaussian) else 0.0
        return max(1e-18, 1e-12 * abs(self.value) + floor)

    @property
    def gradient_accepted(self) -> float:
        floor = 2e-15 * self.scale / self.width if isinstance(self.kernel, Gaussian) else 0.0
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
def reference() -> dict[Cell, list[Case]]:
    """All cases, by cell of the chart."""
    path = pathlib.Path(__file__).parent / "reference" / "fields.json"
    result = collections.defaultdict(list)
    for cell in json.loads(path.read_text())["cells"]:
        for raw in cell["cases"]:
            kernel = KERNELS[cell["kernel"]](raw["kernel"])
            for name in _names(cell["primitive"], raw):
                primitive = PRIMITIVES[name](raw["primitive"])
                result[CELLS[type(kernel), type(primitive)]].append(_case(kernel, primitive, raw))
    return dict(result)


def _names(name, raw):
    """A full arc is also a circle; but at its very centre the pull is that of the rounding of `start` alone."""
    full = raw["primitive"].get("angle", 0.0) > 2 * math.pi - 1e-12
    return (name, "circle") if full and raw["point"] != raw["primitive"]["center"] else (name,)


def _case(kernel, primitive, raw) -> Case:
    if isinstance(kernel, Newtonian):
        scale, width = abs(raw["value"]), primitive.measure / abs(raw["value"])
    else:
        width = 2.0 / kernel.a if isinstance(kernel, Gaussian) else 1.0 / kernel.s
        scale = 1.0 if primitive.dimension == 0 else min(primitive.measure, 2.0 * width)
    return Case(
        kernel, primitive, np.array(raw["point"]), raw["value"], np.array(raw["gradient"]), raw["mode"], scale, width
    )
