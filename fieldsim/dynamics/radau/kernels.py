"""Kernels of the adaptive method: one thread per particle, each with its own time and step."""

import functools

import warp as wp

from fieldsim.dynamics.contact.particle_state import ESCAPED, GONE, ContactParticles, log_event
from fieldsim.dynamics.radau.nodes import PLACES, Pulling, Series, mixed_of, path_of, place_of, pulls_of
from fieldsim.dynamics.radau.step import (
    AHEAD,
    ENDS,
    EXTRAPOLATION,
    IN_POWERS,
    PULL,
    arrived,
    expected_of,
    lengthening,
    replanned,
    scaled,
    settled_of,
)
from fieldsim.dynamics.splitting.groups import column
from fieldsim.numerics.running_sums import exactly_added
from fieldsim.sources.windows import Window, part_from

# A step shorter than this part of the elapsed time is too short to arrive: the particle is lost.
SHORTEST = wp.constant(wp.float64(2.0**-60))
# First steps are this part of the time in which speed or place change.
CAUTION = wp.constant(wp.float64(1e-3))
# Rounding of a coordinate.
ROUNDING = wp.constant(wp.float64(2.0**-53))
# What became of a particle: no step is short enough, or it has stopped at the escape radius.
FLYING, LOST, STOPPED = map(wp.constant, range(3))
# Where it stops is known to this part of a step, after so many tries at most.
MEETING = wp.constant(wp.float64(1e-15))
TRIES = wp.constant(60)


@wp.struct
class Step:
    """A step that was taken: its start, position, velocity and time with their rounding errors, and its length h.

    b: the acceleration along it in powers. h is 0 before the first step.
    """

    x: wp.vec3d
    x_rest: wp.vec3d
    v: wp.vec3d
    v_rest: wp.vec3d
    t: wp.float64
    t_rest: wp.float64
    h: wp.float64
    b: Series


@wp.struct
class Flights:
    """State of N particles, each array (N,): at the end of the last step, that step, and the plan of the next.

    x, v, t: position, velocity, time, with their rounding errors in *_rest; a: acceleration as it is foreseen there.
    last: the last step. plan: length of the next; miss: difference of the last step's powers from their prediction.
    ended: FLYING, LOST or STOPPED. evaluations, steps: counts. tau: the shortest time in which the acceleration
    ever changed; tau_at: when that was.
    """

    x: wp.array(dtype=wp.vec3d)
    x_rest: wp.array(dtype=wp.vec3d)
    v: wp.array(dtype=wp.vec3d)
    v_rest: wp.array(dtype=wp.vec3d)
    t: wp.array(dtype=wp.float64)
    t_rest: wp.array(dtype=wp.float64)
    a: wp.array(dtype=wp.vec3d)
    last: wp.array(dtype=Step)
    plan: wp.array(dtype=wp.float64)
    miss: wp.array(dtype=Series)
    ended: wp.array(dtype=wp.int32)
    steps: wp.array(dtype=wp.int64)
    evaluations: wp.array(dtype=wp.int64)
    tau: wp.array(dtype=wp.float64)
    tau_at: wp.array(dtype=wp.float64)


@wp.struct
class Leg:
    """Task of one launch: particles from `first` on take at most `steps` steps, none from `until` on.

    eta: steps in units of the time in which the acceleration changes. extent: size of what pulls and how far it lies
    from the origin. stride: greatest displacement of a step. begin: time of the simulation's start. escape2: the escape
    radius squared, or inf.
    """

    first: int
    steps: int
    until: wp.float64
    eta: wp.float64
    extent: wp.float64
    stride: wp.float64
    begin: wp.float64
    escape2: wp.float64


@wp.func
def first_step(x: wp.vec3d, v: wp.vec3d, a: wp.vec3d, extent: wp.float64):
    """A safely short first step; later steps grow."""
    size = extent + wp.length(x)
    speed = wp.length(v)
    pull = wp.length(a)
    longest = wp.float64(1.0)
    if pull > wp.float64(0.0):
        longest = wp.sqrt(size / pull)
        if speed > wp.float64(0.0):
            longest = wp.min(longest, speed / pull)
    if speed > wp.float64(0.0):
        longest = wp.min(longest, size / speed)
    return CAUTION * longest


