"""Gaussian points, segments and circles of positive strength, along rays.

Along a ray with parameter t, the field of a point is the Gaussian exp(q - k (t - m)^2); the field of a segment is such
a Gaussian times a share in 0..1 that falls off at the segment's ends. The field of a circle has a closed form at each
place but is no Gaussian of t: for bounds it counts as a constant, within a slab of a ball. These Gaussians bound F: of
n of them one is at least 1/n where F >= 1, and F < 1 wherever the peaks add up to less than 1. Where one alone exceeds
1, the ray has passed the surface. `packet_tracer` searches the interval that remains.
"""

import math

import numpy as np
import warp as wp

from fieldsim.potentials import registry
from fieldsim.potentials.bounds.reach import reach
from fieldsim.potentials.kernels import Gaussian
from fieldsim.potentials.primitives.base import Volume
from fieldsim.potentials.row import FOLD, KERNEL_WIDTH, POINT, SIZE, STRENGTH
from fieldsim.render.scene import bounds

HIGHEST = 60.0  # greatest log F of an element: float32 sums such elements without overflow
SHORTEST = 0.1  # of segments, in kernel widths: the difference of their error functions has digits left

CUT = 2e-6  # in units of the level F = 1: the tail of an element below this is neglected
LEVEL = -math.log(CUT)

# A segment's share at a place, `first` along it, and its derivative along; lengths along times a. See `simd`.
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

# For circles: exp(-w) I0(w), and exp(-w) (I0(w) - I1(w)), to 2e-7 (Abramowitz and Stegun 9.8.1 to 9.8.4).
BESSEL = """
auto bessel = [&](V w, V& i0, V& difference) {
    const C few = w < 3.75f;
    const V near = few ? w * (1.0f / 3.75f) : (V)1.0f, x = near * near, y = few ? (V)1.0f : 3.75f / w;
    const V fall = exp(-w), root_w = 1.0f / root(most(w, (V)3.75f));
    const V few_0 = 1.0f + x * (3.5156229f + x * (3.0899424f + x * (1.2067492f + x * (0.2659732f
        + x * (0.0360768f + x * 0.0045813f)))));
    const V few_1 = w * (0.5f + x * (0.87890594f + x * (0.51498869f + x * (0.15084934f + x * (0.02658733f
        + x * (0.00301532f + x * 0.00032411f))))));
    const V many_0 = 0.39894228f + y * (0.01328592f + y * (0.00225319f + y * (-0.00157565f + y * (0.00916281f
        + y * (-0.02057706f + y * (0.02635537f + y * (-0.01647633f + y * 0.00392377f)))))));
    const V many_1 = 0.39894228f + y * (-0.03988024f + y * (-0.00362018f + y * (0.00163801f + y * (-0.01031555f
        + y * (0.02282967f + y * (-0.02895312f + y * (0.01787654f - y * 0.00420059f)))))));
    i0 = few ? fall * few_0 : root_w * many_0;
    difference = few ? fall * (few_0 - few_1) : root_w * (many_0 - many_1);
};
"""


@wp.struct
class GaussianElements:
    """Gaussian elements of a scene, relative to the eye; each array is (N,) of vec4.

    | columns | point | segment | circle |
    |---|---|---|---|
    | center[0:3], center[3] | position, a^2 | start, a^2 | centre, a^2 |
    | axis[0:3], axis[3] | 0, 0 | direction, length | normal, -radius |
    | height[0] | greatest log F | greatest log F | bound of log F |
    | height[1] | 0 | log F certain on all of it, less height[0] | distance at which F is 0.1 |
    | height[2] | 1 | 1 / (greatest share) | log F on the circle without the factor I0 |
    | height[3] | 0 | 0 | reach |
    """

    center: wp.array(dtype=wp.vec4)
    axis: wp.array(dtype=wp.vec4)
    height: wp.array(dtype=wp.vec4)


KINDS = "points", "segments", "rings"  # each kind includes those before it; see `Primitive.along_rays`


def kind_of(bounded: bounds.Bounded) -> str:
    """The kind of a scene of Gaussian elements, one of KINDS; "" if the packet tracer cannot take some element."""
    rows, used = bounded.rows, set(np.unique(bounded.kinds).tolist())
    kinds = {c.kind: c.primitive.along_rays for c in registry.FORMULAS.values() if c.kernel is Gaussian}
    if not len(rows) or not all(kinds.get(kind) for kind in used):
        return ""
    if rows[:, STRENGTH].min() <= 0.0:
        return ""
    lines = bounded.shape == Volume.CAPSULE
    if lines.any() and (rows[lines, SIZE] * rows[lines, KERNEL_WIDTH]).min() < SHORTEST:
        return ""
    if _heights(bounded)[:, 0].max() > HIGHEST:
        return ""
    return max((kinds[kind] for kind in used), key=KINDS.index)


def _heights(bounded):
    rows = bounded.rows
    a = rows[:, KERNEL_WIDTH]
    height = np.zeros((len(rows), 4))
    height[:, 0] = rows[:, FOLD] + np.log(rows[:, STRENGTH])
    height[:, 2] = 1.0
    lines = bounded.shape == Volume.CAPSULE
    width = (a * rows[:, SIZE])[lines]
    # The share is greatest in the middle, and half of erf(width) at an end.
    middle, end = (np.array([math.erf(x) for x in part]) for part in (0.5 * width, width))
    height[lines, 0] += np.log(math.sqrt(math.pi) / a[lines] * middle)
    height[lines, 1] = np.log(0.5 * end / middle)
    height[lines, 2] = 1.0 / middle
    rings = bounded.shape == Volume.TUBE
    if rings.any():
        height[rings, 2] = height[rings, 0] + np.log(math.tau * rows[rings, SIZE])
        # I0 falls as its argument grows: less than at the circle's inner edge, or than by itself in the middle.
        inner = np.maximum(rows[rings, SIZE] - bounded.reach[rings], 0.0)
        height[rings, 0] = height[rings, 2] - 0.5 * np.log1p(4.0 * a[rings] ** 2 * inner * rows[rings, SIZE])
        height[rings, 1] = reach(rows[rings], bounded.kinds[rings], np.full(rings.sum(), 0.1))
        height[rings, 3] = bounded.reach[rings]
    return height


def elements_of(bounded: bounds.Bounded, device) -> GaussianElements:
    """The elements on a device, for a scene of which `kind_of` is not ""."""
    rows = bounded.rows
    elements = GaussianElements()
    center = np.concatenate([rows[:, POINT], rows[:, [KERNEL_WIDTH]] ** 2], axis=1)
    axis = np.zeros((len(rows), 4))
    for shape, columns, sign in ((Volume.CAPSULE, slice(14, 17), 1.0), (Volume.TUBE, slice(17, 20), -1.0)):
        where = bounded.shape == shape
        axis[where, :3], axis[where, 3] = rows[where, columns], sign * rows[where, SIZE]
    for name, values in (("center", center), ("axis", axis), ("height", _heights(bounded))):
        setattr(elements, name, wp.array(values, dtype=wp.vec4, device=device))
    return elements
