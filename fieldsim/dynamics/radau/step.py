"""One step of the 15th-order Gauss-Radau method, as Warp functions.

All eight nodes are evaluated with the same iterate of the path, so that the evaluations are independent and become one
in lanes; the iteration converges as fast as one from node to node. The start is one of them: in the first sweep its
acceleration, too, is a prediction.
"""

import functools

import warp as wp

from fieldsim.dynamics.radau import tables
from fieldsim.dynamics.radau.nodes import PLACES, Pulling, Series, mixed_of, path_of, pulls_of, weights
from fieldsim.dynamics.splitting.groups import column
from fieldsim.numerics.running_sums import exactly_added, product_rest

SWEEPS = wp.constant(12)
# A sweep is the last if the next would change the path's end by less than this part of h^2 a.
SETTLED = wp.constant(wp.float64(1e-18))
# If it has not converged to this, the step is too long; else the rest is the rounding of the field.
UNSETTLED = wp.constant(wp.float64(1e-6))
# A step may be so many times longer than the one before, or shorter by as much without being taken again.
CHANGE = wp.constant(wp.float64(4.0))
# Beyond this ratio of steps the last step's polynomial is no prediction for the next.
EXTRAPOLATION = wp.constant(wp.float64(20.0))
# b_7 of a smooth motion is about (h / tau)^7 a over 7!: FACTORIAL. KINK: so many times longer steps than it suggests
# may be taken. NOISY: what rounding makes of it, in units of the noise of positions.
FACTORIAL = wp.constant(wp.float64(5040.0))
SEVENTH = wp.constant(wp.float64(1.0 / 7.0))
KINK = wp.constant(wp.float64(3.0))
NOISY = wp.constant(wp.float64(1e4))
TINY = wp.constant(wp.float64(1e-300))

IN_POWERS, WAYS, WAYS_OF_POWERS = weights(tables.IN_POWERS), weights(tables.WAYS), weights(tables.WAYS_OF_POWERS)
AHEAD, ENDS = weights(tables.AHEAD), weights(tables.ENDS)
WAY, WAY_REST, SPEED, SPEED_REST, PULL, FIRST, SECOND, THIRD = map(wp.constant, tables.COLUMNS)


@wp.func
def scaled(b: Series, q: wp.float64):
    """The powers of a polynomial with q times the unit of time."""
    factor = wp.float64(1.0)
    for k in range(1, PLACES):
        factor = factor * q
        for c in range(3):
            b[c, k] = factor * b[c, k]
    return b


@wp.func
def differences(a: Series):
    """The first of the accelerations at the nodes, and the differences of the others from it."""
    found = a
    for c in range(3):
        for k in range(1, PLACES):
            found[c, k] = a[c, k] - a[c, 0]
    return found


@wp.func
def largest(v: wp.vec3d):
    """The largest component, NaN if one is NaN."""
    return wp.where(wp.length_sq(v) >= wp.float64(0.0), wp.max(wp.abs(v)), wp.length_sq(v))


@wp.func
def moved(p: Series, ways: Series, new: Series):
    """Size of the accelerations `p` in a step, and by how much they have moved the last node, in units of h^2."""
    size = largest(column(p, 0, 0)) + largest(column(p, 0, PLACES - 1))
    return size, largest(column(new, 0, PLACES - 1) - column(ways, 0, PLACES - 1))


@wp.func
def is_last(sweep: int, size: wp.float64, error: wp.float64, last: wp.float64):
    """Whether a sweep with `error`, after one with the error `last`, is the last of a step."""
    if sweep == 0:
        return error <= SETTLED * size
    # Estimated change by the next sweep, from the convergence so far, which rounding ends.
    return error * error <= SETTLED * size * last or (sweep > 1 and error >= last)


@functools.cache
def settled_of(kinds_used, lanes: int):
    """Warp function (x, rest, v, b, h, pulling, which) -> (differences, whether it converged, sweeps).

    b: the powers of the acceleration that is expected; rest: of x; see `pulls_of`.
    """
    mixed, path, pulls = mixed_of(lanes), path_of(lanes), pulls_of(kinds_used, lanes)

    @wp.func
    def settled(x: wp.vec3d, rest: wp.vec3d, v: wp.vec3d, b: Series, h: wp.float64, pulling: Pulling, which: int):
        ways = mixed(WAYS_OF_POWERS, b)
        sweeps = wp.int32(0)
        last = wp.float64(wp.inf)
        good = wp.int32(0)
        p = Series()
        for sweep in range(SWEEPS + 0 * which):
            p = differences(pulls(path(ways, x, rest, v, h), pulling, which))
            new = mixed(WAYS, p)
            size, error = moved(p, ways, new)
            ways = new
            sweeps += 1
            if is_last(sweep, size, error, last):
                good = wp.where(error <= UNSETTLED * size, 1, 0)
                break
            last = error
        return p, good, sweeps

    return settled


