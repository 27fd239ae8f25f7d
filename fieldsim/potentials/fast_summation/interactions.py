"""Which cells of sources act on which cells of targets by expansions, and which pieces on which points exactly.

Both trees have the same root. Two cells of a level that touch are taken apart, as long as both have children; those
that do not touch, but whose parents do, interact through expansions (Greengard & Rokhlin 1987). Where few pieces meet
few points, or a cell has no children, all its pieces act exactly.
"""

import dataclasses

import numpy as np

from fieldsim.potentials.fast_summation.octree import Octree

# So many exact evaluations take no longer than one translation of an expansion.
FEW = 64
# So many take no longer than it takes to make the translations of a level, and those of all levels of a kernel that is
# the same in any size.
FEW_IN_A_LEVEL, FEW_AT_ALL = 200_000_000, 30_000_000


@dataclasses.dataclass(frozen=True)
class Far:
    """Translations of a level: from source cells (K,) to target cells (K,), that lie at offsets (K, 3) from them."""

    source: np.ndarray
    target: np.ndarray
    offset: np.ndarray

    def __len__(self) -> int:
        return len(self.source)


@dataclasses.dataclass(frozen=True)
class Near:
    """Exact sums of a level: all pieces below source cells (K,) act on all points below target cells (K,)."""

    source: np.ndarray
    target: np.ndarray


@dataclasses.dataclass(frozen=True)
class Interactions:
    """Far and near of every level, from the root down."""

    far: list[Far]
    near: list[Near]


def interactions(
    sources: Octree, targets: Octree, reach: float = np.inf, few: int = FEW_IN_A_LEVEL, small: int = FEW
) -> Interactions:
    """The interactions of two trees with one root.

    reach: beyond, nothing acts; where finite, no expansion is used. few: so many evaluations of pieces at points are
    exact where all translations of a level do no more; small: so many between two cells.
    """
    far, near = [], []
    pairs = np.zeros((2, 1), dtype=np.int64)
    for number, (source, target) in enumerate(zip(sources.levels, targets.levels, strict=False)):
        a, b = pairs
        offset = target.coordinates[b] - source.coordinates[a]
        inside = np.zeros(len(a), dtype=bool)
        if np.isfinite(reach):
            width = sources.root.width * 0.5**number
            near_by, inside = _within(offset * width, reach, width)
            a, b, offset, inside = a[near_by], b[near_by], offset[near_by], inside[near_by]
            apart = np.zeros(len(a), dtype=bool)
        else:
            apart = np.abs(offset).max(axis=1) > 1
        cost = source.count[a] * target.count[b]
        exact = (cost <= small) | inside | ~apart & (source.leaves[a] | target.leaves[b])
        distant = apart & ~exact
        if cost[distant].sum() <= few:
            exact, distant = exact | distant, np.zeros_like(distant)
        far.append(Far(a[distant], b[distant], offset[distant]))
        near.append(Near(a[exact], b[exact]))
        divided = ~exact & ~distant
        pairs = _children(source, target, a[divided], b[divided])
        if not pairs.size:
            break
    return Interactions(far, near)


def _within(offset, reach, width):
    """Whether cells at offsets (K, 3) have points within the reach of each other, and whether all of them are."""
    gap, span = np.maximum(np.abs(offset) - width, 0.0), np.abs(offset) + width
    return (gap * gap).sum(axis=1) < reach * reach, (span * span).sum(axis=1) < reach * reach


def _children(source, target, a, b):
    """All pairs of children of pairs of cells, (2, K)."""
    ones, others = source.children[a], target.children[b]
    pair = np.repeat(np.arange(len(a)), ones * others)
    k = np.arange(len(pair)) - np.repeat(np.cumsum(ones * others) - ones * others, ones * others)
    return np.stack([source.child[a[pair]] + k // others[pair], target.child[b[pair]] + k % others[pair]])


def near_lists(sources: Octree, targets: Octree, near: list[Near]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What acts exactly on each point of the targets' order: (list of each point (N,), where lists begin, ranges).

    ranges (R, 2): first piece and one past the last, of the sources' order; list k has ranges begin[k]..begin[k + 1].
    """
    # Ranges and the points that they act on, by cells of any level, handed down to leaves.
    points = int(targets.levels[0].count[0])
    lists, starts, ranges = np.zeros(points, dtype=np.int32), [], []
    target = np.zeros(0, dtype=np.int64)
    spans = np.zeros((0, 2), dtype=np.int64)
    total = 0
    for number, level in enumerate(targets.levels):
        if number < len(near):
            source = sources.levels[number]
            first = source.first[near[number].source]
            own = np.stack([first, first + source.count[near[number].source]], axis=1)
            target = np.concatenate([target, near[number].target])
            spans = np.concatenate([spans, own])
        leaf = np.flatnonzero(level.leaves)
        settled = level.leaves[target]
        merged, counts = _merged(target[settled], spans[settled], len(level))
        begin = total + np.cumsum(counts) - counts
        owner = np.repeat(len(starts) + np.arange(len(leaf)), level.count[leaf])
        places = np.repeat(level.first[leaf], level.count[leaf])
        within = np.arange(len(places)) - np.repeat(np.cumsum(level.count[leaf]) - level.count[leaf], level.count[leaf])
        lists[places + within] = owner
        starts.extend(begin[leaf].tolist())
        ranges.append(merged)
        total += len(merged)
        inner = ~settled
        target, spans = _handed_down(level, target[inner], spans[inner])
    return lists, np.array([*starts, total], dtype=np.int32), np.concatenate(ranges).astype(np.int32)


def _merged(cell, spans, cells):
    """Spans (K, 2) sorted by cell and joined where one goes on as another; how many each cell has."""
    by = np.lexsort((spans[:, 0], cell))
    cell, spans = cell[by], spans[by]
    goes_on = (cell[1:] == cell[:-1]) & (spans[1:, 0] == spans[:-1, 1])
    starts = np.flatnonzero(np.concatenate([np.ones(min(1, len(cell)), dtype=bool), ~goes_on]))
    ends = np.concatenate([starts[1:], [len(cell)]])[: len(starts)] - 1
    joined = np.stack([spans[starts, 0], spans[ends, 1]], axis=1)
    return joined, np.bincount(cell[starts], minlength=cells)


def _handed_down(level, cell, spans):
    """Cells' children, each with the spans of its cell."""
    children = level.children[cell]
    which = np.repeat(np.arange(len(cell)), children)
    k = np.arange(len(which)) - np.repeat(np.cumsum(children) - children, children)
    return level.child[cell[which]] + k, spans[which]
