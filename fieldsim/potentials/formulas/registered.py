"""The formulas that exist: which jet evaluates which kernel on which primitive. Importing this module registers them.

The order numbers the formulas, and the numbers are part of compiled code and of the order in which elements are summed.
"""

from fieldsim.potentials.formulas.arc.cauchy import cauchy_arc
from fieldsim.potentials.formulas.arc.circle import (
    cauchy_circle,
    circle_jet,
    gaussian_circle,
    inverse_square_circle,
    newtonian_circle,
)
from fieldsim.potentials.formulas.arc.complement import near_axis, near_axis_gaussian, with_complement
from fieldsim.potentials.formulas.arc.frame import arc_jet, no_ends, plain_ends, plain_offset, ring_offset, sharp_ends
from fieldsim.potentials.formulas.arc.gaussian import gaussian_arc
from fieldsim.potentials.formulas.arc.inverse_square import inverse_square_open_arc
from fieldsim.potentials.formulas.arc.metaball import metaball_arc
from fieldsim.potentials.formulas.arc.newtonian import newtonian_arc
from fieldsim.potentials.formulas.arc.polynomial import polynomial_arc
from fieldsim.potentials.formulas.plane import (
    cauchy_plane,
    gaussian_plane,
    inverse_square_plane,
    metaball_plane,
    newtonian_plane,
    plane_jet,
    polynomial_plane,
)
from fieldsim.potentials.formulas.point import register_points
from fieldsim.potentials.formulas.profile import along_arc, along_segment, profiled_jet
from fieldsim.potentials.formulas.segment.cauchy import cauchy_segment
from fieldsim.potentials.formulas.segment.frame import segment_jet
from fieldsim.potentials.formulas.segment.gaussian import gaussian_segment
from fieldsim.potentials.formulas.segment.inverse_square import inverse_square_segment
from fieldsim.potentials.formulas.segment.metaball import metaball_segment
from fieldsim.potentials.formulas.segment.newtonian import newtonian_segment
from fieldsim.potentials.formulas.segment.polynomial import polynomial_segment
from fieldsim.potentials.formulas.segment.tapered import tapered_jet
from fieldsim.potentials.formulas.solid import face_jet
from fieldsim.potentials.formulas.triangle.cauchy import cauchy_triangle_jet
from fieldsim.potentials.formulas.triangle.gaussian import gaussian_triangle_jet
from fieldsim.potentials.formulas.triangle.inverse_square import inverse_square_triangle_jet
from fieldsim.potentials.formulas.triangle.metaball import metaball_triangle_jet
from fieldsim.potentials.formulas.triangle.newtonian import newtonian_triangle_jet
from fieldsim.potentials.formulas.triangle.polynomial import polynomial_triangle_jet
from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Metaball, Newtonian, Quartic, SoftObject
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.face import Face
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.profile import ProfiledArc, ProfiledSegment
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.tapered import TaperedSegment
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.potentials.registry import FORMULAS, register


def on_arc(kernel, circle, inside, offset, ends):
    """The jet of an arc under a kernel whose full circle serves near the axis."""
    local = with_complement.bind(arc=kernel, circle=circle, hollow=inside)
    return arc_jet.bind(kernel=local, offset=offset, ends=ends)


def clipped(kernel):
    """The jet of an arc or a circle under a kernel of compact support."""
    return arc_jet.bind(kernel=kernel, offset=ring_offset, ends=no_ends)


register_points(Cauchy)
register_points(Gaussian)
register_points(Newtonian)

register(Cauchy, Segment, segment_jet.bind(kernel=cauchy_segment))
register(Gaussian, Segment, segment_jet.bind(kernel=gaussian_segment))
register(Newtonian, Segment, segment_jet.bind(kernel=newtonian_segment))

register(Cauchy, Circle, circle_jet.bind(kernel=cauchy_circle, offset=plain_offset))
register(Gaussian, Circle, circle_jet.bind(kernel=gaussian_circle, offset=plain_offset))
register(Newtonian, Circle, circle_jet.bind(kernel=newtonian_circle, offset=ring_offset))

register(Cauchy, Arc, on_arc(cauchy_arc, cauchy_circle, near_axis, plain_offset, plain_ends))
register(Gaussian, Arc, on_arc(gaussian_arc, gaussian_circle, near_axis_gaussian, plain_offset, plain_ends))
register(Newtonian, Arc, on_arc(newtonian_arc, newtonian_circle, near_axis, ring_offset, sharp_ends))

register_points(SoftObject)
register_points(Quartic)
register_points(Metaball)

register(SoftObject, Arc, clipped(polynomial_arc(SoftObject)))
register(Quartic, Arc, clipped(polynomial_arc(Quartic)))
register(SoftObject, Circle, clipped(polynomial_arc(SoftObject)))
register(Quartic, Circle, clipped(polynomial_arc(Quartic)))

register(SoftObject, Segment, segment_jet.bind(kernel=polynomial_segment(SoftObject)))
register(Quartic, Segment, segment_jet.bind(kernel=polynomial_segment(Quartic)))
register(Metaball, Segment, segment_jet.bind(kernel=metaball_segment))

register_points(InverseSquare)
register(InverseSquare, Segment, segment_jet.bind(kernel=inverse_square_segment))
register(InverseSquare, Arc, arc_jet.bind(kernel=inverse_square_open_arc, offset=ring_offset, ends=sharp_ends))
register(InverseSquare, Circle, circle_jet.bind(kernel=inverse_square_circle, offset=ring_offset))

register(Metaball, Arc, clipped(metaball_arc))
register(Metaball, Circle, clipped(metaball_arc))

register(Newtonian, Triangle, newtonian_triangle_jet)
register(Metaball, Triangle, metaball_triangle_jet)
register(Quartic, Triangle, polynomial_triangle_jet(Quartic))
register(SoftObject, Triangle, polynomial_triangle_jet(SoftObject))

register(Cauchy, Plane, plane_jet.bind(kernel=cauchy_plane))
register(Gaussian, Plane, plane_jet.bind(kernel=gaussian_plane))
register(InverseSquare, Plane, plane_jet.bind(kernel=inverse_square_plane))
register(Metaball, Plane, plane_jet.bind(kernel=metaball_plane))
register(Newtonian, Plane, plane_jet.bind(kernel=newtonian_plane))
register(Quartic, Plane, plane_jet.bind(kernel=polynomial_plane(Quartic)))
register(SoftObject, Plane, plane_jet.bind(kernel=polynomial_plane(SoftObject)))

# Every kernel that is on segments or arcs is on profiled ones, too.
for _plain, _primitive, _along in ((Segment, ProfiledSegment, along_segment), (Arc, ProfiledArc, along_arc)):
    for _kernel in [kernel for kernel, primitive in FORMULAS if primitive is _plain]:
        register(_kernel, _primitive, profiled_jet.bind(jet=FORMULAS[_kernel, _plain].jet, along=_along))

register(Newtonian, Face, face_jet)
register(Newtonian, TaperedSegment, tapered_jet)

register(Gaussian, Triangle, gaussian_triangle_jet)
register(Cauchy, Triangle, cauchy_triangle_jet)
register(InverseSquare, Triangle, inverse_square_triangle_jet)
