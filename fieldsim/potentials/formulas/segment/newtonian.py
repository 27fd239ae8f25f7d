"""Segments under the Newtonian kernel, in the coordinates of `frame`."""

import math

from fieldsim.numerics.elementary import log1p
from fieldsim.portable import portable, real


@portable
def newtonian_segment(lo: real, rho2: real, length: real, softening: real, fold: real):
    """Local derivatives for `segment_jet`, of 1/sqrt(r^2 + softening^2). Relative error < 1e-14 off the wire.

    On an unsoftened wire F is inf, the slope across 0, and the slope along that of the finite ends (0 at an end).
    """
    hi = lo + length
    d2 = rho2 + softening * softening
    r_lo = math.sqrt(lo * lo + d2)
    r_hi = math.sqrt(hi * hi + d2)
    zero = real(0.0)
    if r_lo == zero:
        return real(math.inf), zero, zero, zero, zero, zero
    both = real(1.0) / (r_lo * r_hi)
    i_lo = r_hi * both
    i_hi = r_lo * both
    along = -(length * i_lo) * ((lo + hi) * i_hi) / (r_lo + r_hi)
    squares = i_lo * i_lo + i_lo * i_hi + i_hi * i_hi
    along_along = -(lo * along) * squares - length * i_hi * i_hi * i_hi
    # What F is the logarithm of; the integral of 1 / r^3; what that of 1 / r^5 has beside terms of the ends.
    # (F by one division: of r_lo + r_hi less the length, as positive terms over a common denominator.)
    beyond_lo = r_lo + abs(lo)
    beyond_hi = r_hi + hi
    common = beyond_lo * beyond_hi
    excess = d2 * (beyond_lo + beyond_hi) + (lo + abs(lo)) * common
    # Beside the segment, and beyond its end, where differences would cancel. Divided once, not in both branches: lanes
    # go through both.
    turn = hi * i_hi - lo * i_lo
    under = d2
    share = rho2 * (real(1.0) - (lo * i_lo) * (hi * i_hi))
    of = d2
    if lo > zero:
        turn = (length * i_lo) * ((lo + hi) * i_hi)
        under = hi * r_lo + lo * r_hi
        share = (rho2 * i_lo * i_hi) * (d2 + lo * lo + hi * hi)
        of = r_lo * r_hi + lo * hi
    if under == zero:  # of d2, where no potential is needed
        return real(math.inf), along, zero, along_along, zero, zero
    across = turn / under
    rest = share / of
    ends = rho2 * i_lo * i_lo + rho2 * i_hi * i_hi
    return (
        log1p(real(2.0) * length * common / excess),
        along,
        -across,
        along_along,
        -(math.sqrt(rho2) * along) * squares,
        across * (ends + rest),
    )
