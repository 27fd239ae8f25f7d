"""Fast sums of the elements of one kernel at many points."""

import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np
import warp as wp

from fieldsim.potentials import registry
from fieldsim.potentials.elements import Elements
from fieldsim.potentials.fast_summation import passes
from fieldsim.potentials.fast_summation.interactions import (
    FEW_AT_ALL,
    FEW_IN_A_LEVEL,
    Interactions,
    interactions,
    near_lists,
)
from fieldsim.potentials.fast_summation.laws import law_values
from fieldsim.potentials.fast_summation.near import near_sums
from fieldsim.potentials.fast_summation.octree import Cube, Octree, built, doublings
from fieldsim.potentials.fast_summation.pieces import Pieces
from fieldsim.potentials.fast_summation.translations import RINGS, Scaled, Translations, translations
from fieldsim.potentials.field_kernels import SHAPES
from fieldsim.potentials.row import FOLD, KERNEL_WIDTH, STRENGTH

# Most pieces in a cell that is not divided further, under a kernel that is the same in any size, and under others, for
# which every level of cells has translations of its own; and most points.
PIECES, PIECES_OF_A_SIZE, POINTS = 64, 512, 16
# Errors are rounded down to a third or a tenth of one, so that other points need no other translations.
STEPS = 2
# Gaussians end where they have fallen to this share of their height.
NOTHING = 1e-18
# Sums are compared with exact ones at so many points. At others they may be wrong by so many times the largest error
# seen there, and by so many times the root of the errors' mean square: of 1e5 points, the worst has 7 to 9 times that.
CHECKED, SAFETY, TAIL = 64, 3.0, 12.0
# What rounding is, as a share of what is far; how much steeper each derivative of expansions may be, per half width.
ROUNDING, STEEP = 2e-15, 200.0
# What is first tried, as a share of the tolerance.
FIRST = 0.04
# If they are wrong by more than allowed, all is done again for this share of the tolerance; so often.
TIGHTER, TRIALS = 0.3, 4


class Group:
    """Elements of one kernel: their pieces, and what of the fast sum depends on them alone."""

    def __init__(self, elements: Elements, kernel, most: int | None = None, within: Cube | None = None):
        self.kernel, self.count = kernel, len(elements)
        few = self.sizeless or not kernel.power
        self.pieces = Pieces(elements, most or (PIECES if few else PIECES_OF_A_SIZE), within)
        self.kinds_used = tuple(np.unique(self.pieces.kinds).tolist())
        sums = np.concatenate([[0.0], np.cumsum(self.pieces.amounts())])
        # Of strengths without signs, by the cells of each level.
        self.amounts = [sums[level.first + level.count] - sums[level.first] for level in self.pieces.tree.levels]
        self._moments = {}

    @functools.cached_property
    def tables(self):
        """Rows and kinds of the pieces, as Warp arrays."""
        return _tables(self.pieces.rows, self.pieces.kinds)

    @functools.cached_property
    def unsigned_tables(self):
        """The same with strengths without signs."""
        if (self.pieces.rows[:, STRENGTH] >= 0.0).all():
            return self.tables
        rows = self.pieces.rows.copy()
        rows[:, STRENGTH] = np.abs(rows[:, STRENGTH])
        return _tables(rows, self.pieces.kinds)

    @property
    def sizeless(self) -> bool:
        """Whether the kernel is the same in any size but for a factor, as bare inverse powers are."""
        return bool(self.kernel.unit) and self.kernel.width == 0.0

    @property
    def measured(self) -> int:
        """So many evaluations of an element at a point take about as long as a fast sum does at least."""
        if not self.kernel.power:
            return 10_000_000
        return 200_000_000 if self.sizeless else 2_000_000_000

    @property
    def reach(self) -> float:
        """Beyond this distance nothing acts; inf for kernels that fall as a power."""
        if self.kernel.power:
            return math.inf
        return self.kernel.width if self.kernel.compact else float(self.kernel.inverse(NOTHING, self.kernel.width))

    def moments(self, order: int, digits: float) -> list[np.ndarray]:
        """Moments (C, p, p, p) of all levels of its own tree, kept for the last order; right to exp(-digits)."""
        key = order, math.ceil(digits)
        if key not in self._moments:
            self._moments.clear()
            self._moments[key] = self._made(*key)
        return self._moments[key]

    def _made(self, order, digits):
        tree = self.pieces.tree
        widths = np.empty(len(self.pieces))
        for number, level in enumerate(tree.levels):
            count = np.where(level.leaves, level.count, 0)
            items = np.repeat(level.first - np.cumsum(count) + count, count) + np.arange(count.sum())
            widths[items] = tree.root.width * 0.5**number
        which, positions, amounts = self.pieces.charges(widths, digits)
        begin = np.searchsorted(which, np.arange(len(self.pieces) + 1))
        first = [begin[level.first] for level in tree.levels]
        count = [begin[level.first + level.count] - begin[level.first] for level in tree.levels]
        return passes.upward(tree, positions, amounts, first, count, order)

    def exact(self, points: np.ndarray, order: int, *, unsigned: bool = False) -> list[np.ndarray]:
        """The exact sums at a few points (N, 3); unsigned: of strengths without signs."""
        lists, ranges = np.zeros(len(points), dtype=np.int32), np.array([[0, len(self.pieces)]])
        tables = self.unsigned_tables if unsigned else self.tables
        return near_sums(points, lists, np.array([0, 1]), ranges, tables, self.kinds_used, order)


