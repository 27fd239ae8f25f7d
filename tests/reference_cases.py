"""The cases of reference/fields.json as fieldsim's objects, and what error is accepted.

Accepted in float64, for the value and for the norm of the gradient's error:

- kernels with algebraic tails: 1e-12 of the value, at any distance;
- kernels whose tails vanish (Gaussian): 1e-12 of the value + 2e-15 S, with S = h(0) min(L, 2w) for a curve of length L
  and h(0) for a point, w = 2/a; S/w for the gradient.

Below 1e-18 everything is accepted. In float32: 5e-6 of the field's own scale there, |F| + S for the value and
|grad F| + S/w for the gradient, with w = 1/s for the Cauchy kernel and S = 0 for the Newtonian, which has no width.
"""

import dataclasses
import functools
import importlib
import json
import pathlib
import pkgutil

import numpy as np

from fieldsim import potentials
from fieldsim.potentials.cells import CELLS, Cell
from fieldsim.potentials.kernels import Cauchy, Gaussian, Kernel, Newtonian
from fieldsim.potentials.primitive import Primitive

# The chart fills as the modules are imported.
MODULES = {
    m.name: importlib.import_module(f"fieldsim.potentials.{m.name}") for m in pkgutil.iter_modules(potentials.__path__)
}

KERNELS = {
    "cauchy": lambda p: Cauchy(s=p["s"]),
    "gaussian": lambda p: Gaussian(a=p["a"]),
    "inverse": lambda p: Newtonian(softening=p["eps"]),
}
PRIMITIVES = {
    "point": lambda p: MODULES["point"].Point(p["p"]),
    "segment": lambda p: MODULES["segment"].Segment(p["a"], p["b"]),
    "arc": lambda p: MODULES["arc"].Arc(p["center"], p["normal"], p["start"], p["radius"], p["angle"]),
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
    result = {}
    for cell in json.loads(path.read_text())["cells"]:
        if cell["primitive"] not in MODULES:
            continue
        cases = [_case(KERNELS[cell["kernel"]], PRIMITIVES[cell["primitive"]], raw) for raw in cell["cases"]]
        result[CELLS[type(cases[0].kernel), type(cases[0].primitive)]] = cases
    return result


def _case(kernel_of, primitive_of, raw) -> Case:
    kernel, primitive = kernel_of(raw["kernel"]), primitive_of(raw["primitive"])
    scale, width = 0.0, 1.0
    if not isinstance(kernel, Newtonian):
        width = 2.0 / kernel.a if isinstance(kernel, Gaussian) else 1.0 / kernel.s
        scale = 1.0 if primitive.dimension == 0 else min(primitive.measure, 2.0 * width)
    return Case(
        kernel, primitive, np.array(raw["point"]), raw["value"], np.array(raw["gradient"]), raw["mode"], scale, width
    )
