"""Pieces of elements: what of points and curves lies in the cells of an octree."""

import numpy as np

from fieldsim.numerics.quadrature import gauss_legendre
from fieldsim.potentials import registry
from fieldsim.potentials.elements import Elements
from fieldsim.potentials.fast_summation.octree import Cube, Octree, built, doubled, enclosing
from fieldsim.potentials.row import ANGLE, LENGTH, RADIUS, STRENGTH

# What sticks out of a cell by less than this share of a piece is not cut off.
OVERHANG = 1e-6
# No more pieces are made than so many times the elements, and some.
SHARE, SOME = 3, 20_000
# Quadrature: more nodes than these no piece in a cell needs.
MOST_NODES = 40


class Pieces:
    """Elements of one kernel, points and curves, cut at the cells of an octree with at most `most` pieces in a leaf.

    within: a cell that the octree's root is, doubled until it holds all elements.

    rows (N, ROW_WIDTH), kinds (N,): the pieces as elements, in the tree's order.
    """

    def __init__(self, elements: Elements, most: int, within: Cube | None = None):
        self._rows, self._parts = elements.rows, registry.parts_of(elements.kinds)
        count = len(elements)
        self._element: np.ndarray = np.arange(count)
        self._begin: np.ndarray = np.zeros(count)
        self._end: np.ndarray = np.ones(count)
        self._limit = SHARE * count + SOME
        boxes = [formula.primitive.row_box(self._rows[which]) for formula, which in self._parts]
        low, high = (np.concatenate(side) for side in zip(*boxes, strict=True))
        low, high = low.min(axis=0), high.max(axis=0)
        root = enclosing(low, high) if within is None else doubled(within, low, high)
        self.tree: Octree = built(root, count, self._middles, most, cut=self._cut)
        self.rows, self.kinds = self._packed(elements.kinds)

    def __len__(self) -> int:
        return len(self.kinds)

    def _each(self, items):
        """(formula, which of the items are its, as an index; their rows)."""
        element = self._element[items]
        for formula, which in self._parts:
            mine = np.arange(len(items)) if isinstance(which, slice) else np.flatnonzero(which[element])
            if mine.size:
                yield formula, mine, self._rows[element[mine]]

    def _places(self, items, u):
        """Points (N, 3) of items' elements at parameters (N,)."""
        found = np.empty((len(items), 3))
        for formula, mine, rows in self._each(items):
            found[mine] = formula.primitive.row_places(rows, u[mine, None], u[mine, None])
        return found

    def _middles(self, items):
        return self._places(items, 0.5 * (self._begin[items] + self._end[items]))

    def _cut(self, items, cells, middles):
        """See `octree.built`."""
        kept = self._element, self._begin, self._end
        for axis in range(3):
            todo = np.arange(len(items))
            while todo.size:
                u = self._crossings(items[todo], axis, middles[todo, axis])
                crossed = np.isfinite(u)
                todo, u = todo[crossed], u[crossed]
                added = len(self._element) + np.arange(len(todo))
                if len(self._element) + len(todo) > self._limit:
                    self._element, self._begin, self._end = kept
                    return None
                old = items[todo]
                self._element = np.concatenate([self._element, self._element[old]])
                self._begin = np.concatenate([self._begin, u])
                self._end = np.concatenate([self._end, self._end[old]])
                self._end[old] = u
                cells, middles = np.concatenate([cells, cells[todo]]), np.concatenate([middles, middles[todo]])
                items = np.concatenate([items, added])
                todo = len(items) - len(added) + np.arange(len(added))
        return items, cells

    def _crossings(self, items, axis, planes):
        """Parameters (N,) where items cross planes (N,) within themselves; nan: nowhere."""
        begin, end = self._begin[items], self._end[items]
        margin = OVERHANG * (end - begin)
        found = np.full(len(items), np.nan)
        for formula, mine, rows in self._each(items):
            if formula.primitive.dimension:
                inside = begin[mine] + margin[mine], end[mine] - margin[mine]
                found[mine] = formula.primitive.row_crossing(rows, axis, planes[mine], *inside)
        return found

    def _packed(self, kinds):
        """Rows and kinds of the pieces, in the tree's order."""
        order = self.tree.order
        self._element, self._begin, self._end = self._element[order], self._begin[order], self._end[order]
        kinds, rows = kinds[self._element], np.empty((len(self._element), self._rows.shape[1]))
        cut = (self._begin > 0.0) | (self._end < 1.0)
        for formula, mine, own in self._each(np.arange(len(kinds))):
            rows[mine] = own
            some = mine[cut[mine]]
            if some.size:
                rows[some] = formula.primitive.row_part(own[cut[mine]], self._begin[some], self._end[some])
                kinds[some] = registry.FORMULAS[formula.kernel, formula.primitive.part].kind
        return rows, kinds

    def amounts(self) -> np.ndarray:
        """The sizes of strength times measure (N,)."""
        found = np.empty(len(self))
        for formula, which in registry.parts_of(self.kinds):
            found[which] = np.abs(self.rows[which, STRENGTH]) * formula.primitive.row_measure(self.rows[which])
        return found

    def charges(self, width: np.ndarray, digits: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points that stand for pieces from afar: which piece (n,), ascending, positions (n, 3), amounts (n,).

        width (N,): of each piece's cell, within which nothing is that sees it from afar; they are right to
        exp(-digits).
        """
        found = []
        for formula, which in registry.parts_of(self.kinds):
            own = np.arange(len(self))[which]
            rows, primitive = self.rows[own], formula.primitive
            counts = _nodes_needed(primitive, rows, width[own], digits)
            for count in np.unique(counts):
                some = counts == count
                found.append(_charges(primitive, own[some], rows[some], int(count)))
        which, positions, amounts = (np.concatenate(parts) for parts in zip(*found, strict=True))
        by = np.argsort(which, kind="stable")
        return which[by], positions[by], amounts[by]


def _nodes_needed(primitive, rows, clearance, digits):
    """Gauss nodes (N,) along pieces for exp(-digits): see `primitives.quadrature.interval_needed`."""
    if primitive.dimension == 0:
        return np.ones(len(rows), dtype=int)
    away = clearance / (0.5 * primitive.row_measure(rows) if primitive.uniform else 0.5 * rows[:, LENGTH])
    if primitive.round:
        # The singularity over an arc, in its angle.
        away = np.minimum(away, np.arcsinh(clearance / rows[:, RADIUS]) / (0.5 * rows[:, ANGLE]))
    needed = digits / (2.0 * np.arcsinh(away))
    return np.clip(np.ceil(needed), 2, MOST_NODES).astype(int)


def _charges(primitive, which, rows, count):
    nodes, weights = (np.zeros(1), np.ones(1)) if primitive.dimension == 0 else gauss_legendre(count)
    u = np.tile(nodes, len(rows))[:, None]
    positions = primitive.row_places(np.repeat(rows, count, axis=0), u, u)
    amounts = primitive.row_density(rows, np.broadcast_to(nodes, (len(rows), count))) * weights
    return np.repeat(which, count), positions, (amounts * rows[:, STRENGTH, None]).ravel()
