"""Registry of formulas: which portable function evaluates which primitive under which kernel.

A formula's `jet(x, y, z, rows, i)` returns (F, Fx, Fy, Fz, Fxx, Fyy, Fzz, Fxy, Fxz, Fyz) of row i at (x, y, z): value,
gradient and Hessian in one evaluation (`potentials.row` says what stands in a row). Who needs less takes less:
compilers drop what is left unused.
"""

import dataclasses
import functools
import itertools

import numpy as np

from fieldsim.errors import InputError
from fieldsim.portable import Indices, Portable, Table, hole, portable, real


@dataclasses.dataclass(frozen=True)
class Formula:
    """What evaluates a primitive under a kernel. `kind` is the number that element arrays carry."""

    kind: int
    kernel: type
    primitive: type
    jet: Portable = dataclasses.field(compare=False)


FORMULAS: dict[tuple[type, type], Formula] = {}
# No number is given twice, so that what was compiled for one is never taken for another's.
_numbers = itertools.count()


def register(kernel: type, primitive: type, jet: Portable) -> None:
    """Enter a formula into the registry."""
    if (kernel, primitive) in FORMULAS:
        raise InputError(f"{kernel.__name__} on {primitive.__name__} is registered already")
    FORMULAS[kernel, primitive] = Formula(next(_numbers), kernel, primitive, jet)


def unregister(kernel: type) -> None:
    """Take all formulas of a kernel out of the registry; fields made with it can then not be evaluated."""
    for key in [key for key in FORMULAS if key[0] is kernel]:
        del FORMULAS[key]


def kernels() -> list[type]:
    """The kernels that have formulas, in the order of registration."""
    return list(dict.fromkeys(kernel for kernel, _primitive in FORMULAS))


def formula_of(kernel, primitive) -> Formula:
    """The formula of a kernel and a primitive (instances)."""
    try:
        return FORMULAS[type(kernel), type(primitive)]
    except KeyError:
        near = [pair for pair in FORMULAS if type(kernel) is pair[0] or type(primitive) is pair[1]]
        known = ", ".join(sorted(f"{k.__name__} on {p.__name__}" for k, p in near or FORMULAS))
        raise InputError(f"no field is known for {kernel!r} on {primitive!r}; known: {known}") from None


def formulas_of(kinds) -> dict[int, Formula]:
    """The formulas of some numbers, by these and in the order of registration.

    Raises InputError for a number whose formula is not registered any more.
    """
    wanted = {int(kind) for kind in kinds}
    found = {formula.kind: formula for formula in FORMULAS.values() if formula.kind in wanted}
    if missing := sorted(wanted - set(found)):
        raise InputError(
            f"formulas {missing} are not registered any more; register their kernel again, and make the field anew"
        )
    return found


def parts_of(kinds: np.ndarray) -> list[tuple["Formula", np.ndarray | slice]]:
    """The formulas among element kinds (N,), each with where it is: an index of arrays whose axis is the elements'."""
    present = list(formulas_of(np.unique(kinds)).values())
    if len(present) == 1:
        return [(present[0], slice(None))]
    return [(formula, kinds == formula.kind) for formula in present]


# What `by_kind` and the functions below it fill.
kind = hole()
function = hole("x, y, z, rows, i")
below = hole("x, y, z, rows, kinds, i")
others = hole("x, y, z, rows, kinds, i")
jet = hole("x, y, z, rows, kinds, i")
one = hole("x, y, z, rows, kinds, i")


@portable
def _alone(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int):
    return function(x, y, z, rows, i)


@portable
def _choose(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int):
    if kinds[i] < kind:
        return below(x, y, z, rows, kinds, i)
    return others(x, y, z, rows, kinds, i)


@portable
def _nothing(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int):
    zero = real(0.0)
    return zero, zero, zero, zero, zero, zero, zero, zero, zero, zero


def by_kind(functions: dict[int, Portable]) -> Portable:
    """Portable (x, y, z, rows, kinds, i) -> what the function of element i's kind, of (x, y, z, rows, i), returns.

    It halves the kinds, so that calls nest as deep as the logarithm of their number.
    """
    kinds = sorted(functions)
    if len(kinds) == 1:
        return _alone.bind(function=functions[kinds[0]])
    half = len(kinds) // 2
    below, others = (by_kind({kind: functions[kind] for kind in part}) for part in (kinds[:half], kinds[half:]))
    return _choose.bind(kind=kinds[half], below=below, others=others)


@functools.cache
def element_jet(kinds_used: tuple[int, ...]) -> Portable:
    """Portable (x, y, z, rows, kinds, i) -> the jet of element i, knowing only the given kinds."""
    jets = {kind: formula.jet for kind, formula in formulas_of(kinds_used).items()}
    return by_kind(jets) if jets else _nothing


@portable
def _without_hessian(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int):
    f, fx, fy, fz, _xx, _yy, _zz, _xy, _xz, _yz = jet(x, y, z, rows, kinds, i)
    return f, fx, fy, fz


@functools.cache
def element_field(kinds_used: tuple[int, ...]) -> Portable:
    """Portable (x, y, z, rows, kinds, i) -> (F, dF/dx, dF/dy, dF/dz) of element i, knowing only the given kinds."""
    return _without_hessian.bind(jet=element_jet(kinds_used))


@portable
def _sum(x: real, y: real, z: real, rows: Table, kinds: Indices, first: int, count: int):
    f = real(0.0)
    fx = real(0.0)
    fy = real(0.0)
    fz = real(0.0)
    for i in range(first, first + count):
        f_i, fx_i, fy_i, fz_i = one(x, y, z, rows, kinds, i)
        f += f_i
        fx += fx_i
        fy += fy_i
        fz += fz_i
    return f, fx, fy, fz


@functools.cache
def field_sum(kinds_used: tuple[int, ...]) -> Portable:
    """Portable (x, y, z, rows, kinds, first, count) -> (F and its gradient) over rows first..first+count-1."""
    return _sum.bind(one=element_field(kinds_used))


@portable
def _sum_of_jets(x: real, y: real, z: real, rows: Table, kinds: Indices, first: int, count: int):
    f = real(0.0)
    fx = real(0.0)
    fy = real(0.0)
    fz = real(0.0)
    xx = real(0.0)
    yy = real(0.0)
    zz = real(0.0)
    xy = real(0.0)
    xz = real(0.0)
    yz = real(0.0)
    for i in range(first, first + count):
        f_i, fx_i, fy_i, fz_i, xx_i, yy_i, zz_i, xy_i, xz_i, yz_i = one(x, y, z, rows, kinds, i)
        f += f_i
        fx += fx_i
        fy += fy_i
        fz += fz_i
        xx += xx_i
        yy += yy_i
        zz += zz_i
        xy += xy_i
        xz += xz_i
        yz += yz_i
    return f, fx, fy, fz, xx, yy, zz, xy, xz, yz


@functools.cache
def jet_sum(kinds_used: tuple[int, ...]) -> Portable:
    """Portable (x, y, z, rows, kinds, first, count) -> the jet summed over rows first..first+count-1."""
    return _sum_of_jets.bind(one=element_jet(kinds_used))
