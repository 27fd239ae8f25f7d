"""From a primitive's local derivatives to value, gradient and Hessian in space.

A jet is (F, Fx, Fy, Fz, Fxx, Fyy, Fzz, Fxy, Fxz, Fyz). Each primitive has one element here, to which the kernel's local
function is bound; derivatives across a line or from a centre come divided by distances, so that nothing is divided here
but offsets by their own norm. Closer to a bare source than the type can hold them, derivatives are 0, as on it.
"""

import math

from fieldsim.portable import Table, portable, real
from fieldsim.potentials.arc import _half_angle
from fieldsim.potentials.segment import CLOSE, SPLIT, _remainder


@portable
def point_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a point. `kernel(r2, width, fold)` returns (F, F' / r, F'' - F' / r)."""
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    r2 = dx * dx + dy * dy + dz * dz
    f, slope, bend = kernel(r2, rows[i, 1], rows[i, 4])  # noqa: F821 - bound by the cells
    f *= rows[i, 0]
    slope *= rows[i, 0]
    bend *= rows[i, 0]
    if not math.isfinite(slope):
        slope = real(0.0)
    gx = slope * dx
    gy = slope * dy
    gz = slope * dz
    if not math.isfinite(bend):
        slope = real(0.0)
        bend = real(0.0)
    r = math.sqrt(r2)
    if r > real(0.0):
        dx /= r
        dy /= r
        dz /= r
    return (
        f,
        gx,
        gy,
        gz,
        slope + bend * dx * dx,
        slope + bend * dy * dy,
        slope + bend * dz * dz,
        bend * dx * dy,
        bend * dx * dz,
        bend * dy * dz,
    )


@portable
def segment_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a segment, in the coordinates of `segment`: lo along, rho across.

    `kernel(lo, rho2, length, width, fold)` returns (F, F_lo, F_rho / rho, F_lolo, F_lorho, F_rhorho - F_rho / rho).
    """
    length = rows[i, 2]
    ux = rows[i, 14]
    uy = rows[i, 15]
    uz = rows[i, 16]
    # Offsets from the nearer end, so that points close to either end keep their digits.
    near = 5
    far = 8
    out = -real(1.0)
    if (x - rows[i, 5]) * ux + (y - rows[i, 6]) * uy + (z - rows[i, 7]) * uz > real(0.5) * length:
        near = 8
        far = 5
        out = real(1.0)
    wx = x - rows[i, near]
    wy = y - rows[i, near + 1]
    wz = z - rows[i, near + 2]
    lo = out * (wx * ux + wy * uy + wz * uz)
    wx -= lo * out * ux
    wy -= lo * out * uy
    wz -= lo * out * uz
    rho2 = wx * wx + wy * wy + wz * wz
    if rho2 < real(CLOSE) * lo * lo:
        # Close to the line what is left of the offset is mostly rounding; once more, with care.
        t = -lo / length
        t_high = (t + real(SPLIT)) - real(SPLIT)
        grid = real(2.0) * real(SPLIT) * length
        wx = _remainder(x, rows[i, near], rows[i, far], t_high, t - t_high, grid)
        wy = _remainder(y, rows[i, near + 1], rows[i, far + 1], t_high, t - t_high, grid)
        wz = _remainder(z, rows[i, near + 2], rows[i, far + 2], t_high, t - t_high, grid)
        along = wx * ux + wy * uy + wz * uz
        wx -= along * ux
        wy -= along * uy
        wz -= along * uz
        rho2 = wx * wx + wy * wy + wz * wz
    f, slope, across, slope_slope, mixed, bend = kernel(lo, rho2, length, rows[i, 1], rows[i, 4])  # noqa: F821
    f *= rows[i, 0]
    slope *= out * rows[i, 0]
    across *= rows[i, 0]
    mixed *= out * rows[i, 0]
    bend *= rows[i, 0]
    if not math.isfinite(slope + across):
        slope = real(0.0)
        across = real(0.0)
    gx = slope * ux + across * wx
    gy = slope * uy + across * wy
    gz = slope * uz + across * wz
    # The Hessian is `across` in all directions, what it has more along, and the rest with the offset from the line.
    lift = slope_slope * rows[i, 0] - across
    if not math.isfinite(lift + mixed + bend):
        across = real(0.0)
        lift = real(0.0)
        mixed = real(0.0)
        bend = real(0.0)
    rho = math.sqrt(rho2)
    if rho > real(0.0):
        wx /= rho
        wy /= rho
        wz /= rho
    return (
        f,
        gx,
        gy,
        gz,
        across + lift * ux * ux + real(2.0) * mixed * ux * wx + bend * wx * wx,
        across + lift * uy * uy + real(2.0) * mixed * uy * wy + bend * wy * wy,
        across + lift * uz * uz + real(2.0) * mixed * uz * wz + bend * wz * wz,
        lift * ux * uy + mixed * (ux * wy + uy * wx) + bend * wx * wy,
        lift * ux * uz + mixed * (ux * wz + uz * wx) + bend * wx * wz,
        lift * uy * uz + mixed * (uy * wz + uz * wy) + bend * wy * wz,
    )


