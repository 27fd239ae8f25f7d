"""Triangles: closed forms by edges when near or midway, a cubature of the definition when far.

With the foot of the perpendicular from the query point as origin and H' = r h(r),

    F = sum over edges of the integral of (H(sqrt(d^2 + t^2 + z^2)) - H(|z|)) d / (d^2 + t^2) dt,

d the signed distance to the edge's line (positive inside) and t the position along it. The in-plane gradient is
exactly -sum (outward normal of the edge) * (field of the edge as a segment under the same kernel), which gives all of
the Hessian but zz. What a kernel adds are, per edge, the segment's field with its two slopes and up to four sums, and,
once, the value and the first two derivatives in z made of those sums: see `edges`.

Terms of size R / size cancel when R, the distance, grows; beyond FAR sizes (or for a kernel wider than that) 36 points
of a conical Gauss rule are exact to rounding, and farther away fewer.
"""

import math

from fieldsim.numerics.angles import arctangent, turned
from fieldsim.numerics.compensated import split_at, two_difference
from fieldsim.numerics.constants import TAU, THIRD
from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials.row import (
    AREA,
    CORNER_A_X,
    CORNER_B_X,
    CORNER_C_X,
    FOLD,
    KERNEL_WIDTH,
    SIZE,
    STRENGTH,
    edge_of,
    normal_of,
)

FAR = 6.0

# Closer than this many sizes to the plane or a line, and farther than the root of AT_CORNER from a corner, with care.
CLOSE = 1e-3
AT_CORNER = 1e-12

# Adding and taking away 1.5 2^n in float64 rounds to a multiple of 2^(n - 52).
GRID_8 = 1.5 * 2.0**8
GRID_28 = 1.5 * 2.0**28
GRID_32 = 1.5 * 2.0**32


@portable
def _edge_line(px: real, py: real, qx: real, qy: real):
    """The edge p..q from the origin: place (outward) and side of the nearer end, direction, length."""
    ux = qx - px
    uy = qy - py
    length = math.sqrt(ux * ux + uy * uy)
    per = real(1.0) / length
    ux *= per
    uy *= per
    lo = px * ux + py * uy
    hi = qx * ux + qy * uy
    side = real(1.0)
    # (Choices without branches, which a processor would mispredict at every other point.)
    if abs(lo) > abs(hi):
        lo = -hi
        side = -side
    return lo, side, ux, uy, length


@portable
def _distance(px: real, py: real, qx: real, qy: real):
    """Signed distance of the origin from the line p..q, positive on its left; by the nearer end."""
    ux = qx - px
    uy = qy - py
    per = real(1.0) / math.sqrt(ux * ux + uy * uy)
    x = px
    y = py
    if px * px + py * py > qx * qx + qy * qy:
        x = qx
        y = qy
    return (x * uy - y * ux) * per


@portable
def _beside(px: real, py: real, qx: real, qy: real, d: real, otherwise: real):
    """The origin's distance from the edge p..q where it lies beside that, outside; else `otherwise`."""
    ux = qx - px
    uy = qy - py
    if max(d, max(px * ux + py * uy, -(qx * ux + qy * uy))) < real(0.0):
        otherwise = -d
    return otherwise


@portable
def _outside(ax: real, ay: real, bx: real, by: real, cx: real, cy: real, d_ab: real, d_bc: real, d_ca: real):
    """How far outside the triangle the foot lies; not positive inside."""
    outside = math.sqrt(ax * ax + ay * ay)
    outside = _beside(ax, ay, bx, by, d_ab, outside)
    outside = _beside(bx, by, cx, cy, d_bc, outside)
    outside = _beside(cx, cy, ax, ay, d_ca, outside)
    inside = min(d_ab, min(d_bc, d_ca))
    if inside >= real(0.0):
        outside = -inside
    return outside


@portable
def _edge(j: int, ax: real, ay: real, bx: real, by: real, cx: real, cy: real, d_ab: real, d_bc: real, d_ca: real):
    """Start and end of edge j, and the signed distance from it."""
    if j == 1:
        return bx, by, cx, cy, d_bc
    if j == 2:
        return cx, cy, ax, ay, d_ca
    return ax, ay, bx, by, d_ab


# What a kernel adds for an edge, and what it makes of the sums; see `edges`.
edge = hole("d, lo, length, z, k, fold, outside")
total = hole("q_1, q_2, q_3, q_4, angle_1, angle_2, angle_3, z, k, fold, outside, trace")


