"""Forces and torques of the field on one body, written once for numba and for plain Python.

Two ways to feel gravity: as a sum over mass points ("points", "geoms"), which derives from its energy exactly, or at
the centre of mass with the torque of the field's gradient across the body ("torque"). Each returns (force, torque about
the centre of mass, potential energy).
"""

import functools
import math

from fieldsim.mujoco.callback.evaluate import field_at, jet_at, maker, product, turns, vectors
from fieldsim.mujoco.callback.rows import COMPENSATED


@functools.cache
def pull_at_center(native: bool):
    """Function (k, plan, views, turns) -> force at the centre of mass, gravity-gradient torque, energy.

    With the body's principal axes e_i, moments I_i and H_ij = e_i . Hessian e_j, the torque about e_1 is
    (I_3 - I_2) H_23, and so on round; the energy is -m F - sum of j_i H_ii / 2 where j_i = (I_j + I_k - I_i) / 2 is the
    sum of m r_i^2. The tide's pull on the centre of mass, smaller by (size / distance)^2, is left out, and with it the
    energy is not kept: it takes third derivatives.
    """
    jet = jet_at(native)
    turn, _ = turns(native)
    dot, _, _ = vectors(native)
    across = product(native)

    @maker(native)
    def axis(matrix, b, i):
        return matrix[b, i], matrix[b, 3 + i], matrix[b, 6 + i]

    @maker(native)
    def pull(k, plan, views, turned):
        b = plan.bodies[k]
        x = views.xipos
        share = 1.0 - plan.law[COMPENSATED] * views.gravcomp[b]
        m = share * views.mass[b]
        f, g, h = jet((x[b, 0], x[b, 1], x[b, 2]), plan.gravity, turned)
        e1, e2, e3 = axis(views.ximat, b, 0), axis(views.ximat, b, 1), axis(views.ximat, b, 2)
        i1, i2, i3 = share * views.inertia[b, 0], share * views.inertia[b, 1], share * views.inertia[b, 2]
        he2, he3 = across(h, e2), across(h, e3)
        torque = (i3 - i2) * dot(e2, he3), (i1 - i3) * dot(e1, he3), (i2 - i1) * dot(e1, he2)
        h2, h3 = dot(e2, he2), dot(e3, he3)
        h1 = h[0] + h[1] + h[2] - h2 - h3
        spread = (i2 + i3 - i1) * h1 + (i3 + i1 - i2) * h2 + (i1 + i2 - i3) * h3
        return (m * g[0], m * g[1], m * g[2]), turn(views.ximat, b, torque), -m * f - 0.25 * spread

    return pull


@functools.cache
def pull_on_points(native: bool, spread_out: bool):
    """Function (k, plan, views, turns) -> force, torque and energy, summed over the body's mass points.

    spread_out: the points' places are in units of sqrt(3 x the mean of x^2 over the mass) along each axis, as of now.
    """
    field = field_at(native)
    turn, _ = turns(native)
    _, cross, _ = vectors(native)

    @maker(native)
    def spread(views, b):
        m, i1, i2, i3 = views.mass[b], views.inertia[b, 0], views.inertia[b, 1], views.inertia[b, 2]
        if not spread_out or not m > 0.0:
            return 1.0, 1.0, 1.0
        half = 0.5 * (i1 + i2 + i3)
        return (
            math.sqrt(3.0 * max(half - i1, 0.0) / m),
            math.sqrt(3.0 * max(half - i2, 0.0) / m),
            math.sqrt(3.0 * max(half - i3, 0.0) / m),
        )

    @maker(native)
    def pull(k, plan, views, turned):
        b = plan.bodies[k]
        x = views.xipos
        sx, sy, sz = spread(views, b)
        fx, fy, fz, tx, ty, tz, u = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(plan.first_point[k], plan.first_point[k + 1]):
            m = plan.points[i, 3]
            arm = turn(views.ximat, b, (sx * plan.points[i, 0], sy * plan.points[i, 1], sz * plan.points[i, 2]))
            f, g = field((x[b, 0] + arm[0], x[b, 1] + arm[1], x[b, 2] + arm[2]), plan.gravity, turned)
            t = cross(arm, g)
            fx += m * g[0]
            fy += m * g[1]
            fz += m * g[2]
            tx += m * t[0]
            ty += m * t[1]
            tz += m * t[2]
            u -= m * f
        m = (1.0 - plan.law[COMPENSATED] * views.gravcomp[b]) * views.mass[b]
        return (m * fx, m * fy, m * fz), (m * tx, m * ty, m * tz), m * u

    return pull