@portable
def _depth(p: real, q: real, radius: real):
    """p^2 + q^2 - radius^2 with an error of 2^-79 of its terms instead of 2^-53, so that a wire's vicinity is resolved.

    Each number is split in two halves of its digits, whose products are exact (so that a compiler may fuse them); the
    leading ones cancel without rounding. In single precision nothing is split.
    """
    grid = real(2.0) * real(SPLIT) * radius
    if abs(p) + abs(q) > real(2.0) * radius:
        return p * p + q * q - radius * radius
    p_high = (p + grid) - grid
    q_high = (q + grid) - grid
    r_high = (radius + grid) - grid
    p_low = p - p_high
    q_low = q - q_high
    r_low = radius - r_high
    lead = (p_high * p_high - r_high * r_high) + q_high * q_high
    cross = p_high * p_low + q_high * q_low - r_high * r_low
    return lead + (real(2.0) * cross + (p_low * p_low + q_low * q_low - r_low * r_low))


@portable
def arc_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of an arc or circle, in the coordinates of `arc`.

    `kernel(rho, inner, z, radius, angle, c0, s0, width)` returns the jet in the orthonormal frame of the query's radial
    direction, the azimuthal one and the normal; inner = rho - radius, and (c0, s0) are the cosine and sine of v0, half
    the angle from the query's azimuth to the start, in (-pi, 0].
    """
    ux = rows[i, 14]
    uy = rows[i, 15]
    uz = rows[i, 16]
    nx = rows[i, 17]
    ny = rows[i, 18]
    nz = rows[i, 19]
    vx = ny * uz - nz * uy
    vy = nz * ux - nx * uz
    vz = nx * uy - ny * ux
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    p = dx * ux + dy * uy + dz * uz
    q = dx * vx + dy * vy + dz * vz
    rho = math.sqrt(p * p + q * q)
    c0, s0 = _half_angle(p, q, rho)
    cos = real(1.0)
    sin = real(0.0)
    if rho > real(0.0):
        cos = p / rho
        sin = q / rho
    radius = rows[i, 2]
    inner = _depth(p, q, radius) / (rho + radius)
    height = dx * nx + dy * ny + dz * nz
    f, fa, fb, fn, faa, fbb, fnn, fab, fan, fbn = kernel(  # noqa: F821 - bound by the cells
        rho, inner, height, radius, rows[i, 3], c0, s0, rows[i, 1]
    )
    if not math.isfinite(fa + fb + fn):
        fa = real(0.0)
        fb = real(0.0)
        fn = real(0.0)
    if not math.isfinite(faa + fbb + fnn + fab + fan + fbn):
        faa = real(0.0)
        fbb = real(0.0)
        fnn = real(0.0)
        fab = real(0.0)
        fan = real(0.0)
        fbn = real(0.0)
    strength = rows[i, 0]
    # The radial direction a and the azimuthal one b.
    ax = cos * ux + sin * vx
    ay = cos * uy + sin * vy
    az = cos * uz + sin * vz
    bx = cos * vx - sin * ux
    by = cos * vy - sin * uy
    bz = cos * vz - sin * uz
    # The Hessian applied to the axes, in the frame.
    xa = faa * ax + fab * bx + fan * nx
    xb = fab * ax + fbb * bx + fbn * nx
    xn = fan * ax + fbn * bx + fnn * nx
    ya = faa * ay + fab * by + fan * ny
    yb = fab * ay + fbb * by + fbn * ny
    yn = fan * ay + fbn * by + fnn * ny
    za = faa * az + fab * bz + fan * nz
    zb = fab * az + fbb * bz + fbn * nz
    zn = fan * az + fbn * bz + fnn * nz
    return (
        strength * f,
        strength * (fa * ax + fb * bx + fn * nx),
        strength * (fa * ay + fb * by + fn * ny),
        strength * (fa * az + fb * bz + fn * nz),
        strength * (xa * ax + xb * bx + xn * nx),
        strength * (ya * ay + yb * by + yn * ny),
        strength * (za * az + zb * bz + zn * nz),
        strength * (xa * ay + xb * by + xn * ny),
        strength * (xa * az + xb * bz + xn * nz),
        strength * (ya * az + yb * bz + yn * nz),
    )
