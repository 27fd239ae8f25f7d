"""Kernels of compact support on segments: integrals over the part of the segment inside the support.

Because these kernels vanish at the support's edge with their first derivative, F's first and second derivatives are the
integrals of the kernel's over the same clipped part, without terms from its moving ends.
"""

import math

from fieldsim.portable import portable, real
from fieldsim.potentials.cells import register_jet
from fieldsim.potentials.compact import quartic, soft_object
from fieldsim.potentials.kernels import Metaball, Quartic, SoftObject
from fieldsim.potentials.segment import Segment, segment_jet
from fieldsim.potentials.special import log1p


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
    # The support's part of the line: |q| < k.
    k2 = (radius - rho) * (radius + rho)
    if k2 <= real(0.0):
        return f, along, across, along_along, mixed, bend
    k = math.sqrt(k2)
    start = max(lo, -k)
    half = real(0.5) * (min(lo + length, k) - start)
    if lo >= -k and lo + length <= k:
        half = real(0.5) * length
    if half <= real(0.0):
        return f, along, across, along_along, mixed, bend
    per = real(1.0) / radius
    middle = (start + half) * per
    half *= per
    k2 = k2 * per * per
    rho *= per
    for j in range(4):
        node = real(0.33998104358485626)
        weight = real(0.6521451548625461)
        if j >= 2:
            node = real(0.8611363115940526)
            weight = real(0.34785484513745385)
        if j == 1 or j == 3:
            node = -node
        q = middle + half * node
        h, slope, curve = profile(k2 - q * q)  # noqa: F821 - bound below
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


@portable
def _shell(a: real, width: real, rho2: real, radius: real):
    """A metaball's outer part 3/2 (1 - r / radius)^2 over q = a..a + width, a >= 0, r > 0.

    Returns (F, F_q, F_rho / rho, F_qq, F_qrho / rho, F_rhorho - F_rho / rho), derivatives of the integrand integrated;
    the integrals of r, 1 / r and 1 / r^3 all carry the width as a factor.
    """
    if width <= real(0.0):
        return real(0.0), real(0.0), real(0.0), real(0.0), real(0.0), real(0.0)
    b = a + width
    r_a = math.sqrt(a * a + rho2)
    r_b = math.sqrt(b * b + rho2)
    twice = a + b
    rise = twice / (r_a + r_b)
    inverse = log1p(width * (real(1.0) + rise) / (a + r_a))
    first = real(0.25) * width * (r_a + r_b + twice * rise) + real(0.5) * rho2 * inverse
    cubic = rho2 * width * twice / (r_a * r_b * (b * r_a + a * r_b))
    squares = width * (rho2 + (a * a + a * b + b * b) / real(3.0))
    per = real(1.0) / radius
    across = real(3.0) * per * (width * per - inverse)
    bend = real(3.0) * per * cubic
    return (
        real(1.5) * (width + per * (per * squares - real(2.0) * first)),
        -real(3.0) * per * width * (rise - real(0.5) * per * twice),
        across,
        real(3.0) * per * per * width - bend,
        real(3.0) * per * width * rise / (r_a * r_b),
        bend,
    )


@portable
def metaball_segment(lo: real, rho2: real, length: real, radius: real, fold: real):
    """Local derivatives for `segment_jet`: inner parabola, and the outer part on either side of it.

    Error < 1e-14 of the peak over the clipped part. The cuts are offsets from the near end, so that the parts of the
    shortest segments add up.
    """
    third = radius / real(3.0)
    rho = math.sqrt(rho2)
    k_in = math.sqrt(max((third - rho) * (third + rho), real(0.0)))
    k_out = math.sqrt(max((radius - rho) * (radius + rho), real(0.0)))
    t1 = min(max(-k_out - lo, real(0.0)), length)
    t2 = min(max(-k_in - lo, real(0.0)), length)
    t3 = min(max(k_in - lo, real(0.0)), length)
    t4 = min(max(k_out - lo, real(0.0)), length)
    left, left_along, left_across, left_twice, left_mixed, left_bend = _shell(-(lo + t2), t2 - t1, rho2, radius)
    right, right_along, right_across, right_twice, right_mixed, right_bend = _shell(lo + t3, t4 - t3, rho2, radius)
    width = t3 - t2
    a = lo + t2
    b = lo + t3
    per = real(1.0) / radius
    drop = real(3.0) * per * per * width
    squares = rho2 + (a * a + a * b + b * b) / real(3.0)
    return (
        width - drop * squares + left + right,
        right_along - left_along - drop * (a + b),
        left_across + right_across - real(2.0) * drop,
        left_twice + right_twice - real(2.0) * drop,
        rho * (right_mixed - left_mixed),
        left_bend + right_bend,
    )


register_jet(SoftObject, Segment, segment_jet.bind(kernel=_polynomial_segment.bind(profile=soft_object)))
register_jet(Quartic, Segment, segment_jet.bind(kernel=_polynomial_segment.bind(profile=quartic)))
register_jet(Metaball, Segment, segment_jet.bind(kernel=metaball_segment))
