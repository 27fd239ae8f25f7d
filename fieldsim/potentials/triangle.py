"""Triangles: closed forms by edges when near or midway, a cubature of the definition when far.

With the foot of the perpendicular from the query point as origin and H' = r h(r),

    F = sum over edges of the integral of (H(sqrt(d^2 + t^2 + z^2)) - H(|z|)) d / (d^2 + t^2) dt,

d the signed distance to the edge's line (positive inside) and t the position along it. The in-plane gradient is exactly
-sum (outward normal of the edge) * (field of the edge as a segment under the same kernel), which gives all of the Hessian
but zz. What a kernel adds are, per edge, the segment's field with its two slopes and up to four sums, and, once, the
value and the first two derivatives in z made of those sums: see `triangle_edges`.

Terms of size R / size cancel when R, the distance, grows; beyond FAR sizes (or for a kernel wider than that) 36 points of a
conical Gauss rule are exact to rounding.
"""

import dataclasses
import math

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.primitive import Primitive

FAR = 8.0
THIRD = 1 / 3


@dataclasses.dataclass(frozen=True)
class Triangle(Primitive):
    """A flat triangle. Its normal is right-handed about a, b, c."""

    a: tuple[float, float, float]
    b: tuple[float, float, float]
    c: tuple[float, float, float]

    dimension = 2

    def _checked(self):
        corners = {name: validate.vector("Triangle", name, getattr(self, name)) for name in "abc"}
        a, b, c = (np.array(corner) for corner in corners.values())
        edges = np.array([b - a, c - b, a - c])
        size = np.linalg.norm(edges, axis=1).max()
        # What rounding of coordinates can fake is not an area.
        rounding = 4 * np.finfo(float).eps * max(size, np.abs([a, b, c]).max())
        if not np.linalg.norm(np.cross(edges[0], edges[1])) > rounding * size:
            raise InputError(
                f"Triangle: a, b and c are {a.tolist()}, {b.tolist()} and {c.tolist()}, on one line, without area; "
                "move one of them, or use Segment"
            )
        return corners

    @property
    def measure(self) -> float:
        """The area."""
        a, b, c = np.array([self.a, self.b, self.c])
        return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a)))

    def pack(self, row):
        """Write size (the longest edge), area, corners, the direction from a to b and the normal into an element row."""
        a, b, c = np.array([self.a, self.b, self.c])
        row[2] = max(np.linalg.norm(b - a), np.linalg.norm(c - b), np.linalg.norm(a - c))
        row[3] = self.measure
        row[5:14] = *self.a, *self.b, *self.c
        row[14:17] = (b - a) / np.linalg.norm(b - a)
        # The normal from the corner whose edges are the most nearly perpendicular.
        normal = max(
            (
                np.cross(v - u, w - u) / (np.linalg.norm(v - u) * np.linalg.norm(w - u))
                for u, v, w in ((a, b, c), (b, c, a), (c, a, b))
            ),
            key=np.linalg.norm,
        )
        row[17:20] = normal / np.linalg.norm(normal)


@portable
def _abscissa(k: int):
    """Gauss-Legendre node and weight k of 6 on 0..1."""
    if k == 0:
        return real(0.03376524289842399), real(0.08566224618958518)
    if k == 1:
        return real(0.16939530676686773), real(0.1803807865240693)
    if k == 2:
        return real(0.38069040695840156), real(0.23395696728634552)
    if k == 3:
        return real(0.6193095930415985), real(0.23395696728634552)
    if k == 4:
        return real(0.8306046932331322), real(0.1803807865240693)
    return real(0.966234757101576), real(0.08566224618958518)


@portable
def _radius(k: int):
    """Gauss-Jacobi node and weight k of 6 for the weight 2 s on 0..1."""
    if k == 0:
        return real(0.07305432868025888), real(0.017476603627219065)
    if k == 1:
        return real(0.2307661379699455), real(0.08791033110101795)
    if k == 2:
        return real(0.44132848122844986), real(0.19732230178131052)
    if k == 3:
        return real(0.6630153097188457), real(0.2815851075763979)
    if k == 4:
        return real(0.8519214003315158), real(0.27108499446303724)
    return real(0.9706835728402151), real(0.14462066145101737)


