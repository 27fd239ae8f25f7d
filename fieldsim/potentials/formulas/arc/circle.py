"""Full circles, in their local invariants: distance rho from the axis, height z above the plane.

With R the radius, near2 = (rho - R)^2 + z^2 and far2 = (rho + R)^2 + z^2 are the squared distances of the wire's
nearest and farthest points. All sums below keep their digits on the axis and next to the wire. A source point seen over
the half angle v (as in `frame`) lies at the offset (inner cos^2 v + outer sin^2 v, -2 R sin v cos v, z) from the query,
with inner = rho - R, outer = rho + R; the Hessian is made of the integrals of its parts' products.
"""

import math

from fieldsim.numerics.bessel import bessel_scaled
from fieldsim.numerics.constants import TAU
from fieldsim.numerics.elliptic import elliptic_dv
from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials.formulas.axial import axial_hessian
from fieldsim.potentials.kernels.gaussian import EXPONENT_LIMIT
from fieldsim.potentials.row import FOLD, KERNEL_WIDTH, RADIUS, STRENGTH, from_center, normal_of

# Ratio of squared distances below which a bare wire may overflow what its field is made of.
CLOSEST = 1e-30


@portable
def cauchy_circle(rho: real, inner: real, z: real, radius: real, s: real, fold: real):
    """Local derivatives for `circle_jet`, of the Cauchy kernel. Relative error 2e-15.

    With q, Q = 1 + s^2 (near2, far2), the eccentric angle of `cauchy_arc` runs once round.
    """
    s2 = s * s
    outer = rho + radius
    far = real(1.0) + s2 * (outer * outer + z * z)
    r = (real(1.0) + s2 * (inner * inner + z * z)) / far
    scale = real(math.pi) * radius / (r * math.sqrt(r) * far * far)
    push = s2 / far / r * scale
    across = r + real(3.0) * r * r + real(6.0) * (real(1.0) + r) * (s2 * radius * inner / far)
    isotropic = real(3.0) + (real(2.0) + real(3.0) * r) * r
    # Integrals of the fourth powers of cos(v) and sin(v), and of both squared, over q^4; in them offsets go squared.
    cos4 = real(5.0) + r
    both = r * (real(1.0) + r)
    sin4 = r * r * (real(1.0) + real(5.0) * r)
    bend = real(3.0) * s2 / far / r
    radial = bend * (inner * inner * cos4 + outer * (real(2.0) * inner * both + outer * sin4))
    mixed = bend * z * (inner * cos4 + real(2.0) * rho * both + outer * sin4)
    return (
        scale * (real(1.0) + r),
        -real(2.0) * push * across,
        -push * z * isotropic,
        push * (radial - isotropic),
        push * (bend * z * z * (cos4 + real(2.0) * both + sin4) - isotropic),
        push * mixed,
    )


@portable
def gaussian_circle(rho: real, inner: real, z: real, radius: real, a: real, fold: real):
    """Local derivatives for `circle_jet`, of exp(fold - a^2 r^2), its exponent clamped at EXPONENT_LIMIT.

    Relative error 1e-14 of the value and of the force's scale: F = 2 pi R exp(fold - a^2 near2) I0e(2 a^2 rho R).
    """
    a2 = a * a
    i0, difference, slope = bessel_scaled(real(2.0) * a2 * rho * radius)
    top = math.exp(min(fold - a2 * (inner * inner + z * z), real(EXPONENT_LIMIT)))
    scale = real(TAU) * radius * top
    # rho I0 - R I1, over rho: well inside the circle, and elsewhere without the difference of I0 and I1.
    if rho < real(0.5) * radius:
        across = i0 - real(2.0) * a2 * radius * radius * slope
    else:
        across = (inner * i0 + radius * difference) / rho
    push = real(2.0) * a2 * scale
    # Mean squares of the offset's parts, radial and along the normal, and of their product, times 2 a^2.
    twice = real(2.0) * a2
    radial = twice * (inner * inner * i0 + radius * (real(2.0) * rho * difference - radius * slope))
    mixed = twice * z * (inner * i0 + radius * difference)
    return (
        scale * i0,
        -push * across,
        -push * i0 * z,
        push * (radial - i0),
        push * (twice * z * z * i0 - i0),
        push * mixed,
    )


