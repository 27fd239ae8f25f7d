"""The chart of cells: which portable function evaluates which primitive under which kernel.

An element is one primitive with its kernel, packed as a row of `WIDTH` reals, in the frame of its body:

| columns | content |
|---|---|
| 0 STRENGTH | factor on the integral |
| 1 KERNEL | the kernel's parameter: s, a or softening |
| 2 SIZE | a segment's length, an arc's radius |
| 3 ANGLE | an arc's angle |
| 4 FOLD | a Gaussian's folded exponent: h = exp(FOLD - a^2 r^2), so that exp(256) never stands alone |
| 5-7, 8-10, 11-13 | positions: a point; a segment's start and end; an arc's centre |
| 14-16, 17-19 | unit directions: a segment's axis; an arc's start and normal |
| 20-34 | numbers of its own: a profile's shape, degree and coefficients |

A cell's `jet(x, y, z, rows, i)` returns (F, Fx, Fy, Fz, Fxx, Fyy, Fzz, Fxy, Fxz, Fyz) of row i at (x, y, z): value,
gradient and Hessian in one evaluation. Who needs less takes less: compilers drop what is left unused.
"""

import dataclasses
import functools

import numpy as np

from fieldsim.errors import InputError
from fieldsim.portable import Indices, Portable, Table, portable, real

STRENGTH, KERNEL, SIZE, ANGLE, FOLD = range(5)
POSITIONS = slice(5, 14)
DIRECTIONS = slice(14, 20)
OWN = slice(20, 35)
WIDTH = 35
# Softenings below this are none: their powers are no numbers.
BARE = 1e-60


@dataclasses.dataclass(frozen=True)
class Cell:
    """One entry of the chart. `kind` is the number that element arrays carry."""

    kind: int
    kernel: type
    primitive: type
    jet: Portable = dataclasses.field(compare=False)


CELLS: dict[tuple[type, type], Cell] = {}


def register(kernel: type, primitive: type, jet: Portable) -> None:
    """Enter a cell into the chart."""
    if (kernel, primitive) in CELLS:
        raise InputError(f"{kernel.__name__} on {primitive.__name__} is in the chart already")
    CELLS[kernel, primitive] = Cell(len(CELLS), kernel, primitive, jet)


def cell_of(kernel, primitive) -> Cell:
    """The cell of a kernel and a primitive (instances)."""
    try:
        return CELLS[type(kernel), type(primitive)]
    except KeyError:
        known = ", ".join(sorted(f"{k.__name__} on {p.__name__}" for k, p in CELLS))
        raise InputError(f"no field is known for {kernel!r} on {primitive!r}; known: {known}") from None


@dataclasses.dataclass(frozen=True)
class Elements:
    """Packed elements, grouped by cell. rows (N, WIDTH) float64; kinds (N,) int32; order: where each came from."""

    rows: np.ndarray
    kinds: np.ndarray
    order: np.ndarray

    @property
    def kinds_used(self) -> tuple[int, ...]:
        """The kinds that occur, ascending: the key under which code is compiled."""
        return tuple(np.unique(self.kinds).tolist())

    def __len__(self) -> int:
        return len(self.kinds)

    def scaled(self, factor: float) -> "Elements":
        """The elements with their strengths multiplied."""
        rows = self.rows.copy()
        rows[:, STRENGTH] *= factor
        _quiet(rows)
        return dataclasses.replace(self, rows=rows)

    def grouped(self) -> tuple["Elements", np.ndarray]:
        """The elements sorted by cell, and the permutation that sorts them."""
        by = np.argsort(self.kinds, kind="stable")
        return Elements(self.rows[by], self.kinds[by], self.order[by]), by


def parts_of(kinds: np.ndarray) -> list[tuple["Cell", np.ndarray | slice]]:
    """The cells among element kinds (N,), each with where it is: an index of arrays whose axis is the elements'."""
    used = set(np.unique(kinds).tolist())
    present = [cell for cell in CELLS.values() if cell.kind in used]
    if len(present) == 1:
        return [(present[0], slice(None))]
    return [(cell, kinds == cell.kind) for cell in present]


def pack(primitives, kernels, strengths, folds=None) -> Elements:
    """Elements of concrete primitives, one kernel and one strength each, grouped by cell."""
    rows = np.zeros((len(primitives), WIDTH))
    kinds = np.zeros(len(primitives), dtype=np.int32)
    for row, (primitive, kernel) in enumerate(zip(primitives, kernels, strict=True)):
        kinds[row] = cell_of(kernel, primitive).kind
        rows[row, KERNEL] = kernel.width
        primitive.pack(rows[row])
    rows[:, STRENGTH] = strengths
    rows[:, FOLD] = 0.0 if folds is None else folds
    _quiet(rows)
    return Elements(rows, kinds, np.arange(len(kinds))).grouped()[0]


def _quiet(rows):
    """Soften what has no strength: 0 times the infinite field of a bare source is 0, not nan."""
    rows[(rows[:, STRENGTH] == 0.0) & (rows[:, KERNEL] < BARE), KERNEL] = 1.0


def concatenate(parts) -> Elements:
    """Several `Elements` as one, kept in the given order (not grouped again)."""
    parts = list(parts)
    if not parts:
        return Elements(np.zeros((0, WIDTH)), np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.int64))
    return Elements(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("rows", "kinds", "order")))


def place(rows: np.ndarray, rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Rows moved from the body's frame to the world's: x -> rotation x + position.

    rows (..., WIDTH); rotation (..., 3, 3) and position (..., 3) may differ from row to row.
    """
    placed = rows.copy()
    shape = rows.shape[:-1]
    turn = np.swapaxes(rotation, -1, -2)
    positions = rows[..., POSITIONS].reshape(*shape, 3, 3) @ turn + position[..., None, :]
    placed[..., POSITIONS] = positions.reshape(*shape, 9)
    placed[..., DIRECTIONS] = (rows[..., DIRECTIONS].reshape(*shape, 2, 3) @ turn).reshape(*shape, 6)
    return placed


@portable
def _alone(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int):
    return function(x, y, z, rows, i)  # noqa: F821 - bound by `by_kind`


@portable
def _choose(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int):
    if kinds[i] < kind:  # noqa: F821 - bound by `by_kind`
        return below(x, y, z, rows, kinds, i)  # noqa: F821
    return others(x, y, z, rows, kinds, i)  # noqa: F821


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
    jets = {cell.kind: cell.jet for cell in CELLS.values() if cell.kind in kinds_used}
    return by_kind(jets) if kinds_used else _nothing


@portable
def _without_hessian(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int):
    f, fx, fy, fz, _xx, _yy, _zz, _xy, _xz, _yz = jet(x, y, z, rows, kinds, i)  # noqa: F821 - bound by `element_field`
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
        f_i, fx_i, fy_i, fz_i = one(x, y, z, rows, kinds, i)  # noqa: F821 - bound by `field_sum`
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
        f_i, fx_i, fy_i, fz_i, xx_i, yy_i, zz_i, xy_i, xz_i, yz_i = one(  # noqa: F821 - bound by `jet_sum`
            x, y, z, rows, kinds, i
        )
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
