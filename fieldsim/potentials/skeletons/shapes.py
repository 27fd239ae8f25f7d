"""Skeletons of several primitives: polylines, polygons, rectangles, discs, boxes, and curves as arcs and segments.

Each gives a tuple of primitives for a `Field` or a `Body`. Neighbouring primitives meet exactly, so that fields add up
without a seam: pieces of a curve at their ends, triangles along whole edges.
"""

import itertools
import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.base import MOST, Primitive
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.potentials.skeletons.biarc import MOST_PRIMITIVES, fitted
from fieldsim.types import ArrayLike, RealLike, VectorLike

# A function of parameters (M,) that gives points or vectors (M, 3).
Curve: TypeAlias = Callable[[np.ndarray], np.ndarray]

# Points of a polygon may lie off its plane by this part of its size.
FLAT = 1e-9


def polyline(points: ArrayLike, closed: bool = False) -> tuple[Segment, ...]:
    """Segments from point to point, (N, 3), and back to the first if `closed`.

    Raises InputError for fewer than two points and for neighbours at the same place.
    """
    points = _several("polyline", points, 2)
    validate.flag("polyline", "closed", closed)
    _refuse_repeated("polyline", points, closed)
    return tuple(Segment(p, q) for p, q in _pairs(points, closed))


def polygon(points: ArrayLike) -> tuple[Triangle, ...]:
    """N - 2 triangles (fewer where three points are on one line) that fill a flat simple polygon of corners (N, 3).

    The corners run around once, convex or not, and right-handed about the triangles' normal. Ears are cut off, the best
    shaped first (Meisters 1975). Raises InputError for corners at the same place, off the plane of the others by more
    than 1e-9 of the polygon's size, and for sides that cross or touch.
    """
    points = _several("polygon", points, 3)
    _refuse_repeated("polygon", points, closed=True)
    flat = _flattened(points)
    _refuse_crossing(flat)
    return tuple(Triangle(*points[list(ear)]) for ear in _ears(flat))


def rectangle(center: VectorLike, u: VectorLike, v: VectorLike) -> tuple[Triangle, Triangle]:
    """Two triangles that fill the rectangle of sides u and v (vectors, perpendicular), their normal along u x v."""
    center = np.array(validate.vector("rectangle", "center", center))
    u, v = (np.array(validate.vector("rectangle", name, side)) for name, side in (("u", u), ("v", v)))
    sizes = np.abs(u).max(), np.abs(v).max()
    for name, size in zip("uv", sizes, strict=True):
        if size > MOST:
            raise InputError(f"rectangle: {name} is of size {size:g}; give one of at most {MOST:g}, in another unit")
    sizes = np.linalg.norm(u), np.linalg.norm(v)
    for name, size in zip("uv", sizes, strict=True):
        if size == 0.0:
            raise InputError(f"rectangle: {name} is (0, 0, 0); give the vector of a side")
    if abs(u @ v) > FLAT * sizes[0] * sizes[1]:
        raise InputError(
            f"rectangle: u = {u.tolist()} and v = {v.tolist()} are not perpendicular; give such, or use polygon"
        )
    a, b, c, d = (center + 0.5 * (s * u + t * v) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return Triangle(a, b, c), Triangle(a, c, d)


def disc(
    center: VectorLike, normal: VectorLike, radius: RealLike, tolerance: RealLike | None = None
) -> tuple[Triangle, ...]:
    """A fan of triangles about `center` that fills the disc across `normal`, its rim within `tolerance` of the circle.

    The regular polygon has the disc's own area, its corners outside and its sides' middles inside. The tolerance is a
    thousandth of the radius by default.
    """
    return fan("disc", center, normal, radius, tolerance)


def fan(
    owner: str, center: VectorLike, normal: VectorLike, radius: RealLike, tolerance: RealLike | None
) -> tuple[Triangle, ...]:
    """`disc` in the name of `owner`."""
    center = np.array(validate.vector(owner, "center", center))
    normal = np.array(validate.direction(owner, "normal", normal))
    radius = validate.number(owner, "radius", radius, above=0.0)
    if tolerance is not None and radius > 1e13 * _tolerance(owner, tolerance):
        raise InputError(f"{owner}: tolerance is {tolerance:g} at radius {radius:g}; give a larger one")
    tolerance = 1e-3 * radius if tolerance is None else _tolerance(owner, tolerance)
    rough = math.pi * math.sqrt(radius / tolerance / 3.0)
    validate.bounded(owner, "triangles", rough, MOST_PRIMITIVES, "give a larger tolerance")
    count = 3
    # The corners stick out the most, by a third of the angle squared for many of them.
    while _circumradius(count) - 1.0 > tolerance / radius:
        count = max(count + 1, math.floor(math.pi * math.sqrt(radius / (3.0 * tolerance))))
    u, v = _axes(normal)
    angles = 2 * math.pi * np.arange(count) / count
    rim = center + radius * _circumradius(count) * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v)
    return tuple(Triangle(center, p, q) for p, q in _pairs(rim, closed=True))


