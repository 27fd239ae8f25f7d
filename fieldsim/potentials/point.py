"""Points: F = h(r)."""

import dataclasses
import math

from fieldsim import validate
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.cells import register
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.primitive import Primitive

# Exponents are clamped here: exp(60) fits float32 with room for sums, and only a surface drawn with a fold above 60 (a
# blobbiness below -60) has such exponents at all, deep inside, where nothing but "well above T" matters.
EXPONENT_LIMIT = 60.0


@dataclasses.dataclass(frozen=True)
class Point(Primitive):
    """A point source."""

    position: tuple[float, float, float]

    measure = 1.0
    dimension = 0

    def _checked(self):
        return {"position": validate.vector("Point", "position", self.position)}

    def pack(self, row):
        """Write the position into an element row."""
        row[5:8] = self.position


@portable
def cauchy_point(r2: real, s: real, fold: real):
    """h(r) and dh/d(r^2) of the Cauchy kernel."""
    h = real(1.0) / (real(1.0) + s * s * r2)
    return h * h, -real(2.0) * s * s * h * h * h


@portable
def gaussian_point(r2: real, a: real, fold: real):
    """h(r) and dh/d(r^2) of the Gaussian exp(fold - a^2 r^2), its exponent clamped at EXPONENT_LIMIT."""
    h = math.exp(min(fold - a * a * r2, real(EXPONENT_LIMIT)))
    return h, -a * a * h


@portable
def newtonian_point(r2: real, softening: real, fold: real):
    """h(r) and dh/d(r^2) of the softened 1/r. At an unsoftened source: +inf and slope 0."""
    d2 = r2 + softening * softening
    if d2 == real(0.0):
        return real(math.inf), real(0.0)
    h = real(1.0) / math.sqrt(d2)
    return h, -real(0.5) * h / d2


@portable
def _element(x: real, y: real, z: real, rows: Table, i: int):
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    f, slope = kernel(dx * dx + dy * dy + dz * dz, rows[i, 1], rows[i, 4])  # noqa: F821 - bound below
    f *= rows[i, 0]
    slope *= real(2.0) * rows[i, 0]
    return f, slope * dx, slope * dy, slope * dz


register(Cauchy, Point, _element.bind(kernel=cauchy_point))
register(Gaussian, Point, _element.bind(kernel=gaussian_point))
register(Newtonian, Point, _element.bind(kernel=newtonian_point))
