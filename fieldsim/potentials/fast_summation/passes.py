"""The passes of a fast summation: moments up the tree of sources, translations, local expansions down to points."""

import functools
import math

import numpy as np

from fieldsim.potentials.fast_summation import chebyshev
from fieldsim.potentials.fast_summation.interactions import Far
from fieldsim.potentials.fast_summation.octree import Octree, bits

# Charges, or points, of one cell are taken so many at a time; and so many such batches.
BATCH, BATCHES = 32, 256
# So many charges at a time.
CHARGES = 1500
# Reals of translated moments that are held at a time.
HELD = 4_000_000


def _batches(first, count):
    """Ranges of items (cells' first (C,), count (C,)) in batches: (cell of each batch, its items; -1 where none)."""
    batches = -(-count // BATCH)
    cell = np.repeat(np.arange(len(count)), batches)
    number = np.arange(len(cell)) - np.repeat(np.cumsum(batches) - batches, batches)
    within = number[:, None] * BATCH + np.arange(BATCH)
    items = first[cell, None] + within
    return cell, np.where(within < count[cell, None], items, -1)


def leaf_moments(positions, amounts, middles, half, first, count, order) -> np.ndarray:
    """Moments (C, p, p, p) of charges in cells with middles (C, 3), whose items are first .. first + count - 1."""
    found = np.zeros((len(middles), order, order * order))
    begin = 0
    while begin < len(middles):
        # As many cells at a time as fit the cache.
        end = begin + max(1, int(np.searchsorted(np.cumsum(count[begin:]), CHARGES)))
        some = slice(begin, min(end, len(middles)))
        cell = np.repeat(np.arange(len(middles))[some], count[some])
        starts = np.cumsum(count[some]) - count[some]
        items = np.arange(len(cell)) + np.repeat(first[some] - starts, count[some])
        x, y, z = np.moveaxis(chebyshev.basis((positions[items] - middles[cell]) / half, order), 1, 0)
        x = (x * amounts[items, None]).T
        across = (y[:, :, None] * z[:, None, :]).reshape(len(cell), -1)
        for k, start, number in zip(range(some.start, some.stop), starts, count[some], strict=True):
            np.matmul(x[:, start : start + number], across[start : start + number], out=found[k])
        begin = some.stop
    return found.reshape(len(middles), order, order, order)


def raised(moments: np.ndarray, level, above: int, order: int) -> np.ndarray:
    """Moments (C, p, p, p) of a level's cells as moments of the `above` cells of the level above."""
    found = np.zeros((above, order, order, order))
    for octant in range(8):
        own = level.octant == octant
        found[level.parent[own]] += chebyshev.applied(moments[own], chebyshev.child(order, octant))
    return found


def lowered(local: np.ndarray, level, order: int) -> np.ndarray:
    """Local expansions (C, p, p, p) of the level above as those of a level's cells."""
    found = np.empty((len(level), order, order, order))
    for octant in range(8):
        own = level.octant == octant
        matrices = [matrix.T for matrix in chebyshev.child(order, octant)]
        found[own] = chebyshev.applied(local[level.parent[own]], matrices)
    return found


class Buffers:
    """Arrays that are used again: fresh ones of that size cost more than what is written to them."""

    def __init__(self):
        self._kept: dict[tuple, np.ndarray] = {}

    def empty(self, name: str, dtype, *shape: int) -> np.ndarray:
        """An array of that shape with any content, in the place of the last of that name."""
        size, key = math.prod(shape), (name, dtype)
        if key not in self._kept or self._kept[key].size < size:
            self._kept[key] = np.empty(size, dtype=dtype)
        return self._kept[key][:size].reshape(shape)


def translated(moments: np.ndarray, source, target, far: Far, translations) -> np.ndarray:
    """Local expansions (C, order^3) of targets by moments (S, order^3) of sources, for the translations' ring."""
    moments = translations.projected(moments)
    local = np.zeros((len(target), translations.rank))
    # Cells of one octant together, and a source of zeros beyond the last of each.
    own, others = ([np.flatnonzero(level.octant == octant) for octant in range(8)] for level in (source, target))
    place = np.empty(len(source), dtype=np.int64)
    for cells in own:
        place[cells] = np.arange(len(cells))
    sources = {}
    for offset, which in _by_offset(far, translations.ring).items():
        of = np.full(len(target), -1)
        of[far.target[which]] = place[far.source[which]]
        sources[offset] = [of[cells] for cells in others]
    buffers = Buffers()
    for number, dtype in enumerate((np.float64, np.float32)):
        before, after = (
            {t: pair[number] for t, pair in side.items()} for side in (translations.before, translations.after)
        )
        given = [moments[cells].astype(dtype) for cells in own]
        found = [np.zeros((len(cells), translations.rank), dtype=dtype) for cells in others]
        for offsets in _batched(sources, before, HELD // len(source)):
            _translate(given, found, {offset: sources[offset] for offset in offsets}, before, after, buffers)
        for cells, part in zip(others, found, strict=True):
            local[cells] += part
    return translations.expanded(local)


def _by_offset(far, ring):
    """Offset -> its pairs of cells, as indices; of a ring."""
    chosen = np.flatnonzero(np.abs(far.offset).max(axis=1) == ring)
    keys = (far.offset[chosen] + 3) @ np.array([49, 7, 1])
    by = np.argsort(keys, kind="stable")
    found, starts = np.unique(keys[by], return_index=True)
    if not len(found):
        return {}
    return {
        (int(k) // 49 - 3, int(k) // 7 % 7 - 3, int(k) % 7 - 3): chosen[which]
        for k, which in zip(found, np.split(by, starts[1:]), strict=True)
    }


def _batched(offsets, factors, most):
    """Offsets in batches of which the factors have about `most` columns."""
    batch, columns = [], 0
    for offset in offsets:
        width = factors[offset].shape[1]
        if batch and columns + width > most:
            yield batch
            batch, columns = [], 0
        batch.append(offset)
        columns += width
    if columns:
        yield batch


def _translate(moments, local, sources, before, after, buffers):
    """Add the translations of some offsets to local expansions; both on the basis, by octants, (C, R) each.

    sources: offset -> by octant of the targets, which source (of its octant) acts on each; -1: none.
    before, after: offset -> (R, rank).
    """
    held, dtype = [], moments[0].dtype
    for octant, own in enumerate(moments):
        offsets = [offset for offset in sources if len(own) and _meets(octant, offset)]
        factor = _side_by_side(before, offsets, buffers, dtype)
        part = buffers.empty(f"held {octant}", dtype, len(own) + 1, factor.shape[1])
        part[-1] = 0.0
        np.matmul(own, factor, out=part[:-1])
        ends = np.cumsum([before[offset].shape[1] for offset in offsets])
        held.append((part, dict(zip(offsets, ends.tolist(), strict=True))))
    for octant, own in enumerate(local):
        offsets = [offset for offset in sources if offset in held[octant_at(octant, offset)][1]]
        if not len(own) or not offsets:
            continue
        factor = _side_by_side(after, offsets, buffers, dtype)
        gathered, end = buffers.empty("gathered", dtype, len(own), factor.shape[1]), 0
        for offset in offsets:
            part, ends = held[octant_at(octant, offset)]
            width, last = after[offset].shape[1], ends[offset]
            gathered[:, end : end + width] = part[sources[offset][octant], last - width : last]
            end += width
        own += np.matmul(gathered, factor.T, out=buffers.empty("sum", dtype, *own.shape))


def _side_by_side(factors, offsets, buffers, dtype):
    rank = len(next(iter(factors.values())))
    whole = buffers.empty("side by side", dtype, rank, sum(factors[offset].shape[1] for offset in offsets))
    return np.concatenate([np.empty((rank, 0), dtype), *(factors[offset] for offset in offsets)], axis=1, out=whole)


@functools.cache
def octant_at(octant: int, offset) -> int:
    """The octant of a source whose target, of the given one, lies at an offset from it."""
    return int((bits(np.array(octant)) - np.array(offset) & 1) @ np.array([4, 2, 1]))


@functools.cache
def _meets(octant, offset):
    """Whether the parents of a cell of that octant and of the one at the offset from it touch."""
    return bool((np.abs((bits(np.array(octant)) + np.array(offset)) >> 1) <= 1).all())


def add_at_points(found, local, positions, middles, half, first, count, order) -> None:
    """Add to value, gradient and Hessian, those that are in `found`, what local expansions (C, p, p, p) give.

    Those of a cell, with middles (C, 3), serve the points positions[first .. first + count - 1].
    """
    cell, items = _batches(first, count)
    for begin in range(0, len(cell), BATCHES):
        own, some = cell[begin : begin + BATCHES], items[begin : begin + BATCHES]
        inside = some >= 0
        jets = _jets(local[own], (positions[some] - middles[own][:, None]) / half, order, len(found) - 1)
        for power, (into, part) in enumerate(zip(found, jets, strict=True)):
            into[some[inside]] += part[inside] / half**power


def _jets(local, places, order, derivatives):
    """Value and derivatives of expansions (K, p, p, p) at places (K, B, 3), in half widths."""
    if derivatives == 0:
        bases = [(chebyshev.basis(places[..., axis], order),) for axis in range(3)]
    else:
        bases = [chebyshev.basis_and_derivatives(places[..., axis], order) for axis in range(3)]
    shape = *places.shape[:2], order, order
    flat = local.reshape(len(local), order, -1)
    along = [np.matmul(x, flat).reshape(shape) for x in bases[0][: derivatives + 1]]

    def part(i, j, k):
        """The derivative of these degrees along x, y and z."""
        return np.einsum("kbj,kbj->kb", np.matmul(bases[1][j][:, :, None], along[i])[:, :, 0], bases[2][k])

    value = part(0, 0, 0)
    if derivatives == 0:
        return [value]
    gradient = np.stack([part(1, 0, 0), part(0, 1, 0), part(0, 0, 1)], axis=-1)
    if derivatives == 1:
        return [value, gradient]
    xx, yy, zz, xy, xz, yz = (
        part(*degrees) for degrees in ((2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (1, 0, 1), (0, 1, 1))
    )
    hessian = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=-1)
    return [value, gradient, hessian.reshape(*value.shape, 3, 3)]


def upward(pieces_tree: Octree, positions, amounts, first, count, order) -> list[np.ndarray]:
    """Moments (C, p, p, p) of every level, from the root down.

    first, count: per level, the charges of its cells without children.
    """
    levels = pieces_tree.levels
    moments: list[np.ndarray] = [np.zeros(0)] * len(levels)
    for number in range(len(levels) - 1, -1, -1):
        level = levels[number]
        if number + 1 < len(levels):
            below = levels[number + 1]
            moments[number] = raised(moments[number + 1], below, len(level), order)
        else:
            moments[number] = np.zeros((len(level), order, order, order))
        leaf = np.flatnonzero(level.leaves)
        middles = pieces_tree.root.centers(level.coordinates[leaf], number)
        half = 0.5 * pieces_tree.root.width * 0.5**number
        moments[number][leaf] += leaf_moments(
            positions, amounts, middles, half, first[number][leaf], count[number][leaf], order
        )
    return moments
