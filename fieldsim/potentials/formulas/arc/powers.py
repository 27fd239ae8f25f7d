"""Integrals over an arc of powers of 1 / d^2: what rational kernels on arcs are made of (notation as in `frame`).

With m = near2 / far2 and all lengths in units of sqrt(far2), d^2 = m cos^2 v + sin^2 v, and the eccentric angle
tan(psi) = tan(v) / sqrt(m) makes dv / d^2 = dpsi / sqrt(m), cos^2 v / d^2 = cos^2 psi / m and sin^2 v / d^2 =
sin^2 psi. So integrals of even powers of cos v and sin v over that power of d and one more d^2 are those of even powers
of cos(psi) and sin(psi). In the range t of psi and the products of the ends' cosines and sines, they come down to the
integrals of sin^2, sin^4 and sin^6 from 0 to t. As in `segment.inverse_powers`, each of these follows from the
next by a sum of positive terms, without an arctangent and, up to a branchless choice beyond a right angle, without a
case; none is lost as m -> 0.
"""

import math

from fieldsim.numerics.constants import HALF_PI, THIRD, TWO_THIRDS
from fieldsim.numerics.sine_integrals import sixth_power
from fieldsim.portable import portable, real


@portable
def arc_powers(m: real, inverse: real, c0: real, s0: real, c1: real, s1: real, turn: real):
    """Integrals over v, each with a relative error < 1e-14.

    inverse: 1 / m, read only where cos(t) < 0; undefined at an end of the arc (d = 0 there).
    Returns cos(t), sin(t) / sqrt(m), the products of the ends' cosines and sines over d0 d1, and 1 / d0^2, 1 / d1^2;
    then the integrals of 1 over d^2; of cos^2, sin^2 and cos sin over d^4; of m cos^4, cos^2 sin^2 and sin^4 over d^6;
    and that of m^2 cos^6 over d^8.
    """
    e0 = m * c0 * c0 + s0 * s0
    e1 = m * c1 * c1 + s1 * s1
    h0 = real(1.0) / e0
    h1 = real(1.0) / e1
    d0 = math.sqrt(e0)
    d1 = math.sqrt(e1)
    # Divisions wait for no root and no other division where a product can: 1 / (d0 d1), tan(t / 2) / sqrt(m).
    root = (d0 * h0) * (d1 * h1)
    dot = m * c0 * c1 + s0 * s1
    halving = turn / (d0 * d1 + abs(dot))
    # Beyond a right angle the supplement, taken from the half turn's pi / sqrt(m) and so on.
    beyond = real(0.0)
    if dot < real(0.0):
        halving = -halving
        beyond = inverse
    cc = c0 * c1 * root
    ss = s0 * s1 * root
    sine = turn * root
    cosine = dot * root
    square = sine * sine
    sine2 = m * square
    # Six times the integral of sin^6, five times that of sin^4, ..., without powers of `sine`.
    beside = sine * cosine
    six = halving * sixth_power(m * halving * halving)
    five = sine2 * six + beside
    three = real(0.8) * sine2 * five + beside
    half_turn = real(HALF_PI) * math.sqrt(beyond)
    half_turn3 = half_turn * beyond
    # Of sin^2 and of sin^4 over m^(3/2).
    second = half_turn3 + real(THIRD) * square * three
    fourth = real(0.75) * half_turn3 + real(0.2) * sine2 * square * five
    step = (s0 * c1 + c0 * s1) * root
    lift = cc * cosine + square
    cos4 = m * cc * sine * lift + fourth
    cos6 = real(0.625) * half_turn3 + square * sine2 * sine2 * six / real(6.0)
    cos6 += m * m * cc * sine * (lift * lift - real(THIRD) * sine2 * cc * cc)
    return (
        cosine,
        sine,
        cc,
        ss,
        h0,
        h1,
        real(2.0) * half_turn + (real(TWO_THIRDS) * sine2 * three + beside),
        cc * sine + second,
        ss * sine + m * second,
        real(0.5) * sine * step,
        cos4,
        real(0.25) * (second + beside * step * step),
        ss * sine * (ss * cosine + sine2) + m * fourth,
        cos6,
    )
