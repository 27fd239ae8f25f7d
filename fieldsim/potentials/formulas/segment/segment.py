"""Straight segments, in their local invariants.

With q the coordinate along the segment, counted outward from the end nearer to the query point, the segment covers
q = lo..hi as seen from the point, hi = lo + length, and rho2 is the squared distance from its line:

    F = integral from lo to hi of h(sqrt(q^2 + rho2)) dq,        dF/dlo = h(hi) - h(lo) exactly.

Because the near end is the origin, |lo| <= hi, and every form below is a sum of positive terms beyond the end (lo > 0),
where differences of antiderivatives would cancel.
"""

import math

from fieldsim.numerics.compensated import half_digits, split_at, two_difference
from fieldsim.numerics.elementary import log1p
from fieldsim.numerics.error_functions import erfcx
from fieldsim.numerics.quadrature import legendre_8
from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials.formulas.segment.inverse_powers import inverse_powers
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.kernels.gaussian import EXPONENT_LIMIT
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.registry import register
from fieldsim.potentials.row import END_X, FOLD, KERNEL_WIDTH, LENGTH, START_X, STRENGTH, axis_of

HALF_SQRT_PI = math.sqrt(math.pi) / 2
# Below this width in units of 1/a a Gaussian segment is integrated by eight Gauss-Legendre nodes, exact to rounding.
SHORT = 0.5
# Squares of scaled distances are clamped here where they multiply a Gaussian that has long vanished (0 inf is NaN).
FAR = 1e30
# Closer to the line than 0.1 of the distance along it (squared), the offset across is computed with care.
CLOSE = 1e-2


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
    i_lo = real(1.0) / r_lo
    i_hi = real(1.0) / r_hi
    along = -(length * i_lo) * ((lo + hi) * i_hi) / (r_lo + r_hi)
    squares = i_lo * i_lo + i_lo * i_hi + i_hi * i_hi
    along_along = -(lo * along) * squares - length * i_hi * i_hi * i_hi
    # What F is the logarithm of; the integral of 1 / r^3; what that of 1 / r^5 has beside terms of the ends.
    # (F by one division: of r_lo + r_hi less the length, as positive terms over a common denominator.)
    beyond_lo = r_lo + abs(lo)
    beyond_hi = r_hi + hi
    common = beyond_lo * beyond_hi
    excess = d2 * (beyond_lo + beyond_hi) + (lo + abs(lo)) * common
    if lo > zero:
        across = (length * i_lo) * ((lo + hi) * i_hi) / (hi * r_lo + lo * r_hi)
        rest = (rho2 * i_lo * i_hi) * (d2 + lo * lo + hi * hi) / (r_lo * r_hi + lo * hi)
    else:
        if d2 == zero:  # asked of d2, for who needs no potential
            return real(math.inf), along, zero, along_along, zero, zero
        across = (hi * i_hi - lo * i_lo) / d2
        rest = (rho2 / d2) * (real(1.0) - (lo * i_lo) * (hi * i_hi))
    ends = rho2 * i_lo * i_lo + rho2 * i_hi * i_hi
    return (
        log1p(real(2.0) * length * common / excess),
        along,
        -across,
        along_along,
        -(math.sqrt(rho2) * along) * squares,
        across * (ends + rest),
    )


@portable
def _remainder(p: real, near: real, far: real, t_high: real, t_low: real, grid: real):
    """(p - near) - t (far - near) with an error of 2^-79 (float32: 2^-35) of the segment, in one coordinate.

    Differences carry their rounding errors along; t and the edge are split so that the leading product is exact. (Only
    sums and exact products are relied on: a compiler may fuse them.)
    """
    d, d_error = two_difference(p, near)
    e, e_error = two_difference(far, near)
    e_high, e_low = split_at(e, grid)
    rest = d_error - (t_high + t_low) * e_error - t_low * e_low
    return ((d - t_high * e_high) - t_high * e_low) - t_low * e_high + rest


