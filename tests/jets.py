"""Jets (value, gradient, Hessian) of rows of one pair, and what a field of vanishing tails is measured by."""

import math

import targets

from fieldsim.potentials import registry
from fieldsim.potentials.elements import pack
from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Newtonian


def row(kernel, primitive, fold=0.0):
    """The element row of one primitive of strength 1."""
    return pack([primitive], [kernel], 1.0, fold).rows[0]


def evaluate(target, pair, points, rows):
    """F (N,), gradient (N, 3) and Hessian (N, 3, 3) of element i at points[i]; pair: (kernel type, primitive type)."""
    out = targets.jets(target, [registry.FORMULAS[pair].kind] * len(points), rows, points)
    return out[:, 0], out[:, 1:4], targets.hessians(out)


def scale(kernel, area=math.inf):
    """(S, w) of the reference's README, for kernels whose tails vanish; S = 0 for the others."""
    if isinstance(kernel, Cauchy | InverseSquare | Newtonian):
        return 0.0, 1.0
    width = 2 / kernel.a if isinstance(kernel, Gaussian) else kernel.radius
    return min(area, math.pi * width**2), width
