"""Where a ray crosses a hard shape, and the normal there, each in the shape's own frame (see `world.shapes`).

A convex shape is one interval (t0, t1) of the ray, t0 > t1 for a miss; a crossing is the first end of it ahead. An arc
tube may have six ends; its torus is a quartic, solved in float64: for a tube of a hundredth of the arc's radius float32
would leave some hundredths of the tube's radius.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import warp as wp

from fieldsim.render.scene.tables import FOREVER
from fieldsim.render.scene.volumes import MISS, pierce_sphere

_TINY = wp.constant(1.0e-12)


@wp.func
def ahead(t0: float, t1: float):
    """The first end of an interval that lies ahead; FOREVER for none."""
    if t0 > t1 or t1 <= 0.0:
        return FOREVER
    return wp.where(t0 > 0.0, t0, t1)


@wp.func
def _within(o: float, d: float, half: float, t0: float, t1: float):
    """The part of t0..t1 in which |o + t d| <= half."""
    if wp.abs(d) < _TINY:
        if wp.abs(o) > half:
            return MISS, -MISS
        return t0, t1
    a = (-half - o) / d
    b = (half - o) / d
    return wp.max(t0, wp.min(a, b)), wp.min(t1, wp.max(a, b))


@wp.func
def _known_miss(t0: float, t1: float):
    """The interval, made one that adds nothing to a span where it is empty."""
    if t0 > t1:
        return MISS, -MISS
    return t0, t1


@wp.func
def ellipsoid_span(o: wp.vec3, d: wp.vec3, radii: wp.vec3):
    """Interval within an ellipsoid."""
    # In units of the semi-axes it is a unit ball.
    scaled = wp.cw_div(d, radii)
    speed = wp.length(scaled)
    t0, t1 = pierce_sphere(wp.cw_div(o, radii), scaled / speed, wp.vec3(0.0, 0.0, 0.0), 1.0)
    return t0 / speed, t1 / speed


@wp.func
def box_span(o: wp.vec3, d: wp.vec3, half: wp.vec3):
    """Interval within a box."""
    t0, t1 = _within(o[0], d[0], half[0], -MISS, MISS)
    t0, t1 = _within(o[1], d[1], half[1], t0, t1)
    return _within(o[2], d[2], half[2], t0, t1)


@wp.func
def cylinder_span(o: wp.vec3, d: wp.vec3, radius: float, half: float):
    """Interval within a cylinder along z."""
    t0 = -MISS
    t1 = MISS
    speed2 = d[0] * d[0] + d[1] * d[1]
    if speed2 < _TINY:
        if o[0] * o[0] + o[1] * o[1] > radius * radius:
            return MISS, -MISS
    else:
        middle = -(o[0] * d[0] + o[1] * d[1]) / speed2
        # The line's distance from the axis; its square would cancel against the radius's.
        across = wp.abs(o[0] * d[1] - o[1] * d[0]) / wp.sqrt(speed2)
        rest = (radius - across) * (radius + across)
        if rest < 0.0:
            return MISS, -MISS
        t0 = middle - wp.sqrt(rest / speed2)
        t1 = middle + wp.sqrt(rest / speed2)
    return _within(o[2], d[2], half, t0, t1)


@wp.func
def capsule_span(o: wp.vec3, d: wp.vec3, radius: float, half: float):
    """Interval within a capsule along z: it is convex, so the span of its parts is its own."""
    t0, t1 = cylinder_span(o, d, radius, half)
    t0, t1 = _known_miss(t0, t1)
    a0, a1 = pierce_sphere(o, d, wp.vec3(0.0, 0.0, -half), radius)
    b0, b1 = pierce_sphere(o, d, wp.vec3(0.0, 0.0, half), radius)
    return wp.min(t0, wp.min(a0, b0)), wp.max(t1, wp.max(a1, b1))


@wp.func
def _edge_span(o: wp.vec3, d: wp.vec3, a: wp.vec3, b: wp.vec3, radius: float):
    """Interval within the capsule from a to b, both in the plane z = 0."""
    length = wp.length(b - a)
    u = (b - a) / length
    v = wp.vec3(-u[1], u[0], 0.0)
    q = o - 0.5 * (a + b)
    # A turned frame with its z along the edge.
    return capsule_span(
        wp.vec3(wp.dot(q, v), q[2], wp.dot(q, u)), wp.vec3(wp.dot(d, v), d[2], wp.dot(d, u)), radius, 0.5 * length
    )


@wp.func
def _inner(o: wp.vec3, d: wp.vec3, a: wp.vec3, b: wp.vec3, t0: float, t1: float):
    """The part of t0..t1 on the left of the line from a to b."""
    offset = (b[0] - a[0]) * (o[1] - a[1]) - (b[1] - a[1]) * (o[0] - a[0])
    slope = (b[0] - a[0]) * d[1] - (b[1] - a[1]) * d[0]
    if slope == 0.0:
        if offset < 0.0:
            return MISS, -MISS
        return t0, t1
    t = -offset / slope
    if slope > 0.0:
        return wp.max(t0, t), t1
    return t0, wp.min(t1, t)


@wp.func
def prism_span(o: wp.vec3, d: wp.vec3, b: wp.vec3, c: wp.vec3, radius: float):
    """Interval within the radius of the triangle 0, b, c: a prism and three capsules, together convex."""
    a = wp.vec3(0.0, 0.0, 0.0)
    t0, t1 = _within(o[2], d[2], radius, -MISS, MISS)
    t0, t1 = _inner(o, d, a, b, t0, t1)
    t0, t1 = _inner(o, d, b, c, t0, t1)
    t0, t1 = _inner(o, d, c, a, t0, t1)
    t0, t1 = _known_miss(t0, t1)
    x0, x1 = _edge_span(o, d, a, b, radius)
    y0, y1 = _edge_span(o, d, b, c, radius)
    z0, z1 = _edge_span(o, d, c, a, radius)
    return wp.min(wp.min(t0, x0), wp.min(y0, z0)), wp.max(wp.max(t1, x1), wp.max(y1, z1))


@wp.func
def slab_crossing(o: wp.vec3, d: wp.vec3, half: float, x: float, y: float):
    """First crossing of the planes z = half and -half; x, y: half sizes of the rectangle, or 0 for no end."""
    if d[2] == 0.0:
        return FOREVER
    best = float(FOREVER)
    for k in range(2):
        t = (float(2 * k - 1) * half - o[2]) / d[2]
        p = o + t * d
        if t > 0.0 and t < best and (x == 0.0 or (wp.abs(p[0]) <= x and wp.abs(p[1]) <= y)):
            best = t
    return best


_Quartic = wp.types.vector(length=5, dtype=wp.float64)  # coefficients, from the constant on


@wp.func
def _bracketed(low: wp.float64, high: wp.float64, c: _Quartic):
    """The root in low..high of a polynomial that is monotone there; `high` for none. Newton's steps, else bisection."""
    zero = wp.float64(0.0)
    a = wp.float64(low)
    b = wp.float64(high)
    rising = (((c[4] * b + c[3]) * b + c[2]) * b + c[1]) * b + c[0] > zero
    if rising == ((((c[4] * a + c[3]) * a + c[2]) * a + c[1]) * a + c[0] > zero):
        return high
    u = wp.float64(0.5) * (a + b)
    for _k in range(60):
        # Horner's scheme for value and slope.
        f = c[4]
        slope = zero
        for j in range(4):
            slope = slope * u + f
            f = f * u + c[3 - j]
        if (f > zero) == rising:
            b = u
        else:
            a = u
        step = wp.float64(0.5) * (a + b) - u
        if slope != zero:
            newton = -f / slope
            if u + newton > a and u + newton < b:
                step = newton
        u += step
        if wp.abs(step) < wp.float64(1.0e-12):
            break
    return u


