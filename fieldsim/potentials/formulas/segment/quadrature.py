"""Segments under any smooth kernel of compact support, by quadrature of its law.

Because such a kernel vanishes at its radius with its first derivative, F's derivatives are the integrals of the
kernel's over the part of the segment within the radius, without terms of that part's ends (see `segment.polynomial`).
"""

import math

from fieldsim.errors import InputError
from fieldsim.numerics.quadrature import legendre_16
from fieldsim.portable import hole, portable, real
from fieldsim.potentials.formulas.segment.frame import segment_jet
from fieldsim.potentials.formulas.segment.polynomial import chord
from fieldsim.potentials.kernels import Kernel
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.registry import register

law = hole("r2, width, fold, times")


@portable
def _segment(lo: real, rho2: real, length: real, radius: real, fold: real):
    """Local derivatives for `segment_jet`."""
    f = real(0.0)
    along = real(0.0)
    across = real(0.0)
    along_along = real(0.0)
    mixed = real(0.0)
    bend = real(0.0)
    rho = math.sqrt(rho2)
    start, half, _k2 = chord(lo, rho, length, radius)
    if half <= real(0.0):
        return f, along, across, along_along, mixed, bend
    # Sixteen nodes are exact for laws that are polynomials in r^2 of degree 15.
    for j in range(16):
        node, weight = legendre_16(min(j, 15 - j))
        if j > 7:
            node = -node
        q = start + half + half * node
        h, slope, curve = law(q * q + rho2, radius, fold, real(1.0))
        f += weight * h
        along += weight * q * slope
        across += weight * slope
        along_along += weight * (slope + real(2.0) * q * q * curve)
        mixed += weight * q * curve
        bend += weight * curve
    twice = real(2.0) * half
    return (
        half * f,
        twice * along,
        twice * across,
        twice * along_along,
        real(2.0) * twice * rho * mixed,
        real(2.0) * twice * rho2 * bend,
    )


def register_segments(kernel: type[Kernel]) -> None:
    """Enter segments under a compact kernel into the registry, by quadrature of its law.

    Its law must be smooth within its radius. Raises InputError for a kernel that does not end.
    """
    if not kernel.compact:
        raise InputError(
            f"{kernel.__name__} has no end, which the quadrature on segments needs; derive it from Compact, or "
            "register a closed form on Segment"
        )
    local = _segment.bind(law=kernel.law)
    register(kernel, Segment, segment_jet.bind(kernel=local))
