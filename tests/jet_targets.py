"""The cells with Hessians on every target: one jet of element i at point i, in kernels compiled once."""

import functools
import importlib
import pkgutil

import numba
import numpy as np
import warp as wp

from fieldsim import launch, potentials
from fieldsim.potentials import cells

for module in pkgutil.iter_modules(potentials.__path__):
    importlib.import_module(f"fieldsim.potentials.{module.name}")

JETS = list(cells.CELLS_JET)


def rows_of(primitives, kernels):
    """Packed rows (N, WIDTH) of unit strength and the indices (N,) of their cells in JETS."""
    rows = np.zeros((len(primitives), cells.WIDTH))
    for row, primitive, kernel in zip(rows, primitives, kernels, strict=True):
        primitive.pack(row)
        row[cells.KERNEL] = kernel.width
    rows[:, cells.STRENGTH] = 1.0
    kinds = [JETS.index((type(k), type(p))) for k, p in zip(kernels, primitives, strict=True)]
    return rows, np.array(kinds, dtype=np.int32)


def evaluate(target, rows, kinds, points):
    """Jets (N, 10) in float64; outputs start as NaN."""
    jets = np.full((len(points), 10), np.nan)
    points = np.asarray(points, dtype=float)
    if target == "numba":
        _numba()(points, rows, kinds, jets)
        return jets
    scalar = wp.float64 if target == "warp64" else wp.float32
    output = wp.array(jets, dtype=scalar, device="cpu")
    inputs = [
        wp.array(points, dtype=wp.types.vector(3, scalar), device="cpu"),
        wp.array(rows, dtype=scalar, device="cpu"),
        wp.array(kinds, dtype=wp.int32, device="cpu"),
    ]
    launch.launch(warp_kernel(scalar), len(points), inputs, [output], device="cpu")
    return output.numpy().astype(float)


@functools.cache
def _any_jet():
    first, *others = JETS
    chosen = cells._last.bind(element=cells.CELLS_JET[first])
    for key in others:
        chosen = cells._choose.bind(kind=JETS.index(key), element=cells.CELLS_JET[key], otherwise=chosen)
    return chosen


@functools.cache
def warp_kernel(scalar):
    """The Warp kernel of all cells."""
    jet = _any_jet().warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def one_each(
        start: int,
        points: wp.array(dtype=wp.types.vector(3, scalar)),
        rows: wp.array(dtype=scalar, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        jets: wp.array(dtype=scalar, ndim=2),
    ):
        i = start + wp.tid()
        p = points[i]
        f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz = jet(p[0], p[1], p[2], rows, kinds, i)
        jets[i, 0] = f
        jets[i, 1] = fx
        jets[i, 2] = fy
        jets[i, 3] = fz
        jets[i, 4] = fxx
        jets[i, 5] = fyy
        jets[i, 6] = fzz
        jets[i, 7] = fxy
        jets[i, 8] = fxz
        jets[i, 9] = fyz

    return one_each


@functools.cache
def _numba():
    jet = _any_jet().numba

    @numba.njit(error_model="numpy")
    def one_each(points, rows, kinds, jets):
        for i in range(len(points)):
            jets[i] = np.array(jet(points[i, 0], points[i, 1], points[i, 2], rows, kinds, i))

    return one_each
