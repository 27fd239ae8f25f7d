"""Octrees whose cells hold few items: points, or pieces of elements that are cut at the faces of cells."""

import dataclasses
import itertools
import math
from collections.abc import Callable

import numpy as np

# No cell is divided further, nor where its width comes to this share of coordinates: what lies that close is one place.
DEEPEST, GRAIN = 36, 2.0**-44
# The significant bits of a root's width, and of its corner in terms of that: all cells' middles are then exact numbers.
BITS, CORNER_BITS = 6, 10
# The least width of a root, as a share of coordinates.
LEAST = 2.0**-20
# A root is doubled no further: what lies farther away is summed exactly.
FARTHEST_DOUBLING = 45


@dataclasses.dataclass(frozen=True)
class Cube:
    """A root cell: its least corner (3,) and its width."""

    low: np.ndarray
    width: float

    @property
    def deepest(self) -> int:
        """The level below which no cell is divided."""
        most = float(np.abs([self.low, self.low + self.width]).max())
        return min(DEEPEST, max(0, math.floor(math.log2(self.width / most / GRAIN))))

    def centers(self, coordinates: np.ndarray, level: int) -> np.ndarray:
        """The middles (N, 3) of cells (N, 3) of a level, counted from the least corner; they may lie outside."""
        return self.low + (coordinates + 0.5) * (self.width * 0.5**level)


@dataclasses.dataclass
class Level:
    """The cells of a level, those with items: where, how many items lie below, which, and the links between levels.

    coordinates: (C, 3) integers; items first .. first + count - 1 of the tree's order; parent: (C,) indices in the
    level above; child: (C,) the index of the first of `children` (C,) cells in the level below. Cells are sorted by
    their parents, then by octant (x is bit 2, z bit 0).
    """

    coordinates: np.ndarray
    parent: np.ndarray
    octant: np.ndarray
    count: np.ndarray
    first: np.ndarray
    child: np.ndarray
    children: np.ndarray

    def __len__(self) -> int:
        return len(self.count)

    @property
    def leaves(self) -> np.ndarray:
        """Which cells have no children, as a mask."""
        return self.children == 0


@dataclasses.dataclass(frozen=True)
class Octree:
    """Levels from the root down, and the items in the order of its leaves."""

    root: Cube
    levels: list[Level]
    order: np.ndarray

    def below(self, octants: list[int]) -> "Octree":
        """The tree with roots above its own, each twice as wide: octants of the cell below in each, from the top."""
        if not octants:
            return self
        levels, shift = [], np.zeros(3, dtype=np.int64)
        low, width = self.root.low, self.root.width * 2.0 ** len(octants)
        zero, count = np.zeros(1, dtype=np.int64), self.levels[0].count
        for number, octant in enumerate([0, *octants]):
            shift = 2 * shift + bits(np.array(octant))
            above = Level(shift[None], zero, np.array([octant if number else 0]), count, zero, zero, zero + 1)
            levels.append(above)
        low = low - shift * self.root.width
        top = levels.pop()
        for depth, level in enumerate(self.levels):
            moved = dataclasses.replace(level, coordinates=level.coordinates + shift * 2**depth)
            if depth == 0:
                moved.octant, moved.parent = top.octant, zero
            levels.append(moved)
        return Octree(Cube(low, width), levels, self.order)


def bits(octant: np.ndarray) -> np.ndarray:
    """The halves (..., 3) of x, y and z that octants (...,) are: 0 or 1."""
    return octant[..., None] >> np.array([2, 1, 0]) & 1


def enclosing(low: np.ndarray, high: np.ndarray, bits: int = BITS) -> Cube:
    """A cube around a box; bits: of its width that are significant."""
    size, most = float((high - low).max()), float(np.abs([low, high]).max())
    width = max(size * (1.0 + 2.0 ** (2 - CORNER_BITS)), LEAST * most, 1e-300)
    mantissa, exponent = math.frexp(width)
    width = math.ldexp(math.ceil(mantissa * 2.0**bits), exponent - bits)
    grid = math.ldexp(1.0, exponent - CORNER_BITS)
    return Cube(np.floor((0.5 * (low + high) - 0.5 * width) / grid + 0.5) * grid, width)


