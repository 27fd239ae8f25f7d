"""The cases of reference/fields.json as fieldsim's objects, and what error is accepted.

Accepted in float64, for the value and for the norm of the gradient's error:

- kernels with algebraic tails: 1e-12 of the value, at any distance;
- kernels whose tails vanish (Gaussian): 1e-12 of the value + 2e-15 S, with S = h(0) min(L, 2w) for a curve of length L
  and h(0) for a point, w = 2/a; S/w for the gradient.

Below 1e-18 everything is accepted. In float32: 5e-6 of the field's own scale there, |F| + S for the value and
|grad F| + S/w for the gradient, with w = 1/s for the Cauchy kernel and S = 0 for the Newtonian, which has no width.
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
}


@dataclasses.dataclass(frozen=True)
class Case:
    """One query: F = value and grad F = gradient at `point`; `scale` is S, `width` w (0 and 1 for the Newtonian)."""

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
        return 5e-6 * (np.linalg.norm(self.gradient) + self.scale / self.width)


@functools.cache
def reference() -> dict[Cell, list[Case]]:
    """All cases, by cell of the chart."""
    path = pathlib.Path(__file__).parent / "reference" / "fields.json"
    result = collections.defaultdict(list)
    for cell in json.loads(path.read_text())["cells"]:
        for raw in cell["cases"]:
            kernel = KERNELS[cell["kernel"]](raw["kernel"])
            primitive = PRIMITIVES[cell["primitive"]](raw["primitive"])
            for same in (primitive, _as_circle(primitive)):
                if same is not None:
                    result[CELLS[type(kernel), type(same)]].append(_case(kernel, same, raw))
    return dict(result)


def _as_circle(primitive):
    """The Circle that a full Arc is."""
    if isinstance(primitive, Arc) and primitive.angle > 2 * math.pi - 1e-12:
        return Circle(primitive.center, primitive.normal, primitive.radius)
    return None


def _case(kernel, primitive, raw) -> Case:
    scale, width = 0.0, 1.0
    if not isinstance(kernel, Newtonian):
        width = 2.0 / kernel.a if isinstance(kernel, Gaussian) else 1.0 / kernel.s
        scale = 1.0 if primitive.dimension == 0 else min(primitive.measure, 2.0 * width)
    return Case(
        kernel, primitive, np.array(raw["point"]), raw["value"], np.array(raw["gradient"]), raw["mode"], scale, width
    )
