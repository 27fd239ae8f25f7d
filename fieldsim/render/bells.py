"""First hit of a ray with the surface F = 1 of Gaussian points and segments of positive strength.

Along a ray such an element is a bell, exp(q - k (t - m)^2), times a share in 0..1 that falls off at a segment's ends.
Bells bound themselves: among n of them F < 1 wherever each is below 1/n, which leaves a bracket that is often shorter
than a kernel's width, and none at all where the peaks add up to less than 1. Where one bell alone exceeds 1, the
surface has been passed. Within the bracket log F is followed by cubics as in `hermite`.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools
import math

import numpy as np
import warp as wp

from fieldsim.potentials import cells
from fieldsim.potentials.kernels import Gaussian
from fieldsim.potentials.point import Point
from fieldsim.potentials.segment import Segment
from fieldsim.render import bounds, cubics, hermite

ROOM = wp.constant(48)  # bells of a ray in local memory
GIVEN_UP = wp.constant(-2.0)  # instead of a distance: too many bells, or a start that may be inside
HIGHEST = 60.0  # logarithm of bells that float32 adds up without overflow
SHORTEST = 0.1  # of segments, in kernel widths: the difference of their error functions has digits left

CUT = 2e-6  # of F, that a bell may be short of
FLOOR = wp.constant(1.0e-12)  # a field below counts as this, so that its logarithm exists
SPLITS = wp.constant(6)

_LEVEL = wp.constant(-math.log(CUT))
_SATURATED = wp.constant(4.0)  # erfc(4) = 1.5e-8
_PER_ROOT_PI = wp.constant(1.0 / math.sqrt(math.pi))
_ENTER, _STEP, _ROOT = (wp.constant(k) for k in range(3))


@wp.struct
class Bells:
    """Elements relative to the eye.

    center: a point, or a segment's start, and a^2; axis: a segment's direction and length (0: a point);
    height: of log F, (greatest, certain on all of the segment, reciprocal of the greatest share, unused).
    """

    center: wp.array(dtype=wp.vec4)
    axis: wp.array(dtype=wp.vec4)
    height: wp.array(dtype=wp.vec4)


@wp.func
def _slab(from_start: float, slope: float, low: float, high: float):
    """Where low <= from_start + slope t <= high."""
    if wp.abs(slope) < 1.0e-6:
        if from_start < low or from_start > high:
            return hermite.FOREVER, -hermite.FOREVER
        return -hermite.FOREVER, hermite.FOREVER
    a = (low - from_start) / slope
    b = (high - from_start) / slope
    return wp.min(a, b), wp.max(a, b)


@wp.func
def _share(t: float, end: wp.vec4):
    """A segment's share and its slope; end: (position and slope along, length, all times a, and a factor)."""
    first = end[0] + end[1] * t
    second = end[2] - first
    near = wp.min(first, second)
    far = wp.max(first, second)
    share = float(0.0)
    if near < 0.0:
        share = wp.erfc(-near)
        if end[2] < _SATURATED:
            share -= wp.erfc(far)
    else:
        share = 1.0
        if near < _SATURATED:
            share = wp.erf(near)
        if far < _SATURATED:
            share += wp.erf(far)
        else:
            share += 1.0
    slope = float(0.0)
    if wp.abs(first) < _SATURATED:
        slope = wp.exp(-first * first)
    if wp.abs(second) < _SATURATED:
        slope -= wp.exp(-second * second)
    return 0.5 * end[3] * share, end[3] * _PER_ROOT_PI * end[1] * slope


