"""Segments under the inverse-square kernel, in the coordinates of `frame`."""

import math

from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.segment.inverse_powers import inverse_powers


@portable
def inverse_square_segment(lo: real, rho2: real, length: real, softening: real, fold: real):
    """Local derivatives for `segment_jet`. Relative error < 1e-14 off the wire.

    On a bare wire F is inf and the derivatives are 0.
    """
    hi = lo + length
    d2 = rho2 + softening * softening
    if lo * lo + d2 == real(0.0) or (d2 == real(0.0) and lo <= real(0.0)):
        return real(math.inf), real(0.0), real(0.0), real(0.0), real(0.0), real(0.0)
    root, ends, far, one, two, three, _four = inverse_powers(lo, length, d2)
    along = -(length * root) * ((lo + hi) * root)
    along_along = -real(2.0) * (lo * along * ends + length * far * far)
    mixed = -real(2.0) * math.sqrt(rho2) * along * ends
    return one, along, -real(2.0) * two, along_along, mixed, real(8.0) * rho2 * three
