"""The free rigid body, solved exactly: its angular momentum in the body's frame and its rotation, after any time.

With m the angular momentum in the principal frame, a1 >= a2 >= a3 the inverse moments and G = |m|, Euler's equations
m' = m x (a m) are solved by Jacobi's elliptic functions. Written with S = sn(lambda t) / lambda, where

    S'^2 = (1 - P S^2) (1 - N S^2),    P = (a2 - a3) ((a1 - a3) m3^2 + (a1 - a2) m2^2),
                                       N = (a1 - a2) ((a1 - a3) m1^2 + (a2 - a3) m2^2),

the addition theorems give m(t) from m(0) without a division by anything that can vanish: symmetric tops (P N = 0),
spheres (P = N = 0) and the separatrix (P = N) are no special cases. (Jacobi 1849; Celledoni, Fasso, Safstrom & Zanna
2008, whose form of the rotation angle psi about m is used: its integrand is smooth where Euler's angles are not.)
"""

import math

from fieldsim.numerics.elliptic import jacobi_functions
from fieldsim.numerics.quadrature import unit_legendre_6
from fieldsim.portable import portable, real

# lambda t of a panel: there `jacobi_functions` and the Gauss-Legendre rule of 6 nodes are exact to rounding, because
# nothing is singular within pi / 2 of the real axis.
PANEL = 0.25


@portable
def _turned(m1: real, m2: real, m3: real, a12: real, a23: real, a13: real, p: real, n: real, t: real):
    """The angular momentum a time t later; a12 = a1 - a2 and so on."""
    s, c, d = jacobi_functions(t, p, n)
    scale = real(1.0) / (real(1.0) - a12 * a23 * m2 * m2 * s * s)
    return (
        (m1 * c - a23 * s * d * m2 * m3) * scale,
        (m2 * c * d + a13 * s * m1 * m3) * scale,
        (m3 * d - a12 * s * c * m1 * m2) * scale,
    )


@portable
def _onto(x: real, y: real, z: real, first: bool, sign: real):
    """Unit quaternion (w, x, y, z) of the least turn that takes a unit vector onto `sign` times axis 1 or axis 3."""
    zero = real(0.0)
    w = real(1.0) + sign * z
    qx = sign * y
    qy = -sign * x
    qz = zero
    if first:
        w = real(1.0) + sign * x
        qx = zero
        qy = sign * z
        qz = -sign * y
    scale = real(1.0) / math.sqrt(w * w + qx * qx + qy * qy + qz * qz)
    return w * scale, qx * scale, qy * scale, qz * scale


@portable
def free_rotor(m1: real, m2: real, m3: real, a1: real, a2: real, a3: real, t: real):
    """A free body after a time t: (m1, m2, m3, w, x, y, z).

    m: angular momentum in the principal frame, at the start and, returned, at the end; a1 >= a2 >= a3 >= 0: inverse
    principal moments. (w, x, y, z): the turn Q within the body's frame, R(t) = R(0) Q, so that Q m(t) = m(0).
    Errors of rounding, for any t; the cost grows with t times the rate of nutation.
    """
    g = math.sqrt(m1 * m1 + m2 * m2 + m3 * m3)
    if g == real(0.0):
        return m1, m2, m3, real(1.0), real(0.0), real(0.0), real(0.0)
    a12 = a1 - a2
    a23 = a2 - a3
    a13 = a1 - a3
    # Which of the axes 1 and 3 the angular momentum circles: its component there keeps its sign.
    first = a12 * m1 * m1 > a23 * m3 * m3
    axis = m3
    a = a3
    lack = a13 * m1 * m1 + a23 * m2 * m2
    if first:
        axis = m1
        a = a1
        lack = -(a12 * m2 * m2 + a13 * m3 * m3)
    sign = math.copysign(real(1.0), axis)
    v0, v1, v2, v3 = _onto(m1 / g, m2 / g, m3 / g, first, sign)
    rate = math.sqrt(max(a23 * (a13 * m3 * m3 + a12 * m2 * m2), a12 * (a13 * m1 * m1 + a23 * m2 * m2)))
    panels = max(int(math.ceil(rate * abs(t) / real(PANEL))), 1)  # noqa: RUF046 - a float to Warp
    h = t / real(panels)
    waited = real(0.0)
    for _ in range(panels):
        # Constants, but those of what rounding has made of m: else its errors would grow near the separatrix.
        p = a23 * (a13 * m3 * m3 + a12 * m2 * m2)
        n = a12 * (a13 * m1 * m1 + a23 * m2 * m2)
        for k in range(6):
            place, weight = unit_legendre_6(k)
            n1, _n2, n3 = _turned(m1, m2, m3, a12, a23, a13, p, n, place * h)
            along = sign * n3
            if first:
                along = sign * n1
            waited += weight / (g + along)
        m1, m2, m3 = _turned(m1, m2, m3, a12, a23, a13, p, n, h)
    half = real(0.5) * (a * g * t + lack * (waited * h))
    c = math.cos(half)
    s = sign * math.sin(half)
    size = math.sqrt(m1 * m1 + m2 * m2 + m3 * m3)
    u0, u1, u2, u3 = _onto(m1 / size, m2 / size, m3 / size, first, sign)
    # The turn about the axis, and then the least turn at the end: only one of its components 1 and 3 is not zero.
    s1 = real(0.0)
    s3 = s
    if first:
        s1 = s
        s3 = real(0.0)
    w = c * u0 - s1 * u1 - s3 * u3
    x = c * u1 + s1 * u0 - s3 * u2
    y = c * u2 + s3 * u1 - s1 * u3
    z = c * u3 + s3 * u0 + s1 * u2
    return (
        m1,
        m2,
        m3,
        v0 * w + v1 * x + v2 * y + v3 * z,
        v0 * x - v1 * w - v2 * z + v3 * y,
        v0 * y - v2 * w - v3 * x + v1 * z,
        v0 * z - v3 * w - v1 * y + v2 * x,
    )
