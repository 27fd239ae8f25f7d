"""How a kernel's width and strength follow from Blinn's two numbers: the radius in isolation R and the blobbiness B.

The width, with b = -B:

| kernel | rule | width |
|---|---|---|
| Gaussian | Blinn's own | a = sqrt(b) / R |
| Cauchy, InverseSquare, Newtonian | half maximum where the Gaussian has it, at R sqrt(ln 2 / b) | s, softening |
| Quartic, SoftObject, Metaball | slope of log h at R that of the Gaussian, -2 b / R | support radius S |

The strength puts the surface F = 1 of one primitive alone at the distance R: a point's is a sphere, a segment's or
arc's the tube of the whole straight line, a triangle's or plane's the slab of the whole plane. Where the field of a
whole line (1/r) or plane (1/r, 1/r^2) is infinite, a primitive is measured by itself: at the distance R beside a
segment's middle, above the middle of an arc along its normal, or above a triangle's centroid. An infinite plane has no
such field at all.
"""

import math

from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.elements import pack
from fieldsim.potentials.kernels import (
    COMPACT,
    Cauchy,
    Gaussian,
    InverseSquare,
    Kernel,
    Metaball,
    Newtonian,
    Quartic,
    SoftObject,
)
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment

# Half width of (1 + s^2 r^2)^-2 equals that of exp(-a^2 r^2) when s = CAUCHY_PER_GAUSSIAN a.
CAUCHY_PER_GAUSSIAN = math.sqrt((math.sqrt(2.0) - 1.0) / math.log(2.0))
# Half the length, in radii, of what stands for the whole line: enough for 1/r^2, which falls as the inverse of it.
ENDLESS = 1e18


def _half(radius, b):
    """Where the Gaussian has half its maximum."""
    return radius * math.sqrt(math.log(2.0) / b)


def _metaball_share(b):
    """R / S: the slope of log h is -2 u / (1 - u) outside a third of S, and -6 u^2 / (1 - 3 u^2) within, u = R / S."""
    return b / (1.0 + b) if b >= 0.5 else math.sqrt(b / (3.0 * (1.0 + b)))


def _soft_object_share(b):
    """R / S: with w = 1 - u^2, (1 - w)(10 + 12 w) = b w (5 + 4 w)."""
    half = 0.5 * (5.0 * b - 2.0)
    root = math.hypot(half, math.sqrt(10.0 * (12.0 + 4.0 * b)))
    # The root that does not cancel, for either sign of the middle coefficient.
    w = 10.0 / (root + half) if half > 0.0 else (root - half) / (12.0 + 4.0 * b)
    return math.sqrt(1.0 - w)


_WIDTHS = {
    Gaussian: lambda radius, b: math.sqrt(b) / radius,
    Cauchy: lambda radius, b: CAUCHY_PER_GAUSSIAN * math.sqrt(b) / radius,
    Newtonian: lambda radius, b: _half(radius, b) / math.sqrt(3.0),
    InverseSquare: lambda radius, b: _half(radius, b),
    Metaball: lambda radius, b: radius / _metaball_share(b),
    SoftObject: lambda radius, b: radius / _soft_object_share(b),
    Quartic: lambda radius, b: radius * math.sqrt(1.0 + 2.0 / b),
}


def kernel_of(kind: type, radius: float, blobbiness: float) -> Kernel:
    """The kernel of a class with the width that follows from R and B."""
    return kind(_WIDTHS[kind](radius, -blobbiness))


def strength(kernel: Kernel, radius: float, dimension: int) -> tuple[float, float]:
    """(strength, fold) that put F = 1 at `radius` from a point, a whole line or a whole plane; see `registry`.

    Raises InputError where that field is infinite, or ends before the radius.
    """
    if isinstance(kernel, Gaussian):
        # A line's field is sqrt(pi)/a exp(-a^2 rho^2), a plane's pi/a^2 exp(-a^2 z^2).
        return (kernel.a / math.sqrt(math.pi)) ** dimension, (kernel.a * radius) ** 2
    if _diverges(kernel, dimension):
        raise InputError(f"the field of {kernel!r} on a whole {('line', 'plane')[dimension - 1]} is infinite")
    half = 2.0 * kernel.width if isinstance(kernel, COMPACT) else ENDLESS * radius
    line = Segment((-half, 0, 0), (half, 0, 0))
    whole = (Point((0, 0, 0)), line, Plane((0, 0, 0), (0, 0, 1)))[dimension]
    return _inverse(kernel, radius, whole, (0.0, 0.0, radius)), 0.0


def strength_on(kernel: Kernel, radius: float, primitive: Primitive) -> tuple[float, float]:
    """(strength, fold) of a primitive, such that F = 1 lies at `radius` from it in isolation."""
    if not _diverges(kernel, primitive.dimension) and primitive.uniform:
        return strength(kernel, radius, primitive.dimension)
    if primitive.endless:
        raise InputError(
            f"Material: the field of {kernel!r} on an infinite plane has no level; give triangles, or another kernel"
        )
    return _inverse(kernel, radius, primitive.plain(), primitive.beside(radius)), 0.0


def _diverges(kernel, dimension):
    return (isinstance(kernel, Newtonian) and dimension > 0) or (isinstance(kernel, InverseSquare) and dimension > 1)


def _inverse(kernel, radius, primitive, point):
    """1 / F at a point."""
    elements = pack([primitive], [kernel], [1.0])
    value = registry.formula_of(kernel, primitive).jet(*map(float, point), elements.rows, 0)[0]
    if not value > 0.0:
        raise InputError(
            f"Material: radius is {radius:g}, but {kernel!r} ends before; give it a radius of support above that"
        )
    return 1.0 / float(value)