@functools.cache
def functions(segments):
    """(gather, search): Warp functions for points, and for segments too where asked for."""

    @wp.func
    def gather(
        i: int,
        o: wp.vec3,
        d: wp.vec3,
        far: float,
        bells: Bells,
        ids: wp.array(dtype=int),
        bell: wp.array(dtype=wp.vec4),
        ends: wp.array(dtype=wp.vec4),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        count: int,
    ):
        """(count, far) with the bell of element i; far shrinks to where it alone is opaque."""
        c = bells.center[i]
        h = bells.height[i]
        to = wp.vec3(c[0], c[1], c[2]) - o
        across = to
        turned = d
        end = wp.vec4(0.0, 0.0, 0.0, 0.0)
        low = float(0.0)
        high = float(far)
        k = c[3]
        if wp.static(segments):
            axis = bells.axis[i]
            if axis[3] > 0.0:
                a = wp.vec3(axis[0], axis[1], axis[2])
                along = -wp.dot(to, a)
                slope = wp.dot(d, a)
                reach = wp.sqrt((h[0] + _LEVEL) / k)
                s0, s1 = _slab(along, slope, -reach, axis[3] + reach)
                low = wp.max(low, s0)
                high = wp.min(high, s1)
                to += along * a
                turned = d - slope * a
                root = wp.sqrt(k)
                end = wp.vec4(root * along, root * slope, root * axis[3], h[2])
        speed2 = float(1.0)
        if wp.static(segments):
            speed2 = wp.max(wp.dot(turned, turned), 1.0e-12)
        m = wp.dot(to, turned) / speed2
        across = to - m * turned
        q = h[0] - k * wp.dot(across, across)
        k *= speed2
        if q <= -_LEVEL:
            return count, far
        half = wp.sqrt((q + _LEVEL) / k)
        low = wp.max(low, m - half)
        high = wp.min(high, m + half)
        if low >= high:
            return count, far
        opaque = float(far)
        certain = q + h[1]
        if certain > 0.0:
            half = wp.sqrt(certain / k)
            c0 = m - half
            c1 = m + half
            if wp.static(segments):
                if end[2] > 0.0:
                    s0, s1 = _slab(end[0], end[1], 0.0, end[2])
                    c0 = wp.max(c0, s0)
                    c1 = wp.min(c1, s1)
            if c0 > 0.0 and c0 < c1:
                opaque = wp.min(opaque, c0)
        if count < ROOM:
            ids[count] = i
            bell[count] = wp.vec4(q, k, m, 1.0 / wp.sqrt(c[3]))
            t0s[count] = low
            t1s[count] = high
            if wp.static(segments):
                ends[count] = end
        return count + 1, opaque

    @wp.func
    def total(
        t: float,
        bell: wp.array(dtype=wp.vec4),
        ends: wp.array(dtype=wp.vec4),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        count: int,
    ):
        """Log F, its slope, and how far the next node may be."""
        f = float(0.0)
        slope = float(0.0)
        step = float(hermite.FOREVER)
        for j in range(count):
            b = bell[j]
            if t0s[j] > t:
                step = wp.min(step, wp.max(t0s[j] - t, b[3]))
            elif t1s[j] >= t:
                u = t - b[2]
                f_j = wp.exp(b[0] - b[1] * u * u)
                slope_j = -2.0 * b[1] * u * f_j
                if wp.static(segments):
                    if ends[j][2] > 0.0:
                        share, fall = _share(t, ends[j])
                        slope_j = slope_j * share + fall * f_j
                        f_j *= share
                f += f_j
                slope += slope_j
                step = wp.min(step, b[3])
        f = wp.max(f, FLOOR)
        return wp.log(f), slope / f, step

    @wp.func
    def bracket(
        far: float,
        opaque: float,
        ids: wp.array(dtype=int),
        bell: wp.array(dtype=wp.vec4),
        ends: wp.array(dtype=wp.vec4),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        count: int,
    ):
        """(begin, end, count): where the first hit can be, begin >= end for nowhere, and how many bells play a part."""
        share = wp.log(float(count))
        begin = float(hermite.FOREVER)
        end = float(0.0)
        peaks = float(0.0)
        for j in range(count):
            b = bell[j]
            if opaque == far:
                # A bell that is behind falls from its value at the start.
                u = wp.min(b[2], 0.0)
                peaks += wp.exp(b[0] - b[1] * u * u)
            if b[0] + share > 0.0:
                half = wp.sqrt((b[0] + share) / b[1])
                low = wp.max(b[2] - half, t0s[j])
                high = wp.min(b[2] + half, t1s[j])
                if low < high:
                    begin = wp.min(begin, low)
                    end = wp.max(end, high)
        if opaque < far:
            end = opaque
            begin = wp.min(begin, end)
        elif peaks < 1.0 - CUT:
            return 0.0, 0.0, 0
        begin = wp.max(begin, 0.0)
        end = wp.min(end, opaque)
        left = int(0)
        for j in range(count):
            if t0s[j] <= end and t1s[j] >= begin:
                ids[left] = ids[j]
                bell[left] = bell[j]
                t0s[left] = t0s[j]
                t1s[left] = t1s[j]
                if wp.static(segments):
                    ends[left] = ends[j]
                left += 1
        return begin, end, left

    @wp.func
    def search(
        far: float,
        opaque: float,
        outside: bool,
        ids: wp.array(dtype=int),
        bell: wp.array(dtype=wp.vec4),
        ends: wp.array(dtype=wp.vec4),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        gathered: int,
    ):
        """(t of the first hit before far, NO_HIT or GIVEN_UP; how many bells matter there).

        outside: whether the ray is known to start outside, if only just.
        """
        if gathered == 0:
            return hermite.NO_HIT, 0
        if gathered > ROOM:
            return GIVEN_UP, 0
        t, end, count = bracket(far, opaque, ids, bell, ends, t0s, t1s, gathered)
        hit = float(hermite.NO_HIT)
        if t > end or count == 0:
            return hit, count
        t = float(t)
        t_e = float(t)
        right = float(t)
        length = float(0.0)
        g = float(0.0)
        s = float(0.0)
        g_right = float(0.0)
        s_right = float(0.0)
        tries = int(0)
        mode = int(_ENTER)
        while True:
            g_e, s_e, step = total(t_e, bell, ends, t0s, t1s, count)
            if t_e >= end and opaque < far:
                g_e = wp.max(g_e, 0.0)
            if mode == _ENTER and g_e >= 0.0:
                if not outside or t > 0.0:
                    # On the bound's edge: a lone bell, or a start inside.
                    hit = wp.where(t > 0.0, t, GIVEN_UP)
                    break
                g_e = -hermite.ON_SURFACE
            if mode == _STEP and g_e < 0.0:
                u = cubics.suspect(g, s * (t_e - t), g_e, s_e * (t_e - t))
                if u * (t_e - t) > 0.02 * length and tries < SPLITS:
                    tries += 1
                    t_e = t + u * (t_e - t)
                    continue
            if mode != _ROOT and g_e < 0.0:
                if t_e >= end:
                    break
                t = t_e
                g = g_e
                s = s_e
                length = wp.max(step, 1.0e-6 * t)
                t_e = wp.min(t + length, end)
                tries = 0
                mode = _STEP
                continue
            if mode == _ROOT:
                tries += 1
                if wp.abs(g_e) < hermite.CLOSE or tries == hermite.TRIES:
                    hit = t_e
                    if s_e > 0.0:
                        hit = wp.clamp(t_e - g_e / s_e, t, right)
                    break
            else:
                mode = _ROOT
                tries = 0
            if g_e < 0.0:
                t = t_e
                g = g_e
                s = s_e
            else:
                right = t_e
                g_right = g_e
                s_right = s_e
            h = right - t
            t_e = t + h * cubics.cubic_root(g, s * h, g_right, s_right * h)
        return hit, count

    return gather, search


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