@portable
def newtonian_circle(rho: real, inner: real, z: real, radius: real, softening: real, fold: real):
    """Local derivatives for `circle_jet`, of 1/sqrt(r^2 + softening^2). Relative error 5e-15.

    F = 4 R K / far; with the integrals D and V of `elliptic_dv` the attraction is a sum without cancellation, where the
    usual form in K and E divides by rho and takes a difference. On a bare wire F is inf and the derivatives are 0, as
    they are where they overflow next to it.
    """
    outer = rho + radius
    height2 = z * z + softening * softening
    near2 = inner * inner + height2
    root = real(1.0) / math.sqrt(outer * outer + height2)
    inverse = root * root
    m1 = near2 * inverse
    scale = real(4.0) * radius * root
    push = scale / near2
    if m1 < real(CLOSEST):
        zero = real(0.0)
        if m1 == zero:
            return real(math.inf), zero, zero, zero, zero, zero
        if not math.isfinite(push):
            push = zero
    d, v = elliptic_dv(min(m1, real(1.0)))
    m_v = real(4.0) * radius * rho * inverse * v
    m1_d = m1 * d
    across = real(2.0) * radius * inner * inverse * v + m1_d
    isotropic = m_v + real(2.0) * m1_d
    # Three times the integrals of the fourth powers of cos(v) and sin(v), and of both squared, over d^5, in the units
    # of `push`: the mirrored argument (DLMF 22.4) makes them those of cn^4, sn^4, sn^2 cn^2, which are B - V/3, D - V/3
    # and V/3. The first goes with squares of offsets that are at most near2.
    cos4 = real(3.0) * (m_v + m1_d) - v
    sin4 = real(3.0) * m1_d - m1 * v
    radial = inner * inner / near2 * cos4 + inverse * outer * (real(2.0) * inner * v + outer * sin4)
    mixed = inner * z / near2 * cos4 + inverse * z * (real(2.0) * rho * v + outer * sin4)
    return (
        scale * (m_v + d + m1_d),
        -real(2.0) * push * across,
        -push * z * isotropic,
        push * (radial - isotropic),
        push * (z * z / near2 * cos4 + inverse * z * z * (real(2.0) * v + sin4) - isotropic),
        push * mixed,
    )


@portable
def inverse_square_circle(rho: real, inner: real, z: real, radius: real, softening: real, fold: real):
    """Local derivatives for `circle_jet`. Relative error 1e-14 off the wire, as `inverse_square_arc`, t being pi.

    On a bare wire F is inf and the derivatives are 0, as they are where they overflow next to it.
    """
    outer = rho + radius
    height2 = z * z + softening * softening
    near2 = inner * inner + height2
    if near2 == real(0.0):
        zero = real(0.0)
        return real(math.inf), zero, zero, zero, zero, zero
    i_near = real(1.0) / near2
    i_far = real(1.0) / (outer * outer + height2)
    f = real(math.pi) * real(2.0) * radius * math.sqrt(i_near) * math.sqrt(i_far)
    across = -real(2.0) * f * ((inner * outer + height2) * i_near * i_far)
    isotropic = -f * (i_near + i_far)
    # Squares of offsets, which are at most near2, with the fourth power of the cosine.
    a = inner * i_near
    b = z * i_near
    c = outer * i_far
    d = z * i_far
    radial = f * (real(3.0) * a * a + real(2.0) * a * c + real(3.0) * c * c)
    along = f * (real(3.0) * b * b + real(2.0) * b * d + real(3.0) * d * d)
    mixed = f * (real(3.0) * a * b + a * d + b * c + real(3.0) * c * d)
    if not abs(across + radial + along + isotropic) < real(math.inf):
        zero = real(0.0)
        return f, zero, zero, zero, zero, zero
    return f, across, z * isotropic, isotropic + radial, isotropic + along, mixed


kernel = hole("rho, inner, z, radius, width, fold")
offset = hole("x, y, z, rows, i, rho, height")


@portable
def circle_jet(x: real, y: real, z: real, rows: Table, i: int):
    """Jet of a circle.

    `kernel(rho, inner, z, radius, width, fold)`, inner = rho - radius, returns (F, F_rho / rho, F_z, F_rhorho, F_zz,
    F_rhoz): divided by rho, the slope needs no direction on the axis.
    """
    radius = rows[i, RADIUS]
    nx, ny, nz = normal_of(rows, i)
    wx, wy, wz = from_center(x, y, z, rows, i)
    height = wx * nx + wy * ny + wz * nz
    wx -= height * nx
    wy -= height * ny
    wz -= height * nz
    rho = math.sqrt(wx * wx + wy * wy + wz * wz)
    inner, height = offset(x, y, z, rows, i, rho, height)
    f, across, along, radial, along_along, mixed = kernel(
        rho, inner, height, radius, rows[i, KERNEL_WIDTH], rows[i, FOLD]
    )
    f *= rows[i, STRENGTH]
    across *= rows[i, STRENGTH]
    along *= rows[i, STRENGTH]
    gx = across * wx + along * nx
    gy = across * wy + along * ny
    gz = across * wz + along * nz
    # The Hessian is `across` in all directions, what it has more along the radius and the normal, and the mixed rest.
    bend = radial * rows[i, STRENGTH] - across
    lift = along_along * rows[i, STRENGTH] - across
    mixed *= rows[i, STRENGTH]
    xx, yy, zz, xy, xz, yz = axial_hessian(across, lift, mixed, bend, nx, ny, nz, wx, wy, wz, rho)
    return f, gx, gy, gz, xx, yy, zz, xy, xz, yz