@portable
def beside_line(
    x: real, y: real, z: real, rows: Table, i: int, start: int, end: int, ux: real, uy: real, uz: real, length: real
):
    """(out, lo, wx, wy, wz, rho2): the coordinates of `segment` for the line between two positions of row i.

    start, end: their first columns; (ux, uy, uz): the direction between them. out: 1 where the end is the nearer one,
    -1 where the start is; lo: along, outward from it; w: offset from the line, of square rho2.
    """
    # Offsets from both ends, and those from the nearer one, so that points close to either keep their digits.
    out = -real(1.0)
    wx = x - rows[i, start]
    wy = y - rows[i, start + 1]
    wz = z - rows[i, start + 2]
    along = wx * ux + wy * uy + wz * uz
    lo = -along
    fx = x - rows[i, end]
    fy = y - rows[i, end + 1]
    fz = z - rows[i, end + 2]
    beyond = fx * ux + fy * uy + fz * uz
    if along + beyond > real(0.0):
        out = real(1.0)
        wx = fx
        wy = fy
        wz = fz
        along = beyond
        lo = beyond
    wx -= along * ux
    wy -= along * uy
    wz -= along * uz
    rho2 = wx * wx + wy * wy + wz * wz
    if rho2 < real(CLOSE) * (lo * lo):
        # Close to the line what is left of the offset is mostly rounding; once more, with care.
        near = start
        far = end
        if out > real(0.0):
            near = end
            far = start
        t = -lo / length
        t_high, t_low = split_at(t, half_digits())
        grid = real(2.0) * half_digits() * length
        wx = _remainder(x, rows[i, near], rows[i, far], t_high, t_low, grid)
        wy = _remainder(y, rows[i, near + 1], rows[i, far + 1], t_high, t_low, grid)
        wz = _remainder(z, rows[i, near + 2], rows[i, far + 2], t_high, t_low, grid)
        along = wx * ux + wy * uy + wz * uz
        wx -= along * ux
        wy -= along * uy
        wz -= along * uz
        rho2 = wx * wx + wy * wy + wz * wz
    return out, lo, wx, wy, wz, rho2


kernel = hole("lo, rho2, length, width, fold")


@portable
def segment_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a segment, in the coordinates of `segment`: lo along, rho across.

    `kernel(lo, rho2, length, width, fold)` returns (F, F_lo, F_rho / rho, F_lolo, F_lorho, F_rhorho - F_rho / rho).
    """
    length = rows[i, LENGTH]
    ux, uy, uz = axis_of(rows, i)
    out, lo, wx, wy, wz, rho2 = beside_line(x, y, z, rows, i, START_X, END_X, ux, uy, uz, length)
    f, slope, across, slope_slope, mixed, bend = kernel(lo, rho2, length, rows[i, KERNEL_WIDTH], rows[i, FOLD])
    f *= rows[i, STRENGTH]
    slope *= out * rows[i, STRENGTH]
    across *= rows[i, STRENGTH]
    mixed *= out * rows[i, STRENGTH]
    bend *= rows[i, STRENGTH]
    if not abs(slope + across) < real(math.inf):
        slope = real(0.0)
        across = real(0.0)
    gx = slope * ux + across * wx
    gy = slope * uy + across * wy
    gz = slope * uz + across * wz
    # The Hessian is `across` in all directions, what it has more along, and the rest with the offset from the line.
    lift = slope_slope * rows[i, STRENGTH] - across
    if not abs(lift + mixed + bend) < real(math.inf):
        across = real(0.0)
        lift = real(0.0)
        mixed = real(0.0)
        bend = real(0.0)
    rho = math.sqrt(rho2)
    if rho > real(0.0):
        wx /= rho
        wy /= rho
        wz /= rho
    return (
        f,
        gx,
        gy,
        gz,
        across + lift * ux * ux + real(2.0) * mixed * ux * wx + bend * wx * wx,
        across + lift * uy * uy + real(2.0) * mixed * uy * wy + bend * wy * wy,
        across + lift * uz * uz + real(2.0) * mixed * uz * wz + bend * wz * wz,
        lift * ux * uy + mixed * (ux * wy + uy * wx) + bend * wx * wy,
        lift * ux * uz + mixed * (ux * wz + uz * wx) + bend * wx * wz,
        lift * uy * uz + mixed * (uy * wz + uz * wy) + bend * wy * wz,
    )


for _kernel, _local in ((Cauchy, cauchy_segment), (Gaussian, gaussian_segment), (Newtonian, newtonian_segment)):
    register(_kernel, Segment, segment_jet.bind(kernel=_local))