@wp.func
def fitted(plan: wp.float64, left: wp.float64):
    """The step shortened or stretched so that the rest of the window is not a tiny step."""
    h = plan
    if plan >= left:
        h = left
    elif plan + plan > left:
        h = wp.float64(0.5) * left
    return h


@functools.cache
def within_of(kinds_used, lanes: int):
    """Warp function (step, h, pulling, which, window) -> position and velocity at the time h after a step's start.

    The step is repeated up to that time, as the polynomial's error inside a step is far larger than at its end.
    """
    settled, mixed = settled_of(kinds_used, lanes), mixed_of(lanes)
    place = place_of(kinds_used, lanes)

    @wp.func
    def within(step: Step, h: wp.float64, pulling: Pulling, which: int, window: Window):
        place(pulling, which, window, step.t, step.t_rest, h)
        b = scaled(step.b, h / step.h)
        p, _good, _sweeps = settled(step.x, step.x_rest, step.v, b, h, pulling, which)
        a = column(p, 0, 0)
        x, _x_rest, v, _v_rest = arrived(step.x, step.x_rest, step.v, step.v_rest, a, mixed(ENDS, p), h)
        return x, v

    return within


@functools.cache
def crossing_of(kinds_used, lanes: int):
    """Warp function (step, radius squared, pulling, which, window) -> the time in a step that crosses the radius.

    Newton's method within a bracket, on the motion itself. The step begins within the radius and ends outside.
    """
    within = within_of(kinds_used, lanes)

    @wp.func
    def crossing(step: Step, radius2: wp.float64, pulling: Pulling, which: int, window: Window):
        low = wp.float64(0.0)
        high = step.h
        h = wp.float64(0.5) * step.h
        for _ in range(TRIES + 0 * which):
            x, v = within(step, h, pulling, which, window)
            beyond = wp.dot(x, x) - radius2
            if beyond > wp.float64(0.0):
                high = h
            else:
                low = h
            last = h
            h = h - wp.float64(0.5) * beyond / wp.dot(x, v)
            if not (h > low and h < high):
                h = wp.float64(0.5) * (low + high)
            if wp.abs(h - last) <= MEETING * step.h:
                break
        return h

    return crossing


