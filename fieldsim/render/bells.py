"""Gaussian points and segments of positive strength, along rays.

Along a ray such an element is a bell, exp(q - k (t - m)^2), times a share in 0..1 that falls off at a segment's ends.
Bells bound themselves: among n of them F < 1 wherever each is below 1/n, and everywhere where the peaks add up to less
than 1. Where one bell alone exceeds 1, the surface has been passed. `lockstep` looks for the surface in what remains.
"""

import math

import numpy as np
import warp as wp

from fieldsim.potentials import cells
from fieldsim.potentials.kernels import Gaussian
from fieldsim.potentials.point import Point
from fieldsim.potentials.segment import Segment
from fieldsim.render import bounds

HIGHEST = 60.0  # logarithm of bells that float32 adds up without overflow
SHORTEST = 0.1  # of segments, in kernel widths: the difference of their error functions has digits left

CUT = 2e-6  # of F, that a bell may be short of
LEVEL = -math.log(CUT)

# A segment's share at a place, `first` along it, and its derivative along; lengths along times a. See `lanes`.
SHARE = """
auto share = [&](V first, float length, float factor, V& part, V& change) {
    const V second = length - first, nearest = least(first, second);
    part = factor;
    change = 0.0f;
    // erfc(4) = 1.5e-8
    if (any(nearest < 4.0f)) {
        part = 0.5f * factor * (erfc(-nearest) - erfc(length - nearest));
        change = 0.564189584f * factor * (exp(-first * first) - exp(-second * second));
    }
};
"""


@wp.struct
class Bells:
    """Elements relative to the eye.

    center: a point, or a segment's start, and a^2; axis: a segment's direction and length (0: a point);
    height: of log F, (greatest, certain on all of the segment, reciprocal of the greatest share, unused).
    """

    center: wp.array(dtype=wp.vec4)
    axis: wp.array(dtype=wp.vec4)
    height: wp.array(dtype=wp.vec4)


def kind_of(bounded: bounds.Bounded) -> str:
    """Which bells the elements are, "points" or "segments"; "" where some are none."""
    kinds = {cells.CELLS[Gaussian, primitive].kind: primitive for primitive in (Point, Segment)}
    rows = bounded.rows
    if not len(rows) or not set(np.unique(bounded.kinds).tolist()) <= set(kinds):
        return ""
    if rows[:, cells.STRENGTH].min() <= 0.0:
        return ""
    lines = bounded.shape == bounds.SEGMENT
    if lines.any() and (rows[lines, cells.SIZE] * rows[lines, cells.KERNEL]).min() < SHORTEST:
        return ""
    if _heights(bounded)[:, 0].max() > HIGHEST:
        return ""
    return "segments" if lines.any() else "points"


def _heights(bounded):
    rows = bounded.rows
    a = rows[:, cells.KERNEL]
    height = np.zeros((len(rows), 4))
    height[:, 0] = rows[:, cells.FOLD] + np.log(rows[:, cells.STRENGTH])
    height[:, 2] = 1.0
    lines = bounded.shape == bounds.SEGMENT
    width = (a * rows[:, cells.SIZE])[lines]
    # The share is greatest in the middle, and half of erf(width) at an end.
    middle, end = (np.array([math.erf(x) for x in part]) for part in (0.5 * width, width))
    height[lines, 0] += np.log(math.sqrt(math.pi) / a[lines] * middle)
    height[lines, 1] = np.log(0.5 * end / middle)
    height[lines, 2] = 1.0 / middle
    return height


def bells_of(bounded: bounds.Bounded, device) -> Bells:
    """The elements of a scene for which `kind_of` has a name, on a device."""
    rows = bounded.rows
    lines = (bounded.shape == bounds.SEGMENT)[:, None]
    bells = Bells()
    center = np.concatenate([rows[:, 5:8], rows[:, [cells.KERNEL]] ** 2], axis=1)
    axis = np.where(lines, np.concatenate([rows[:, 14:17], rows[:, [cells.SIZE]]], axis=1), 0.0)
    for name, values in (("center", center), ("axis", axis), ("height", _heights(bounded))):
        setattr(bells, name, wp.array(values, dtype=wp.vec4, device=device))
    return bells
