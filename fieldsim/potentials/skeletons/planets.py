"""Skeletons of planets, ready for a Body: `Body(planets.donut(), gravity=Newtonian(), surface=clay)`.

Each is a tuple of primitives of one dimension, about `center`, flat ones across `normal`; lengths are in scene units.
"""

import math

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.potentials.skeletons import shapes
from fieldsim.types import RealLike, VectorLike, WholeLike

# A length whose square is finite.
LONGEST = 1e100
ORIGIN = (0.0, 0.0, 0.0)
UP = (0.0, 0.0, 1.0)


def cigar(
    length: RealLike = 2.0,
    *,
    center: VectorLike = ORIGIN,
    axis: VectorLike = (1.0, 0.0, 0.0),
) -> tuple[Segment]:
    """One segment along `axis`, its middle at `center`."""
    return (_cigar("cigar", length, center, axis),)


def _cigar(owner, length, center, axis):
    half = 0.5 * _positive(owner, "length", length) * np.array(validate.direction(owner, "axis", axis))
    center = np.array(validate.vector(owner, "center", center))
    return Segment(center - half, center + half)


def cross(length: RealLike = 2.0, *, center: VectorLike = ORIGIN, normal: VectorLike = UP) -> tuple[Segment, ...]:
    """Two segments of the given length that halve each other at right angles."""
    return _asterisk("cross", 4, 0.5 * _positive("cross", "length", length), center, normal)


def asterisk(
    arms: WholeLike = 6,
    radius: RealLike = 1.0,
    *,
    center: VectorLike = ORIGIN,
    normal: VectorLike = UP,
) -> tuple[Segment, ...]:
    """Straight arms from `center`, evenly around; opposite ones are one segment."""
    arms = validate.whole("asterisk", "arms", arms, at_least=2, at_most=shapes.MOST_PRIMITIVES)
    return _asterisk("asterisk", arms, radius, center, normal)


