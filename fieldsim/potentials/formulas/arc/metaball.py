"""The metaball on arcs and circles: elliptic integrals over the outer shell, clipped to the arc.

With v half the angle from the query's azimuth, d^2 = near2 + p sin^2 v, p = 4 rho R. By symmetry the arc is folded to
v in [0, pi / 2], in up to three pieces; on each, d grows, so that it meets the inner ball (d < support / 3, where h is
a parabola in d), the outer shell and the outside in turn. Odd integrands change sign with the side.

Moments are named by their powers: of sin^2 v (`s`), of sin v cos v (`sc`), over d or its powers (`_1`, `_3`).
"""

import math

from fieldsim.numerics.angles import sine_cosine
from fieldsim.numerics.constants import HALF_PI, TAU
from fieldsim.numerics.elliptic import carlson_d_pair
from fieldsim.numerics.quadrature import legendre_12
from fieldsim.numerics.sine_integrals import sine_powers
from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.arc.polynomial import middle, reach


@portable
def _plain(sin: real, cos: real, sin_half: real, cos_half: real, width: real):
    """Integrals of sin^2 v and sin v cos v over a range of given width from an angle with the given sine and cosine.

    The third and fourth result are the sine and cosine of the range's end.
    """
    turn = real(2.0) * sin_half * cos_half
    versine = real(2.0) * sin_half * sin_half
    sin_middle = sin * cos_half + cos * sin_half
    cos_middle = cos * cos_half - sin * sin_half
    second, _ = sine_powers(sin_half, cos_half, real(0.5) * width)
    squares = real(2.0) * second + turn * sin_middle * sin_middle
    return (
        squares,
        turn * sin_middle * cos_middle,
        sin * (real(1.0) - versine) + cos * turn,
        cos * (real(1.0) - versine) - sin * turn,
    )


@portable
def _quadrature(sin_c: real, cos_c: real, reach: real, near2: real, p: real):
    """Integrals of 1/d, sin^2/d, near2/d^3, sin^2/d^3, sin^4/d^3 by twelve Gauss nodes in tan((v - c) / 2).

    Over 2 atan(reach) to both sides of the middle c, of given sine and cosine.

    Exact to rounding where d varies little: see `_shell`.
    """
    one = real(0.0)
    s_1 = real(0.0)
    n_3 = real(0.0)
    s_3 = real(0.0)
    ss_3 = real(0.0)
    for k in range(6):
        node, weight = legendre_12(k)
        t = reach * node
        share = real(1.0) / (real(1.0) + t * t)
        weight *= real(2.0) * reach * share
        across = real(2.0) * t * share * cos_c
        along = (real(1.0) - t * t) * share * sin_c
        for side in range(2):
            sin = along + across
            if side == 1:
                sin = along - across
            square = sin * sin
            d2 = near2 + p * square
            inverse = weight / math.sqrt(d2)
            cubic = inverse / d2
            one += inverse
            s_1 += inverse * square
            n_3 += cubic * near2
            s_3 += cubic * square
            ss_3 += cubic * square * square
    return one, s_1, n_3, s_3, ss_3


