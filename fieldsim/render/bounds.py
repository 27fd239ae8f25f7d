"""How far each element reaches: cut radii, bounding capsules, and the scene in float32 as seen from the eye.

Beyond its reach an element contributes less than `CUT` to a field whose surface is at 1. At the surface of an isolated
Gaussian of blobbiness B the slope is 2B/R, so leaving that much out moves the surface by CUT R / (2|B|).
"""

import dataclasses
import math

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials import cells
from fieldsim.potentials.kernels import Cauchy, Gaussian

CUT = 1e-4

POINT, SEGMENT, ARC = range(3)
_SHAPES = {"Point": POINT, "Segment": SEGMENT, "Arc": ARC, "Circle": ARC}


@dataclasses.dataclass(frozen=True)
class Bounded:
    """Elements relative to the eye, in units of `unit`, with what bounds them. All float64; N elements.

    rows (N, WIDTH); kinds (N,); shape (N,): POINT, SEGMENT or ARC; reach (N,): the distance from the primitive beyond
    which the element is cut; core (N,): radius within which a point alone exceeds the level, 0 for other shapes and
    where some strength is negative; width (N,): length over which its kernel changes; start, end (N, 3) and radius
    (N,): a capsule around all of it.
    """

    rows: np.ndarray
    kinds: np.ndarray
    shape: np.ndarray
    reach: np.ndarray
    core: np.ndarray
    width: np.ndarray
    start: np.ndarray
    end: np.ndarray
    radius: np.ndarray


def bound(elements: cells.Elements, eye: np.ndarray, unit: float) -> Bounded:
    """Elements moved to the eye, scaled and bounded. Raises InputError for a cell that cannot be rendered."""
    rows, kinds = elements.rows.copy(), elements.kinds
    shape = np.zeros(len(rows), dtype=np.int32)
    reach = np.zeros(len(rows))
    core = np.zeros(len(rows))
    width = np.zeros(len(rows))
    rows[:, cells.POSITIONS] = (rows[:, cells.POSITIONS] - np.tile(eye, 3)) / unit
    rows[:, cells.SIZE] /= unit
    by_kind = {cell.kind: cell for cell in cells.CELLS.values()}
    for kind in elements.kinds_used:
        cell, where = by_kind[kind], kinds == kind
        name = cell.primitive.__name__
        if name not in _SHAPES or cell.kernel not in _REACH:
            raise InputError(f"surfaces of {cell.kernel.__name__} on {name} cannot be rendered")
        shape[where] = _SHAPES[name]
        part = rows[where]
        dimension = 0 if shape[where][0] == POINT else 1
        part[:, cells.KERNEL] *= unit
        part[:, cells.STRENGTH] *= unit**dimension
        rows[where] = part
        reach[where] = _REACH[cell.kernel](part, shape[where][0], CUT / _SHARED[cell.kernel](len(part)))
        if shape[where][0] == POINT:
            core[where] = _REACH[cell.kernel](part, POINT, 1.0)
        width[where] = 1.0 / part[:, cells.KERNEL]
    if (rows[:, cells.STRENGTH] < 0.0).any():
        core[:] = 0.0
    start, end, radius = _capsules(rows, shape, reach)
    return Bounded(rows, kinds, shape, reach, core, width, start, end, radius)


def unit_of(elements: cells.Elements, radii: np.ndarray) -> float:
    """A power of two near the scene's smallest kernel width or sphere, so that scaling changes no digit."""
    smallest = [1.0 / np.max(elements.rows[:, cells.KERNEL])] if len(elements) else []
    smallest += [np.min(radii)] if len(radii) else []
    return 2.0 ** round(math.log2(min(smallest, default=1.0)))


def reaches_level(bounded: Bounded) -> bool:
    """Whether the field is at least 1 at the middle of some primitive; looks at the most promising ones."""
    total = cells.field_sum(tuple(np.unique(bounded.kinds).tolist()))
    for i in np.argsort(-bounded.reach / bounded.width, kind="stable")[:16]:
        point = _middle(bounded.rows[i], bounded.shape[i])
        try:
            if total(*map(float, point), bounded.rows, bounded.kinds, 0, len(bounded.kinds))[0] >= 1.0:
                return True
        except OverflowError:
            return True
    return False


def _middle(row, shape):
    """The middle of a primitive."""
    if shape == SEGMENT:
        return 0.5 * (row[5:8] + row[8:11])
    if shape == ARC:
        half = 0.5 * row[cells.ANGLE]
        turned = math.cos(half) * row[14:17] + math.sin(half) * np.cross(row[17:20], row[14:17])
        return row[_ARC_CENTER] + row[cells.SIZE] * turned
    return row[5:8]


def _measures(rows, shape):
    """Measure of each primitive, or 1 for a point."""
    if shape == POINT:
        return np.ones(len(rows))
    return rows[:, cells.SIZE] * (rows[:, cells.ANGLE] if shape == ARC else 1.0)


def _gaussian_reach(rows, shape, cut):
    """Distance where measure * h, or for segments the infinite line's field if that is less, falls to `cut`."""
    a = rows[:, cells.KERNEL]
    extent = _measures(rows, shape)
    if shape == SEGMENT:
        extent = np.minimum(extent, math.sqrt(math.pi) / a)
    height = rows[:, cells.FOLD] + np.log(np.maximum(np.abs(rows[:, cells.STRENGTH]) * extent, 1e-300) / cut)
    return np.sqrt(np.maximum(height, 0.0)) / a


def _cauchy_reach(rows, shape, cut):
    """As for the Gaussian."""
    s, strength = rows[:, cells.KERNEL], np.abs(rows[:, cells.STRENGTH])
    q = np.sqrt(strength * _measures(rows, shape) / cut)
    if shape == SEGMENT:
        q = np.minimum(q, (strength * math.pi / (2.0 * s) / cut) ** (2.0 / 3.0))
    return np.sqrt(np.maximum(q - 1.0, 0.0)) / s


_REACH = {Gaussian: _gaussian_reach, Cauchy: _cauchy_reach}
# Among how many of N elements the cut is shared: the Cauchy's tails are so long that many small ones add up.
_SHARED = {Gaussian: lambda number: 1.0, Cauchy: lambda number: min(number, 100) ** 0.5}


def _capsules(rows, shape, reach):
    """Capsules (start, end, radius) around the volumes; an arc's is a sphere."""
    start = rows[:, 5:8].copy()
    end = start.copy()
    segments = shape == SEGMENT
    end[segments] = rows[segments, 8:11]
    arcs = shape == ARC
    start[arcs] = end[arcs] = rows[arcs][:, _ARC_CENTER]
    return start, end, reach + np.where(arcs, rows[:, cells.SIZE], 0.0)


_ARC_CENTER = slice(5, 8)