@portable
def far_away(ax: real, ay: real, bx: real, by: real, cx: real, cy: real, z: real, area: real, k: real, fold: real):
    """Jet in the triangle's frame by the conical rule of 36 points, degree 11 (Stroud 1971)."""
    f = real(0.0)
    fx = real(0.0)
    fy = real(0.0)
    level = real(0.0)
    bend = real(0.0)
    fxx = real(0.0)
    fyy = real(0.0)
    fxy = real(0.0)
    fxz = real(0.0)
    fyz = real(0.0)
    ring = int(0)  # noqa: UP018, RUF046 - a variable to Warp, where a bare 0 would be a constant
    place = int(0)  # noqa: UP018, RUF046
    for _ in range(36):  # one loop, which Warp does not unroll as it would two of 6
        s, weight = _radius(ring)
        t, share = _abscissa(place)
        place += 1
        if place == 6:
            place = 0
            ring += 1
        weight *= share * area
        dx = -(ax + s * ((bx - ax) + t * (cx - bx)))
        dy = -(ay + s * ((by - ay) + t * (cy - by)))
        h, slope, curve = point(dx * dx + dy * dy + z * z, k, fold)  # noqa: F821 - bound by the kernel
        f += weight * h
        slope *= real(2.0) * weight
        curve *= real(4.0) * weight
        fx += slope * dx
        fy += slope * dy
        level += slope
        bend += curve
        fxx += curve * dx * dx
        fyy += curve * dy * dy
        fxy += curve * dx * dy
        fxz += curve * dx
        fyz += curve * dy
    return f, fx, fy, level * z, fxx + level, fyy + level, bend * z * z + level, fxy, fxz * z, fyz * z


@portable
def _line(px: real, py: real, qx: real, qy: real):
    """The edge p..q from the origin: distance (positive on the left), place and side of the nearer end, unit direction, length."""
    ux = qx - px
    uy = qy - py
    length = math.sqrt(ux * ux + uy * uy)
    ux /= length
    uy /= length
    lo = px * ux + py * uy
    hi = qx * ux + qy * uy
    if abs(lo) <= abs(hi):
        return px * uy - py * ux, lo, real(1.0), ux, uy, length
    return qx * uy - qy * ux, -hi, -real(1.0), ux, uy, length


@portable
def near_by(ax: real, ay: real, bx: real, by: real, cx: real, cy: real, z: real, area: real, k: real, fold: real):
    """Jet in the triangle's frame from closed forms; the corners as seen from the foot of the perpendicular."""
    d_ab, lo, side, ux, uy, length = _line(ax, ay, bx, by)
    d_bc, lo, side, ux, uy, length = _line(bx, by, cx, cy)
    d_ca, lo, side, ux, uy, length = _line(cx, cy, ax, ay)
    # How far outside the foot lies at least; negative inside.
    outside = -min(d_ab, min(d_bc, d_ca))
    fx = real(0.0)
    fy = real(0.0)
    fxx = real(0.0)
    fyy = real(0.0)
    fxy = real(0.0)
    fxz = real(0.0)
    fyz = real(0.0)
    sum_1 = real(0.0)
    sum_2 = real(0.0)
    sum_3 = real(0.0)
    sum_4 = real(0.0)
    px = ax
    py = ay
    qx = bx
    qy = by
    for j in range(3):
        if j == 1:
            px = bx
            py = by
            qx = cx
            qy = cy
        if j == 2:
            px = cx
            py = cy
            qx = ax
            qy = ay
        d, lo, side, ux, uy, length = _line(px, py, qx, qy)
        s, along, across, q_1, q_2, q_3, q_4 = edge(d, lo, length, z, k, fold, outside)  # noqa: F821 - bound by the kernel
        # Outward normal (uy, -ux); moving along u lowers lo, moving along the normal lowers d.
        along *= -side
        up = real(2.0) * z * across
        across *= -real(2.0) * d
        fx -= uy * s
        fy += ux * s
        fxx -= uy * (ux * along + uy * across)
        fyy += ux * (uy * along - ux * across)
        fxy += real(0.5) * (ux - uy) * (ux + uy) * along + ux * uy * across
        fxz -= uy * up
        fyz += ux * up
        sum_1 += q_1
        sum_2 += q_2
        sum_3 += q_3
        sum_4 += q_4
    f, fz, fzz = total(sum_1, sum_2, sum_3, sum_4, z, k, fold, outside, fxx + fyy)  # noqa: F821 - bound by the kernel
    return f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz


