"""Full circles, in their local invariants: distance rho from the axis, height z above the plane.

A kernel's function returns (F, dF/drho / rho, dF/dz): the first slope vanishes on the axis like rho, and divided by it
no direction is needed there. With R the radius, near2 = (rho - R)^2 + z^2 and far2 = (rho + R)^2 + z^2 are the squared
distances of the wire's nearest and farthest points. All sums below keep their digits on the axis and next to the wire.
"""

import dataclasses
import math

import numpy as np

from fieldsim import validate
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.cells import register
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.point import EXPONENT_LIMIT
from fieldsim.potentials.primitive import Primitive
from fieldsim.potentials.special import bessel_scaled, elliptic_dv

TAU = 2 * math.pi


@dataclasses.dataclass(frozen=True)
class Circle(Primitive):
    """A full circle about `center`, in the plane across `normal`: an Arc of 2 pi."""

    center: tuple[float, float, float]
    normal: tuple[float, float, float]
    radius: float

    dimension = 1

    def _checked(self):
        return {
            "center": validate.vector("Circle", "center", self.center),
            "normal": validate.direction("Circle", "normal", self.normal),
            "radius": validate.number("Circle", "radius", self.radius, above=0.0),
        }

    @property
    def measure(self) -> float:
        """The circumference."""
        return TAU * self.radius

    def pack(self, row):
        """Write radius, angle, centre, some start and the normal into an element row."""
        normal = np.array(self.normal)
        start = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        row[2:4] = self.radius, TAU
        row[5:8] = self.center
        row[14:17] = start / np.linalg.norm(start)
        row[17:20] = normal


@portable
def cauchy_circle(rho: real, z: real, radius: real, s: real, fold: real):
    """(F, dF/drho / rho, dF/dz) of the Cauchy kernel. Relative error 2e-15.

    With q, Q = 1 + s^2 (near2, far2), the eccentric angle of `cauchy_arc` runs once round.
    """
    s2 = s * s
    inner = rho - radius
    far = real(1.0) + s2 * ((rho + radius) * (rho + radius) + z * z)
    r = (real(1.0) + s2 * (inner * inner + z * z)) / far
    scale = real(math.pi) * radius / (r * math.sqrt(r) * far * far)
    push = s2 / far / r * scale
    across = r + real(3.0) * r * r + real(6.0) * (real(1.0) + r) * (s2 * radius * inner / far)
    return (
        scale * (real(1.0) + r),
        -real(2.0) * push * across,
        -push * z * (real(3.0) + (real(2.0) + real(3.0) * r) * r),
    )


@portable
def gaussian_circle(rho: real, z: real, radius: real, a: real, fold: real):
    """(F, dF/drho / rho, dF/dz) of the Gaussian exp(fold - a^2 r^2), its exponent clamped at EXPONENT_LIMIT.

    Relative error 1e-14 of the value and of the force's scale: F = 2 pi R exp(fold - a^2 near2) I0e(2 a^2 rho R).
    """
    a2 = a * a
    inner = rho - radius
    i0, difference, slope = bessel_scaled(real(2.0) * a2 * rho * radius)
    top = math.exp(min(fold - a2 * (inner * inner + z * z), real(EXPONENT_LIMIT)))
    scale = real(TAU) * radius * top
    # rho I0 - R I1, over rho: well inside the circle, and elsewhere without the difference of I0 and I1.
    if rho < real(0.5) * radius:
        across = i0 - real(2.0) * a2 * radius * radius * slope
    else:
        across = (inner * i0 + radius * difference) / rho
    return scale * i0, -real(2.0) * a2 * scale * across, -real(2.0) * a2 * scale * i0 * z


@portable
def newtonian_circle(rho: real, z: real, radius: real, softening: real, fold: real):
    """(F, dF/drho / rho, dF/dz) of 1/sqrt(r^2 + softening^2). Relative error 5e-15; on a bare wire (inf, 0, 0).

    F = 4 R K / far; with the integrals D and V of `elliptic_dv` the attraction is a sum without cancellation, where the
    usual form in K and E divides by rho and takes a difference.
    """
    inner = rho - radius
    outer = rho + radius
    height2 = z * z + softening * softening
    near2 = inner * inner + height2
    root = real(1.0) / math.sqrt(outer * outer + height2)
    inverse = root * root
    m1 = near2 * inverse
    if m1 == real(0.0):
        return real(math.inf), real(0.0), real(0.0)
    d, v = elliptic_dv(min(m1, real(1.0)))
    m_v = real(4.0) * radius * rho * inverse * v
    m1_d = m1 * d
    scale = real(4.0) * radius * root
    push = scale / near2
    across = real(2.0) * radius * inner * inverse * v + m1_d
    return scale * (m_v + d + m1_d), -real(2.0) * push * across, -push * z * (m_v + real(2.0) * m1_d)


@portable
def _element(x: real, y: real, z: real, rows: Table, i: int):
    nx = rows[i, 17]
    ny = rows[i, 18]
    nz = rows[i, 19]
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    height = dx * nx + dy * ny + dz * nz
    dx -= height * nx
    dy -= height * ny
    dz -= height * nz
    rho = math.sqrt(dx * dx + dy * dy + dz * dz)
    f, across, along = kernel(rho, height, rows[i, 2], rows[i, 1], rows[i, 4])  # noqa: F821 - bound below
    f *= rows[i, 0]
    across *= rows[i, 0]
    along *= rows[i, 0]
    return f, across * dx + along * nx, across * dy + along * ny, across * dz + along * nz


register(Cauchy, Circle, _element.bind(kernel=cauchy_circle))
register(Gaussian, Circle, _element.bind(kernel=gaussian_circle))
register(Newtonian, Circle, _element.bind(kernel=newtonian_circle))