@wp.func
def _torus_quartic(p: wp.vec3d, d: wp.vec3d, ring: wp.float64, radius: wp.float64):
    """The quartic in u that is negative where p + u d, p orthogonal to the unit vector d, lies within a torus."""
    two = wp.float64(2.0)
    four = wp.float64(4.0)
    rho = wp.sqrt(p[0] * p[0] + p[1] * p[1])
    k = wp.dot(p, p) + ring * ring - radius * radius
    c = _Quartic()
    # k^2 - 4 ring^2 rho^2 as a product, which does not cancel.
    c[0] = (k - two * ring * rho) * (k + two * ring * rho)
    c[1] = -two * four * ring * ring * (p[0] * d[0] + p[1] * d[1])
    c[2] = two * k - four * ring * ring * (d[0] * d[0] + d[1] * d[1])
    c[4] = wp.float64(1.0)
    return c


@wp.func
def torus_roots(o: wp.vec3, direction: wp.vec3, ring: float, radius: float):
    """The up to four crossings of the torus about z, ascending, padded with FOREVER; t > 0 or not."""
    # In units of the whole, from the ray's point nearest to the centre.
    size = wp.float64(ring) + wp.float64(radius)
    d = wp.vec3d(direction)
    speed = wp.length(d)
    d /= speed
    middle = -wp.dot(wp.vec3d(o), d)
    p = (wp.vec3d(o) + middle * d) / size
    roots = wp.vec4(FOREVER, FOREVER, FOREVER, FOREVER)
    rest = wp.float64(1.0) - wp.dot(p, p)
    if rest <= wp.float64(0.0):
        return roots
    c = _torus_quartic(p, d, wp.float64(ring) / size, wp.float64(radius) / size)
    slope = _Quartic()
    slope[0] = c[1]
    slope[1] = wp.float64(2.0) * c[2]
    slope[3] = wp.float64(4.0)
    # Where the slope turns, where it vanishes, and so the pieces over which the quartic is monotone.
    end = wp.sqrt(rest)
    turn = wp.min(wp.sqrt(wp.max(-c[2] / wp.float64(6.0), wp.float64(0.0))), end)
    bounds = wp.vec4d(_bracketed(-end, -turn, slope), _bracketed(-turn, turn, slope), _bracketed(turn, end, slope), end)
    low = -end
    count = int(0)
    for piece in range(4):
        high = bounds[piece]
        if high > low:
            root = _bracketed(low, high, c)
            if root < high:
                roots[count] = float((middle + root * size) / speed)
                count += 1
        low = high
    return roots


