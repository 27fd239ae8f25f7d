"""Polynomial kernels of compact support on arcs and circles: integrals over the parts of the arc inside the support.

w = 1 - d^2 / R^2 is linear in the cosine and sine of the angle y from the middle of such a part. Odd powers of sin y
integrate to nothing, even ones are powers of the versine c = 1 - cos y, whose integrals carry all digits. The support's
edge adds no terms (as on segments). An arc that leaves the support may come back with its other end: two parts.
"""

import math

from fieldsim.numerics.angles import arctangent, sine_cosine
from fieldsim.numerics.constants import HALF_PI, TAU
from fieldsim.numerics.sine_integrals import sine_powers, sine_sixth
from fieldsim.portable import hole, portable, real


@portable
def reach(rho: real, inner: real, z: real, radius: real, support: real):
    """Half angle v in [0, pi / 2] at which a circle leaves the support: 0 all outside, pi / 2 all inside."""
    near = math.sqrt(inner * inner + z * z)
    outer = rho + radius
    far = math.sqrt(outer * outer + z * z)
    if near >= support:
        return real(0.0)
    if far <= support:
        return real(HALF_PI)
    return arctangent(math.sqrt((support - near) * (support + near)), math.sqrt((far - support) * (far + support)))


@portable
def middle(angle: real, c0: real, s0: real):
    """Half the angle from the query's azimuth to an arc's middle, in [-pi / 2, pi / 2]; 0 for a full circle."""
    if angle >= real(TAU):
        return real(0.0)
    # v0 without its turn by pi, so that a start close by on either side keeps its digits.
    if c0 < real(0.0):
        c0 = -c0
        s0 = -s0
    v = math.copysign(arctangent(abs(s0), c0), s0) + real(0.25) * angle
    if v > real(HALF_PI):
        v -= real(math.pi)
    return v


# h = SQUARE w^2 + CUBE w^3.
SQUARE = hole()
CUBE = hole()


@portable
def _part(rho: real, inner: real, z: real, radius: real, support: real, mid: real, half: real):
    """Jet of the part mid - half .. mid + half (angles from the query's azimuth), in the frame of `arc_jet`."""
    sin_mid, cos_mid = sine_cosine(real(0.5) * mid)
    dip = real(2.0) * sin_mid * sin_mid
    cos = real(1.0) - dip
    sin = real(2.0) * sin_mid * cos_mid
    # Offset of the query from the middle, in the frame of the middle's radius: across (u), along the tangent (v), z.
    # From the source at y it is (u + radius c, v - radius sin y, z).
    u = inner - rho * dip
    v = -rho * sin
    per = real(1.0) / support
    a = real(1.0) - ((u * per) * (u * per) + (v * per) * (v * per) + (z * per) * (z * per))
    bend = real(2.0) * (rho * per) * (radius * per)
    b = bend * cos
    s = bend * sin
    # w = a - b c - s sin y. Integrals of powers of c, then of sin^2 y = c (2 - c) and c sin^2 y.
    sin_quarter, cos_quarter = sine_cosine(real(0.5) * half)
    second, fourth = sine_powers(sin_quarter, cos_quarter, real(0.5) * half)
    q0 = real(2.0) * half
    q1 = real(8.0) * second
    q2 = real(16.0) * fourth
    q3 = real(32.0) * sine_sixth(sin_quarter, cos_quarter, fourth)
    p1 = real(2.0) * q1 - q2
    p2 = real(2.0) * q2 - q3
    # Integrals of w, w c, ... and of w^2, w^2 c, w^2 sin y, w^3.
    w = a * q0 - b * q1
    w_c = a * q1 - b * q2
    w_cc = a * q2 - b * q3
    w_s = -s * p1
    w_cs = -s * p2
    w_ss = a * p1 - b * p2
    ww = a * w - b * w_c + s * s * p1
    ww_c = a * w_c - b * w_cc + s * s * p2
    ww_s = -real(2.0) * s * w_ss
    www = a * (a * w - b * w_c) - b * (a * w_c - b * w_cc) + real(3.0) * s * s * w_ss
    # h = SQUARE w^2 + CUBE w^3.
    two = real(2.0) * real(SQUARE)
    three = real(3.0) * real(CUBE)
    six = real(6.0) * real(CUBE)
    g = two * w + three * ww
    g_c = two * w_c + three * ww_c
    g_s = two * w_s + three * ww_s
    k = two * q0 + six * w
    k_c = two * q1 + six * w_c
    k_s = six * w_s
    k_cs = six * w_cs
    push = -real(2.0) * radius * per * per
    pull = -real(2.0) * per * per * push
    # In the frame of the middle.
    fu = push * (u * g + radius * g_c)
    fv = push * (v * g - radius * g_s)
    fz = push * z * g
    isotropic = push * g
    fuu = pull * (u * (u * k + real(2.0) * radius * k_c) + radius * radius * (two * q2 + six * w_cc))
    fvv = pull * (v * (v * k - real(2.0) * radius * k_s) + radius * radius * (two * p1 + six * w_ss))
    fuv = pull * (u * (v * k - radius * k_s) + radius * (v * k_c - radius * k_cs))
    fuz = pull * z * (u * k + radius * k_c)
    fvz = pull * z * (v * k - radius * k_s)
    return (
        radius * (real(SQUARE) * ww + real(CUBE) * www),
        cos * fu - sin * fv,
        sin * fu + cos * fv,
        fz,
        isotropic + cos * cos * fuu - real(2.0) * cos * sin * fuv + sin * sin * fvv,
        isotropic + sin * sin * fuu + real(2.0) * cos * sin * fuv + cos * cos * fvv,
        isotropic + pull * z * z * k,
        cos * sin * (fuu - fvv) + (cos * cos - sin * sin) * fuv,
        cos * fuz - sin * fvz,
        sin * fuz + cos * fvz,
    )


