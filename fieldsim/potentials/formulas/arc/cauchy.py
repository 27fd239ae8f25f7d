"""Arcs under the Cauchy kernel; notation as in `frame`."""

from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.arc.powers import arc_powers


@portable
def cauchy_arc(
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
    s: real,
    fold: real,
):
    """Jet of the Cauchy kernel, in the frame of `arc_jet`. Relative error < 1e-13.

    Its integrals are `arc_powers` with 1 + s^2 (near2, far2) in the place of near2 and far2.
    """
    s2 = s * s
    outer = rho + radius
    near = real(1.0) + s2 * (inner * inner + z * z)
    far = real(1.0) + s2 * (outer * outer + z * z)
    per = real(1.0) / far
    inverse = far / near
    m = near * per
    _cosine, _sine, _cc, _ss, h0, h1, _one, cos2, sin2, swing, cos4, both, sin4, cos6 = arc_powers(
        m, inverse, c0, s0, c1, s1, turn
    )
    scale = real(2.0) * radius * per * per
    push = -real(4.0) * s2 * per * scale
    swing *= -radius * push
    # The force's integrals are over d^6, with a factor m, those that the Hessian has beside them over d^8, with m^2.
    push *= inverse
    both *= m
    sin4 *= m
    along = cos4 + real(2.0) * both + sin4
    cos4_sin2 = m * (cos4 - cos6)
    cos2_sin4 = m * (both - cos4_sin2)
    sin6 = m * (sin4 - cos2_sin4)
    near_near = cos6 + cos4_sin2
    near_far = cos4_sin2 + cos2_sin4
    far_far = cos2_sin4 + sin6
    bend = -real(6.0) * s2 * per * inverse
    radial = inner * inner * near_near + outer * (real(2.0) * inner * near_far + outer * far_far)
    mixed = inner * near_near + real(2.0) * rho * near_far + outer * far_far
    height = near_near + real(2.0) * near_far + far_far
    t0 = h0 * (real(2.0) * h0 + h1)
    t1 = h1 * (real(2.0) * h1 + h0)
    twist = -real(2.0) * s2 * per * swing
    return (
        scale * (cos2 + sin2),
        push * (inner * cos4 + real(2.0) * rho * both + outer * sin4),
        swing * (h0 + h1),
        push * z * along,
        push * (along + bend * radial),
        push * (along + bend * real(4.0) * radius * radius * near_far),
        push * (along + bend * z * z * height),
        twist * (inner * (c0 * c0 * t0 + c1 * c1 * t1) + outer * (s0 * s0 * t0 + s1 * s1 * t1)),
        push * bend * z * mixed,
        twist * z * (t0 + t1),
    )