@wp.func
def lengthening(a0: wp.vec3d, ends: Series, last: wp.vec3d, noise: wp.float64):
    """The time in which the acceleration changes, in steps, from its derivatives a, j, s, c at the step's end.

    The longer of two: 2 a^2 / (j^2 + a s) of Pham, Rein & Spiegel 2024 (eq. 16), which vanishes where the acceleration
    passes zero, as in a ring's hole, so that steps would never get there; and Aarseth's (a s + j^2) / (j c + s^2),
    which does not. Both are squares of times. Where the last power is far larger than they promise, the field has a
    kink, and that power itself, Everhart's measure, finds the steps that it takes.
    last: the last power. noise: accelerations too small to move anything by a rounding error.
    """
    force = wp.length(column(ends, 0, PULL))
    jerk = wp.length(column(ends, 0, FIRST))
    snap = wp.length(column(ends, 0, SECOND))
    by_force = wp.float64(2.0) * force * force / wp.max(jerk * jerk + force * snap, TINY)
    below = jerk * wp.length(column(ends, 0, THIRD)) + snap * snap
    by_jerk = wp.float64(wp.inf)
    if below != wp.float64(0.0):
        by_jerk = (force * snap + jerk * jerk + noise * noise) / below
    tau = wp.sqrt(wp.max(by_force, by_jerk))
    rough = wp.length(last) - NOISY * noise
    if rough > wp.float64(0.0):
        scale = wp.max(force, wp.length(a0)) / (FACTORIAL * rough)
        part = tau / KINK
        part3 = part * part * part
        if part3 * part3 * part > scale:
            tau = KINK * wp.pow(scale, SEVENTH)
    return tau


@wp.func
def expected_of(shifted: Series, miss: Series, a: wp.vec3d, known: bool, q: wp.float64):
    """Powers of the acceleration foreseen for a step q times as long as the last.

    shifted: those of the last step from its end on; miss: by how much it had been foreseen wrongly; a: the
    acceleration, which is all there is where nothing is known.
    """
    b = Series()
    if known:
        b = scaled(shifted, q) + miss
    else:
        for c in range(3):
            b[c, 0] = a[c]
    return b


@wp.func
def replanned(plan: wp.float64, h: wp.float64, growth: wp.float64, good: int):
    """Whether a step of length h, of which a step `growth` times as long is wanted, counts; length of the next."""
    if good == 1 and growth * CHANGE >= wp.float64(1.0):
        return True, wp.min(growth * h, CHANGE * wp.max(plan, h))
    # Not (growth < ...), so that a NaN shortens as well.
    if good == 1 and growth > wp.float64(0.02):
        return False, growth * h
    return False, wp.float64(0.25) * h


@wp.func
def arrived(
    x: wp.vec3d, x_rest: wp.vec3d, v: wp.vec3d, v_rest: wp.vec3d, a0: wp.vec3d, ends: Series, h: wp.float64
):  # fmt: skip
    """Position and velocity at the end of a step from x and v, with their rests.

    What rounding takes from the weights would pull one way at each step, and show after a thousand orbits. It is added
    to rests, which are rounded one way as often as the other: a sum with the large part alone would lose it.
    """
    dx = h * (h * column(ends, 0, WAY) + v_rest) + (h * (h * column(ends, 0, WAY_REST)) + product_rest(h, v))
    a, a_rest = exactly_added(a0, wp.vec3d(), column(ends, 0, SPEED))
    dv_rest = h * (a_rest + column(ends, 0, SPEED_REST)) + product_rest(h, a)
    x, x_rest = exactly_added(x, x_rest, h * v)
    x, x_rest = exactly_added(x, x_rest, dx)
    v, v_rest = exactly_added(v, v_rest, h * a)
    v, v_rest = exactly_added(v, v_rest, dv_rest)
    return x, x_rest, v, v_rest
