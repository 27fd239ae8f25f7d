"""Infinite planes: F is a function of the height z alone.

F(z) = 2 pi integral from |z| of r h(r) dr, which diverges for the inverse powers while its derivative does not; these
are given relative to a gauge: F = 0 at z = 0 for the Newtonian kernel, F = -pi log(z^2 + softening^2) for the inverse
square.
"""

import math

from fieldsim.numerics.compensated import half_digits, split_at, two_difference
from fieldsim.numerics.constants import TAU
from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials.formulas.triangle.metaball import metaball_levels
from fieldsim.potentials.kernels.gaussian import EXPONENT_LIMIT
from fieldsim.potentials.row import FOLD, KERNEL_WIDTH, NORMAL_X, POINT_X, STRENGTH, from_point, normal_of

# Closer to the plane than this part of the offset from its point, the height is computed with care.
CLOSE = 0.125


@portable
def cauchy_plane(z: real, s: real, fold: real):
    """(F, dF/dz, d2F/dz2) of the Cauchy kernel."""
    h = real(1.0) / (real(1.0) + s * s * z * z)
    f = real(math.pi) * h / (s * s)
    slope = -real(TAU) * h * h
    return f, slope * z, slope * h * (real(1.0) - real(3.0) * s * s * z * z)


@portable
def gaussian_plane(z: real, a: real, fold: real):
    """(F, dF/dz, d2F/dz2) of the Gaussian exp(fold - a^2 r^2), its exponent clamped at EXPONENT_LIMIT."""
    h = real(TAU) * math.exp(min(fold - a * a * z * z, real(EXPONENT_LIMIT)))
    return real(0.5) * h / (a * a), -h * z, h * (real(2.0) * a * a * z * z - real(1.0))


@portable
def inverse_square_plane(z: real, softening: real, fold: real):
    """(F, dF/dz, d2F/dz2) of 1/(r^2 + softening^2). On an unsoftened plane: inf, slopes 0."""
    w = math.sqrt(z * z + softening * softening)
    if w == real(0.0):
        return real(math.inf), real(0.0), real(0.0)
    slope = -real(TAU) / w
    return (
        -real(TAU) * math.log(w),
        slope * (z / w),
        slope / w * ((softening - z) / w) * ((softening + z) / w),
    )


@portable
def newtonian_plane(z: real, softening: real, fold: real):
    """(F, dF/dz, d2F/dz2) of 1/sqrt(r^2 + softening^2). On an unsoftened plane: 0 (slopes of both sides cancel)."""
    w = math.sqrt(z * z + softening * softening)
    if w == real(0.0):
        return real(0.0), real(0.0), real(0.0)
    u = z / w
    ratio = softening / w
    return -real(TAU) * z * (z / (w + softening)), -real(TAU) * u, -real(TAU) * ratio * ratio / w


# h = c2 y^2 + c3 y^3.
c2 = hole()
c3 = hole()


@portable
def _polynomial_plane(z: real, radius: real, fold: real):
    """(F, dF/dz, d2F/dz2) of c2 y^2 + c3 y^3, y = 1 - (z / radius)^2, within the radius."""
    u = z / radius
    # The difference is exact next to the support's edge.
    y = max((radius - abs(z)) * (radius + abs(z)) / (radius * radius), real(0.0))
    f = real(math.pi) * radius * radius * (real(c2) / real(3.0) + real(c3) * y / real(4.0)) * y * y * y
    slope = -real(TAU) * (real(c2) + real(c3) * y) * y * y
    bend = (real(2.0) * real(c2) + real(3.0) * real(c3) * y) * y
    return f, z * slope, slope + real(2.0) * real(TAU) * u * u * bend


@portable
def metaball_plane(z: real, radius: real, fold: real):
    """(F, dF/dz, d2F/dz2) of the Metaball."""
    u = abs(z) / radius
    level, h, slope = metaball_levels(u * u)
    return (
        -real(TAU) * radius * radius * level,
        -real(TAU) * z * h,
        -real(TAU) * (h + real(2.0) * u * u * slope),
    )


@portable
def close_height(x: real, y: real, z: real, rows: Table, i: int, reach: real):
    """The height above the plane to 2^-76 (float32: 2^-34) of `reach`, the largest of the offset's coordinates.

    As `close_to_the_ring` of arcs: offsets carry their rounding error along, and factors are split in two halves of
    their digits, whose leading products are exact (a compiler may fuse them) and cancel exactly.
    """
    unit = real(4.0) * half_digits()
    grid = unit * reach
    lead = real(0.0)
    rest = real(0.0)
    for k in range(3):
        p = x
        if k == 1:
            p = y
        if k == 2:
            p = z
        d, error = two_difference(p, rows[i, POINT_X + k])
        high, low = split_at(d, grid)
        low += error
        n_high, n_low = split_at(rows[i, NORMAL_X + k], unit)
        lead += high * n_high
        rest += high * n_low + low * (n_high + n_low)
    return lead + rest


kernel = hole("z, width, fold")


@portable
def plane_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a plane. `kernel(z, width, fold)` returns (F, dF/dz, d2F/dz2) at height z."""
    nx, ny, nz = normal_of(rows, i)
    dx, dy, dz = from_point(x, y, z, rows, i)
    height = dx * nx + dy * ny + dz * nz
    reach = max(abs(dx), max(abs(dy), abs(dz)))
    if abs(height) < real(CLOSE) * reach:
        height = close_height(x, y, z, rows, i, reach)
    f, slope, curve = kernel(height, rows[i, KERNEL_WIDTH], rows[i, FOLD])
    f *= rows[i, STRENGTH]
    slope *= rows[i, STRENGTH]
    curve *= rows[i, STRENGTH]
    return (
        f,
        slope * nx,
        slope * ny,
        slope * nz,
        curve * nx * nx,
        curve * ny * ny,
        curve * nz * nz,
        curve * nx * ny,
        curve * nx * nz,
        curve * ny * nz,
    )


def polynomial_plane(kernel):
    """The local derivatives for `plane_jet` under a kernel that is a polynomial."""
    square, cube = kernel.coefficients()
    return _polynomial_plane.bind(c2=square, c3=cube)