@portable
def _shell(start: real, width: real, near2: real, p: real):
    """Moments over a piece of the outer shell, where d > 0.

    Of s and sc; of 1, s and sc over d; of near2, s, ss, sc and s sc over d^3.

    Carlson's integrals between two limits (Carlson 1988, from the sums U of products of the limits' sines and cosines)
    take the difference of two incomplete integrals without cancellation: of cos^2 / d as far2 / 3 R_D + ..., of
    sin^2 / d as near2 / 3 R_D + ...; the others follow from those.
    """
    sin, cos = sine_cosine(start)
    sin_half, cos_half = sine_cosine(real(0.5) * width)
    s, sc, sin_end, cos_end = _plain(sin, cos, sin_half, cos_half, width)
    turn = real(2.0) * sin_half * cos_half
    far2 = near2 + p
    d2_start = near2 + p * sin * sin
    d2_end = near2 + p * sin_end * sin_end
    d_start = math.sqrt(d2_start)
    d_end = math.sqrt(d2_end)
    both = d_start * d_end
    # sin^2 of the end less that of the start, = turn sin(start + end).
    rise = real(2.0) * sc
    sc_1 = rise / (d_start + d_end)
    sc_3 = sc_1 / both
    ssc_3 = sc_3 * (near2 * (sin * sin + sin_end * sin_end) + p * sin * sin * sin_end * sin_end) / (both + near2)
    # d vanishes at v = +-i asinh(near / sqrt(p)), far enough from short pieces and from all where p is small.
    middle_v = start + real(0.5) * width
    if p < real(0.25) * near2 or p * (real(1.4) * width * width - middle_v * middle_v) < real(0.5) * near2:
        one_1, s_1, n_3, s_3, ss_3 = _quadrature(
            sin * cos_half + cos * sin_half,
            cos * cos_half - sin * sin_half,
            sin_half / (real(1.0) + cos_half),
            near2,
            p,
        )
        return s, sc, one_1, s_1, sc_1, n_3, s_3, ss_3, sc_3, ssc_3
    # U, with the shortness of the range, rise, taken out.
    u1 = sin_end * cos_end * d_start + sin * cos * d_end
    u2 = sin * cos_end * d_start + sin_end * cos * d_end
    u3 = sin * cos_end * d_end + sin_end * cos * d_start
    x = (u1 / rise) * (u1 / rise)
    r_near, r_far = carlson_d_pair(x, x + near2, x + far2)
    s_1 = near2 / real(3.0) * r_near + sin * sin_end * rise / u3
    c_1 = far2 / real(3.0) * r_far + cos * cos_end * rise / u2
    # sin cos / d at the end less at the start.
    step = turn * (
        real(0.5) * (cos * cos_end - sin * sin_end) * (d_start + d_end)
        - real(0.5) * p * (rise / turn) * (rise / turn) * (cos * cos_end + sin * sin_end) / (d_start + d_end)
    )
    step /= both
    s_3 = (c_1 - step) / far2
    n_3 = s_1 + step + near2 * s_3
    ss_3 = (s_1 - near2 * s_3) / p
    return s, sc, c_1 + s_1, s_1, sc_1, n_3, s_3, ss_3, sc_3, ssc_3


@portable
def _folded(angle: real, c0: real, s0: real):
    """The arc, mirrored so that its middle lies at a positive angle: where it is cut into three pieces to fold.

    Returns the angle at which it starts, its width, what of it lies before 0 and beyond pi / 2, the sign of odd
    integrands and how often the arc counts.
    """
    v = middle(angle, c0, s0)
    side = real(1.0)
    if v < real(0.0):
        side = -side
        v = -v
    width = real(0.5) * angle
    times = real(1.0)
    if angle >= real(TAU):
        # One half of the circle, twice; what is odd vanishes.
        width = real(HALF_PI)
        v = real(0.5) * width
        times = real(2.0)
        side = real(0.0)
    low = v - real(0.5) * width
    return low, width, max(-low, real(0.0)), max(v + real(0.5) * width - real(HALF_PI), real(0.0)), side, times


@portable
def _piece(k: int, low: real, width: real, before: real, beyond: real, side: real):
    """Start, width and sign of odd integrands of the folded piece k."""
    if k == 1:
        return real(0.0), before, -side
    if k == 2:
        return real(HALF_PI) - beyond, beyond, -side
    return max(low, real(0.0)), width - before - beyond, side


@portable
def _ball(start: real, width: real):
    """Integrals of sin^2 v and sin v cos v over a piece of the inner ball."""
    sin, cos = sine_cosine(start)
    sin_half, cos_half = sine_cosine(real(0.5) * width)
    squares, products, _, _ = _plain(sin, cos, sin_half, cos_half, width)
    return squares, products


