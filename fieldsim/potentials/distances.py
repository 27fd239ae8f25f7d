"""Distances from a point to the primitives, as portable functions (x, y, z, rows, i) of a packed row (see `cells`)."""

import math

from fieldsim.portable import Table, portable, real
from fieldsim.potentials.arc import Arc
from fieldsim.potentials.circle import Circle
from fieldsim.potentials.plane import Plane
from fieldsim.potentials.point import Point
from fieldsim.potentials.profile import ProfiledArc, ProfiledSegment
from fieldsim.potentials.segment import Segment
from fieldsim.potentials.triangle import Triangle


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
def _circle(x: real, y: real, z: real, rows: Table, i: int):
    """Distance to the whole circle of an arc: not more than that to the arc."""
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    height = dx * rows[i, 17] + dy * rows[i, 18] + dz * rows[i, 19]
    dx -= height * rows[i, 17]
    dy -= height * rows[i, 18]
    dz -= height * rows[i, 19]
    off = math.sqrt(dx * dx + dy * dy + dz * dz) - rows[i, 2]
    return math.sqrt(off * off + height * height)


@portable
def _arc(x: real, y: real, z: real, rows: Table, i: int):
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    height = dx * rows[i, 17] + dy * rows[i, 18] + dz * rows[i, 19]
    along = dx * rows[i, 14] + dy * rows[i, 15] + dz * rows[i, 16]
    # normal x start is the direction a quarter turn on.
    tx = rows[i, 18] * rows[i, 16] - rows[i, 19] * rows[i, 15]
    ty = rows[i, 19] * rows[i, 14] - rows[i, 17] * rows[i, 16]
    tz = rows[i, 17] * rows[i, 15] - rows[i, 18] * rows[i, 14]
    across = dx * tx + dy * ty + dz * tz
    # Turned so that the arc's middle is ahead and the nearer end to the left.
    half = real(0.5) * rows[i, 3]
    cosine = math.cos(half)
    sine = math.sin(half)
    ahead = along * cosine + across * sine
    left = abs(across * cosine - along * sine)
    off = math.sqrt(ahead * ahead + left * left) - rows[i, 2]
    if math.atan2(left, ahead) > half:
        end_ahead = ahead - rows[i, 2] * cosine
        end_left = left - rows[i, 2] * sine
        off = math.sqrt(end_ahead * end_ahead + end_left * end_left)
    return math.sqrt(off * off + height * height)


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
    Arc: _circle,
    Circle: _circle,
    Triangle: _triangle,
    Plane: _plane,
    ProfiledSegment: _segment,
    ProfiledArc: _circle,
}

# As above, exact for open arcs, too.
EXACT_DISTANCES = {**DISTANCES, Arc: _arc, ProfiledArc: _arc}
