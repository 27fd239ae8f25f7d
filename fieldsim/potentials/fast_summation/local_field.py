"""A field of many elements that stand still, prepared for single points: read from tables by a portable function.

A box is divided into equal cells. Each has a local expansion of what is far, and a list of the elements near, which
are summed exactly; `LocalField.read`, with its `tables`, gives value and gradient at a point in numba, in Warp or in
lanes. Beyond the box all elements are summed.
"""

import dataclasses
import functools
import itertools
import math
import typing

import numpy as np

from fieldsim.portable import Indices, Portable, Table, hole, portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.elements import Elements
from fieldsim.potentials.fast_summation import chebyshev
from fieldsim.potentials.fast_summation.interactions import interactions, near_lists
from fieldsim.potentials.fast_summation.near import near_sums
from fieldsim.potentials.fast_summation.octree import Cube, built
from fieldsim.potentials.fast_summation.summation import (
    FIRST,
    TIGHTER,
    TRIALS,
    Group,
    Plan,
    groups_of,
    local_expansions,
    translations_of,
)

# Most pieces in a cell of sources; about how many elements a cell of the box has; the most cells along its edge.
PIECES, EACH, CELLS = 8, 2.0, 32
# Points of the box at which the error is looked at, and the factor by which it is trusted.
CHECKED, SAFETY = 200, 3.0

# How many polynomials there are along each axis; the sum over rows.
ORDER = hole()
total = hole("x, y, z, rows, kinds, first, count")


@portable
def _expansion(x: real, y: real, z: real, local: Table, cell: int):
    """A cell's expansion and its derivatives along x, y and z, by Clenshaw's recurrence along each."""
    zero = real(0.0)
    two = real(2.0)
    # Of the sums along x: value, derivatives along x, y and z; the last and the one before.
    f = zero
    fx = zero
    fy = zero
    fz = zero
    g = zero
    gx = zero
    gy = zero
    gz = zero
    for i in range(ORDER):
        p = zero
        py = zero
        pz = zero
        q = zero
        qy = zero
        qz = zero
        for j in range(ORDER):
            u = zero
            uz = zero
            v = zero
            vz = zero
            place = ((ORDER - 1 - i) * ORDER + ORDER - 1 - j) * ORDER + ORDER - 1
            for k in range(ORDER):
                w = local[cell, place - k] + two * z * u - v
                wz = two * u + two * z * uz - vz
                v = u
                vz = uz
                u = w
                uz = wz
            s = u - z * v + two * y * p - q
            sy = two * p + two * y * py - qy
            sz = uz - v - z * vz + two * y * pz - qz
            q = p
            qy = py
            qz = pz
            p = s
            py = sy
            pz = sz
        r = p - y * q + two * x * f - g
        rx = two * f + two * x * fx - gx
        ry = py - q - y * qy + two * x * fy - gy
        rz = pz - y * qz + two * x * fz - gz
        g = f
        gx = fx
        gy = fy
        gz = fz
        f = r
        fx = rx
        fy = ry
        fz = rz
    return f - x * g, fx - g - x * gx, fy - x * gy, fz - x * gz


expansion = hole("x, y, z, local, cell")


@portable
def _read(
    x: real,
    y: real,
    z: real,
    box: Table,
    cells: Indices,
    local: Table,
    begin: Indices,
    ranges: Indices,
    rows: Table,
    kinds: Indices,
):
    """Value and gradient at a point, of the tables of a `LocalField`."""
    edge = int(box[0, 4])
    count = int(box[0, 5])
    u = (x - box[0, 0]) * box[0, 3]
    v = (y - box[0, 1]) * box[0, 3]
    w = (z - box[0, 2]) * box[0, 3]
    most = real(edge)
    if u < real(0.0) or v < real(0.0) or w < real(0.0) or u >= most or v >= most or w >= most:
        return total(x, y, z, rows, kinds, 0, count)
    i = int(u)
    j = int(v)
    k = int(w)
    cell = cells[(i * edge + j) * edge + k]
    if cell < 0:
        return total(x, y, z, rows, kinds, 0, count)
    half = real(0.5)
    two = real(2.0)
    f, fx, fy, fz = expansion(
        two * (u - real(i) - half), two * (v - real(j) - half), two * (w - real(k) - half), local, cell
    )
    scale = two * box[0, 3]
    fx *= scale
    fy *= scale
    fz *= scale
    for one in range(begin[cell], begin[cell + 1]):
        first = ranges[2 * one]
        g, gx, gy, gz = total(x, y, z, rows, kinds, first, ranges[2 * one + 1] - first)
        f += g
        fx += gx
        fy += gy
        fz += gz
    return f, fx, fy, fz


@dataclasses.dataclass(frozen=True)
class LocalField:
    """A field that `read(x, y, z, *tables)` gives at any point: value, and gradient along x, y and z.

    tables: the box, its cells, expansions, lists of what is near, and all pieces of elements, as NumPy arrays.
    """

    read: Portable = dataclasses.field(repr=False)
    tables: tuple[np.ndarray, ...] = dataclasses.field(repr=False)
    order: int


class _Cells(typing.NamedTuple):
    """The cells of a box, those of a level of a group's tree: corner, width, cells along the edge, which (C, 3)."""

    low: np.ndarray
    width: float
    edge: int
    which: np.ndarray

    @property
    def middles(self) -> np.ndarray:
        """The cells' middles (C, 3)."""
        return self.low + (self.which + 0.5) * self.width


