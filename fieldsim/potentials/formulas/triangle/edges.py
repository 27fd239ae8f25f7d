"""What each kernel adds to a triangle, edge by edge.

`edge(d, lo, length, z, k, fold, outside)` takes the signed distance d of the foot of the perpendicular to the edge's
line (positive inside), the edge's range lo..lo + length along it, counted outward from its nearer end, the height z,
and how far outside the triangle the foot lies (not positive inside). It returns the segment's (F, F_lo, F_(rho^2)) and
four terms to be summed over the edges; `total` makes (F, F_z, F_zz) of the sums and the trace of the in-plane
Hessian.
"""

import math

from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.segment.segment import newtonian_segment
from fieldsim.potentials.formulas.triangle.cubature import far_away, points_a_side
from fieldsim.potentials.formulas.triangle.triangle import FAR, near_by, triangle_jet
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.potentials.registry import register

# Newtonian: F = sum d S - w Omega, w^2 = z^2 + softening^2, Omega the solid angle at height w.


@portable
def angles(d: real, lo: real, hi: real, w: real, g2: real):
    """Vectors of two angles, with the sign of d: of `view`, and of the rest of the angle under which the edge is seen.

    g2 is d^2 + w^2. `view` is the part of the solid angle, seen from height w, between the foot and the edge: the
    difference of atan(t d / (d^2 + w^2 + w r)) at the two ends; the rest that of atan(t w / (d r)). No terms cancel;
    the choices are made without branches, which a processor would mispredict.
    """
    d2 = d * d
    r_lo = math.sqrt(lo * lo + g2)
    r_hi = math.sqrt(hi * hi + g2)
    # hi r_lo - lo r_hi.
    swing = hi * r_lo + abs(lo) * r_hi
    over = real(1.0)
    if lo > real(0.0):
        over = swing
        swing = g2 * (hi - lo) * (hi + lo)
    swing *= w / over
    both = lo * hi
    x = (g2 + w * r_lo) * (g2 + w * r_hi) + d2 * both
    return x, d * ((hi - lo) * g2 + swing), d2 * (r_lo * r_hi) + w * w * both, d * swing


@portable
def newtonian_edge(d: real, lo: real, length: real, z: real, softening: real, fold: real, outside: real):
    """Of an edge that an unsoftened query point lies on, the infinite part of the slope is left out.

    Outside the triangle the angles sum up to nothing; what remains then vanishes with w, without cancelling.
    """
    s, along, across, _ll, _lr, _rr = newtonian_segment(lo, d * d + z * z, length, softening, fold)
    if s == real(math.inf):
        s = real(0.0)
    w = math.sqrt(z * z + softening * softening)
    cos, sin, rest_x, rest_y = angles(d, lo, lo + length, w, d * d + z * z + softening * softening)
    if outside > w:
        cos = rest_x
        sin = -rest_y
        if d == real(0.0):
            cos = real(1.0)
    nil = real(0.0)
    return s, along, real(0.5) * across, d * s, nil, nil, nil, cos, sin, real(1.0), nil, real(1.0), nil


@portable
def newtonian_total(
    q_1: real,
    q_2: real,
    q_3: real,
    q_4: real,
    angle_1: real,
    angle_2: real,
    angle_3: real,
    z: real,
    softening: real,
    fold: real,
    outside: real,
    trace: real,
):
    """On the unsoftened sheet itself F_z is the mean of its two sides, 0."""
    w = math.sqrt(z * z + softening * softening)
    if w == real(0.0):
        return q_1, real(0.0), -trace
    up = z / w
    soft = softening / w
    return q_1 - w * angle_1, -angle_1 * up, -trace * up * up - angle_1 * soft * (soft / w)


@portable
def newtonian_far(away: real, size: real, softening: real):
    """Points a side once distance or softening exceeds FAR sizes."""
    return points_a_side((away + softening * softening) / (size * size), real(FAR))


@portable
def nowhere(away: real, size: real, k: real):
    """A kernel that never vanishes."""
    return False


def formula(kernel, edge, total, points, is_gone=nowhere):
    """The jet of a triangle under a kernel, from its parts."""
    return triangle_jet.bind(
        points=points,
        is_gone=is_gone,
        distant=far_away(kernel.law),
        closed_form=near_by.bind(edge=edge, total=total),
    )


register(Newtonian, Triangle, formula(Newtonian, newtonian_edge, newtonian_total, newtonian_far))
