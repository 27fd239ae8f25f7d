"""Arcs in their local invariants, and from local derivatives to value, gradient and Hessian in space.

The query point lies at distance rho from the axis and height z above the plane. A source point at angle u from the
query's azimuth is seen over the half angle v = u / 2: with near2 = (rho - R)^2 + z^2 and far2 = (rho + R)^2 + z^2

    d^2 = near2 cos^2 v + far2 sin^2 v,        F = 2 R integral of h(d) dv from v0 to v1 = v0 + angle / 2.

The ends enter as cosines and sines (c0, s0), (c1, s1) of v0 and v1, in products that keep their digits for the shortest
arcs and next to the ends; turn = sin(angle / 2), versine = 1 - cos(angle / 2). A kernel's function takes these, in the
order of `ARC`, and returns the jet in the frame of `arc_jet`, made of integrals of products of the offset from a source
point to the query,

    (inner cos^2 v + outer sin^2 v, -2 R sin v cos v, z),        inner = rho - R, outer = rho + R.

Odd in v, integrals of sin v cos v are differences of end values, as dF/dphi = R (h(d0) - h(d1)) is; what they have in
common is d1^2 - d0^2 = 4 R rho turn sin(v0 + v1). Squares of inner and z, which are at most near2, multiply integrals
of cos^4 v, so that each product keeps its digits next to the wire.

Closer to a bare source than the type can hold them, derivatives are 0, as on it.
"""

import math

from fieldsim.numerics.angles import sine_cosine
from fieldsim.numerics.compensated import half_digits, split_at, two_difference
from fieldsim.numerics.constants import TAU
from fieldsim.numerics.precision import is_single
from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials.formulas.arc.ends import BESIDE, BESIDE_SINGLE, beside_end, beside_start
from fieldsim.potentials.row import (
    ANGLE,
    CENTER_X,
    FOLD,
    KERNEL_WIDTH,
    NORMAL_X,
    RADIUS,
    STRENGTH,
    first_of,
    from_center,
    normal_of,
)

# Arguments of a kernel on an arc, in this order (`hole` checks it); width and fold are the kernel's.
ARC = "rho, inner, z, radius, angle, c0, s0, c1, s1, turn, versine, width, fold"
# Closer to the ring than this part of its radius, the offset from it is computed with care.
CLOSE = 0.125


@portable
def close_to_the_ring(x: real, y: real, z: real, rows: Table, i: int):
    """rho^2 - radius^2 and the height above the plane, for points close to the ring.

    Their error is 2^-76 (float32: 2^-34) of the ring instead of 2^-52, so that the wire's vicinity is resolved whatever
    the ring's orientation: the offset from the centre carries its rounding error along, and all factors are split in
    two halves of their digits, whose leading products are exact (a compiler may fuse them) and cancel exactly.
    """
    unit = real(4.0) * half_digits()
    radius = rows[i, RADIUS]
    grid = unit * radius
    high, low = split_at(radius, grid)
    # Sums over the coordinates, by size: of the offset's squares less the radius's, and of the offset times the normal.
    lead = -high * high
    cross = -high * low
    rest = -low * low
    height = real(0.0)
    height_rest = real(0.0)
    for k in range(3):
        p = x
        if k == 1:
            p = y
        if k == 2:
            p = z
        d, error = two_difference(p, rows[i, CENTER_X + k])
        high, low = split_at(d, grid)
        low += error
        lead += high * high
        cross += high * low
        rest += low * low
        n_high, n_low = split_at(rows[i, NORMAL_X + k], unit)
        height += high * n_high
        height_rest += high * n_low + low * (n_high + n_low)
    height += height_rest
    return (lead + (real(2.0) * cross + rest)) - height * height, height


@portable
def ring_offset(x: real, y: real, z: real, rows: Table, i: int, rho: real, height: real):
    """Offset from the ring, (rho - radius, height): close to it with more digits than coordinates have."""
    radius = rows[i, RADIUS]
    inner = rho - radius
    if abs(inner) + abs(height) < real(CLOSE) * radius:
        depth, height = close_to_the_ring(x, y, z, rows, i)
        inner = depth / (rho + radius)
    return inner, height


@portable
def plain_offset(x: real, y: real, z: real, rows: Table, i: int, rho: real, height: real):
    """As `ring_offset`, for fields that are smooth on the wire."""
    return rho - rows[i, RADIUS], height


