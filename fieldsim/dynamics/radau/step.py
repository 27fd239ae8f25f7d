"""One step of the 15th-order Gauss-Radau method, as Warp functions.

All seven nodes are evaluated with the same iterate of the path, so that the seven evaluations are independent and a
processor overlaps them; the iteration converges as fast as one from node to node. Positions at the nodes are kept and
corrected, so that a sweep costs little beside the field.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics.radau import tables
from fieldsim.dynamics.radau.tables import ORDER, Series
from fieldsim.numerics.running_sums import exactly_added, product_rest
from fieldsim.sources.field import field_at
from fieldsim.sources.stages import Stages

SWEEPS = wp.constant(12)
STAGES = wp.constant(ORDER + 1)
# A sweep is the last if the next would change the path's end by less than this part of h^2 a.
SETTLED = wp.constant(wp.float64(1e-18))
# If it has not converged to this, the step is too long; else the rest is the rounding of the field.
UNSETTLED = wp.constant(wp.float64(1e-6))
# A step may be so many times longer than the one before, or shorter by as much without being taken again.
CHANGE = wp.constant(wp.float64(4.0))
# Beyond this ratio of steps the last step's polynomial is no prediction for the next.
EXTRAPOLATION = wp.constant(wp.float64(20.0))
# b_6 of a smooth motion is about (h / tau)^7 a over 7!: FACTORIAL. KINK: so many times longer steps than it suggests
# may be taken. NOISY: what rounding makes of it, in units of the noise of positions.
FACTORIAL = wp.constant(wp.float64(5040.0))
SEVENTH = wp.constant(wp.float64(1.0 / 7.0))
KINK = wp.constant(wp.float64(3.0))
NOISY = wp.constant(wp.float64(1e4))
TINY = wp.constant(wp.float64(1e-300))

_Matrix = wp.types.matrix(shape=(ORDER, ORDER), dtype=wp.float64)
_Vector = wp.types.vector(length=ORDER, dtype=wp.float64)


def _matrix(values):
    return wp.constant(_Matrix(*np.ravel(values)))


POWERS = _matrix(tables.POWERS)
BACK = _matrix(tables.BACK)
DIVIDE = _matrix(tables.DIVIDE)
OFFSETS = _matrix(tables.OFFSETS)
BINOMIALS = _matrix(tables.BINOMIALS)
SPEED = wp.constant(_Vector(*tables.SPEED))
SPEED_REST = wp.constant(_Vector(*tables.SPEED_REST))
WAY = wp.constant(_Vector(*tables.WAY))
NODES = wp.constant(_Vector(*tables.STEP_NODES))
# s^(k+1) differentiated at s = 1 once, twice and three times.
FIRST = wp.constant(_Vector(*(float(k + 1) for k in range(ORDER))))
SECOND = wp.constant(_Vector(*(float((k + 1) * k) for k in range(ORDER))))
THIRD = wp.constant(_Vector(*(float((k + 1) * k * (k - 1)) for k in range(ORDER))))


@wp.func
def continued(b: Series, q: wp.float64):
    """The powers of the last step's polynomial on the next step, q times as long."""
    result = Series()
    factor = wp.float64(1.0)
    for k in range(ORDER):
        factor = factor * q
        u = b[k]
        for j in range(k + 1, ORDER):
            u = u + BINOMIALS[k, j] * b[j]
        result[k] = factor * u
    return result


@wp.func
def shortened(b: Series, q: wp.float64):
    """The powers of the same polynomial on the first part q of its step."""
    factor = wp.float64(1.0)
    for k in range(ORDER):
        factor = factor * q
        b[k] = factor * b[k]
    return b


@wp.func
def in_newton_form(b: Series):
    """The coefficients g of b."""
    g = Series()
    for j in range(ORDER):
        u = b[j]
        for k in range(j + 1, ORDER):
            u = u + BACK[k, j] * b[k]
        g[j] = u
    return g


@wp.func
def in_powers(g: Series):
    """The powers b of g."""
    b = Series()
    for j in range(ORDER):
        u = g[j]
        for k in range(j + 1, ORDER):
            u = u + POWERS[k, j] * g[k]
        b[j] = u
    return b


@wp.func
def node_offsets(v: wp.vec3d, rest: wp.vec3d, a0: wp.vec3d, g: Series, h: wp.float64):
    """Positions of the nodes relative to the start."""
    d = Series()
    for m in range(ORDER):
        u = (wp.float64(0.5) * NODES[m] * NODES[m]) * a0
        for k in range(ORDER):
            u = u + OFFSETS[m, k] * g[k]
        d[m] = rest + (NODES[m] * h) * v + (h * h) * u
    return d