part = hole("rho, inner, z, radius, support, mid, half")


@portable
def _polynomial_arc(
    rho: real,
    inner: real,
    z: real,
    radius: real,
    angle: real,
    c0: real,
    s0: real,
    c1: real,
    s1: real,
    turn: real,
    versine: real,
    support: real,
    fold: real,
):
    """Jet for `arc_jet`, of h = SQUARE w^2 + CUBE w^3. Error < 1e-14 of the peak over the part inside."""
    f = real(0.0)
    fa = real(0.0)
    fb = real(0.0)
    fn = real(0.0)
    faa = real(0.0)
    fbb = real(0.0)
    fnn = real(0.0)
    fab = real(0.0)
    fan = real(0.0)
    fbn = real(0.0)
    edge = real(2.0) * reach(rho, inner, z, radius, support)
    mid = real(2.0) * middle(angle, c0, s0)
    # Mirrored, so that the middle lies at a positive angle.
    side = real(1.0)
    if mid < real(0.0):
        side = -side
        mid = -mid
    low = mid - real(0.5) * angle
    high = mid + real(0.5) * angle
    for k in range(2):
        part_mid = mid
        part_half = real(0.5) * angle
        if k == 1:
            # The other end of the arc, back inside from the far side.
            part_half = real(0.5) * (edge - real(TAU) + high)
            part_mid = part_half - edge
            if edge >= real(math.pi):
                part_half = real(0.0)
        elif edge < real(math.pi) and (low < -edge or high > edge):
            part_half = real(0.5) * (min(high, edge) - max(low, -edge))
            part_mid = real(0.5) * (min(high, edge) + max(low, -edge))
        if part_half > real(0.0):
            g, ga, gb, gn, gaa, gbb, gnn, gab, gan, gbn = part(rho, inner, z, radius, support, part_mid, part_half)
            f += g
            fa += ga
            fb += gb
            fn += gn
            faa += gaa
            fbb += gbb
            fnn += gnn
            fab += gab
            fan += gan
            fbn += gbn
    return f, fa, side * fb, fn, faa, fbb, fnn, side * fab, fan, side * fbn


def polynomial_arc(kernel):
    """The jet for `arc_jet` under a kernel that is a polynomial."""
    square, cube = kernel.coefficients()
    return _polynomial_arc.bind(part=_part.bind(SQUARE=square, CUBE=cube))