@portable
def near_by(
    ax: real,
    ay: real,
    bx: real,
    by: real,
    cx: real,
    cy: real,
    d_ab: real,
    d_bc: real,
    d_ca: real,
    z: real,
    k: real,
    fold: real,
):
    """Jet in the triangle's frame from closed forms; corners (a the nearest) and distances as seen from the foot."""
    outside = _outside(ax, ay, bx, by, cx, cy, d_ab, d_bc, d_ca)
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
    x_1 = real(1.0)
    y_1 = real(0.0)
    turns_1 = real(0.0)
    x_2 = real(1.0)
    y_2 = real(0.0)
    turns_2 = real(0.0)
    x_3 = real(1.0)
    y_3 = real(0.0)
    turns_3 = real(0.0)
    for j in range(3):
        px, py, qx, qy, d = _edge(j, ax, ay, bx, by, cx, cy, d_ab, d_bc, d_ca)
        lo, side, ux, uy, length = _edge_line(px, py, qx, qy)
        s, along, across, q_1, q_2, q_3, q_4, cos_1, sin_1, cos_2, sin_2, cos_3, sin_3 = edge(
            d, lo, length, z, k, fold, outside
        )
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
        x_1, y_1, turns_1 = turned(x_1, y_1, turns_1, cos_1, sin_1)
        x_2, y_2, turns_2 = turned(x_2, y_2, turns_2, cos_2, sin_2)
        x_3, y_3, turns_3 = turned(x_3, y_3, turns_3, cos_3, sin_3)
    angle_1 = arctangent(y_1, x_1) + real(TAU) * turns_1
    angle_2 = arctangent(y_2, x_2) + real(TAU) * turns_2
    angle_3 = arctangent(y_3, x_3) + real(TAU) * turns_3
    f, fz, fzz = total(sum_1, sum_2, sum_3, sum_4, angle_1, angle_2, angle_3, z, k, fold, outside, fxx + fyy)
    return f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz


@portable
def _apart(x: real, y: real, z: real, rows: Table, i: int, column: int):
    """Squared distance of the corner at `column`."""
    dx = rows[i, column] - x
    dy = rows[i, column + 1] - y
    dz = rows[i, column + 2] - z
    return dx * dx + dy * dy + dz * dz


@portable
def _remainder(p: real, base: real, left: real, right: real, s: real, t: real, size: real):
    """(p - base) - s (left - base) - t (right - base) in one coordinate, with an error of 2^-73 sizes instead of 2^-53.

    Differences carry their rounding errors along; s, t, the edges and the offset are split so that the leading products
    and their sum are exact, whether or not a compiler fuses them. (In single precision nothing is gained or lost.)
    """
    d, d_error = two_difference(p, base)
    e, e_error = two_difference(left, base)
    g, g_error = two_difference(right, base)
    d_high, d_low = split_at(d, real(GRID_8) * size)
    e_high, e_low = split_at(e, real(GRID_28) * size)
    g_high, g_low = split_at(g, real(GRID_28) * size)
    s_high, s_low = split_at(s, real(GRID_32))
    t_high, t_low = split_at(t, real(GRID_32))
    lead = (d_high - s_high * e_high) - t_high * g_high
    rest = d_low - s_high * e_low - s_low * e - t_high * g_low - t_low * g
    return lead + (rest + (d_error - s * e_error - t * g_error))


@portable
def _nearest_first(x: real, y: real, z: real, rows: Table, i: int):
    """Columns of the corners, the nearest first: in its vicinity offsets from it keep their digits."""
    a2 = _apart(x, y, z, rows, i, CORNER_A_X)
    b2 = _apart(x, y, z, rows, i, CORNER_B_X)
    c2 = _apart(x, y, z, rows, i, CORNER_C_X)
    base = CORNER_A_X
    left = CORNER_B_X
    right = CORNER_C_X
    if b2 < a2:
        base = CORNER_B_X
        left = CORNER_C_X
        right = CORNER_A_X
    if c2 < min(a2, b2):
        base = CORNER_C_X
        left = CORNER_A_X
        right = CORNER_B_X
    return base, left, right


@portable
def _second_axis(e1x: real, e1y: real, e1z: real, nx: real, ny: real, nz: real):
    """The frame's axis across the normal and the first edge."""
    return ny * e1z - nz * e1y, nz * e1x - nx * e1z, nx * e1y - ny * e1x


