"""Mass points: a skeleton's mass as points with weights, by Gauss's rules, exact as more are taken."""

import functools
import math

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials.field import total_measure
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.face import Face
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.tapered import TaperedSegment
from fieldsim.potentials.primitives.triangle import Triangle

# Points at most along one length of a curve, a surface, a solid.
MOST = {1: 64, 2: 16, 3: 6}
# So many points along a length give moments of mass to rounding, also those of whole circles.
EXACT = 24


@functools.cache
def _gauss(count):
    """Gauss-Legendre nodes and weights on 0..1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (nodes + 1.0), 0.5 * weights


def _simplex(corners, count):
    """Points (n, 3) and weights (n,), of sum 1, in the simplex of d + 1 corners: Gauss's rule in Duffy's coordinates.

    Also the first coordinate u of each point, which runs from 0 at the first corner to 1 opposite it.
    """
    corners = np.array(corners)
    nodes, weights = _gauss(count)
    points, shares, reach = corners[:1], np.ones(1), np.ones(1)
    first = None
    dimension = len(corners) - 1
    for k in range(1, dimension + 1):
        u = np.tile(nodes, len(points))
        reach = np.repeat(reach, count) * u
        points = np.repeat(points, count, axis=0) + reach[:, None] * (corners[k] - corners[k - 1])
        power = dimension - k
        shares = np.repeat(shares, count) * np.tile(weights, len(shares)) * (power + 1) * u**power
        first = u if first is None else np.repeat(first, count)
    return points, shares, first


def _arc(arc, count):
    closed = isinstance(arc, Circle)
    nodes, weights = (np.arange(count) / count, np.full(count, 1.0 / count)) if closed else _gauss(count)
    normal = np.array(arc.normal)
    start = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))]) if closed else np.array(arc.start)
    start = start / np.linalg.norm(start)
    angle = (2 * math.pi if closed else arc.angle) * nodes[:, None]
    around = np.cos(angle) * start + np.sin(angle) * np.cross(normal, start)
    return np.array(arc.center) + arc.radius * around, weights


def _of_primitive(primitive, count):
    """Points (n, 3) and weights (n,), of sum 1, of one primitive, `count` along each of its dimensions."""
    if isinstance(primitive, Point):
        return np.array([primitive.position]), np.ones(1)
    if isinstance(primitive, Arc | Circle):
        return _arc(primitive, count)
    if isinstance(primitive, Segment):
        points, shares, u = _simplex([primitive.start, primitive.end], count)
        if isinstance(primitive, TaperedSegment):
            shares = shares * (primitive.start_density + u * (primitive.end_density - primitive.start_density))
        return points, shares / shares.sum()
    if isinstance(primitive, Triangle):
        return _simplex([primitive.a, primitive.b, primitive.c], count)[:2]
    if isinstance(primitive, Face):
        return _simplex([primitive.center, primitive.a, primitive.b, primitive.c], count)[:2]
    if isinstance(primitive, Plane):
        primitive.measure  # noqa: B018 - raises what there is to say
    raise InputError(f"no mass points are known for {primitive!r}; a free body takes another skeleton")


def mass_points(skeleton, counts) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) in the body's frame and weights (n,), of sum 1, of a concrete skeleton of even density.

    counts: points along each primitive's dimensions, one number per primitive.
    """
    total = total_measure(skeleton)
    parts = [_of_primitive(p, count) for p, count in zip(skeleton, counts, strict=True)]
    shares = [p.measure / total * weights for p, (_, weights) in zip(skeleton, parts, strict=True)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(shares)


def enough(primitive, clearance: float, tolerance: float) -> int:
    """Points along a primitive that give its pull on what is `clearance` away to a relative error of `tolerance`.

    Gauss's rule of n points errs by rho^(-2n), rho = the half axes' sum of the largest ellipse around the interval that
    meets nothing singular (Trefethen 2008); even points on a circle err by exp(-n eta). No more than MOST.
    """
    needed = math.log(1.0 / tolerance)
    if isinstance(primitive, Point):
        return 1
    if isinstance(primitive, Circle):
        count = needed / math.asinh(clearance / primitive.radius)
    else:
        half = (
            math.asinh(clearance / primitive.radius) / (0.5 * primitive.angle)
            if isinstance(primitive, Arc)
            else (clearance / (0.5 * _size(primitive)))
        )
        count = needed / (2.0 * math.asinh(half))
    return max(3, min(MOST[primitive.dimension], math.ceil(count)))


def _size(primitive):
    """Length of the longest edge."""
    corners = [getattr(primitive, name) for name in ("start", "end", "a", "b", "c") if hasattr(primitive, name)]
    return max(math.dist(p, q) for p in corners for q in corners)
