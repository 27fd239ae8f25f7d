"""Every compiled target of the formulas, evaluating element i at point i; each is compiled once, when first asked."""

import ctypes
import functools

import numba
import numpy as np
import warp as wp
from numba import types

from fieldsim import launch
from fieldsim.native.functions import native_function
from fieldsim.portable.lanes.kernels import items_of, lanes_kernel
from fieldsim.potentials import registry
from fieldsim.potentials.elements import pack
from fieldsim.potentials.row import ROW_WIDTH


def evaluate(target, elements, points):
    """F (N,) and its gradient (N, 3) of element i alone at points[i], in float64."""
    out = jets(target, elements.kinds, elements.rows, points)
    return out[:, 0], out[:, 1:4]


def jets(target, kinds, rows, points):
    """Jets (N, 10) in float64 of element i alone at points[i]; outputs start as NaN.

    target: "warp64", "warp32", "lanes64", "lanes32" or "numba".
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
        return jets_by_numba(_jet(kind), points, rows)
    scalar = wp.float32 if target.endswith("32") else wp.float64
    if target.startswith("lanes"):
        return _jets_in_lanes(kind, scalar, rows, points)
    arrays = [wp.array(a, dtype=scalar, device="cpu") for a in (points, rows, out)]
    launch.launch(_warp(kind, scalar), len(points), arrays[:2], arrays[2:], device="cpu")
    return arrays[2].numpy().astype(float)


# Value, gradient and the Hessian's rows, by their places in a jet.
MATRIX = (4, 7, 8, 7, 5, 9, 8, 9, 6)


def _jets_in_lanes(kind, scalar, rows, points):
    """As `jets`: where one row repeats, as fields do, the same in all lanes, else each lane with a row of its own."""
    alone = len(rows) > 0 and (rows == rows[0]).all()
    inputs = ("points", "table", "int" if alone else "integers")
    kernel = lanes_kernel(_jet(kind), scalar, inputs, ((0,), (1, 2, 3), MATRIX))
    index = 0 if alone else wp.array(np.arange(len(points)), dtype=wp.int32, device="cpu")
    vector = wp.types.vector(3, scalar)
    given = [wp.array(points, dtype=vector, device="cpu"), wp.array(rows, dtype=scalar, device="cpu"), index]
    shapes = {(): scalar, (3,): vector, (3, 3): wp.types.matrix((3, 3), scalar)}
    results = [
        wp.array(np.full((len(points), *shape), np.nan), dtype=dtype, device="cpu") for shape, dtype in shapes.items()
    ]
    launch.launch(kernel, items_of(len(points), scalar), given, results, device="cpu")
    value, gradient, hessian = (result.numpy().astype(float) for result in results)
    return np.column_stack([value, gradient, hessian.reshape(-1, 9)[:, [0, 4, 8, 1, 2, 5]]])


@functools.cache
def _jet(kind):
    return registry.formulas_of([kind])[kind].jet


def jets_by_numba(jet, points, rows):
    """Jets (N, 10) by a formula's numba twin for native code, of row i, or of the only one, at points (N, 3)."""
    points, rows = (np.ascontiguousarray(a, dtype=float) for a in (points, rows))
    out = np.full((len(points), 10), np.nan)
    _numba(jet)(points.ctypes.data, len(points), rows.ctypes.data, len(rows), out.ctypes.data)
    return out


@functools.cache
def _numba(jet):
    """The C function, kept on disk: numba takes seconds for a formula, in each process."""

    def make():
        twin = jet.native

        def one_each(points_at, count, rows_at, row_count, out_at):
            points = numba.carray(points_at, (count, 3))
            rows = numba.carray(rows_at, (row_count, ROW_WIDTH))
            out = numba.carray(out_at, (count, 10))
            for i in range(count):
                terms = twin(points[i, 0], points[i, 1], points[i, 2], rows, min(i, row_count - 1))
                for k, term in enumerate(terms):
                    out[i, k] = term

        return one_each

    reals = types.CPointer(types.float64)
    signature = types.void(reals, types.intp, reals, types.intp, reals)
    module = jet.bindings.get("kernel", jet).__module__.replace("fieldsim.potentials.formulas.", "")
    name = f"jet_{module}_{jet.__qualname__}".replace(".", "_")
    made = native_function(name, make, signature, folders=(), portables=[jet], takes=(ROW_WIDTH,))
    kinds = (ctypes.c_void_p, ctypes.c_ssize_t, ctypes.c_void_p, ctypes.c_ssize_t, ctypes.c_void_p)
    return ctypes.CFUNCTYPE(None, *kinds)(made.address)


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
