"""Segments under the quartic and the soft object's kernel: integrals over the part of the segment inside the support.

Because these kernels vanish at the support's edge with their first derivative, F's first and second derivatives are the
integrals of the kernel's over the same clipped part, without terms from its moving ends.
"""

import math

from fieldsim.numerics.quadrature import legendre_4
from fieldsim.portable import hole, portable, real

# The kernel as a polynomial in w = 1 - r^2 / radius^2, with its first two derivatives.
profile = hole("w")


@portable
def chord(lo: real, rho: real, length: real, radius: real):
    """(start, half, k2): what of a segment lies within `radius` of a point at the distance rho from its line.

    start: the near end of that part, as lo; half: half its length, 0 or less for none; k2: the square of half the part
    of the whole line. Nothing cancels, also at the edge.
    """
    k2 = (radius - rho) * (radius + rho)
    if k2 <= real(0.0):
        return lo, real(0.0), k2
    k = math.sqrt(k2)
    start = max(lo, -k)
    half = real(0.5) * (min(lo + length, k) - start)
    if lo >= -k and lo + length <= k:
        half = real(0.5) * length
    return start, half, k2


@portable
def _polynomial_segment(lo: real, rho2: real, length: real, radius: real, fold: real):
    """Local derivatives for `segment_jet`, of a polynomial in r^2 of degree <= 3: four Gauss nodes are exact.

    All terms of F are positive; no cancellation inside, outside or at the edge of the support.
    """
    f = real(0.0)
    along = real(0.0)
    across = real(0.0)
    along_along = real(0.0)
    mixed = real(0.0)
    bend = real(0.0)
    rho = math.sqrt(rho2)
    start, half, k2 = chord(lo, rho, length, radius)
    if half <= real(0.0):
        return f, along, across, along_along, mixed, bend
    per = real(1.0) / radius
    middle = (start + half) * per
    half *= per
    k2 = k2 * per * per
    rho *= per
    for j in range(2):
        node, weight = legendre_4(j)
        for side in range(2):
            q = middle + half * node
            if side == 1:
                q = middle - half * node
            h, slope, curve = profile(k2 - q * q)
            f += weight * h
            along -= weight * q * slope
            across -= weight * slope
            along_along += weight * (real(2.0) * q * q * curve - slope)
            mixed += weight * q * curve
            bend += weight * curve
    half_per = real(2.0) * half * per
    return (
        half * radius * f,
        real(2.0) * half * along,
        half_per * across,
        half_per * along_along,
        real(2.0) * half_per * rho * mixed,
        real(2.0) * half_per * rho * rho * bend,
    )


def polynomial_segment(kernel):
    """The local derivatives for `segment_jet` under a kernel that is a polynomial."""
    return _polynomial_segment.bind(profile=kernel.profile)