@portable
def _of_moments(
    inner: real,
    z: real,
    radius: real,
    near2: real,
    p: real,
    support: real,
    times: real,
    ball: real,
    ball_s: real,
    ball_sc: real,
    shell: real,
    s: real,
    sc: real,
    one_1: real,
    s_1: real,
    sc_1: real,
    n_3: real,
    s_3: real,
    ss_3: real,
    sc_3: real,
    ssc_3: real,
):
    """The jet from the moments over the ball and the shell; times: how often they count."""
    # The offset from a source point is (inner + 2 R sin^2, -2 R sin cos, z); both kernels' parts are summed with it.
    per = real(1.0) / support
    twice = real(2.0) * radius
    ring = times * twice
    a = real(0.0)
    b = real(0.0)
    if near2 > real(0.0):
        a = inner / math.sqrt(near2)
        b = z / math.sqrt(near2)
    # h' / r over ball and shell: scale times these.
    scale = real(3.0) * per * ring
    g = per * (shell - real(2.0) * ball) - one_1
    g_s = per * (s - real(2.0) * ball_s) - s_1
    g_sc = per * (sc - real(2.0) * ball_sc) - sc_1
    f = ball - real(3.0) * per * per * (near2 * ball + p * ball_s)
    f += real(1.5) * (shell + per * per * (near2 * shell + p * s) - real(2.0) * per * (near2 * one_1 + p * s_1))
    return (
        ring * f,
        scale * (inner * g + twice * g_s),
        -scale * twice * g_sc,
        scale * z * g,
        scale * (g + a * a * n_3 + twice * (real(2.0) * inner * s_3 + twice * ss_3)),
        scale * (g + twice * twice * (s_3 - ss_3)),
        scale * (g + b * b * n_3),
        -scale * twice * (inner * sc_3 + twice * ssc_3),
        scale * (a * b * n_3 + twice * z * s_3),
        -scale * twice * z * sc_3,
    )


@portable
def metaball_arc(
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
    """Jet for `arc_jet`. Error < 1e-14 of the peak over the part inside the support."""
    v_in = reach(rho, inner, z, radius, support / real(3.0))
    v_out = reach(rho, inner, z, radius, support)
    near2 = inner * inner + z * z
    p = real(4.0) * rho * radius
    low, width, before, beyond, side, times = _folded(angle, c0, s0)
    # Integrals over the ball (w) and the shell.
    ball = real(0.0)
    ball_s = real(0.0)
    ball_sc = real(0.0)
    shell = real(0.0)
    s = real(0.0)
    sc = real(0.0)
    one_1 = real(0.0)
    s_1 = real(0.0)
    sc_1 = real(0.0)
    n_3 = real(0.0)
    s_3 = real(0.0)
    ss_3 = real(0.0)
    sc_3 = real(0.0)
    ssc_3 = real(0.0)
    for k in range(3):
        start, piece, sign = _piece(k, low, width, before, beyond, side)
        # The pieces' cuts are offsets from the start, so that parts of the shortest arcs add up.
        inside = min(max(v_in - start, real(0.0)), piece)
        within = min(max(v_out - start, real(0.0)), piece)
        # Where all of the circle is within, so is the piece: its end on the far side is pi / 2 to rounding alone, which
        # short arcs would lose.
        if v_in >= real(HALF_PI):
            inside = piece
        if v_out >= real(HALF_PI):
            within = piece
        rest = within - inside
        if inside > real(0.0):
            squares, products = _ball(start, inside)
            ball += inside
            ball_s += squares
            ball_sc += sign * products
        if rest > real(0.0):
            m0, m1, m2, m3, m4, m5, m6, m7, m8, m9 = _shell(start + inside, rest, near2, p)
            shell += rest
            s += m0
            sc += sign * m1
            one_1 += m2
            s_1 += m3
            sc_1 += sign * m4
            n_3 += m5
            s_3 += m6
            ss_3 += m7
            sc_3 += sign * m8
            ssc_3 += sign * m9
    # fmt: off
    return _of_moments(
        inner, z, radius, near2, p, support, times,
        ball, ball_s, ball_sc, shell, s, sc, one_1, s_1, sc_1, n_3, s_3, ss_3, sc_3, ssc_3,
    )
    # fmt: on
