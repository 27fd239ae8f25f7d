"""What each kernel adds to a triangle, edge by edge.

`edge(d, lo, length, z, k, fold, outside)` takes the signed distance d of the foot of the perpendicular to the edge's
line (positive inside), the edge's range lo..lo + length along it, counted outward from its nearer end, the height z,
and how far outside the triangle the foot lies (not positive inside). It returns the segment's (F, F_lo, F_(rho^2)) and
four terms to be summed over the edges; `total` makes (F, F_z, F_zz) of the sums and the trace of the in-plane
Hessian.
"""

import math

from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.triangle.cubature import far_away
from fieldsim.potentials.formulas.triangle.frame import near_by, triangle_jet


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
def nowhere(away: real, size: real, k: real):
    """A kernel that never vanishes."""
    return False


def triangle_formula(kernel, edge, total, points, is_gone=nowhere):
    """The jet of a triangle under a kernel, from its parts."""
    return triangle_jet.bind(
        points=points,
        is_gone=is_gone,
        distant=far_away(kernel.law),
        closed_form=near_by.bind(edge=edge, total=total),
    )
