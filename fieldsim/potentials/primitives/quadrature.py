"""Gauss's rules on the simplices that primitives are: segments, triangles, tetrahedra."""

import math

import numpy as np

from fieldsim.numerics.quadrature import gauss_legendre


def simplex(corners, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3) and weights (n,), of sum 1, in the simplex of d + 1 corners: Gauss's rule in Duffy's coordinates.

    Also the first coordinate u of each point, which runs from 0 at the first corner to 1 opposite it.
    """
    corners = np.array(corners)
    nodes, weights = gauss_legendre(count)
    points, shares, reach, first = corners[:1], np.ones(1), np.ones(1), np.zeros(1)
    dimension = len(corners) - 1
    for k in range(1, dimension + 1):
        u = np.tile(nodes, len(points))
        reach = np.repeat(reach, count) * u
        points = np.repeat(points, count, axis=0) + reach[:, None] * (corners[k] - corners[k - 1])
        power = dimension - k
        shares = np.repeat(shares, count) * np.tile(weights, len(shares)) * (power + 1) * u**power
        first = u if k == 1 else np.repeat(first, count)
    return points, shares, first


def simplex_needed(corners, clearance: float, digits: float) -> float:
    """Nodes along a simplex that give its pull on what is `clearance` away to exp(-digits), relative."""
    longest = max(math.dist(p, q) for p in corners for q in corners)
    return interval_needed(clearance / (0.5 * longest), digits)


def interval_needed(away: float, digits: float) -> float:
    """Gauss nodes on -1..1 for exp(-digits), for an integrand whose singularity is at i `away`.

    n nodes err by rho^(-2n), rho = the half axes' sum of the largest ellipse around the interval that meets nothing
    singular (Trefethen 2008).
    """
    return digits / (2.0 * math.asinh(away))