def _asterisk(owner, arms, radius, center, normal):
    place = _plane(owner, center, normal)
    tips = place(_ring(arms, _positive(owner, "radius", radius)))
    if arms % 2 == 0:
        return tuple(Segment(tips[k], tips[k + arms // 2]) for k in range(arms // 2))
    return tuple(Segment(place(np.zeros((1, 3)))[0], tip) for tip in tips)


def jack(length: RealLike = 2.0, *, center: VectorLike = ORIGIN) -> tuple[Segment, ...]:
    """Three segments along x, y and z that halve each other."""
    return tuple(_cigar("jack", length, center, axis) for axis in np.eye(3))


def donut(radius: RealLike = 1.0, *, center: VectorLike = ORIGIN, normal: VectorLike = UP) -> tuple[Circle]:
    """One circle."""
    center, normal = validate.vector("donut", "center", center), validate.direction("donut", "normal", normal)
    return (Circle(center, normal, _positive("donut", "radius", radius)),)


def star(
    points: WholeLike = 5,
    radius: RealLike = 1.0,
    inner: RealLike = 0.4,
    *,
    center: VectorLike = ORIGIN,
    normal: VectorLike = UP,
) -> tuple[Segment, ...]:
    """The outline of a star: tips at `radius`, notches between them at `inner`, which is smaller."""
    points = validate.whole("star", "points", points, at_least=2, at_most=shapes.MOST_PRIMITIVES)
    radius, inner = _positive("star", "radius", radius), _positive("star", "inner", inner)
    if not inner < radius:
        raise InputError(f"star: inner is {inner:g} and radius {radius:g}; give an inner radius below the outer")
    corners = _ring(2 * points, radius)
    corners[1::2] *= inner / radius
    return shapes.polyline(_plane("star", center, normal)(corners), closed=True)


def spiral(
    turns: RealLike = 3.0,
    radius: RealLike = 1.0,
    inner: RealLike = 0.1,
    *,
    center: VectorLike = ORIGIN,
    normal: VectorLike = UP,
    tolerance: RealLike | None = None,
) -> tuple[Primitive, ...]:
    """An Archimedean spiral from `inner` out to `radius`, as arcs within `tolerance` (a thousandth of the radius)."""
    turns, radius = _positive("spiral", "turns", turns), _positive("spiral", "radius", radius)
    inner = validate.number("spiral", "inner", inner, at_least=0.0)
    if not inner < radius:
        raise InputError(f"spiral: inner is {inner:g} and radius {radius:g}; give an inner radius below the outer")
    growth = (radius - inner) / (2 * math.pi * turns)

    def shape(t):
        r = inner + growth * t
        return _columns(r * np.cos(t), r * np.sin(t))

    def slope(t):
        r = inner + growth * t
        return _columns(growth * np.cos(t) - r * np.sin(t), growth * np.sin(t) + r * np.cos(t))

    return _curve("spiral", shape, slope, 2 * math.pi * turns, radius, tolerance, center, normal)


def helix(
    turns: RealLike = 3.0,
    radius: RealLike = 0.5,
    height: RealLike = 2.0,
    *,
    center: VectorLike = ORIGIN,
    normal: VectorLike = UP,
    tolerance: RealLike | None = None,
) -> tuple[Primitive, ...]:
    """A spring around `normal`, its middle at `center`, as arcs within `tolerance` (a thousandth of the radius)."""
    turns, radius = _positive("helix", "turns", turns), _positive("helix", "radius", radius)
    height = _positive("helix", "height", height)
    rise = height / (2 * math.pi * turns)

    def shape(t):
        return _columns(radius * np.cos(t), radius * np.sin(t), rise * t - 0.5 * height)

    def slope(t):
        return _columns(-radius * np.sin(t), radius * np.cos(t), rise)

    return _curve("helix", shape, slope, 2 * math.pi * turns, radius, tolerance, center, normal)


def knot(
    radius: RealLike = 1.0,
    *,
    center: VectorLike = ORIGIN,
    normal: VectorLike = UP,
    tolerance: RealLike | None = None,
) -> tuple[Primitive, ...]:
    """A trefoil knot that reaches out to `radius`, as arcs within `tolerance` (a thousandth of the radius)."""
    radius = _positive("knot", "radius", radius)
    scale = radius / 3.0

    def shape(t):
        return scale * _columns(np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t))

    def slope(t):
        return scale * _columns(np.cos(t) + 4 * np.cos(2 * t), -np.sin(t) + 4 * np.sin(2 * t), -3 * np.cos(3 * t))

    return _curve("knot", shape, slope, 2 * math.pi, radius, tolerance, center, normal)


def pancake(
    radius: RealLike = 1.0,
    *,
    center: VectorLike = ORIGIN,
    normal: VectorLike = UP,
    tolerance: RealLike | None = None,
) -> tuple[Triangle, ...]:
    """A disc of triangles, its rim within `tolerance` of the circle (a thousandth of the radius)."""
    return shapes.fan("pancake", center, normal, radius, tolerance)


def brick(size: VectorLike = (1.0, 1.0, 1.0), *, center: VectorLike = ORIGIN) -> tuple[Triangle, ...]:
    """The surface of a box with sides along x, y and z."""
    return shapes.sides("brick", center, size)


def _positive(owner, name, value):
    return validate.number(owner, name, value, above=0.0, at_most=LONGEST)


def _columns(x, y, z=0.0):
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def _ring(count, radius):
    """Points evenly around a circle, (count, 3), the first on the first axis."""
    angles = 2 * math.pi * np.arange(count) / count
    return _columns(radius * np.cos(angles), radius * np.sin(angles))


def _plane(owner, center, normal):
    """A function that moves points (M, 3) from about the origin, z up, to `center` and `normal`."""
    center = np.array(validate.vector(owner, "center", center))
    frame = _frame(np.array(validate.direction(owner, "normal", normal)))
    return lambda points: center + points @ frame


def _frame(normal):
    """A rotation that takes z to `normal` as its rows; none at all for z itself."""
    if normal[2] == 1.0:
        return np.eye(3)
    u = np.cross((0.0, 0.0, 1.0), normal) if abs(normal[2]) < 0.9 else np.cross((0.0, 1.0, 0.0), normal)
    u /= np.linalg.norm(u)
    return np.array([u, np.cross(normal, u), normal])


def _curve(owner, shape, slope, end, radius, tolerance, center, normal):
    place = _plane(owner, center, normal)
    origin = place(np.zeros((1, 3)))
    tolerance = 1e-3 * radius if tolerance is None else _positive(owner, "tolerance", tolerance)
    return shapes.curve(lambda t: place(shape(t)), lambda t: place(slope(t)) - origin, 0.0, end, tolerance=tolerance)
