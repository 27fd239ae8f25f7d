"""Segments under the Gaussian, in the coordinates of `frame`."""

import math

from fieldsim.numerics.error_functions import erfcx
from fieldsim.numerics.quadrature import legendre_8
from fieldsim.portable import portable, real
from fieldsim.potentials.kernels.gaussian import EXPONENT_LIMIT

HALF_SQRT_PI = math.sqrt(math.pi) / 2

# Below this width in units of 1/a a Gaussian segment is integrated by eight Gauss-Legendre nodes, exact to rounding.
SHORT = 0.5

# Squares of scaled distances are clamped here where they multiply a Gaussian that has long vanished (0 inf is NaN).
FAR = 1e30


@portable
def _short_gaussian(lo: real, width: real, exponent: real):
    """Integrals of exp(exponent - q^2) and of its derivative over q = lo..lo + width, width <= SHORT."""
    f = real(0.0)
    slope = real(0.0)
    half = real(0.5) * width
    for k in range(4):
        node, weight = legendre_8(k)
        near = lo + half * (real(1.0) - node)
        far = lo + half * (real(1.0) + node)
        h_near = half * weight * math.exp(min(exponent - near * near, real(EXPONENT_LIMIT)))
        h_far = half * weight * math.exp(min(exponent - far * far, real(EXPONENT_LIMIT)))
        f += h_near + h_far
        slope -= real(2.0) * (near * h_near + far * h_far)
    return f, slope


@portable
def gaussian_segment(lo: real, rho2: real, length: real, a: real, fold: real):
    """Local derivatives for `segment_jet`, of exp(fold - a^2 r^2), its exponent clamped at EXPONENT_LIMIT.

    Error < 1e-14 of F plus 1e-16 of the peak. Beyond the end erfc(lo) - erfc(hi) is taken in scaled form, so that a
    large fold and a vanishing erfc meet as one exponent.
    """
    q_lo = a * lo
    width = a * length
    q_hi = q_lo + width
    exponent = fold - a * a * rho2
    if width < real(SHORT):
        f, slope = _short_gaussian(q_lo, width, exponent)
        far = math.exp(min(exponent - q_hi * q_hi, real(EXPONENT_LIMIT)))
        return _gaussian_jet(lo, rho2, length, a, f / a, slope, far)
    drop = math.exp(-width * (q_lo + q_hi))
    end = math.exp(min(exponent - q_lo * q_lo, real(EXPONENT_LIMIT)))
    if q_lo > real(0.0):
        f = end * (erfcx(q_lo) - drop * erfcx(q_hi))
    else:
        f = math.exp(min(exponent, real(EXPONENT_LIMIT))) * (math.erf(q_hi) + math.erf(-q_lo))
    f *= real(HALF_SQRT_PI) / a
    return _gaussian_jet(lo, rho2, length, a, f, end * (drop - real(1.0)), end * drop)


@portable
def _gaussian_jet(lo: real, rho2: real, length: real, a: real, f: real, along: real, far: real):
    """Local derivatives of a Gaussian segment from F, dF/dlo and h at the far end."""
    a2 = a * a
    across = -real(2.0) * a2 * f
    return (
        f,
        along,
        across,
        -real(2.0) * a2 * (lo * along + length * far),
        -real(2.0) * a2 * math.sqrt(rho2) * along,
        -real(2.0) * across * min(a2 * rho2, real(FAR)),
    )
