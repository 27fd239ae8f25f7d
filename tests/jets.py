"""Jets (value, gradient, Hessian) of single elements on every compiled target, and the reference's cases for them."""

import functools
import importlib
import json
import math
import pathlib
import pkgutil

import numba
import numpy as np
import warp as wp

from fieldsim import launch, potentials
from fieldsim.potentials import cells, kernels
from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Newtonian

# The chart fills as the modules are imported.
for module in pkgutil.iter_modules(potentials.__path__):
    importlib.import_module(f"fieldsim.potentials.{module.name}")

KERNELS = {
    "cauchy": lambda p: Cauchy(p["s"]),
    "gaussian": lambda p: Gaussian(p["a"]),
    "inverse": lambda p: Newtonian(p["eps"]),
    "inverse_squared": lambda p: InverseSquare(p["eps"]),
    "metaballs": lambda p: kernels.Metaball(p["R"]),
    "soft_objects": lambda p: kernels.SoftObject(p["R"]),
    "quartic": lambda p: kernels.Quartic(p["R"]),
}


def row(kernel, primitive, fold=0.0):
    """The element row of one primitive of strength 1."""
    result = np.zeros(cells.WIDTH)
    primitive.pack(result)
    result[[cells.STRENGTH, cells.KERNEL, cells.FOLD]] = 1.0, kernel.width, fold
    return result


def evaluate(target, cell, points, rows):
    """F (N,), gradient (N, 3) and Hessian (N, 3, 3) of element i at points[i]; outputs start as NaN."""
    out = np.full((len(points), 10), np.nan)
    points, rows = np.ascontiguousarray(points, dtype=float), np.ascontiguousarray(rows, dtype=float)
    if target == "numba":
        _numba(cell)(points, rows, out)
    else:
        scalar = wp.float64 if target == "warp64" else wp.float32
        arrays = [wp.array(a, dtype=scalar, device="cpu") for a in (points, rows, out)]
        launch.launch(_warp(cell, scalar), len(points), arrays[:2], arrays[2:], device="cpu")
        out = arrays[2].numpy().astype(float)
    xx, yy, zz, xy, xz, yz = out[:, 4:].T
    return out[:, 0], out[:, 1:4], np.moveaxis(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), -1, 0)


@functools.cache
def _numba(cell):
    element = cells.CELLS_JET[cell].numba

    @numba.njit(error_model="numpy")
    def each(points, rows, out):
        for i in range(len(points)):
            out[i] = element(points[i, 0], points[i, 1], points[i, 2], rows, i)

    return each


@functools.cache
def _warp(cell, scalar):
    element = cells.CELLS_JET[cell].warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def each(
        start: int,
        points: wp.array(dtype=scalar, ndim=2),
        rows: wp.array(dtype=scalar, ndim=2),
        out: wp.array(dtype=scalar, ndim=2),
    ):
        i = start + wp.tid()
        f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz = element(points[i, 0], points[i, 1], points[i, 2], rows, i)
        out[i, 0] = f
        out[i, 1] = fx
        out[i, 2] = fy
        out[i, 3] = fz
        out[i, 4] = fxx
        out[i, 5] = fyy
        out[i, 6] = fzz
        out[i, 7] = fxy
        out[i, 8] = fxz
        out[i, 9] = fyz

    return each


def scale(kernel, area=math.inf):
    """(S, w) of the reference's README, for kernels whose tails vanish; S = 0 for the others."""
    if isinstance(kernel, Cauchy | InverseSquare | Newtonian):
        return 0.0, 1.0
    width = 2 / kernel.a if isinstance(kernel, Gaussian) else kernel.radius
    return min(area, math.pi * width**2), width


def reference(name, make):
    """The reference's cases of one primitive, by kernel type: (kernels, primitives, points, values, gradients)."""
    path = pathlib.Path(__file__).parent / "reference" / "surfaces.json"
    result = {}
    for cell in json.loads(path.read_text())["cells"]:
        if cell["primitive"] == name:
            columns = [
                (KERNELS[cell["kernel"]](c["kernel"]), make(c["primitive"]), c["point"], c["value"], c["gradient"])
                for c in cell["cases"]
            ]
            a, b, *numbers = zip(*columns, strict=True)
            result[type(a[0])] = a, b, *(np.array(n) for n in numbers)
    return result
