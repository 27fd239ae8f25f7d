"""Bounds of elements: reach, bounding volume and greatest bend (curvature of log F), relative to the eye.

Beyond its reach an element contributes less than the tolerance to a field whose surface is at 1. At the surface of an
isolated Gaussian of blobbiness B the slope is 2B/R, so leaving that much out moves it by tolerance R / (2|B|).

The *bend* K of an element is a number such that along any ray, where its field is below 1, the second derivative of
log F (compact kernels: of 2 sqrt F) is at least -K. It is that of the kernel, however the kernel is spread: for
F = integral of exp(phi), (log F)'' is the mean of phi'' plus a variance, so that together the sharpest counts; for
F = integral of v^2, (sqrt F)'' is at least integral(v v'') / sqrt(F), and so at least -max|v''| sqrt(measure), and
several add up as the root of the sum of their squares. See `solvers.hermite` for its use.
"""

import dataclasses
import math

import numpy as np

from fieldsim.potentials import registry
from fieldsim.potentials.bounds.reach import reach, scale, within
from fieldsim.potentials.elements import Elements
from fieldsim.potentials.primitives.base import Volume
from fieldsim.potentials.row import ANGLE, END, KERNEL_WIDTH, NORMAL, POSITIONS, SIZE, START, STRENGTH

# The order of elements whose kernel is a power law is its power; others have one bend, or end.
ENDS = -1
# Used for infinity, in units of the scene.
FAR = 1e7
# With strengths of both signs these bounds do not hold; bends are then multiplied by this factor.
_SIGNED = 8.0
# Among how many elements that end near to each other the tolerance is shared; and, as the tails of power laws are
# so long that many small ones add up, among the root of how many of those at most.
_SHARED = 4
_SHARED_TAILS = 100


@dataclasses.dataclass(frozen=True)
class Bounded:
    """Elements relative to the eye, in units of `unit`, with what bounds them. All float64; N elements.

    rows (N, ROW_WIDTH); kinds (N,); shape (N,): its `Volume`; reach (N,): the distance from the
    primitive beyond which the element is cut; core (N,): radius within which a point alone exceeds the level, 0 for
    other shapes and where some strength is negative; width (N,): length over which its field changes; bend (N,): see
    above, of planes for a ray straight onto them; order (N,): above 0 for those that bend as order / distance^2
    instead, ENDS for compact ones; start, end (N, 3) and radius (N,): a capsule around all of it.
    """

    rows: np.ndarray
    kinds: np.ndarray
    shape: np.ndarray
    reach: np.ndarray
    core: np.ndarray
    width: np.ndarray
    bend: np.ndarray
    order: np.ndarray
    start: np.ndarray
    end: np.ndarray
    radius: np.ndarray


def bound(elements: Elements, eye: np.ndarray, unit: float, tolerance: float = 1e-5) -> Bounded:
    """Elements moved to the eye, scaled and bounded. tolerance: of the field, relative to its level.

    Raises InputError for a formula that cannot be rendered.
    """
    rows, kinds = _scaled(elements, eye, unit), elements.kinds
    parts = registry.parts_of(kinds)
    shape, order = np.zeros((2, len(rows)), dtype=np.int32)
    bend, level = np.zeros(len(rows)), np.full(len(rows), tolerance / _SHARED)
    for formula, where in parts:
        shape[where] = formula.primitive.volume
        order[where] = ENDS if formula.kernel.compact else formula.kernel.power
        bend[where] = _bend(formula, rows[where])
        if formula.kernel.power and not formula.kernel.unit:
            level[where] = tolerance / min(len(kinds[where]), _SHARED_TAILS) ** 0.5
    far = reach(rows, kinds, level)
    signed = (rows[:, STRENGTH] < 0.0).any()
    core = np.where((shape == Volume.BALL) & (not signed), reach(rows, kinds, 1.0), 0.0)
    if signed:
        bend, order = _SIGNED * bend, np.where(order > 0, int(_SIGNED) * order, order)
    start, end, extent = _capsules(rows, shape)
    if parts and all(formula.kernel.unit for formula, _ in parts):
        far = np.minimum(far, _around(parts, rows, start, end, extent))
    far = np.minimum(far, FAR)
    radius = np.where(shape == Volume.SLAB, FAR, far + extent)
    width = np.minimum(scale(rows, kinds), FAR)
    return Bounded(rows, kinds, shape, far, core, width, bend, order, start, end, radius)


