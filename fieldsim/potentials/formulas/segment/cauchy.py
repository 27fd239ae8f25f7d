"""Segments under the Cauchy kernel, in the coordinates of `frame`."""

import math

from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.segment.inverse_powers import inverse_powers


@portable
def cauchy_segment(lo: real, rho2: real, length: real, s: real, fold: real):
    """Local derivatives for `segment_jet`, of the Cauchy kernel.

    Relative error < 1e-13, also far beyond the ends. Sherstyuk 1999, eq. 2.21, with both arctangents combined.
    """
    c2 = real(1.0) + s * s * rho2
    width = s * length
    # With q in units of 1/s; the ends' h is then the square of the integrand's.
    root, ends, far, _one, two, three, four = inverse_powers(s * lo, width, c2)
    step = width * (s * lo + (s * lo + width)) * root * root
    per2 = real(4.0) * s * s
    step3 = per2 * step * (ends * ends - root * root)
    return (
        two * (real(1.0) / s),
        -step * ends,
        -real(4.0) * s * three,
        lo * step3 - per2 * length * far * far * far,
        math.sqrt(rho2) * step3,
        real(6.0) * s * (per2 * rho2) * four,
    )
