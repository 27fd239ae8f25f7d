"""Where a ray enters and leaves the volumes that bound elements: sphere, capsule, piece of a torus.

Each function takes a ray o + t d, |d| = 1, and returns t0 <= t1, or t0 > t1 for a miss. The volume of an arc may be
pierced twice; the result then spans both passages.
"""

import warp as wp

from fieldsim.render import bounds

MISS = wp.constant(1.0e30)
_POINT = wp.constant(bounds.POINT)
_SEGMENT = wp.constant(bounds.SEGMENT)


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
def _arc_distance(p: wp.vec3, radius: float, angle: float, start: wp.vec3, normal: wp.vec3):
    """Distance from p (relative to the centre) to an arc."""
    x = wp.dot(p, start)
    y = wp.dot(p, wp.cross(normal, start))
    z = wp.dot(p, normal)
    rho = wp.sqrt(x * x + y * y)
    cosine = wp.cos(0.5 * angle)
    sine = wp.sin(0.5 * angle)
    # Within half the angle of the arc's middle: beside the arc, not beyond an end.
    if x * cosine + y * sine >= rho * cosine:
        return wp.sqrt((rho - radius) * (rho - radius) + z * z)
    # The nearer end is the one on p's side of the plane through the middle; turned, it lies at (cosine, |sine|).
    u = x * cosine + y * sine
    v = wp.abs(y * cosine - x * sine)
    du = u - radius * cosine
    dv = v - radius * sine
    return wp.sqrt(du * du + dv * dv + z * z)


@wp.func
def _pierce_arc(
    o: wp.vec3,
    d: wp.vec3,
    center: wp.vec3,
    radius: float,
    angle: float,
    start: wp.vec3,
    normal: wp.vec3,
    reach: float,
):
    t0, t1 = pierce_sphere(o, d, center, radius + reach)
    to = o - center
    height = wp.dot(to, normal)
    slope = wp.dot(d, normal)
    if wp.abs(slope) > 1.0e-12:
        t0 = wp.max(t0, (-height - wp.copysign(reach, slope)) / slope)
        t1 = wp.min(t1, (-height + wp.copysign(reach, slope)) / slope)
    elif wp.abs(height) > reach:
        return MISS, -MISS
    # Both ends walk inwards by their distance from the volume. Stopping early leaves a longer interval, never a
    # shorter one.
    close = 0.05 * reach
    for _k in range(12):
        gap = _arc_distance(to + t0 * d, radius, angle, start, normal) - reach
        if gap <= close or t0 > t1:
            break
        t0 += gap
    for _k in range(12):
        gap = _arc_distance(to + t1 * d, radius, angle, start, normal) - reach
        if gap <= close or t0 > t1:
            break
        t1 -= gap
    return t0, t1


@wp.func
def pierce(o: wp.vec3, d: wp.vec3, shape: int, rows: wp.array2d(dtype=float), i: int, reach: float):
    """Entry and exit of element i's bounding volume."""
    a = wp.vec3(rows[i, 5], rows[i, 6], rows[i, 7])
    if shape == _POINT:
        return pierce_sphere(o, d, a, reach)
    axis = wp.vec3(rows[i, 14], rows[i, 15], rows[i, 16])
    if shape == _SEGMENT:
        return _pierce_capsule(o, d, a, wp.vec3(rows[i, 8], rows[i, 9], rows[i, 10]), axis, rows[i, 2], reach)
    normal = wp.vec3(rows[i, 17], rows[i, 18], rows[i, 19])
    return _pierce_arc(o, d, a, rows[i, 2], rows[i, 3], axis, normal, reach)