def doublings(root: Cube, low: np.ndarray, high: np.ndarray) -> list[int]:
    """The octants, from the top, by which `Octree.below` doubles a root until it holds a box."""
    octants, corner, width = [], root.low.copy(), root.width
    while (low < corner).any() or (high > corner + width).any():
        if len(octants) == FARTHEST_DOUBLING:
            break
        upper = corner - low > high - (corner + width)
        corner = corner - upper * width
        width *= 2.0
        octants.append(int(upper @ np.array([4, 2, 1])))
    return octants[::-1]


def doubled(root: Cube, low: np.ndarray, high: np.ndarray) -> Cube:
    """The root of `Octree.below`, as it holds a box."""
    corner, width = root.low, root.width
    for octant in reversed(doublings(root, low, high)):
        corner, width = corner - bits(np.array(octant)) * width, 2.0 * width
    return Cube(corner, width)


def built(
    root: Cube,
    count: int,
    places: Callable[[np.ndarray], np.ndarray],
    most: int,
    *,
    deepest: int | None = None,
    cut: Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray] | None] | None = None,
) -> Octree:
    """A tree of `count` items in a root, at `places(items)`, whose cells with more than `most` are divided.

    cut(items, cells, middles): items (N,) of cells (N,) cut at the planes through the middles (N, 3) of their cells;
    returns both with what was cut off added; None where it would be too many.
    """
    deepest = root.deepest if deepest is None else deepest
    items, cell = np.arange(count), np.zeros(count, dtype=np.int64)
    coordinates, parent, octant = np.zeros((1, 3), dtype=np.int64), np.zeros(1, dtype=np.int64), np.zeros(1, np.int64)
    levels, settled = [], []
    while True:
        number = len(levels)
        counts = np.bincount(cell, minlength=len(coordinates))
        divided = (counts > most) & (number < deepest)
        chosen = divided[cell]
        inner, own = items[chosen], cell[chosen]
        middles = root.centers(coordinates, number)
        if cut is not None and inner.size:
            parts = cut(inner, own, middles[own])
            if parts is None:
                divided[:] = False
            else:
                inner, own = parts
        zero = np.zeros_like(counts)
        levels.append(Level(coordinates, parent, octant, counts, zero, zero.copy(), zero.copy()))
        settled.append(_sorted_by(cell[~divided[cell]], items[~divided[cell]]))
        if not divided.any():
            break
        upper = places(inner) >= middles[own]
        key = 8 * own + upper @ np.array([4, 2, 1])
        found, cell = np.unique(key, return_inverse=True)
        items, parent, octant = inner, found >> 3, found & 7
        levels[-1].children[:] = np.bincount(parent, minlength=len(counts))
        levels[-1].child[:] = np.cumsum(levels[-1].children) - levels[-1].children
        coordinates = 2 * coordinates[parent] + bits(octant)
    return Octree(root, levels, _ranges(levels, settled))


def _sorted_by(cell, items):
    by = np.argsort(cell, kind="stable")
    return cell[by], items[by]


def _ranges(levels, settled):
    """Set counts and first items of all cells, and return the order of the items."""
    for above, level in zip(levels[-2::-1], levels[:0:-1], strict=True):
        inner = above.children > 0
        above.count[inner] = np.bincount(level.parent, weights=level.count, minlength=len(above))[inner]
    for above, level in itertools.pairwise(levels):
        before = np.cumsum(level.count) - level.count
        level.first[:] = above.first[level.parent] + before - before[above.child[level.parent]]
    order = np.empty(levels[0].count.sum(), dtype=np.int64)
    for level, (cell, items) in zip(levels, settled, strict=True):
        if items.size:
            start = np.searchsorted(cell, cell)
            order[level.first[cell] + np.arange(len(cell)) - start] = items
    return order