def box(center: VectorLike, size: VectorLike) -> tuple[Triangle, ...]:
    """The surface of a box with sides `size` along x, y, z: 12 triangles, their normals outward.

    `solid(mesh(box(...)), density)` is the field of the box filled.
    """
    return sides("box", center, size)


def sides(owner: str, center: VectorLike, size: VectorLike) -> tuple[Triangle, ...]:
    """`box` in the name of `owner`."""
    center = np.array(validate.vector(owner, "center", center))
    size = np.array(validate.vector(owner, "size", size))
    for index, side in enumerate(size):
        validate.number(owner, f"size[{index}]", side, above=0.0, at_most=MOST)
    triangles = []
    for axis, sign in itertools.product(range(3), (-1.0, 1.0)):
        out, u, v = (np.roll(np.eye(3)[axis], k) * size for k in range(3))
        triangles += rectangle(center + 0.5 * sign * out, sign * u, v)
    return tuple(triangles)


def bezier(points: ArrayLike, tolerance: RealLike) -> tuple[Primitive, ...]:
    """A chain of cubic Bezier curves as arcs and segments within `tolerance` of it.

    points: control points (3 k + 1, 3), the last of each cubic being the first of the next. Arcs join with a common
    tangent; where the curve is straight, segments are used.
    """
    points = _several("bezier", points, 4)
    if len(points) % 3 != 1:
        raise InputError(f"bezier: {len(points)} control points; give 4, 7, 10, ...: each cubic adds three")
    tolerance = _tolerance("bezier", tolerance)
    cubics = [points[i : i + 4] for i in range(0, len(points) - 1, 3)]
    for index, cubic in enumerate(cubics):
        if (cubic == cubic[0]).all():
            raise InputError(f"bezier: points[{3 * index}] to points[{3 * index + 3}] are all {_plain(cubic[0])}")
    return tuple(primitive for cubic in cubics for primitive in _cubic(cubic, tolerance))


def catmull_rom(points: ArrayLike, closed: bool = False, *, tolerance: RealLike) -> tuple[Primitive, ...]:
    """The centripetal Catmull-Rom curve through points (N, 3) as arcs and segments within `tolerance` of it.

    Centripetal ones have neither loops nor cusps between points (Yuksel, Schaefer & Keyser 2011). Ends of an open curve
    continue as if mirrored. Raises InputError for fewer than two points (three if closed) and for neighbours at the
    same place.
    """
    points = _several("catmull_rom", points, 3 if validate.flag("catmull_rom", "closed", closed) else 2)
    _refuse_repeated("catmull_rom", points, closed)
    tolerance = _tolerance("catmull_rom", tolerance)
    if closed:
        around = np.concatenate([points[-1:], points, points[:2]])
    else:
        around = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    cubics = (_through(*around[i : i + 4]) for i in range(len(around) - 3))
    return tuple(primitive for cubic in cubics for primitive in _cubic(cubic, tolerance))


