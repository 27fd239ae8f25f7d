"""Straight segments, in their local invariants.

With q the coordinate along the segment, counted outward from the end nearer to the query point, the segment covers
q = lo..hi as seen from the point, hi = lo + length, and rho2 is the squared distance from its line:

    F = integral from lo to hi of h(sqrt(q^2 + rho2)) dq,        dF/dlo = h(hi) - h(lo) exactly.

Because the near end is the origin, |lo| <= hi, and every form below is a sum of positive terms beyond the end (lo > 0),
where differences of antiderivatives would cancel.
"""

import math

from fieldsim.numerics.compensated import half_digits, split_at, two_difference
from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials.formulas.axial import axial_hessian
from fieldsim.potentials.row import END_X, FOLD, KERNEL_WIDTH, LENGTH, START_X, STRENGTH, axis_of

# Closer to the line than 0.1 of the distance along it (squared), the offset across is computed with care.
CLOSE = 1e-2


@portable
def _remainder(p: real, near: real, far: real, t_high: real, t_low: real, grid: real):
    """(p - near) - t (far - near) with an error of 2^-79 (float32: 2^-35) of the segment, in one coordinate.

    Differences carry their rounding errors along; t and the edge are split so that the leading product is exact. (Only
    sums and exact products are relied on: a compiler may fuse them.)
    """
    d, d_error = two_difference(p, near)
    e, e_error = two_difference(far, near)
    e_high, e_low = split_at(e, grid)
    rest = d_error - (t_high + t_low) * e_error - t_low * e_low
    return ((d - t_high * e_high) - t_high * e_low) - t_low * e_high + rest


@portable
def beside_line(
    x: real, y: real, z: real, rows: Table, i: int, start: int, end: int, ux: real, uy: real, uz: real, length: real
):
    """(out, lo, wx, wy, wz, rho2): the coordinates of `segment_jet` for the line between two positions of row i.

    start, end: their first columns; (ux, uy, uz): the direction between them. out: 1 where the end is the nearer one,
    -1 where the start is; lo: along, outward from it; w: offset from the line, of square rho2.
    """
    # Offsets from both ends, and those from the nearer one, so that points close to either keep their digits.
    out = -real(1.0)
    wx = x - rows[i, start]
    wy = y - rows[i, start + 1]
    wz = z - rows[i, start + 2]
    along = wx * ux + wy * uy + wz * uz
    lo = -along
    fx = x - rows[i, end]
    fy = y - rows[i, end + 1]
    fz = z - rows[i, end + 2]
    beyond = fx * ux + fy * uy + fz * uz
    if along + beyond > real(0.0):
        out = real(1.0)
        wx = fx
        wy = fy
        wz = fz
        along = beyond
        lo = beyond
    wx -= along * ux
    wy -= along * uy
    wz -= along * uz
    rho2 = wx * wx + wy * wy + wz * wz
    if rho2 < real(CLOSE) * (lo * lo):
        # Close to the line what is left of the offset is mostly rounding; once more, with care. The nearer end:
        ax = rows[i, start]
        ay = rows[i, start + 1]
        az = rows[i, start + 2]
        bx = rows[i, end]
        by = rows[i, end + 1]
        bz = rows[i, end + 2]
        if out > real(0.0):
            ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
        t = -lo / length
        t_high, t_low = split_at(t, half_digits())
        grid = real(2.0) * half_digits() * length
        wx = _remainder(x, ax, bx, t_high, t_low, grid)
        wy = _remainder(y, ay, by, t_high, t_low, grid)
        wz = _remainder(z, az, bz, t_high, t_low, grid)
        along = wx * ux + wy * uy + wz * uz
        wx -= along * ux
        wy -= along * uy
        wz -= along * uz
        rho2 = wx * wx + wy * wy + wz * wz
    return out, lo, wx, wy, wz, rho2


kernel = hole("lo, rho2, length, width, fold")


@portable
def segment_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a segment, in local coordinates: lo along, rho across.

    `kernel(lo, rho2, length, width, fold)` returns (F, F_lo, F_rho / rho, F_lolo, F_lorho, F_rhorho - F_rho / rho).
    """
    length = rows[i, LENGTH]
    ux, uy, uz = axis_of(rows, i)
    out, lo, wx, wy, wz, rho2 = beside_line(x, y, z, rows, i, START_X, END_X, ux, uy, uz, length)
    f, slope, across, slope_slope, mixed, bend = kernel(lo, rho2, length, rows[i, KERNEL_WIDTH], rows[i, FOLD])
    f *= rows[i, STRENGTH]
    slope *= out * rows[i, STRENGTH]
    across *= rows[i, STRENGTH]
    mixed *= out * rows[i, STRENGTH]
    bend *= rows[i, STRENGTH]
    if not abs(slope + across) < real(math.inf):
        slope = real(0.0)
        across = real(0.0)
    gx = slope * ux + across * wx
    gy = slope * uy + across * wy
    gz = slope * uz + across * wz
    lift = slope_slope * rows[i, STRENGTH] - across
    if not abs(lift + mixed + bend) < real(math.inf):
        across = real(0.0)
        lift = real(0.0)
        mixed = real(0.0)
        bend = real(0.0)
    rho = math.sqrt(rho2)
    xx, yy, zz, xy, xz, yz = axial_hessian(across, lift, mixed, bend, ux, uy, uz, wx, wy, wz, rho)
    return f, gx, gy, gz, xx, yy, zz, xy, xz, yz