@functools.cache
def radau_kernel(kinds_used, lanes: int):
    """Kernel (leg, pulling, window; flights, running): adaptive steps for gravity of the given kinds.

    `running` is set if some particle has not arrived.
    """
    settled, mixed = settled_of(kinds_used, lanes), mixed_of(lanes)
    within, crossing = within_of(kinds_used, lanes), crossing_of(kinds_used, lanes)
    path, pulls, place = path_of(lanes), pulls_of(kinds_used, lanes), place_of(kinds_used, lanes)

    @wp.kernel(module="unique", enable_backward=False)
    def radau(
        start: int,
        leg: Leg,
        pulling: Pulling,
        window: Window,
        flights: Flights,
        running: wp.array(dtype=wp.int32),
    ):
        which = start + wp.tid()
        i = leg.first + which
        x = flights.x[i]
        x_rest = flights.x_rest[i]
        v = flights.v[i]
        v_rest = flights.v_rest[i]
        t = flights.t[i]
        t_rest = flights.t_rest[i]
        a = flights.a[i]
        last = flights.last[i]
        plan = flights.plan[i]
        miss = flights.miss[i]
        ended = flights.ended[i]
        shortest = flights.tau[i]
        shortest_at = flights.tau_at[i]
        taken = wp.int32(0)
        evaluations = wp.int32(0)
        for _ in range(leg.steps):
            if wp.dot(x, x) > leg.escape2:  # where it started, or was put
                ended = STOPPED
            if t >= leg.until or ended != FLYING:
                break
            end = window.bounds[part_from(window, t) + 1]
            left = (end - t) - t_rest
            if plan == wp.float64(0.0):
                place(pulling, which, window, t, t_rest, wp.float64(0.0))
                a = column(pulls(path(Series(), x, x_rest, v, wp.float64(0.0)), pulling, which), 0, 0)
                evaluations += 1
                plan = first_step(x, v, a, leg.extent)
            if plan * wp.length(v) > leg.stride:
                plan = leg.stride / wp.length(v)
            h = fitted(plan, left)
            place(pulling, which, window, t, t_rest, h)
            known = last.h > wp.float64(0.0) and h < EXTRAPOLATION * last.h
            expected = expected_of(mixed(AHEAD, last.b), miss, a, known, h / last.h)
            p, good, sweeps = settled(x, x_rest, v, expected, h, pulling, which)
            evaluations += PLACES * sweeps
            ends = mixed(ENDS, p)
            b = mixed(IN_POWERS, p)
            a = column(p, 0, 0)
            noise = ROUNDING * (leg.extent + wp.length(x)) / (h * h)
            longer = lengthening(a, ends, column(b, 0, PLACES - 1), noise)
            counts, plan = replanned(plan, h, leg.eta * longer, good)
            if counts:
                taken += 1
                last.x = x
                last.x_rest = x_rest
                last.v = v
                last.v_rest = v_rest
                last.t = t
                last.t_rest = t_rest
                last.h = h
                last.b = b
                miss = Series()
                if known:
                    miss = last.b - expected
                x, x_rest, v, v_rest = arrived(x, x_rest, v, v_rest, a, ends, h)
                a = column(ends, 0, PULL)
                t, t_rest = exactly_added(t, t_rest, h)
                if h * longer < shortest:
                    shortest = h * longer
                    shortest_at = t
                if h == left:
                    t = end
                    t_rest = wp.float64(0.0)
                if wp.dot(x, x) > leg.escape2:
                    h = crossing(last, leg.escape2, pulling, which, window)
                    x, v = within(last, h, pulling, which, window)
                    t, t_rest = exactly_added(last.t, last.t_rest, h)
                    last.b = scaled(last.b, h / last.h)
                    last.h = h
                    ended = STOPPED
                    break
            if not (plan > SHORTEST * wp.abs(t - leg.begin)):
                ended = LOST
        flights.x[i] = x
        flights.x_rest[i] = x_rest
        flights.v[i] = v
        flights.v_rest[i] = v_rest
        flights.t[i] = t
        flights.t_rest[i] = t_rest
        flights.a[i] = a
        flights.last[i] = last
        flights.plan[i] = plan
        flights.miss[i] = miss
        flights.ended[i] = ended
        flights.tau[i] = shortest
        flights.tau_at[i] = shortest_at
        flights.steps[i] = flights.steps[i] + wp.int64(taken)
        flights.evaluations[i] = flights.evaluations[i] + wp.int64(evaluations)
        running[i] = wp.where(t < leg.until and ended == FLYING, 1, 0)

    return radau


@functools.cache
def dense_kernel(kinds_used, lanes: int):
    """Kernel (first, flights, pulling, window, times; positions, velocities): dense output within each last step.

    NaN for lost particles.
    """
    within = within_of(kinds_used, lanes)

    @wp.kernel(module="unique", enable_backward=False)
    def dense(
        start: int,
        first: int,
        flights: Flights,
        pulling: Pulling,
        window: Window,
        times: wp.array(dtype=wp.float64),
        positions: wp.array(dtype=wp.vec3d),
        velocities: wp.array(dtype=wp.vec3d),
    ):
        which = start + wp.tid()
        i = first + which
        x = flights.x[i]
        v = flights.v[i]
        step = flights.last[i]
        ahead = flights.ended[i] == STOPPED and times[i] >= flights.t[i]
        if step.h > wp.float64(0.0) and times[i] != flights.t[i] and not ahead:
            x, v = within(step, (times[i] - step.t) - step.t_rest, pulling, which, window)
        if flights.ended[i] == LOST:
            x = wp.float64(wp.nan) * x
            v = wp.float64(wp.nan) * v
        positions[i] = x
        velocities[i] = v

    return dense


@wp.kernel(enable_backward=False)
def escapes(start: int, until: wp.float64, flights: Flights, particles: ContactParticles):
    """Note which particles have stopped by the time `until`, and when, once."""
    i = start + wp.tid()
    stopped = flights.ended[i] == STOPPED and flights.t[i] <= until
    if stopped and particles.states[i] != ESCAPED:
        particles.states[i] = ESCAPED
        log_event(particles, i, flights.t[i], GONE, flights.x[i], wp.vec3d())
