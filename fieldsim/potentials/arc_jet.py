"""From an arc's local derivatives to value, gradient and Hessian in space.

Closer to a bare source than the type can hold them, derivatives are 0, as on it.
"""

import math

from fieldsim.portable import Table, portable, real
from fieldsim.potentials.arc import _half_angle
from fieldsim.potentials.segment import SPLIT


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
