"""Every compiled target of the formulas, evaluating element i at point i; each is compiled once, when first asked."""

import functools

import numba
import numpy as np
import warp as wp

from fieldsim import launch
from fieldsim.potentials import registry
from fieldsim.potentials.elements import pack


def evaluate(target, elements, points):
    """F (N,) and its gradient (N, 3) of element i alone at points[i], in float64."""
    out = jets(target, elements.kinds, elements.rows, points)
    return out[:, 0], out[:, 1:4]


def jets(target, kinds, rows, points):
    """Jets (N, 10) in float64 of element i alone at points[i]; outputs start as NaN.

    target: "warp64", "warp32" or "numba".
    """
    kinds = np.asarray(kinds)
    rows, points = np.asarray(rows, dtype=float), np.asarray(points, dtype=float)
    out = np.full((len(points), 10), np.nan)
    for kind in np.unique(kinds):
        where = kinds == kind
        out[where] = _jets_of_formula(target, int(kind), rows[where], points[where])
    return out


def rows_of(primitives, kernels):
    """Kinds (N,) and packed rows (N, ROW_WIDTH) of single elements of unit strength, in the given order."""
    parts = [pack([p], [k], 1.0) for p, k in zip(primitives, kernels, strict=True)]
    return np.concatenate([part.kinds for part in parts]), np.concatenate([part.rows for part in parts])


def hessians(out):
    """Matrices (N, 3, 3) of the jets (N, 10)."""
    return out[:, [[4, 7, 8], [7, 5, 9], [8, 9, 6]]]


def _jets_of_formula(target, kind, rows, points):
    out = np.full((len(points), 10), np.nan)
    if target == "numba":
        _numba(kind)(points, rows, out)
        return out
    scalar = {"warp64": wp.float64, "warp32": wp.float32}[target]
    arrays = [wp.array(a, dtype=scalar, device="cpu") for a in (points, rows, out)]
    launch.launch(_warp(kind, scalar), len(points), arrays[:2], arrays[2:], device="cpu")
    return arrays[2].numpy().astype(float)


@functools.cache
def _jet(kind):
    return registry.formulas_of([kind])[kind].jet


@functools.cache
def _numba(kind):
    jet = _jet(kind).numba

    @numba.njit(error_model="numpy")
    def one_each(points, rows, out):
        for i in range(len(points)):
            out[i] = jet(points[i, 0], points[i, 1], points[i, 2], rows, i)

    return one_each


@functools.cache
def _warp(kind, scalar):
    jet = _jet(kind).warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def one_each(
        start: int,
        points: wp.array(dtype=scalar, ndim=2),
        rows: wp.array(dtype=scalar, ndim=2),
        out: wp.array(dtype=scalar, ndim=2),
    ):
        i = start + wp.tid()
        f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz = jet(points[i, 0], points[i, 1], points[i, 2], rows, i)
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

    return one_each
