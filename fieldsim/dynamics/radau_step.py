"""One step of the 15th-order Gauss-Radau method, as Warp functions.

All seven nodes are evaluated with the same guess of the path, which leaves seven evaluations in a row that do not wait
for each other: a processor overlaps them, and the sweep converges as fast as one from node to node. Positions at the
nodes are carried along and corrected, so that a sweep costs little beside the field.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics import radau_tables as tables
from fieldsim.dynamics.radau_tables import ORDER, Series
from fieldsim.dynamics.sources import Stages, field_at

SWEEPS = wp.constant(12)
STAGES = wp.constant(ORDER + 1)
# A sweep is the last where the next would change the path's end by less than this part of h^2 a.
SETTLED = wp.constant(wp.float64(1e-16))
# Without settling so far, the step is too long; with it, what is left is the rounding of the field.
UNSETTLED = wp.constant(wp.float64(1e-6))
# A step may be so many times longer than the one before, or shorter by as much without being taken again.
CHANGE = wp.constant(wp.float64(4.0))
# The last step's polynomial is of no use for one so many times longer.
EXTRAPOLATION = wp.constant(wp.float64(20.0))

_Matrix = wp.types.matrix(shape=(ORDER, ORDER), dtype=wp.float64)
_Vector = wp.types.vector(length=ORDER, dtype=wp.float64)


def _matrix(values):
    return wp.constant(_Matrix(*np.ravel(values)))


POWERS = _matrix(tables.POWERS)
BACK = _matrix(tables.BACK)
DIVIDE = _matrix(tables.DIVIDE)
OFFSETS = _matrix(tables.OFFSETS)
BINOMIALS = _matrix(tables.BINOMIALS)
OFFSET_END = wp.constant(_Vector(*tables.OFFSET_END))
SPEED_END = wp.constant(_Vector(*tables.SPEED_END))
NODES = wp.constant(_Vector(*tables.STEP_NODES))
# b_k s^(k+1) integrated once and twice, and differentiated at s = 1 once, twice and three times.
ONCE = wp.constant(_Vector(*(1.0 / (k + 2) for k in range(ORDER))))
TWICE = wp.constant(_Vector(*(1.0 / ((k + 2) * (k + 3)) for k in range(ORDER))))
FIRST = wp.constant(_Vector(*(float(k + 1) for k in range(ORDER))))
SECOND = wp.constant(_Vector(*(float((k + 1) * k) for k in range(ORDER))))
THIRD = wp.constant(_Vector(*(float((k + 1) * k * (k - 1)) for k in range(ORDER))))


@wp.func
def added(x: wp.vec3d, rest: wp.vec3d, change: wp.vec3d):
    """x + rest + change as a rounded sum and what it lacks (Knuth's two-sum)."""
    y = change + rest
    total = x + y
    part = total - x
    return total, (x - (total - part)) + (y - part)


@wp.func
def added(x: wp.float64, rest: wp.float64, change: wp.float64):  # noqa: F811 - Warp chooses by type
    """The same for a number."""
    y = change + rest
    total = x + y
    part = total - x
    return total, (x - (total - part)) + (y - part)


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
def in_newton_form(b: Series):
    """g of b."""
    g = Series()
    for j in range(ORDER):
        u = b[j]
        for k in range(j + 1, ORDER):
            u = u + BACK[k, j] * b[k]
        g[j] = u
    return g


@wp.func
def in_powers(g: Series):
    """b of g."""
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
    """Warp function (x, a0, d, g, h, gravity, stage) -> (g, whether it settled, sweeps).

    d: the nodes' offsets that belong to the guess g. stage: that of the step's start; those of the nodes follow it.
    """
    field = field_at(kinds_used)

    @wp.func
    def settled(x: wp.vec3d, a0: wp.vec3d, d: Series, g: Series, h: wp.float64, gravity: Stages, stage: int):
        h2 = h * h
        sweeps = wp.int32(0)
        last = wp.float64(wp.inf)
        good = wp.int32(0)
        for sweep in range(SWEEPS + 0 * stage):
            pull = Series()
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
                # What the next sweep would change, from the pace so far; rounding makes an end to all progress.
                if error * error <= SETTLED * size * last or (sweep > 1 and error >= last):
                    good = wp.where(error <= UNSETTLED * size, 1, 0)
                    break
            elif error <= SETTLED * size:
                good = wp.int32(1)
                break
            last = error
        return g, good, sweeps

    return settled


@wp.func
def lengthening(a0: wp.vec3d, b: Series, noise: wp.float64):
    """The time in which the acceleration changes, in steps, from its derivatives at the step's end.

    tau^2 = (|a| |a''| + |a'|^2) / (|a'| |a'''| + |a''|^2), of the kind that Pham, Rein & Spiegel 2024 use; theirs
    divides |a|^2 by (|a'|^2 + |a| |a''|), and so vanishes where the acceleration passes zero, as in a hole of a ring.
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
    jerk = wp.length(first)
    snap = wp.length(second)
    above = wp.length(a) * snap + jerk * jerk + noise * noise
    below = jerk * wp.length(third) + snap * snap
    # A NaN compares as false, and stays one.
    return wp.where(below == wp.float64(0.0), wp.float64(wp.inf), wp.sqrt(above / below))


@wp.func
def along(x: wp.vec3d, v: wp.vec3d, a0: wp.vec3d, b: Series, h: wp.float64, s: wp.float64):
    """Position and velocity at the fraction s of a step: its dense output."""
    dx = TWICE[ORDER - 1] * b[ORDER - 1]
    dv = ONCE[ORDER - 1] * b[ORDER - 1]
    for k in range(1, ORDER):
        dx = s * dx + TWICE[ORDER - 1 - k] * b[ORDER - 1 - k]
        dv = s * dv + ONCE[ORDER - 1 - k] * b[ORDER - 1 - k]
    t = s * h
    dx = s * dx + wp.float64(0.5) * a0
    dv = s * dv + a0
    return x + t * (v + t * dx), v + t * dv