@portable
def _again_with_care(
    x: real,
    y: real,
    z: real,
    rows: Table,
    i: int,
    base: int,
    left: int,
    right: int,
    ax: real,
    ay: real,
    bx: real,
    by: real,
    cx: real,
    cy: real,
):
    """The height and the distances from ab, bc and ca once more, where rounding left little of them.

    ax to cy: the corners as seen from the foot, the nearest first.
    """
    e1x, e1y, e1z = edge_of(rows, i)
    nx, ny, nz = normal_of(rows, i)
    e2x, e2y, e2z = _second_axis(e1x, e1y, e1z, nx, ny, nz)
    size = rows[i, SIZE]
    twice = real(2.0) * rows[i, AREA]
    s = (ay * (cx - ax) - ax * (cy - ay)) / twice
    t = (ax * (by - ay) - ay * (bx - ax)) / twice
    dx = _remainder(x, rows[i, base], rows[i, left], rows[i, right], s, t, size)
    dy = _remainder(y, rows[i, base + 1], rows[i, left + 1], rows[i, right + 1], s, t, size)
    dz = _remainder(z, rows[i, base + 2], rows[i, left + 2], rows[i, right + 2], s, t, size)
    height = dx * nx + dy * ny + dz * nz
    d1 = dx * e1x + dy * e1y + dz * e1z
    d2 = dx * e2x + dy * e2y + dz * e2z
    more_s = (d1 * (cy - ay) - d2 * (cx - ax)) / twice
    more_t = (d2 * (bx - ax) - d1 * (by - ay)) / twice
    d_ab = (t + more_t) * twice / math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay))
    d_ca = (s + more_s) * twice / math.sqrt((cx - ax) * (cx - ax) + (cy - ay) * (cy - ay))
    rest = ((real(1.0) - max(s, t)) - min(s, t)) - (more_s + more_t)
    d_bc = rest * twice / math.sqrt((cx - bx) * (cx - bx) + (cy - by) * (cy - by))
    return height, d_ab, d_bc, d_ca


is_gone = hole("away, size, k")
points = hole("away, size, k")
distant = hole("side, ax, ay, bx, by, cx, cy, z, area, k, fold")
closed_form = hole("ax, ay, bx, by, cx, cy, d_ab, d_bc, d_ca, z, k, fold")


@portable
def triangle_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a triangle.

    From the squared distance of its middle, `is_gone(away, size, k)` is whether the kernel vanishes all over it, and
    `points` how many points a side `distant` takes; 0 where it does not do.
    """
    e1x, e1y, e1z = edge_of(rows, i)
    nx, ny, nz = normal_of(rows, i)
    e2x, e2y, e2z = _second_axis(e1x, e1y, e1z, nx, ny, nz)
    base, left, right = _nearest_first(x, y, z, rows, i)
    dx = rows[i, base] - x
    dy = rows[i, base + 1] - y
    dz = rows[i, base + 2] - z
    ax = dx * e1x + dy * e1y + dz * e1z
    ay = dx * e2x + dy * e2y + dz * e2z
    height = -(dx * nx + dy * ny + dz * nz)
    nearest = dx * dx + dy * dy + dz * dz
    dx = rows[i, left] - x
    dy = rows[i, left + 1] - y
    dz = rows[i, left + 2] - z
    bx = dx * e1x + dy * e1y + dz * e1z
    by = dx * e2x + dy * e2y + dz * e2z
    dx = rows[i, right] - x
    dy = rows[i, right + 1] - y
    dz = rows[i, right + 2] - z
    cx = dx * e1x + dy * e1y + dz * e1z
    cy = dx * e2x + dy * e2y + dz * e2z
    size = rows[i, SIZE]
    k = rows[i, KERNEL_WIDTH]
    fold = rows[i, FOLD]
    middle_x = real(THIRD) * (ax + bx + cx)
    middle_y = real(THIRD) * (ay + by + cy)
    away = middle_x * middle_x + middle_y * middle_y + height * height
    if is_gone(away, size, k):
        nil = real(0.0)
        return nil, nil, nil, nil, nil, nil, nil, nil, nil, nil
    side = points(away, size, k)
    if side > 0:
        f, f1, f2, f3, f11, f22, f33, f12, f13, f23 = distant(
            side, ax, ay, bx, by, cx, cy, height, rows[i, AREA], k, fold
        )
    else:
        d_ab = _distance(ax, ay, bx, by)
        d_bc = _distance(bx, by, cx, cy)
        d_ca = _distance(cx, cy, ax, ay)
        close = min(abs(height), min(abs(d_ab), min(abs(d_bc), abs(d_ca))))
        if close < real(CLOSE) * size and nearest > real(AT_CORNER) * size * size:
            # Close to the plane or a line what is left of the offsets is mostly rounding.
            height, d_ab, d_bc, d_ca = _again_with_care(x, y, z, rows, i, base, left, right, ax, ay, bx, by, cx, cy)
        f, f1, f2, f3, f11, f22, f33, f12, f13, f23 = closed_form(
            ax, ay, bx, by, cx, cy, d_ab, d_bc, d_ca, height, k, fold
        )
    w = rows[i, STRENGTH]
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