@portable
def half_angle(cos: real, sin: real):
    """Cosine and sine of v = -phi / 2 in (-pi, 0], of the cosine and sine of phi in [0, 2 pi)."""
    square = real(0.5) + real(0.5) * abs(cos)
    more = math.sqrt(square)
    # The root and the division need not wait for each other.
    less = real(0.5) * abs(sin) / square * more
    c = more
    s = less
    if cos < real(0.0):
        c = less
        s = more
    if sin < real(0.0):
        c = -c
    return c, -s


@portable
def no_ends(x: real, y: real, z: real, rows: Table, i: int, rho: real, near: real, c0: real, s0: real):
    """As `plain_ends`, for kernels that do without."""
    zero = real(0.0)
    return s0, zero, zero, zero, zero


@portable
def plain_ends(x: real, y: real, z: real, rows: Table, i: int, rho: real, near: real, c0: real, s0: real):
    """s0, c1, s1, turn and versine, as in `arc_jet`; near: the query's distance from the ring, or more."""
    sin, cos = sine_cosine(real(0.25) * rows[i, ANGLE])
    turn = real(2.0) * sin * cos
    versine = real(2.0) * sin * sin
    return s0, c0 - (c0 * versine + s0 * turn), s0 - (s0 * versine - c0 * turn), turn, versine


@portable
def sharp_ends(x: real, y: real, z: real, rows: Table, i: int, rho: real, near: real, c0: real, s0: real):
    """As `plain_ends`, for bare fields: with more digits next to an end. A closed ring has no ends."""
    _s0, c1, s1, turn, versine = plain_ends(x, y, z, rows, i, rho, near, c0, s0)
    beside = real(BESIDE)
    if is_single():
        beside = real(BESIDE_SINGLE)
    if near < beside * rows[i, RADIUS] and rows[i, ANGLE] < real(TAU):
        if near + abs(s0) * rho < beside * rows[i, RADIUS]:
            s0 = -real(0.5) * beside_start(x, y, z, rows, i) / (rho * c0)
        if near + abs(s1) * rho < beside * rows[i, RADIUS]:
            s1 = -real(0.5) * beside_end(x, y, z, rows, i) / (rho * c1)
    return s0, c1, s1, turn, versine


@portable
def _direction(p: real, q: real, rho: real):
    """Cosine and sine of the azimuth of (p, q), at distance rho from the axis; 1 and 0 on it."""
    if rho > real(0.0):
        inverse = real(1.0) / rho
        return p * inverse, q * inverse
    return real(1.0), real(0.0)


kernel = hole(ARC)
offset = hole("x, y, z, rows, i, rho, height")
ends = hole("x, y, z, rows, i, rho, near, c0, s0")


@portable
def arc_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of an arc or circle.

    `kernel` takes `ARC` and returns the jet in the orthonormal frame of the query's radial direction, the azimuthal one
    and the normal. v0, half the angle from the query's azimuth to the start, lies in (-pi, 0].
    """
    ux, uy, uz = first_of(rows, i)
    nx, ny, nz = normal_of(rows, i)
    vx = ny * uz - nz * uy
    vy = nz * ux - nx * uz
    vz = nx * uy - ny * ux
    dx, dy, dz = from_center(x, y, z, rows, i)
    p = dx * ux + dy * uy + dz * uz
    q = dx * vx + dy * vy + dz * vz
    rho = math.sqrt(p * p + q * q)
    cos, sin = _direction(p, q, rho)
    c0, s0 = half_angle(cos, sin)
    inner, height = offset(x, y, z, rows, i, rho, dx * nx + dy * ny + dz * nz)
    s0, c1, s1, turn, versine = ends(x, y, z, rows, i, rho, abs(inner) + abs(height), c0, s0)
    f, fa, fb, fn, faa, fbb, fnn, fab, fan, fbn = kernel(
        rho,
        inner,
        height,
        rows[i, RADIUS],
        rows[i, ANGLE],
        c0,
        s0,
        c1,
        s1,
        turn,
        versine,
        rows[i, KERNEL_WIDTH],
        rows[i, FOLD],
    )
    # Unlike `isfinite`, a comparison lets compilers drop the Hessian where it is unused.
    if not abs(fa + fb + fn) < real(math.inf):
        fa = real(0.0)
        fb = real(0.0)
        fn = real(0.0)
    if not abs(faa + fbb + fnn + fab + fan + fbn) < real(math.inf):
        faa = real(0.0)
        fbb = real(0.0)
        fnn = real(0.0)
        fab = real(0.0)
        fan = real(0.0)
        fbn = real(0.0)
    strength = rows[i, STRENGTH]
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
