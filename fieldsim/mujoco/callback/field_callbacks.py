"""Fields of packed elements behind one address each, so that the code that uses them is compiled once for all fields.

A *sum* of a `Source` (its `field`, `jet`, `margin`, `weight` or `foot`) is the address of a C function in native code,
and a portable function in Python. `caller(name, native)` calls it either way.
"""

import ctypes
import functools

import numba
import numpy as np
from numba import types

from fieldsim.mujoco.callback.addresses import call_sum, doubles, halves
from fieldsim.mujoco.callback.feet import near_foot_of, weight_of
from fieldsim.mujoco.callback.pulls import INPUTS, OUTPUTS, pull_of
from fieldsim.mujoco.callback.rows import PULL_ENERGY
from fieldsim.native import fingerprint, inner, lanes_function_at, native_function
from fieldsim.potentials import registry
from fieldsim.sources.margins import margin_of

# How many numbers each gives: F and its gradient; also the Hessian; the distance within which no surface can be; a sum
# of weighted fields and its gradient; that foot of a point on the element `first` which has the number `count`, and its
# margin.
LENGTHS = {"field": 4, "jet": 10, "margin": 1, "weight": 4, "foot": 4}
# The modules that C functions of sums are made of, but for portable functions.
_FOLDERS = "mujoco/callback/field_callbacks.py", "mujoco/callback/addresses.py", "native", "portable/function.py"
_PORTABLE = {
    "field": registry.field_sum,
    "jet": registry.jet_sum,
    "margin": margin_of,
    "weight": weight_of,
    "foot": near_foot_of,
}


def sum_of(name: str, kinds_used, native: bool):
    """The sum of the given formulas: an address, or a portable function."""
    if native:
        return _compiled(name, kinds_used).address
    return _tuple_of(_PORTABLE[name](kinds_used), LENGTHS[name], lambda function: function)


_FUNCTION = ctypes.CFUNCTYPE(None, *[ctypes.c_double] * 3, *[ctypes.c_void_p] * 6)


def values_of(total, rows: np.ndarray, kinds: np.ndarray, first: int, count: int):
    """Function (points (n, 3)) -> the field (n,) of rows first to first + count - 1, by their sum `total`."""

    def natively(points):
        found, call = np.empty((len(points), LENGTHS["field"])), _FUNCTION(total)
        for out, point in zip(found, points.tolist(), strict=True):
            call(*point, rows.ctypes.data, rows.shape[1], kinds.ctypes.data, first, count, out.ctypes.data)
        return found[:, 0]

    def in_python(points):
        return np.array([total(*point, rows, kinds, first, count)[0] for point in points.tolist()])

    return in_python if callable(total) else natively


def _tuple_of(total, length, make):
    """A sum whose result is a tuple, also of one number."""
    if length > 1:
        return total

    @make
    def alone(x, y, z, rows, kinds, first, count):
        return (total(x, y, z, rows, kinds, first, count),)

    return alone


@functools.cache
def _compiled(name, kinds_used):
    """C function (x, y, z, rows, length of a row, kinds, first, count, out)."""
    total = _PORTABLE[name](kinds_used)
    real, word = types.float64, types.intp
    return native_function(
        f"{name}-{fingerprint.digest(kinds_used)[:8]}",
        lambda: _function_of(_tuple_of(total.native, LENGTHS[name], inner), LENGTHS[name]),
        types.void(real, real, real, word, word, word, word, word, word),
        folders=_FOLDERS,
        portables=(total,),
    )


def _function_of(total, length):
    def function(x, y, z, rows, width, kinds, first, count, out):
        table = numba.carray(doubles(rows), (first + count + 1, width))
        result = numba.carray(doubles(out), (length,))
        found = total(x, y, z, table, numba.carray(halves(kinds), (first + count + 1,)), first, count)
        for i, number in enumerate(found):
            result[i] = number

    return function


def pull_sums(accuracy: str, kinds_used, native: bool):
    """The pull on a point by elements of given formulas (`pulls.pull_of`), with its energy and, if native, without.

    Each is an address in lanes, or portable.
    """
    pull = pull_of(accuracy, kinds_used)
    if not native:
        return pull, pull
    kind = f"{'torque' if accuracy == 'torque' else 'points'}-{fingerprint.digest(kinds_used)[:8]}"
    wanted = {"pull": OUTPUTS, "force": OUTPUTS[:PULL_ENERGY]}
    return tuple(lanes_function_at(f"{n}-{kind}", pull, INPUTS, places).address for n, places in wanted.items())


@functools.cache
def caller(name: str, native: bool):
    """Function (x, y, z, source, first, count) -> what the source's sum of that name gives over those rows."""
    if not native:

        def call(x, y, z, source, first, count):
            return getattr(source, name)(x, y, z, source.rows, source.kinds, first, count)

        return call
    invoke = call_sum(LENGTHS[name])
    place = list(LENGTHS).index(name)

    @inner
    def call_native(x, y, z, source, first, count):
        address = (source.field, source.jet, source.margin, source.weight, source.foot)[place]
        rows, kinds = source.rows, source.kinds
        return invoke(address, x, y, z, rows.ctypes.data, rows.shape[1], kinds.ctypes.data, first, count)

    return call_native