def curve(
    position: Curve, velocity: Curve, start: RealLike, end: RealLike, *, tolerance: RealLike
) -> tuple[Primitive, ...]:
    """Any smooth curve as arcs and segments within `tolerance` of it.

    position, velocity: functions of the parameters (M,) giving (M, 3), the second along the first's derivative;
    start, end: the range of the parameter.
    """
    start, end = validate.number("curve", "start", start), validate.number("curve", "end", end)
    if not start < end:
        raise InputError(f"curve: start is {start:g} and end {end:g}; give a range that ascends")
    with np.errstate(all="ignore"):  # what is no number is refused
        for name, function in (("position(...)", position), ("velocity(...)", velocity)):
            _refuse_far("curve", name, validate.points("curve", name, function(np.linspace(start, end, 9))))
        return fitted(position, velocity, start, end, _tolerance("curve", tolerance))


def _cubic(points, tolerance):
    """One cubic Bezier curve as arcs and segments."""

    def position(t):
        s = 1.0 - t[:, None]
        t = t[:, None]
        return s**3 * points[0] + 3 * s**2 * t * points[1] + 3 * s * t**2 * points[2] + t**3 * points[3]

    def velocity(t):
        # Where control points coincide with an end the tangent there is the limit's.
        t = np.clip(t, 1e-7, 1.0 - 1e-7)[:, None]
        s = 1.0 - t
        steps = np.diff(points, axis=0)
        return s**2 * steps[0] + 2 * s * t * steps[1] + t**2 * steps[2]

    return fitted(position, velocity, 0.0, 1.0, tolerance)


def _through(before, p, q, after):
    """Control points of the centripetal Catmull-Rom curve from p to q."""
    # Intervals of the parameter: square roots of the distances.
    d0, d1, d2 = (math.sqrt(np.linalg.norm(b - a)) for a, b in ((before, p), (p, q), (q, after)))
    leave = (p - before) / d0 - (q - before) / (d0 + d1) + (q - p) / d1
    arrive = (q - p) / d1 - (after - p) / (d1 + d2) + (after - q) / d2
    return np.array([p, p + d1 / 3 * leave, q - d1 / 3 * arrive, q])


def _several(owner, points, least):
    points = validate.points(owner, "points", points)
    if len(points) < least:
        raise InputError(f"{owner}: {len(points)} points; give at least {least}")
    _refuse_far(owner, "points", points)
    return points


def _refuse_far(owner, name, points):
    """Raise InputError for points beyond what primitives can have."""
    far = np.flatnonzero(np.abs(points).max(axis=1) > MOST)
    if far.size:
        raise InputError(
            f"{owner}: {name}[{far[0]}] is {_plain(points[far[0]])}; give coordinates of at most {MOST:g}, "
            "in another unit"
        )


def _refuse_repeated(owner, points, closed):
    for index, (p, q) in enumerate(_pairs(points, closed)):
        if (p == q).all():
            other = (index + 1) % len(points)
            hint = "; a closed shape does not repeat its first point" if other == 0 else ""
            raise InputError(f"{owner}: points[{index}] and points[{other}] are both {_plain(p)}; leave one out{hint}")


def _pairs(points, closed):
    ends = np.roll(points, -1, axis=0) if closed else points[1:]
    return zip(points, ends, strict=False)


def _tolerance(owner, tolerance):
    return validate.number(owner, "tolerance", tolerance, above=0.0)


def _plain(point):
    return "(" + ", ".join(f"{x:g}" for x in point) + ")"


def _axes(normal):
    """Two unit vectors that make a right-handed frame with `normal`."""
    u = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    u /= np.linalg.norm(u)
    return u, np.cross(normal, u)


def _circumradius(count):
    """Distance of the corners of a regular polygon that has the unit disc's area."""
    turn = 2 * math.pi / count
    return math.sqrt(turn / math.sin(turn))


