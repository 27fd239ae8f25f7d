"""Which contacts of a sphere are kept where it has more than there is place for, as Warp functions."""

import warp as wp

# Contacts of one sphere: the nearest are kept, of equally near ones those that differ most. In general position a ball
# at rest has three.
MOST = 4
Numbers = wp.types.vector(MOST, wp.float64)
Vectors = wp.types.matrix((MOST, 3), wp.float64)


# Warp copies all of a matrix or vector that is read at a variable place; these read it where it stands.
@wp.func_native("return wp::vec_t<3, wp::float64>(rows.data[k][0], rows.data[k][1], rows.data[k][2]);")
def row(rows: wp.ref[Vectors], k: int) -> wp.vec3d:
    """One of the vectors."""
    ...


@wp.func_native("return numbers.c[k];")
def entry(numbers: wp.ref[Numbers], k: int) -> wp.float64:
    """One of the numbers."""
    ...


@wp.func
def known(count: int, points: wp.ref[Vectors], p: wp.vec3d, within: wp.float64):
    """Whether one of `count` points is that near to p."""
    for k in range(count):
        if wp.length(row(points, k) - p) <= within:
            return True
    return False


@wp.func
def nearest_of(count: int, points: wp.ref[Vectors], p: wp.vec3d, within: wp.float64):
    """The nearest of `count` points to p that is that near, else p itself."""
    found = p
    best = within
    for k in range(count):
        distance = wp.length(row(points, k) - p)
        if distance <= best:
            best = distance
            found = row(points, k)
    return found


@wp.func
def place_for(gap: wp.float64, count: int, gaps: wp.ref[Numbers]):
    """Where there is place for a contact: behind the others, or instead of one with a greater gap; -1 if nowhere."""
    if count < MOST:
        return count
    place = wp.int32(0)
    for k in range(1, MOST):
        if entry(gaps, k) > entry(gaps, place):
            place = k
    if gap < entry(gaps, place):
        return place
    return -1


@wp.func
def spread(normals: wp.ref[Vectors], normal: wp.vec3d):
    """Of a full set of contacts and one more, which to give up for it, or -1 for itself: one of the two most alike.

    What lies on more posts than contacts are kept then leans on those around it, not on those of one side.
    """
    place = wp.int32(-1)
    alike = wp.float64(-1.0)
    for k in range(MOST):
        alike = wp.max(alike, wp.dot(row(normals, k), normal))
    for k in range(MOST):
        for j in range(k):
            like = wp.dot(row(normals, j), row(normals, k))
            if like > alike:
                alike = like
                place = k
    return place


@wp.func
def even(gaps: wp.ref[Numbers], gap: wp.float64, within: wp.float64):
    """Whether all gaps are as great as the given one."""
    for k in range(MOST):
        if wp.abs(entry(gaps, k) - gap) > within:
            return False
    return True


@wp.func
def face(gaps: wp.ref[Numbers], radius: wp.float64, horizon: wp.float64):
    """Of a ball whose centre is outside, put the far sides of bodies as if at the horizon."""
    for k in range(MOST):
        if entry(gaps, k) + radius < wp.float64(0.0):
            gaps[k] = horizon


@wp.func
def least_of(count: int, gaps: wp.ref[Numbers]):
    """Which of `count` gaps is the least."""
    which = wp.int32(0)
    for k in range(1, count):
        if entry(gaps, k) < entry(gaps, which):
            which = k
    return which