def _tables(rows, kinds):
    given = wp.array(np.ascontiguousarray(rows), dtype=wp.float64, device="cpu", copy=False)
    return given, wp.array(kinds.astype(np.int32), dtype=wp.int32, device="cpu")


@dataclasses.dataclass(frozen=True)
class Plan:
    """How a group is summed at given points: trees with one root, and what acts on what.

    doubled: the octants by which the root was doubled; amounts: by the source cells of each level, of strengths
    without signs; order: of the points (N, 3), in the targets' order.
    """

    doubled: list[int]
    sources: Octree
    targets: Octree
    acting: Interactions
    amounts: list[np.ndarray]
    points: np.ndarray


def plan(group: Group, points: np.ndarray) -> Plan:
    """How a group's field is summed at points (N, 3)."""
    tree = group.pieces.tree
    doubled = doublings(tree.root, points.min(axis=0), points.max(axis=0))
    sources = tree.below(doubled)
    deepest = len(sources.levels) - 1
    targets = built(sources.root, len(points), lambda items: points[items], POINTS, deepest=deepest)
    acting = interactions(sources, targets, group.reach, FEW_AT_ALL if group.sizeless else FEW_IN_A_LEVEL)
    amounts = [group.amounts[0]] * len(doubled) + group.amounts
    return Plan(doubled, sources, targets, acting, amounts, points[targets.order])


@dataclasses.dataclass
class Sum:
    """A group's field at points: value and derivatives, in the given order; how wrong they may be; see `fast_sum`.

    bounds: of value, gradient and Hessian at each point, (N,) each; found: how large their errors are by those seen;
    scale: the largest value there of the field of strengths without signs.
    """

    results: list[np.ndarray]
    bounds: list[np.ndarray]
    found: list[float]
    scale: float


def fast_sum(group: Group, points, tolerance: float, order: int, *, proved=False, threads=None, tell=None) -> Sum:
    """Value and derivatives up to `order` of the group's field at points (N, 3).

    The largest error of the value is at most `tolerance` times the largest value, at the points, of the field of
    strengths without signs: proved, by bounds that hold for any amounts at any place in the cells; otherwise, as
    estimated from errors at CHECKED points. tell(words): what is being done.
    """
    tell = tell or (lambda words: None)
    tell("dividing space")
    planned = plan(group, points)
    looked_at = np.unique(np.linspace(0, len(points) - 1, CHECKED).astype(int))
    truth = group.exact(planned.points[looked_at], order)
    scale = _scale(group, planned, looked_at)
    tell("adding what is near")
    lists = near_lists(planned.sources, planned.targets, planned.acting.near)
    near = near_sums(planned.points, *lists, group.tables, group.kinds_used, order, threads)
    allowed = tolerance * scale
    for trial in range(TRIALS):
        tell("adding what is far")
        moved = translations_of(group, planned, FIRST * tolerance * TIGHTER**trial * scale)
        bounds = _bounds(group, planned, moved)
        if proved and bounds[0].max(initial=0.0) > allowed:
            continue
        far = _far(group, planned, moved, order, tolerance)
        sums = [one + other for one, other in zip(near, far, strict=True)]
        found = [_estimated(one[looked_at], other) for one, other in zip(sums, truth, strict=True)]
        if found[0] <= allowed:
            break
    else:
        # No translations are fine enough: all is exact.
        tell("adding everything exactly")
        everything = np.zeros(len(points), dtype=np.int32), np.array([0, 1]), np.array([[0, len(group.pieces)]])
        sums = near_sums(planned.points, *everything, group.tables, group.kinds_used, order, threads)
        bounds, found = [np.zeros(len(points))] * 3, [0.0] * (order + 1)
    return Sum([_unsorted(planned, one) for one in sums], [_unsorted(planned, one) for one in bounds], found, scale)


