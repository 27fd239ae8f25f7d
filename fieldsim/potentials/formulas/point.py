"""Points: F = h(r)."""

import math

from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.registry import register
from fieldsim.potentials.row import FOLD, KERNEL_WIDTH, STRENGTH, from_point

# Exponents are clamped here: exp(60) fits float32 with room for sums, and only a surface drawn with a fold above 60 (a
# blobbiness below -60) has such exponents at all, deep inside, where nothing but "well above T" matters.
EXPONENT_LIMIT = 60.0
# Squares of scaled distances are clamped here where they multiply a Gaussian that has long vanished (0 inf is NaN).
FAR = 1e30


@portable
def cauchy_point(r2: real, s: real, fold: real):
    """h, h' / r and h'' - h' / r of the Cauchy kernel."""
    u = s * s * r2
    h = real(1.0) / (real(1.0) + u)
    slope = -real(4.0) * s * s * h * h * h
    return h * h, slope, -real(6.0) * slope * (u * h)


@portable
def gaussian_point(r2: real, a: real, fold: real):
    """h, h' / r and h'' - h' / r of the Gaussian exp(fold - a^2 r^2), its exponent clamped at EXPONENT_LIMIT."""
    u = a * a * r2
    h = math.exp(min(fold - u, real(EXPONENT_LIMIT)))
    slope = -real(2.0) * a * a * h
    return h, slope, -real(2.0) * slope * min(u, real(FAR))


@portable
def newtonian_point(r2: real, softening: real, fold: real):
    """h, h' / r and h'' - h' / r of the softened 1/r. At an unsoftened source: +inf and slopes 0."""
    d2 = r2 + softening * softening
    if d2 == real(0.0):
        return real(math.inf), real(0.0), real(0.0)
    h = real(1.0) / math.sqrt(d2)
    slope = -h / d2
    return h, slope, -real(3.0) * slope * (r2 / d2)


kernel = hole("r2, width, fold")


@portable
def point_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a point. `kernel(r2, width, fold)` returns (F, F' / r, F'' - F' / r)."""
    dx, dy, dz = from_point(x, y, z, rows, i)
    r2 = dx * dx + dy * dy + dz * dz
    f, slope, bend = kernel(r2, rows[i, KERNEL_WIDTH], rows[i, FOLD])
    f *= rows[i, STRENGTH]
    slope *= rows[i, STRENGTH]
    bend *= rows[i, STRENGTH]
    if not abs(slope) < real(math.inf):
        slope = real(0.0)
    gx = slope * dx
    gy = slope * dy
    gz = slope * dz
    if not abs(bend) < real(math.inf):
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


for _kernel, _local in ((Cauchy, cauchy_point), (Gaussian, gaussian_point), (Newtonian, newtonian_point)):
    register(_kernel, Point, point_jet.bind(kernel=_local))
