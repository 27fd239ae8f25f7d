"""Points: F = h(r)."""

import math

from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials.kernels import Kernel
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.registry import register
from fieldsim.potentials.row import FOLD, KERNEL_WIDTH, STRENGTH, from_point

law = hole("r2, width, fold, times")


@portable
def point_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a point. `law`: see `kernels.base`."""
    dx, dy, dz = from_point(x, y, z, rows, i)
    r2 = dx * dx + dy * dy + dz * dz
    f, first, second = law(r2, rows[i, KERNEL_WIDTH], rows[i, FOLD], r2)
    f *= rows[i, STRENGTH]
    # F' / r, and F'' - F' / r.
    slope = real(2.0) * first * rows[i, STRENGTH]
    bend = real(4.0) * second * rows[i, STRENGTH]
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


def register_points(kernel: type[Kernel]) -> None:
    """Enter points under a kernel into the registry."""
    register(kernel, Point, point_jet.bind(law=kernel.law))