@wp.func
def tube_crossing(o: wp.vec3, d: wp.vec3, ring: float, radius: float, half_angle: float):
    """First crossing ahead of an arc tube with round ends, symmetric about x in the plane z = 0."""
    cosine = wp.cos(half_angle)
    best = float(FOREVER)
    roots = torus_roots(o, d, ring, radius)
    for k in range(4):
        t = roots[k]
        p = o + t * d
        # Beside the arc, not beyond its ends.
        if t > 0.0 and t < best and p[0] >= wp.sqrt(p[0] * p[0] + p[1] * p[1]) * cosine:
            best = t
    if half_angle > 3.1415:
        return best
    for k in range(2):
        side = float(2 * k - 1) * ring * wp.sin(half_angle)
        s0, s1 = pierce_sphere(o, d, wp.vec3(ring * cosine, side, 0.0), radius)
        for j in range(2):
            t = wp.where(j == 0, s0, s1)
            p = o + t * d
            # On the outside of the whole: beyond the ends, and not within the other end.
            if s0 < s1 and t > 0.0 and t < best and p[0] < wp.sqrt(p[0] * p[0] + p[1] * p[1]) * cosine:
                if wp.length(p - wp.vec3(ring * cosine, -side, 0.0)) >= radius:
                    best = t
    return best


@wp.func
def tube_normal(p: wp.vec3, ring: float, half_angle: float):
    """Outward normal at a point on an arc tube: away from the nearest point of the arc."""
    cosine = wp.cos(half_angle)
    rho = wp.sqrt(p[0] * p[0] + p[1] * p[1])
    if p[0] >= rho * cosine:
        return wp.normalize(p - wp.vec3(p[0], p[1], 0.0) * (ring / rho))
    return wp.normalize(p - wp.vec3(ring * cosine, wp.copysign(ring * wp.sin(half_angle), p[1]), 0.0))


@wp.func
def box_normal(p: wp.vec3, half: wp.vec3):
    """Outward normal of the face nearest to p."""
    x = wp.abs(p[0]) - half[0]
    y = wp.abs(p[1]) - half[1]
    z = wp.abs(p[2]) - half[2]
    if x >= y and x >= z:
        return wp.vec3(wp.sign(p[0]), 0.0, 0.0)
    if y >= z:
        return wp.vec3(0.0, wp.sign(p[1]), 0.0)
    return wp.vec3(0.0, 0.0, wp.sign(p[2]))


@wp.func
def cylinder_normal(p: wp.vec3, radius: float, half: float):
    """Outward normal of the side or the end nearest to p."""
    if wp.abs(p[2]) - half > wp.sqrt(p[0] * p[0] + p[1] * p[1]) - radius:
        return wp.vec3(0.0, 0.0, wp.sign(p[2]))
    return wp.normalize(wp.vec3(p[0], p[1], 0.0))


@wp.func
def _nearest_on_edge(p: wp.vec3, a: wp.vec3, b: wp.vec3):
    u = wp.clamp(wp.dot(p - a, b - a) / wp.length_sq(b - a), 0.0, 1.0)
    return a + u * (b - a)


@wp.func
def _left(p: wp.vec3, a: wp.vec3, b: wp.vec3):
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0.0


@wp.func
def prism_normal(p: wp.vec3, b: wp.vec3, c: wp.vec3):
    """Outward normal at a point near the triangle 0, b, c: away from its nearest point."""
    a = wp.vec3(0.0, 0.0, 0.0)
    if _left(p, a, b) and _left(p, b, c) and _left(p, c, a):
        return wp.vec3(0.0, 0.0, wp.sign(p[2]))
    nearest = _nearest_on_edge(p, a, b)
    other = _nearest_on_edge(p, b, c)
    if wp.length_sq(p - other) < wp.length_sq(p - nearest):
        nearest = other
    other = _nearest_on_edge(p, c, a)
    if wp.length_sq(p - other) < wp.length_sq(p - nearest):
        nearest = other
    return wp.normalize(p - nearest)