@portable
def triangle_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a triangle; `is_far(away, size, k)` tells from the squared distance of its middle whether to take `distant`."""
    e1x = rows[i, 14]
    e1y = rows[i, 15]
    e1z = rows[i, 16]
    nx = rows[i, 17]
    ny = rows[i, 18]
    nz = rows[i, 19]
    e2x = ny * e1z - nz * e1y
    e2y = nz * e1x - nx * e1z
    e2z = nx * e1y - ny * e1x
    # Corners as seen from the point; every one from itself, so that its vicinity keeps its digits.
    dx = rows[i, 5] - x
    dy = rows[i, 6] - y
    dz = rows[i, 7] - z
    ax = dx * e1x + dy * e1y + dz * e1z
    ay = dx * e2x + dy * e2y + dz * e2z
    height = -(dx * nx + dy * ny + dz * nz)
    nearest = dx * dx + dy * dy + dz * dz
    dx = rows[i, 8] - x
    dy = rows[i, 9] - y
    dz = rows[i, 10] - z
    bx = dx * e1x + dy * e1y + dz * e1z
    by = dx * e2x + dy * e2y + dz * e2z
    if dx * dx + dy * dy + dz * dz < nearest:
        height = -(dx * nx + dy * ny + dz * nz)
        nearest = dx * dx + dy * dy + dz * dz
    dx = rows[i, 11] - x
    dy = rows[i, 12] - y
    dz = rows[i, 13] - z
    cx = dx * e1x + dy * e1y + dz * e1z
    cy = dx * e2x + dy * e2y + dz * e2z
    if dx * dx + dy * dy + dz * dz < nearest:
        height = -(dx * nx + dy * ny + dz * nz)
    size = rows[i, 2]
    k = rows[i, 1]
    middle_x = real(THIRD) * (ax + bx + cx)
    middle_y = real(THIRD) * (ay + by + cy)
    away = middle_x * middle_x + middle_y * middle_y + height * height
    if is_far(away, size, k):  # noqa: F821 - bound by the kernel
        f, f1, f2, f3, f11, f22, f33, f12, f13, f23 = distant(  # noqa: F821
            ax, ay, bx, by, cx, cy, height, rows[i, 3], k, rows[i, 4]
        )
    else:
        f, f1, f2, f3, f11, f22, f33, f12, f13, f23 = close(  # noqa: F821
            ax, ay, bx, by, cx, cy, height, rows[i, 3], k, rows[i, 4]
        )
    w = rows[i, 0]
    # Hessian times each axis, then those times each axis again.
    g1x = w * (f11 * e1x + f12 * e2x + f13 * nx)
    g1y = w * (f11 * e1y + f12 * e2y + f13 * ny)
    g1z = w * (f11 * e1z + f12 * e2z + f13 * nz)
    g2x = w * (f12 * e1x + f22 * e2x + f23 * nx)
    g2y = w * (f12 * e1y + f22 * e2y + f23 * ny)
    g2z = w * (f12 * e1z + f22 * e2z + f23 * nz)
    g3x = w * (f13 * e1x + f23 * e2x + f33 * nx)
    g3y = w * (f13 * e1y + f23 * e2y + f33 * ny)
    g3z = w * (f13 * e1z + f23 * e2z + f33 * nz)
    return (
        w * f,
        w * (f1 * e1x + f2 * e2x + f3 * nx),
        w * (f1 * e1y + f2 * e2y + f3 * ny),
        w * (f1 * e1z + f2 * e2z + f3 * nz),
        e1x * g1x + e2x * g2x + nx * g3x,
        e1y * g1y + e2y * g2y + ny * g3y,
        e1z * g1z + e2z * g2z + nz * g3z,
        e1x * g1y + e2x * g2y + nx * g3y,
        e1x * g1z + e2x * g2z + nx * g3z,
        e1y * g1z + e2y * g2z + ny * g3z,
    )
