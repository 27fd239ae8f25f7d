"""Where a ray enters and leaves elements' bounding volumes: sphere, capsule, piece of a torus, prism, slab.

Each function takes a ray o + t d, |d| = 1, and returns t0 <= t1, or t0 > t1 for a miss. The volume of an arc may be
pierced twice; the result then spans both passages.
"""

import warp as wp

from fieldsim.potentials.primitives.arc import arc_distance
from fieldsim.potentials.primitives.base import Volume
from fieldsim.potentials.row import LENGTH, RADIUS
from fieldsim.render.scene import bounds
from fieldsim.render.scene.rows import axis_of, center_of, corner_b_of, corner_c_of, end_of, normal_of, point_of

MISS = wp.constant(1.0e30)
_BALL, _CAPSULE, _TUBE, _PRISM = (
    wp.constant(int(volume)) for volume in (Volume.BALL, Volume.CAPSULE, Volume.TUBE, Volume.PRISM)
)
_FAR = wp.constant(bounds.FAR)

_distance_to_arc = arc_distance.warp(wp.float32)


@wp.func
def pierce_sphere(o: wp.vec3, d: wp.vec3, center: wp.vec3, radius: float):
    """Entry and exit of a sphere. The discriminant is formed from the ray's distance, which does not cancel."""
    to = center - o
    middle = wp.dot(to, d)
    across = to - middle * d
    rest = radius * radius - wp.dot(across, across)
    if rest < 0.0:
        return MISS, -MISS
    half = wp.sqrt(rest)
    return middle - half, middle + half


@wp.func
def _pierce_capsule(o: wp.vec3, d: wp.vec3, start: wp.vec3, end: wp.vec3, axis: wp.vec3, length: float, radius: float):
    t0, t1 = pierce_sphere(o, d, start, radius)
    s0, s1 = pierce_sphere(o, d, end, radius)
    t0 = wp.min(t0, s0)
    t1 = wp.max(t1, s1)
    # The cylinder between: its infinite line first, then the slab between the ends.
    to = o - start
    along = wp.dot(to, axis)
    slope = wp.dot(d, axis)
    q = to - along * axis
    dq = d - slope * axis
    speed2 = wp.dot(dq, dq)
    c0 = -MISS
    c1 = MISS
    if speed2 > 1.0e-12:
        middle = -wp.dot(q, dq) / speed2
        closest = q + middle * dq
        rest = radius * radius - wp.dot(closest, closest)
        if rest < 0.0:
            return t0, t1
        half = wp.sqrt(rest / speed2)
        c0 = middle - half
        c1 = middle + half
    elif wp.dot(q, q) > radius * radius:
        return t0, t1
    if wp.abs(slope) > 1.0e-12:
        at_start = -along / slope
        at_end = (length - along) / slope
        c0 = wp.max(c0, wp.min(at_start, at_end))
        c1 = wp.min(c1, wp.max(at_start, at_end))
    elif along < 0.0 or along > length:
        return t0, t1
    if c0 <= c1:
        t0 = wp.min(t0, c0)
        t1 = wp.max(t1, c1)
    return t0, t1


@wp.func
def _clip(t0: float, t1: float, height: float, slope: float, reach: float):
    """The part of t0..t1 where height + t slope <= reach."""
    room = reach - height
    if slope > 1.0e-9:
        return t0, wp.min(t1, room / slope)
    if slope < -1.0e-9:
        return wp.max(t0, room / slope), t1
    if room < 0.0:
        return MISS, -MISS
    return t0, t1


@wp.func
def _pierce_slab(o: wp.vec3, d: wp.vec3, point: wp.vec3, normal: wp.vec3, reach: float):
    """Entry and exit of the slab around a plane, within the view's farthest distance."""
    height = wp.dot(o - point, normal)
    slope = wp.dot(d, normal)
    t0, t1 = _clip(-_FAR, _FAR, height, slope, reach)
    return _clip(t0, t1, -height, -slope, reach)


@wp.func
def _beyond_edge(
    o: wp.vec3, d: wp.vec3, t0: float, t1: float, a: wp.vec3, b: wp.vec3, inside: wp.vec3, normal: wp.vec3, reach: float
):
    """The part of t0..t1 that is not farther out than `reach` from the edge a b, seen along the normal."""
    out = wp.normalize(wp.cross(b - a, normal))
    out *= -wp.sign(wp.dot(out, inside - a))
    return _clip(t0, t1, wp.dot(o - a, out), wp.dot(d, out), reach)


@wp.func
def _pierce_prism(o: wp.vec3, d: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, normal: wp.vec3, reach: float):
    t0, t1 = _pierce_slab(o, d, a, normal, reach)
    t0, t1 = _beyond_edge(o, d, t0, t1, a, b, c, normal, reach)
    t0, t1 = _beyond_edge(o, d, t0, t1, b, c, a, normal, reach)
    return _beyond_edge(o, d, t0, t1, c, a, b, normal, reach)


@wp.func
def _pierce_arc(o: wp.vec3, d: wp.vec3, rows: wp.array2d(dtype=float), i: int, normal: wp.vec3, reach: float):
    center = center_of(rows, i)
    t0, t1 = pierce_sphere(o, d, center, rows[i, RADIUS] + reach)
    s0, s1 = _pierce_slab(o, d, center, normal, reach)
    t0 = wp.max(t0, s0)
    t1 = wp.min(t1, s1)
    # Both ends walk inwards by their distance from the volume. Stopping early leaves a longer interval, never a
    # shorter one.
    close = 0.05 * reach
    for _k in range(12):
        p = o + t0 * d
        gap = _distance_to_arc(p[0], p[1], p[2], rows, i) - reach
        if gap <= close or t0 > t1:
            break
        t0 += gap
    for _k in range(12):
        p = o + t1 * d
        gap = _distance_to_arc(p[0], p[1], p[2], rows, i) - reach
        if gap <= close or t0 > t1:
            break
        t1 -= gap
    return t0, t1


@wp.func
def pierce(o: wp.vec3, d: wp.vec3, shape: int, rows: wp.array2d(dtype=float), i: int, reach: float):
    """Entry and exit of element i's bounding volume."""
    a = point_of(rows, i)
    if shape == _BALL:
        return pierce_sphere(o, d, a, reach)
    if shape == _CAPSULE:
        return _pierce_capsule(o, d, a, end_of(rows, i), axis_of(rows, i), rows[i, LENGTH], reach)
    normal = normal_of(rows, i)
    if shape == _TUBE:
        return _pierce_arc(o, d, rows, i, normal, reach)
    if shape == _PRISM:
        return _pierce_prism(o, d, a, corner_b_of(rows, i), corner_c_of(rows, i), normal, reach)
    return _pierce_slab(o, d, a, normal, reach)