def _flattened(points):
    """The polygon's corners in its plane, (N, 2), counter-clockwise."""
    offsets = points - points.mean(axis=0)
    size = np.abs(offsets).max()
    normal = np.cross(offsets, np.roll(offsets, -1, axis=0)).sum(axis=0)
    if not np.linalg.norm(normal) > FLAT * size**2:
        raise InputError("polygon: its corners enclose no area (on one line, or a figure of eight); move some of them")
    normal /= np.linalg.norm(normal)
    heights = offsets @ normal
    worst = np.argmax(np.abs(heights))
    if abs(heights[worst]) > FLAT * size:
        raise InputError(
            f"polygon: points[{worst}], {_plain(points[worst])}, lies {abs(heights[worst]):g} off the plane of the "
            "others; give corners in one plane"
        )
    return offsets @ np.transpose(_axes(normal))


def _turn(p, q, r):
    """Twice the area of the triangle p, q, r, positive when counter-clockwise."""
    return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])


def _refuse_crossing(flat):
    """Raise InputError for sides of a polygon that cross or touch."""
    count = len(flat)
    nothing = FLAT * np.ptp(flat, axis=0).max() ** 2
    for i, j in itertools.combinations(range(count), 2):
        p, q, r, s = flat[i], flat[(i + 1) % count], flat[j], flat[(j + 1) % count]
        if j == i + 1:
            # Neighbours share q; they must not lie on each other.
            crossing = abs(_turn(p, q, s)) <= nothing and (p - q) @ (s - q) > 0
        elif (j + 1) % count == i:
            crossing = abs(_turn(r, p, q)) <= nothing and (r - p) @ (q - p) > 0
        else:
            crossing = _touch(p, q, r, s, nothing)
        if crossing:
            raise InputError(
                f"polygon: the sides from points[{i}] and from points[{j}] cross or touch; give corners of a simple "
                "polygon in order around it"
            )


def _touch(p, q, r, s, nothing):
    """Whether the segments p q and r s have a point in common."""
    if (np.maximum(p, q) < np.minimum(r, s)).any() or (np.maximum(r, s) < np.minimum(p, q)).any():
        return False
    sides = np.array([_turn(p, q, r), _turn(p, q, s), _turn(r, s, p), _turn(r, s, q)])
    sides[np.abs(sides) <= nothing] = 0.0
    return sides[0] * sides[1] <= 0 and sides[2] * sides[3] <= 0


def _ears(flat):
    """Triples of indices that triangulate a simple counter-clockwise polygon."""
    left = list(range(len(flat)))
    nothing = FLAT * np.ptp(flat, axis=0).max() ** 2
    ears = []
    while len(left) > 2:
        corners = flat[left]
        before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
        area = _turn(before, corners, after)
        # Shape: area over the square of the longest side; corners on a straight line only leave the list.
        sides = np.array([corners - before, after - corners, before - after])
        longest = np.max(np.sum(sides**2, axis=2), axis=0)
        order = np.argsort(-area / longest)
        best = next((k for k in order if area[k] > nothing and _is_empty(corners, k)), None)
        straight = np.flatnonzero(np.abs(area) <= nothing)
        if best is None and not straight.size:
            raise InputError("polygon: its sides cross or touch; give corners of a simple polygon in order around it")
        if best is None:
            del left[straight[0]]
            continue
        ears.append((left[best - 1], left[best], left[(best + 1) % len(left)]))
        del left[best]
    return ears


def _is_empty(corners, k):
    """Whether the ear at corner k holds no other corner of the polygon, nor has one on its inner edge."""
    count = len(corners)
    a, b, c = corners[k - 1], corners[k], corners[(k + 1) % count]
    others = corners[[i for i in range(count) if i not in ((k - 1) % count, k, (k + 1) % count)]]
    inside = (_turn(a, b, others) >= 0) & (_turn(b, c, others) >= 0) & (_turn(c, a, others) >= 0)
    return not inside.any()
