"""Triangles under the Newtonian kernel, edge by edge; interfaces as in `edges`.

F = sum d S - w Omega, w^2 = z^2 + softening^2, Omega the solid angle at height w.
"""

import math

from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.segment.newtonian import newtonian_segment
from fieldsim.potentials.formulas.triangle.cubature import points_a_side
from fieldsim.potentials.formulas.triangle.edges import angles, triangle_formula
from fieldsim.potentials.formulas.triangle.frame import FAR
from fieldsim.potentials.kernels import Newtonian


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


newtonian_triangle_jet = triangle_formula(Newtonian, newtonian_edge, newtonian_total, newtonian_far)
