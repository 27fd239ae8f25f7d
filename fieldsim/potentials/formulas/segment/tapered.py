"""Segments whose density changes evenly from end to end: a tapered cigar.

In the coordinates of `frame` (q outward from the end nearer to the query point, covering lo..lo + length), with
density w_near there and w_far at the other end,

    F = w_near S + (w_far - w_near) / length * M,     S = integral of h dq,     M = integral of (q - lo) h dq,

and for the Newtonian kernel M = r_far - r_near - lo S. From afar these cancel, and 8 Gauss-Legendre nodes are exact.
"""

import math

from fieldsim.numerics.quadrature import unit_legendre_8
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.formulas.axial import axial_hessian
from fieldsim.potentials.formulas.segment.frame import beside_line
from fieldsim.potentials.formulas.segment.newtonian import newtonian_segment
from fieldsim.potentials.row import END_DENSITY, END_X, KERNEL_WIDTH, LENGTH, START_DENSITY, START_X, STRENGTH, axis_of


@portable
def _far(lo: real, rho2: real, length: real, d2: real, w_near: real, w_far: real):
    """What `newtonian_tapered` returns, from 8 nodes."""
    rho = math.sqrt(rho2)
    f = real(0.0)
    along = real(0.0)
    across = real(0.0)
    along_along = real(0.0)
    mixed = real(0.0)
    bend = real(0.0)
    for k in range(8):
        s, weight = unit_legendre_8(k)
        q = lo + s * length
        i_r = real(1.0) / math.sqrt(q * q + d2)
        term = weight * length * (w_near + s * (w_far - w_near)) * i_r
        f += term
        # Offsets in units of the distance.
        term *= i_r
        a = q * i_r
        b = rho * i_r
        along -= term * a
        term *= i_r
        across -= term
        along_along += term * (real(3.0) * a * a - real(1.0))
        mixed += real(3.0) * term * a * b
        bend += real(3.0) * term * b * b
    return f, along, across, along_along, mixed, bend


@portable
def newtonian_tapered(lo: real, rho2: real, length: real, softening: real, w_near: real, w_far: real):
    """(F, F_lo, F_rho / rho, F_lolo, F_lorho, F_rhorho - F_rho / rho); relative error < 1e-13 off the wire.

    On a bare wire F is inf, the slope across 0 and that along what the ends give; F is finite at an end of density 0.
    """
    d2 = rho2 + softening * softening
    hi = lo + length
    r_lo = math.sqrt(lo * lo + d2)
    r_hi = math.sqrt(hi * hi + d2)
    if length < real(0.125) * (r_lo + r_hi):
        return _far(lo, rho2, length, d2, w_near, w_far)
    steep = (w_far - w_near) / length
    f, along, across, along_along, mixed, bend = newtonian_segment(lo, rho2, length, softening, real(0.0))
    zero = real(0.0)
    if f == real(math.inf):
        if r_lo == zero and w_near == zero:
            return steep * length, zero, zero, zero, zero, zero
        return f, w_near * along, zero, w_near * along_along, zero, zero
    i_lo = real(1.0) / r_lo
    i_hi = real(1.0) / r_hi
    rho = math.sqrt(rho2)
    rise = length * ((lo + hi) / (r_lo + r_hi))
    reach = length * i_hi
    steps = i_lo * (rise * i_hi)
    moment = rise - lo * f
    moment_across = -(steps + lo * across)
    cubes = steps * (i_lo * i_lo + i_lo * i_hi + i_hi * i_hi)
    return (
        w_near * f + steep * moment,
        w_near * along + steep * (reach - f),
        w_near * across + steep * moment_across,
        w_near * along_along - steep * (reach * hi * i_hi * i_hi + along),
        w_near * mixed - steep * (rho * (reach * i_hi * i_hi + across)),
        w_near * bend + steep * (rho2 * cubes - lo * bend),
    )


@portable
def tapered_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a tapered segment; placed as in `segment_jet`, knowing which end is near."""
    length = rows[i, LENGTH]
    ux, uy, uz = axis_of(rows, i)
    out, lo, wx, wy, wz, rho2 = beside_line(x, y, z, rows, i, START_X, END_X, ux, uy, uz, length)
    w_near = rows[i, START_DENSITY]
    w_far = rows[i, END_DENSITY]
    if out > real(0.0):
        w_near = rows[i, END_DENSITY]
        w_far = rows[i, START_DENSITY]
    f, slope, across, slope_slope, mixed, bend = newtonian_tapered(
        lo, rho2, length, rows[i, KERNEL_WIDTH], w_near, w_far
    )
    strength = rows[i, STRENGTH]
    slope *= out * strength
    across *= strength
    mixed *= out * strength
    bend *= strength
    # As in `segment_jet`: what overflows next to a bare wire counts as 0 as on it, and the Hessian is `across` in all
    # directions, and the rest.
    if not abs(slope + across) < real(math.inf):
        slope = real(0.0)
        across = real(0.0)
    lift = slope_slope * strength - across
    if not abs(lift + mixed + bend) < real(math.inf):
        lift = real(0.0)
        mixed = real(0.0)
        bend = real(0.0)
    gx = slope * ux + across * wx
    gy = slope * uy + across * wy
    gz = slope * uz + across * wz
    rho = math.sqrt(rho2)
    xx, yy, zz, xy, xz, yz = axial_hessian(across, lift, mixed, bend, ux, uy, uz, wx, wy, wz, rho)
    return strength * f, gx, gy, gz, xx, yy, zz, xy, xz, yz