def _scaled(elements, eye, unit):
    """Rows as seen from the eye, all lengths in units of `unit`."""
    rows = elements.rows.copy()
    rows[:, POSITIONS] = (rows[:, POSITIONS] - np.tile(eye, 3)) / unit
    rows[:, SIZE] /= unit
    for formula, where in registry.parts_of(elements.kinds):
        rows[where, KERNEL_WIDTH] *= unit if formula.kernel.reciprocal else 1.0 / unit
        rows[where, STRENGTH] *= unit ** (formula.primitive.dimension - formula.kernel.unit)
        rows[where, ANGLE] /= unit**formula.primitive.second_unit
    return rows


def _bend(formula, rows):
    """The bend of elements of one formula, (N,)."""
    width = rows[:, KERNEL_WIDTH]
    if formula.kernel.compact:
        # 2 sqrt(F), of the part within reach.
        amplitude = np.sqrt(np.abs(rows[:, STRENGTH]) * within(formula, rows))
        bend = 2.0 * formula.kernel.root_bend * amplitude / width**2
    else:
        bend = formula.kernel.log_bend(width)
    return bend + formula.primitive.row_factor_bend(rows)


def unit_of(elements: Elements, radii: np.ndarray) -> float:
    """A power of two near the scene's smallest kernel width or sphere, so that scaling changes no digit."""
    smallest = [np.min(scale(elements.rows, elements.kinds))] if len(elements) else []
    smallest += [np.min(radii)] if len(radii) else []
    smallest = min(smallest, default=1.0)
    return 2.0 ** round(math.log2(smallest)) if smallest < math.inf else 1.0


def reaches_level(bounded: Bounded) -> bool:
    """Whether the field is at least 1 at the middle of some primitive; looks at the most promising ones."""
    total = registry.field_sum(tuple(np.unique(bounded.kinds).tolist()))
    formulas = registry.formulas_of(np.unique(bounded.kinds))
    for i in np.argsort(-bounded.reach / bounded.width, kind="stable")[:16]:
        point = formulas[bounded.kinds[i]].primitive.row_middle(bounded.rows[i])
        try:
            if total(*map(float, point), bounded.rows, bounded.kinds, 0, len(bounded.kinds))[0] >= 1.0:
                return True
        except (OverflowError, ZeroDivisionError):
            return True
    return False


def _around(parts, rows, start, end, extent):
    """Reaches (N,) that hold all of the surface where every field falls as 1/r or 1/r^2, and so is nowhere small.

    Beyond a ball around all of the skeleton, at the distance r from it, F is at most M1 / r + M2 / r^2.
    """
    center = 0.5 * (start + end).mean(axis=0)
    span = [np.linalg.norm(point - center, axis=1) + extent for point in (start, end)]
    sums = {1: 0.0, 2: 0.0}
    for formula, where in parts:
        part = rows[where]
        mass = np.maximum(part[:, STRENGTH], 0.0) * formula.primitive.row_measure(part)
        sums[formula.kernel.unit] += np.sum(mass)
    ball = np.max(span) + 0.5 * (sums[1] + math.sqrt(sums[1] ** 2 + 4.0 * sums[2]))
    return ball * (1.0 + 1e-6) + span[0]


def _capsules(rows, shape):
    """(start, end, extent): lines (N, 3) and distances from them that hold the primitives; a plane's nearest point."""
    start = rows[:, START].copy()
    end = start.copy()
    extent = np.where(shape == Volume.TUBE, rows[:, SIZE], 0.0)
    segments = shape == Volume.CAPSULE
    end[segments] = rows[segments, END]
    planes = shape == Volume.SLAB
    normal = rows[planes, NORMAL]
    start[planes] = end[planes] = np.sum(normal * start[planes], axis=1)[:, None] * normal
    flat = np.flatnonzero(shape == Volume.PRISM)
    corners = rows[flat, POSITIONS].reshape(-1, 3, 3)
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    longest = np.argmax(sides, axis=1)
    each = np.arange(len(flat))
    start[flat], end[flat] = corners[each, longest], corners[each, (longest + 1) % 3]
    extent[flat] = 2.0 * rows[flat, ANGLE] / sides[each, longest]
    return start, end, extent