def _scale(group, planned, looked_at):
    """The largest value of the field of strengths without signs at some of the points, or near them if all are inf."""
    places = planned.points[looked_at]
    for shift in (0.0, 1e-3 * planned.sources.root.width):
        unsigned = group.exact(places + shift, 0, unsigned=True)[0]
        if np.isfinite(unsigned).any():
            break
    return float(unsigned[np.isfinite(unsigned)].max(initial=0.0))


def _unsorted(planned, results):
    """Results in the targets' order, in that of the given points."""
    found = np.empty_like(results)
    found[planned.targets.order] = results
    return found


def _estimated(results, truth):
    """How large errors are anywhere, by their norm, as seen at a few points (N, ...), where they are finite."""
    with np.errstate(invalid="ignore"):
        differences = (results - truth).reshape(len(truth), -1)
    sizes = np.sqrt((differences**2).sum(axis=1))
    sizes = sizes[np.isfinite(sizes)]
    if not sizes.size:
        return 0.0
    return float(max(SAFETY * sizes.max(), TAIL * np.sqrt((sizes**2).mean())))


def translations_of(group, planned, error) -> dict[int, list[Translations]]:
    """The translations of each level, by rings, that let no sum be wrong by more than about `error`."""
    far, levels = planned.acting.far, planned.sources.levels
    # The more cells, the more is won by a larger error; and of many pieces' errors, of both signs, little is left.
    weights = {k: len(far[k]) ** 0.25 / math.sqrt(len(levels[k])) for k in range(len(far)) if len(far[k])}
    total = sum(len(far[k]) ** 0.25 for k in weights) / math.sqrt(len(levels[-1]))
    scaled, shares = {}, {}
    for k, weight in weights.items():
        most = np.bincount(far[k].target, weights=planned.amounts[k][far[k].source]).max()
        scaled[k] = Scaled(group.kernel, 0.5 * planned.sources.root.width * 0.5**k)
        unit = scaled[k].unit * most
        # Where there is no field, nothing can be wrong.
        shares[k] = error * weight / total / unit if unit > 0.0 and error > 0.0 else 1.0
    if group.sizeless and shares:
        # Translations of all sizes are the same.
        scaled = dict.fromkeys(scaled, Scaled(group.kernel, 1.0))
        shares = dict.fromkeys(shares, min(shares.values()))
    steps = {k: math.floor(STEPS * math.log10(min(max(share, 1e-14), 0.1))) for k, share in shares.items()}
    return {k: [_made(scaled[k], ring, steps[k]) for ring in RINGS] for k in shares}


@functools.lru_cache(maxsize=256)
def _made(scaled, ring, steps):
    return translations(scaled, ring, 10.0 ** (steps / STEPS))


def _bounds(group, planned, moved) -> list[np.ndarray]:
    """How wrong value, gradient and Hessian may be at each point, in the targets' order, (N,) each."""
    # Of each cell: the three bounds without rounding, and the size of what is far, which rounding is a share of.
    bounds = [np.zeros((4, 1))]
    for number, level in enumerate(planned.targets.levels):
        total = bounds[-1][:, level.parent] if number else np.zeros((4, len(level)))
        if number in moved:
            half = 0.5 * planned.sources.root.width * 0.5**number
            far = planned.acting.far[number]
            table = np.zeros((3, 4, 4, 4))
            for one in moved[number]:
                for offset, errors in one.errors.items():
                    table[(slice(None), *offset)] = errors
            offsets = -np.sort(-np.abs(far.offset), axis=1)
            amounts = planned.amounts[number][far.source] * Scaled(group.kernel, half).unit
            total[3] += np.bincount(far.target, weights=amounts, minlength=len(level))
            for k in range(3):
                weights = table[k, offsets[:, 0], offsets[:, 1], offsets[:, 2]] * amounts / half**k
                total[k] += np.bincount(far.target, weights=weights, minlength=len(level))
        bounds.append(total)
    found = np.empty((3, len(planned.points)))
    for number, (level, total) in enumerate(zip(planned.targets.levels, bounds[1:], strict=True)):
        steep = STEEP / (0.5 * planned.sources.root.width * 0.5**number)
        total[:3] += ROUNDING * total[3] * np.array([[1.0], [steep], [steep**2]])
        leaf = np.flatnonzero(level.leaves)
        count = level.count[leaf]
        items = np.repeat(level.first[leaf] - np.cumsum(count) + count, count) + np.arange(count.sum())
        found[:, items] = np.repeat(total[:3, leaf], count, axis=1)
    return list(found + _left_out(group))


