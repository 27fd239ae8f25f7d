"""Distances from a point to the primitives, as portable functions (x, y, z, rows, i) of a row (`potentials.row`)."""

import math

from fieldsim.portable import Table, portable, real
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.profile import ProfiledArc, ProfiledSegment
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.tapered import TaperedSegment
from fieldsim.potentials.primitives.triangle import Triangle


@portable
def _point(x: real, y: real, z: real, rows: Table, i: int):
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@portable
def _segment(x: real, y: real, z: real, rows: Table, i: int):
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    along = dx * rows[i, 14] + dy * rows[i, 15] + dz * rows[i, 16]
    along = min(max(along, real(0.0)), rows[i, 2])
    dx -= along * rows[i, 14]
    dy -= along * rows[i, 15]
    dz -= along * rows[i, 16]
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@portable
def arc_distance(x: real, y: real, z: real, rows: Table, i: int):
    """Distance to an arc."""
    sx = rows[i, 14]
    sy = rows[i, 15]
    sz = rows[i, 16]
    nx = rows[i, 17]
    ny = rows[i, 18]
    nz = rows[i, 19]
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    radius = rows[i, 2]
    half = real(0.5) * rows[i, 3]
    height = dx * nx + dy * ny + dz * nz
    p = dx * sx + dy * sy + dz * sz
    q = dx * (ny * sz - nz * sy) + dy * (nz * sx - nx * sz) + dz * (nx * sy - ny * sx)
    rho = math.sqrt(p * p + q * q)
    cosine = math.cos(half)
    sine = math.sin(half)
    # Turned so that the arc's middle lies at (1, 0), and to its upper half.
    u = p * cosine + q * sine
    v = abs(q * cosine - p * sine)
    if u >= rho * cosine:
        # Beside the arc, not beyond an end.
        return math.sqrt((rho - radius) * (rho - radius) + height * height)
    du = u - radius * cosine
    dv = v - radius * sine
    return math.sqrt(du * du + dv * dv + height * height)


@portable
def _plane(x: real, y: real, z: real, rows: Table, i: int):
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    return abs(dx * rows[i, 17] + dy * rows[i, 18] + dz * rows[i, 19])


@portable
def _beside_edge(x: real, y: real, z: real, rows: Table, i: int, p: int, q: int):
    """Squared distance to the edge between the corners in columns p.. and q.., and the point's side of it.

    The side is positive on the inner one, in the plane.
    """
    dx = x - rows[i, p]
    dy = y - rows[i, p + 1]
    dz = z - rows[i, p + 2]
    ex = rows[i, q] - rows[i, p]
    ey = rows[i, q + 1] - rows[i, p + 1]
    ez = rows[i, q + 2] - rows[i, p + 2]
    side = rows[i, 17] * (ey * dz - ez * dy) + rows[i, 18] * (ez * dx - ex * dz) + rows[i, 19] * (ex * dy - ey * dx)
    along = (dx * ex + dy * ey + dz * ez) / (ex * ex + ey * ey + ez * ez)
    along = min(max(along, real(0.0)), real(1.0))
    dx -= along * ex
    dy -= along * ey
    dz -= along * ez
    return dx * dx + dy * dy + dz * dz, side


@portable
def _triangle(x: real, y: real, z: real, rows: Table, i: int):
    ab, side_ab = _beside_edge(x, y, z, rows, i, 5, 8)
    bc, side_bc = _beside_edge(x, y, z, rows, i, 8, 11)
    ca, side_ca = _beside_edge(x, y, z, rows, i, 11, 5)
    if min(side_ab, min(side_bc, side_ca)) >= real(0.0):
        return _plane(x, y, z, rows, i)
    return math.sqrt(min(ab, min(bc, ca)))


DISTANCES = {
    Point: _point,
    Segment: _segment,
    Arc: arc_distance,
    Circle: arc_distance,
    Triangle: _triangle,
    Plane: _plane,
    ProfiledSegment: _segment,
    TaperedSegment: _segment,
    ProfiledArc: arc_distance,
}
