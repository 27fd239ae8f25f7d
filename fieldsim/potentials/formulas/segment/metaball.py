"""Segments under the metaball: an inner parabola and an outer shell, over the part inside the support."""

import math

from fieldsim.numerics.constants import THIRD
from fieldsim.numerics.elementary import log1p
from fieldsim.portable import portable, real


@portable
def _shell(a: real, width: real, rho2: real, radius: real):
    """A metaball's outer part 3/2 (1 - r / radius)^2 over q = a..a + width, a >= 0, but for the integral of 1 / r.

    Returns (g, F, F_q, F_qrho / rho, F_rhorho - F_rho / rho), derivatives of the integrand integrated; that integral is
    log1p(g), to be left out of F with the factor -3/2 rho2 / radius. All carry the width as a factor.
    """
    # An empty part may lie anywhere, on the source too.
    a = max(a, real(0.0))
    b = a + width
    inner = radius / real(3.0)
    r_a = max(math.sqrt(a * a + rho2), inner)
    r_b = max(math.sqrt(b * b + rho2), inner)
    twice = a + b
    both = r_a + r_b
    inverse = real(1.0) / (both * (a + r_a))
    rise = twice * ((a + r_a) * inverse)
    squares = rho2 + (a * twice + b * b) * real(THIRD)
    per = real(1.0) / radius
    bend = real(0.0)
    if width > real(0.0):
        bend = real(3.0) * per * rho2 * width * twice / (r_a * r_b * (b * r_a + a * r_b))
    return (
        width * (both + twice) * inverse,
        real(1.5) * width * (real(1.0) + per * (per * squares - real(0.5) * (both + twice * rise))),
        -real(3.0) * per * width * (rise - real(0.5) * per * twice),
        real(3.0) * per * width * rise / (r_a * r_b),
        bend,
    )


@portable
def metaball_segment(lo: real, rho2: real, length: real, radius: real, fold: real):
    """Local derivatives for `segment_jet`: inner parabola, and the outer part on either side of it.

    Error < 1e-14 of the peak over the clipped part. The cuts are offsets from the near end, so that the parts of the
    shortest segments add up.
    """
    zero = real(0.0)
    rho = math.sqrt(rho2)
    k2 = (radius - rho) * (radius + rho)
    if k2 <= zero or lo >= radius:
        return zero, zero, zero, zero, zero, zero
    third = radius / real(3.0)
    k_in = math.sqrt(max((third - rho) * (third + rho), zero))
    k_out = math.sqrt(k2)
    t1 = min(max(-k_out - lo, zero), length)
    t2 = min(max(-k_in - lo, zero), length)
    t3 = min(max(k_in - lo, zero), length)
    t4 = min(max(k_out - lo, zero), length)
    a = lo + t2
    b = lo + t3
    x, left, left_along, left_mixed, left_bend = _shell(-a, t2 - t1, rho2, radius)
    y, right, right_along, right_mixed, right_bend = _shell(b, t4 - t3, rho2, radius)
    # The integral of 1 / r over both sides.
    inverse = log1p(x + y + x * y)
    width = t3 - t2
    per = real(1.0) / radius
    drop = real(3.0) * per * per * width
    shells = real(3.0) * per * per * ((t2 - t1) + (t4 - t3))
    squares = rho2 + (a * a + a * b + b * b) * real(THIRD)
    return (
        width - drop * squares + (left + right - real(1.5) * per * rho2 * inverse),
        right_along - left_along - drop * (a + b),
        shells - real(3.0) * per * inverse - real(2.0) * drop,
        shells - left_bend - right_bend - real(2.0) * drop,
        rho * (right_mixed - left_mixed),
        left_bend + right_bend,
    )