def local_field(elements: Elements, low, high, tolerance: float) -> LocalField:
    """The field of elements, prepared for points from `low` to `high` (3,); an error relative to the largest value.

    The largest error, as seen at some points of the box and trusted with a factor, is below the tolerance times the
    largest value there of the field with strengths without signs; where this cannot be, all is exact.
    """
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    width = float((high - low).max())
    edge = 2 ** int(np.clip(round(math.log(max(len(elements) / EACH, 1.0), 8.0)), 1, math.log2(CELLS)))
    cells = _Cells(0.5 * (low + high) - 0.5 * width, width / edge, edge, _grid(edge))
    groups, alone = groups_of(elements, 1, functools.partial(Group, most=PIECES, within=Cube(cells.low, width)))
    order, parts = 1, []
    for group in groups:
        expansions, lists = _expanded(group, cells, tolerance)
        order = max(order, expansions.shape[1])
        parts.append((group.pieces.rows, group.pieces.kinds, expansions, lists))
    if alone.any():
        rest = elements.rows[alone]
        everywhere = [np.array([[0, len(rest)]])] * len(cells.which)
        parts.append((rest, elements.kinds[alone], np.zeros((len(cells.which), 1, 1, 1)), everywhere))
    return _assembled(cells, order, parts)


def _expanded(group, cells, tolerance):
    """Local expansions (C, p, p, p), in Chebyshev polynomials, and near lists, (R, 2) each, of a group in the cells."""
    tree = group.pieces.tree
    level = round(math.log2(tree.root.width / cells.width))
    targets = built(tree.root, len(cells.which), lambda items: cells.middles[items], 1, deepest=level)
    planned = Plan([], tree, targets, interactions(tree, targets, group.reach, 0, 0), group.amounts, cells.middles)
    lists, begin, ranges = near_lists(tree, targets, planned.acting.near)
    own = np.empty(len(lists), dtype=np.int64)
    own[targets.order] = lists
    near = [ranges[begin[k] : begin[k + 1]] for k in own]
    probe = _Probe(group, cells, near)
    for trial in range(TRIALS):
        moved = translations_of(group, planned, FIRST * tolerance * TIGHTER**trial * probe.scale)
        found = np.zeros((len(cells.which), 1, 1, 1))
        for number, leaf, local in local_expansions(group, planned, moved, tolerance):
            found = np.zeros((len(cells.which), *local.shape[1:])) if found.shape[1] == 1 else found
            found[targets.order[targets.levels[number].first[leaf]]] = local
        if SAFETY * probe.error(found) <= tolerance * probe.scale:
            scale = chebyshev.scales(found.shape[1])
            return found * scale[:, None, None] * scale[:, None] * scale, near
    return np.zeros((len(cells.which), 1, 1, 1)), [np.array([[0, len(group.pieces)]])] * len(near)


class _Probe:
    """Points of the box at which a group's expansions and near lists are compared with exact sums."""

    def __init__(self, group, cells, near):
        rng = np.random.default_rng(2)
        self._cell = np.sort(rng.integers(0, len(cells.which), CHECKED))
        self._places = rng.uniform(-1.0, 1.0, (CHECKED, 3))
        points = cells.middles[self._cell] + 0.5 * cells.width * self._places
        unsigned = group.exact(points, 0, unsigned=True)[0]
        self.scale = float(unsigned[np.isfinite(unsigned)].max(initial=0.0))
        begin = np.cumsum([0, *(len(near[cell]) for cell in self._cell)])
        ranges = np.concatenate([np.zeros((0, 2), dtype=np.int64), *(near[cell] for cell in self._cell)])
        lists = np.arange(CHECKED)
        sums = near_sums(points, lists, begin, ranges, group.tables, group.kinds_used, 0)[0]
        self._far = group.exact(points, 0)[0] - sums

    def error(self, expansions) -> float:
        """The largest error of the value."""
        x, y, z = (chebyshev.basis(self._places[:, axis], expansions.shape[1]) for axis in range(3))
        errors = np.abs(np.einsum("na,nb,nc,nabc->n", x, y, z, expansions[self._cell]) - self._far)
        return float(errors[np.isfinite(errors)].max(initial=0.0))


def _grid(edge):
    return np.array(list(itertools.product(range(edge), repeat=3)))


def _assembled(cells, order, parts):
    """The tables of all groups together."""
    local = np.zeros((len(cells.which), order, order, order))
    lists, shift = [[] for _ in cells.which], 0
    for rows, _kinds, expansions, own in parts:
        degree = expansions.shape[1]
        local[:, :degree, :degree, :degree] += expansions
        for into, ranges in zip(lists, own, strict=True):
            into.append(ranges + shift)
        shift += len(rows)
    whole = [np.concatenate([np.zeros((0, 2), dtype=np.int64), *ranges]) for ranges in lists]
    begin = np.cumsum([0, *map(len, whole)]).astype(np.int32)
    rows, kinds = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    box = np.array([[*cells.low, 1.0 / cells.width, cells.edge, len(rows)]])
    tables = (
        *(box, np.arange(len(cells.which), dtype=np.int32), local.reshape(len(local), -1), begin),
        *(np.concatenate(whole).astype(np.int32).ravel(), rows, kinds.astype(np.int32)),
    )
    return LocalField(_reader(tuple(np.unique(kinds).tolist()), order), tables, order)


@functools.cache
def _reader(kinds_used, order):
    return _read.bind(expansion=_expansion.bind(ORDER=order), total=registry.field_sum(kinds_used))
