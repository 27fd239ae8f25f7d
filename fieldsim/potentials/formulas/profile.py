"""The jets of profiled segments and arcs: the product of a primitive's field and its profile's factor."""

import math

from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials.row import (
    ANGLE,
    FIRST_COEFFICIENT,
    LENGTH,
    PROFILE_DEGREE,
    PROFILE_SHAPE,
    axis_of,
    first_of,
    from_center,
    from_start,
    normal_of,
)


@portable
def _factor(u: real, rows: Table, i: int):
    """p(u) and its first two derivatives; beyond 0..1 and on its ends the derivatives are 0."""
    inside = u > real(0.0) and u < real(1.0)
    u = min(max(u, real(0.0)), real(1.0))
    s = u
    slope = real(1.0)
    bend = real(0.0)
    if rows[i, PROFILE_SHAPE] == real(1.0):
        s = real(1.0) - abs(real(2.0) * u - real(1.0))
        slope = real(2.0)
        if u > real(0.5):
            slope = -real(2.0)
        if u == real(0.5):
            slope = real(0.0)
    if rows[i, PROFILE_SHAPE] == real(2.0):
        sin = math.sin(real(math.pi) * u)
        cos = math.cos(real(math.pi) * u)
        s = sin * sin
        slope = real(2.0) * real(math.pi) * sin * cos
        bend = real(2.0) * real(math.pi) * real(math.pi) * (cos * cos - sin * sin)
    # Horner's scheme for the polynomial, its derivative and half its second derivative.
    degree = int(rows[i, PROFILE_DEGREE])
    p = rows[i, FIRST_COEFFICIENT + degree]
    p1 = real(0.0)
    p2 = real(0.0)
    for k in range(degree):
        p2 = p2 * s + p1
        p1 = p1 * s + p
        p = p * s + rows[i, FIRST_COEFFICIENT - 1 + degree - k]
    if not inside:
        return p, real(0.0), real(0.0)
    return p, p1 * slope, real(2.0) * p2 * slope * slope + p1 * bend


@portable
def along_segment(x: real, y: real, z: real, rows: Table, i: int):
    """u, its gradient, and its Hessian's six entries."""
    inverse = real(1.0) / rows[i, LENGTH]
    ux, uy, uz = axis_of(rows, i)
    gx = inverse * ux
    gy = inverse * uy
    gz = inverse * uz
    zero = real(0.0)
    dx, dy, dz = from_start(x, y, z, rows, i)
    u = dx * gx + dy * gy + dz * gz
    return u, gx, gy, gz, zero, zero, zero, zero, zero, zero


@portable
def along_arc(x: real, y: real, z: real, rows: Table, i: int):
    """u, its gradient, and its Hessian's six entries; 1/2 and 0 on the axis."""
    sx, sy, sz = first_of(rows, i)
    nx, ny, nz = normal_of(rows, i)
    tx = ny * sz - nz * sy
    ty = nz * sx - nx * sz
    tz = nx * sy - ny * sx
    dx, dy, dz = from_center(x, y, z, rows, i)
    p = dx * sx + dy * sy + dz * sz
    q = dx * tx + dy * ty + dz * tz
    rho2 = p * p + q * q
    zero = real(0.0)
    if rho2 == zero:
        return real(0.5), zero, zero, zero, zero, zero, zero, zero, zero, zero
    rho = math.sqrt(rho2)
    cos = p / rho
    sin = q / rho
    angle = rows[i, ANGLE]
    # The azimuth from the start, cut on the far side of the arc's middle.
    turn = math.atan2(q, p)
    if turn < real(0.5) * angle - real(math.pi):
        turn += real(2.0) * real(math.pi)
    ax = cos * sx + sin * tx
    ay = cos * sy + sin * ty
    az = cos * sz + sin * tz
    inverse = real(1.0) / (rho * angle)
    bx = inverse * (cos * tx - sin * sx)
    by = inverse * (cos * ty - sin * sy)
    bz = inverse * (cos * tz - sin * sz)
    i_rho = real(1.0) / rho
    return (
        turn / angle,
        bx,
        by,
        bz,
        -real(2.0) * i_rho * ax * bx,
        -real(2.0) * i_rho * ay * by,
        -real(2.0) * i_rho * az * bz,
        -i_rho * (ax * by + ay * bx),
        -i_rho * (ax * bz + az * bx),
        -i_rho * (ay * bz + az * by),
    )


# u and its derivatives; the jet without the profile.
along = hole("x, y, z, rows, i")
jet = hole("x, y, z, rows, i")


@portable
def profiled_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a profiled primitive from its own `jet` and its parameter `along`.

    On a bare wire: inf of the factor's sign, 0 where the factor is 0; infinite parts of derivatives are left out.
    """
    u, ux, uy, uz, uxx, uyy, uzz, uxy, uxz, uyz = along(x, y, z, rows, i)
    f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz = jet(x, y, z, rows, i)
    p, p1, p2 = _factor(u, rows, i)
    value = real(0.0)
    if p != real(0.0):
        value = p * f
    if not abs(f) < real(math.inf):
        f = real(0.0)
    s1 = p1 * f
    s2 = p2 * f
    return (
        value,
        p * fx + s1 * ux,
        p * fy + s1 * uy,
        p * fz + s1 * uz,
        p * fxx + real(2.0) * p1 * ux * fx + s2 * ux * ux + s1 * uxx,
        p * fyy + real(2.0) * p1 * uy * fy + s2 * uy * uy + s1 * uyy,
        p * fzz + real(2.0) * p1 * uz * fz + s2 * uz * uz + s1 * uzz,
        p * fxy + p1 * (ux * fy + uy * fx) + s2 * ux * uy + s1 * uxy,
        p * fxz + p1 * (ux * fz + uz * fx) + s2 * ux * uz + s1 * uxz,
        p * fyz + p1 * (uy * fz + uz * fy) + s2 * uy * uz + s1 * uyz,
    )