def _left_out(group):
    """What a Gaussian's tail may add, in value, gradient and Hessian (3, 1)."""
    if group.kernel.power or group.kernel.compact:
        return np.zeros((3, 1))
    rows, reach = group.pieces.rows, group.reach
    h = law_values(group.kernel, np.array([reach**2]))[0]
    a2 = group.kernel.width**2
    amount = (group.pieces.amounts() * np.exp(rows[:, FOLD])).sum()
    return amount * h * np.array([[1.0], [2.0 * a2 * reach], [(2.0 * a2 * reach) ** 2 + 2.0 * a2]])


def _far(group, planned, moved, derivatives, tolerance):
    """What is far adds to value and derivatives at the points, in the targets' order."""
    points, root = planned.points, planned.sources.root
    found = [np.zeros((len(points), *shape)) for shape in SHAPES[: derivatives + 1]]
    for number, leaf, local in local_expansions(group, planned, moved, tolerance):
        level = planned.targets.levels[number]
        middles = root.centers(level.coordinates[leaf], number)
        own = level.first[leaf], level.count[leaf]
        passes.add_at_points(found, local, points, middles, 0.5 * root.width * 0.5**number, *own, local.shape[1])
    return found


def local_expansions(group: Group, planned: Plan, moved, tolerance: float):
    """Yield, by levels of the targets: (level, cells without children (C,), their local expansions (C, p, p, p)).

    moved: the translations of each level, see `translations_of`; of levels without an expansion there is nothing.
    """
    if not moved:
        return
    degree = max(one.order for rings in moved.values() for one in rings)
    moments = _doubled(group.moments(degree, math.log(10.0 / tolerance)), planned, degree)
    root, local = planned.sources.root, None
    for number, level in enumerate(planned.targets.levels):
        if local is not None:
            local = passes.lowered(local, level, degree)
        if number in moved:
            local = np.zeros((len(level), degree, degree, degree)) if local is None else local
            unit = Scaled(group.kernel, 0.5 * root.width * 0.5**number).unit
            for one in moved[number]:
                _add_translated(local, unit, moments[number], planned, number, one)
        if local is not None:
            leaf = np.flatnonzero(level.leaves)
            yield number, leaf, local[leaf]


def _doubled(moments, planned, order):
    """Moments of the group's own levels, with those of the roots above."""
    above = []
    for octant in reversed(planned.doubled):
        below = dataclasses.replace(
            planned.sources.levels[0], octant=np.array([octant]), parent=np.zeros(1, dtype=np.int64)
        )
        above.append(passes.raised(above[-1] if above else moments[0], below, 1, order))
    return [*reversed(above), *moments]


def _add_translated(local, unit, moments, planned, number, one):
    """Add to local expansions (C, p, p, p) of a level what translations make of moments (S, p, p, p)."""
    own, degree = one.order, local.shape[1]
    # The basis depends on the order by a factor.
    ratio = (degree / own) ** 1.5
    trees = planned.sources.levels[number], planned.targets.levels[number]
    lower = moments[:, :own, :own, :own].reshape(len(moments), own**3)
    found = passes.translated(lower, *trees, planned.acting.far[number], one)
    found *= ratio * ratio * unit
    local[:, :own, :own, :own] += found.reshape(len(local), own, own, own)


def groups_of(elements: Elements, least: int, make: Callable = Group) -> tuple[list[Group], np.ndarray]:
    """Groups of at least so many elements of one kernel, and which elements are in none, as a mask (N,).

    Those are planes, profiled primitives, triangles and faces, and elements of kernels that neither end nor fall as a
    power or a Gaussian. What has no strength is left out. make(elements, kernel): the group.
    """
    groups, alone = [], elements.rows[:, STRENGTH] != 0.0
    kernels: dict[type, list[np.ndarray]] = {}
    for formula, which in registry.parts_of(elements.kinds):
        kernel, primitive = formula.kernel, formula.primitive
        known = primitive.dimension == 0 or (primitive.part is not None and not primitive.profiled)
        if known and (kernel.power or kernel.compact or kernel.folds):
            own = np.arange(len(elements))[which]
            kernels.setdefault(kernel, []).append(own[alone[own]])
    for kernel, parts in kernels.items():
        own = np.sort(np.concatenate(parts))
        laws, law = np.unique(elements.rows[own][:, [KERNEL_WIDTH, FOLD]], axis=0, return_inverse=True)
        for number in np.flatnonzero(np.bincount(law.ravel(), minlength=len(laws)) >= least):
            some = own[law.ravel() == number]
            alone[some] = False
            part = Elements(elements.rows[some], elements.kinds[some], elements.order[some])
            groups.append(make(part, kernel(float(laws[number, 0]))))
    return groups, alone
