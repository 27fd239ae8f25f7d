"""How a kernel's width and strength follow from Blinn's two numbers: the radius in isolation R and the blobbiness B.

The width, with b = -B:

| kernel | rule | width |
|---|---|---|
| Gaussian | Blinn's own | a = sqrt(b) / R |
| inverse powers | half maximum where the Gaussian has it, at R sqrt(ln 2 / b) | s, softening |
| those that end | slope of log h at R that of the Gaussian, -2 b / R | the radius of their support |

The strength puts the surface F = 1 of one primitive alone at the distance R: a point's is a sphere, a segment's or
arc's the tube of the whole straight line, a triangle's or plane's the slab of the whole plane. Where the field of a
whole line (1/r) or plane (1/r, 1/r^2) is infinite, a primitive is measured by itself: at the distance R beside a
segment's middle, above the middle of an arc along its normal, or above a triangle's centroid. An infinite plane has no
such field at all.
"""

from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.elements import pack
from fieldsim.potentials.kernels.base import Diverges, Kernel
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment

# Half the length, in radii, of what stands for the whole line: enough for 1/r^2, which falls as the inverse of it.
ENDLESS = 1e18


def kernel_of(kind: type, radius: float, blobbiness: float) -> Kernel:
    """The kernel of a class with the width that follows from R and B."""
    return kind(kind.width_of(radius, -blobbiness))


def strength(kernel: Kernel, radius: float, dimension: int) -> tuple[float, float]:
    """(strength, fold) that put F = 1 at `radius` from a point, a whole line or a whole plane; see `row`.

    Raises InputError where that field is infinite, or ends before the radius.
    """
    known = kernel.calibrated(radius, dimension)
    if known is not None:
        return known
    if _diverges(kernel, dimension):
        raise InputError(f"the field of {kernel!r} on a whole {('line', 'plane')[dimension - 1]} is infinite")
    half = 2.0 * kernel.width if kernel.compact else ENDLESS * radius
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
    return isinstance(kernel.whole(dimension), Diverges)


def _inverse(kernel, radius, primitive, point):
    """1 / F at a point."""
    elements = pack([primitive], [kernel], [1.0])
    value = registry.formula_of(kernel, primitive).jet(*map(float, point), elements.rows, 0)[0]
    if not value > 0.0:
        raise InputError(
            f"Material: radius is {radius:g}, but {kernel!r} ends before; give it a radius of support above that"
        )
    return 1.0 / float(value)