@wp.func
def largest(v: wp.vec3d):
    """The largest component, NaN if one is NaN."""
    return wp.where(wp.length_sq(v) >= wp.float64(0.0), wp.max(wp.abs(v)), wp.length_sq(v))


@functools.cache
def settled_path(kinds_used):
    """Warp function (x, a0, d, g, h, gravity, stage) -> (g, pull, whether it converged, sweeps).

    d: the nodes' offsets that belong to the guess g. stage: that of the step's start; those of the nodes follow it.
    pull: accelerations at the nodes, less a0.
    """
    field = field_at(kinds_used)

    @wp.func
    def settled(x: wp.vec3d, a0: wp.vec3d, d: Series, g: Series, h: wp.float64, gravity: Stages, stage: int):
        h2 = h * h
        sweeps = wp.int32(0)
        last = wp.float64(wp.inf)
        good = wp.int32(0)
        pull = Series()
        for sweep in range(SWEEPS + 0 * stage):
            for n in range(ORDER):
                _f, a = field(x + d[n], gravity, stage + n + 1)
                pull[n] = a - a0
            change = Series()
            for n in range(ORDER):
                u = DIVIDE[n, 0] * pull[n]
                for k in range(n):
                    u = DIVIDE[n, k + 1] * (u - g[k])
                change[n] = u - g[n]
                g[n] = u
            moved = wp.vec3d()
            for m in range(ORDER):
                moved = OFFSETS[m, 0] * change[0]
                for n in range(1, ORDER):
                    moved = moved + OFFSETS[m, n] * change[n]
                d[m] = d[m] + h2 * moved
            sweeps += 1
            size = largest(a0) + largest(pull[ORDER - 1])
            error = largest(moved)
            if sweep > 0:
                # Estimated change by the next sweep, from the convergence so far, which rounding ends.
                if error * error <= SETTLED * size * last or (sweep > 1 and error >= last):
                    good = wp.where(error <= UNSETTLED * size, 1, 0)
                    break
            elif error <= SETTLED * size:
                good = wp.int32(1)
                break
            last = error
        return g, pull, good, sweeps

    return settled


@wp.func
def lengthening(a0: wp.vec3d, b: Series, noise: wp.float64):
    """The time in which the acceleration changes, in steps, from its derivatives a, j, s, c at the step's end.

    The longer of two: 2 a^2 / (j^2 + a s) of Pham, Rein & Spiegel 2024 (eq. 16), which vanishes where the acceleration
    passes zero, as in a ring's hole, so that steps would never get there; and Aarseth's (a s + j^2) / (j c + s^2),
    which does not. Both are squares of times. Where the last power is far larger than they promise, the field has a
    kink, and that power itself, Everhart's measure, finds the steps that it takes.
    noise: accelerations too small to move anything by a rounding error.
    """
    a = a0
    first = wp.vec3d()
    second = wp.vec3d()
    third = wp.vec3d()
    for k in range(ORDER):
        a = a + b[k]
        first = first + FIRST[k] * b[k]
        second = second + SECOND[k] * b[k]
        third = third + THIRD[k] * b[k]
    force = wp.length(a)
    jerk = wp.length(first)
    snap = wp.length(second)
    by_force = wp.float64(2.0) * force * force / wp.max(jerk * jerk + force * snap, TINY)
    below = jerk * wp.length(third) + snap * snap
    by_jerk = wp.float64(wp.inf)
    if below != wp.float64(0.0):
        by_jerk = (force * snap + jerk * jerk + noise * noise) / below
    tau = wp.sqrt(wp.max(by_force, by_jerk))
    rough = wp.length(b[ORDER - 1]) - NOISY * noise
    if rough > wp.float64(0.0):
        scale = wp.max(force, wp.length(a0)) / (FACTORIAL * rough)
        tau = wp.min(tau, KINK * wp.pow(scale, SEVENTH))
    return tau


@wp.func
def travelled(v: wp.vec3d, v_rest: wp.vec3d, a0: wp.vec3d, pull: Series, h: wp.float64):
    """How far a step of length h leads beside the rounded h v, and the change of velocity as a large and a small part.

    pull: accelerations at the nodes less a0. The weights carry their rounding errors: these would pull one way at each
    step, and show after a thousand orbits.
    """
    dx = wp.float64(0.5) * a0
    dv = wp.vec3d()
    for k in range(ORDER):
        dx = dx + WAY[k] * pull[k]
        dv = dv + SPEED_REST[k] * pull[k]
    for k in range(ORDER):
        dv = dv + SPEED[k] * pull[k]
    a, rest = exactly_added(a0, wp.vec3d(), dv)
    return h * (h * dx + v_rest) + product_rest(h, v), h * a, h * rest + product_rest(h, a)
