"""Kernels of the adaptive method: one thread per particle, each with its own time and step."""

import functools

import warp as wp

from fieldsim.dynamics.radau.step import (
    CHANGE,
    EXTRAPOLATION,
    NODES,
    STAGES,
    continued,
    in_newton_form,
    in_powers,
    lengthening,
    node_offsets,
    settled_path,
    shortened,
    travelled,
)
from fieldsim.dynamics.radau.tables import ORDER, Series
from fieldsim.numerics.running_sums import exactly_added
from fieldsim.sources.field import field_at
from fieldsim.sources.stages import Stages
from fieldsim.sources.windows import Window, place_rows

# A step shorter than this part of the elapsed time is too short to arrive: the particle is lost.
SHORTEST = wp.constant(wp.float64(2.0**-60))
# First steps are this part of the time in which speed or place change.
CAUTION = wp.constant(wp.float64(1e-3))
# Rounding of a coordinate.
ROUNDING = wp.constant(wp.float64(2.0**-53))


@wp.struct
class Flights:
    """State of N particles, each array (N,): at the end of the last step, that step, and the plan of the next.

    x, v, t: position, velocity, time, with their rounding errors in *_rest. x0, v0, t0, a0: the same at the last step's
    start, and the acceleration; h: its length, 0 before the first; b: its acceleration in powers. plan: length of the
    next step; miss: difference of b from its prediction. lost: 1 where no step is short enough. evaluations,
    steps: counts. tau: the shortest time in which the acceleration ever changed; tau_at: when that was.
    """

    x: wp.array(dtype=wp.vec3d)
    x_rest: wp.array(dtype=wp.vec3d)
    v: wp.array(dtype=wp.vec3d)
    v_rest: wp.array(dtype=wp.vec3d)
    t: wp.array(dtype=wp.float64)
    t_rest: wp.array(dtype=wp.float64)
    x0: wp.array(dtype=wp.vec3d)
    v0: wp.array(dtype=wp.vec3d)
    x0_rest: wp.array(dtype=wp.vec3d)
    v0_rest: wp.array(dtype=wp.vec3d)
    a0: wp.array(dtype=wp.vec3d)
    t0: wp.array(dtype=wp.float64)
    t0_rest: wp.array(dtype=wp.float64)
    h: wp.array(dtype=wp.float64)
    b: wp.array(dtype=Series)
    plan: wp.array(dtype=wp.float64)
    miss: wp.array(dtype=Series)
    lost: wp.array(dtype=wp.int32)
    steps: wp.array(dtype=wp.int64)
    evaluations: wp.array(dtype=wp.int64)
    tau: wp.array(dtype=wp.float64)
    tau_at: wp.array(dtype=wp.float64)


@wp.struct
class Leg:
    """Task of one launch: particles from `first` on take at most `steps` steps, none from `until` on.

    eta: steps in units of the time in which the acceleration changes. extent: size of what pulls and how far it lies
    from the origin. stride: greatest displacement of a step. begin: time of the simulation's start.
    """

    first: int
    steps: int
    until: wp.float64
    eta: wp.float64
    extent: wp.float64
    stride: wp.float64
    begin: wp.float64


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
def radau_kernel(kinds_used):
    """Kernel (flights; leg, gravity, window): adaptive steps for gravity of the given kinds.

    `running` is set if some particle has not arrived.
    """
    field = field_at(kinds_used)
    settled = settled_path(kinds_used)
    place = place_rows(kinds_used)

    @wp.kernel(module="unique", enable_backward=False)
    def radau(
        start: int,
        leg: Leg,
        gravity: Stages,
        window: Window,
        flights: Flights,
        running: wp.array(dtype=wp.int32),
    ):
        stage = (start + wp.tid()) * STAGES
        i = leg.first + start + wp.tid()
        x = flights.x[i]
        x_rest = flights.x_rest[i]
        v = flights.v[i]
        v_rest = flights.v_rest[i]
        t = flights.t[i]
        t_rest = flights.t_rest[i]
        x0 = flights.x0[i]
        v0 = flights.v0[i]
        x0_rest = flights.x0_rest[i]
        v0_rest = flights.v0_rest[i]
        a0 = flights.a0[i]
        t0 = flights.t0[i]
        t0_rest = flights.t0_rest[i]
        last = flights.h[i]
        b = flights.b[i]
        plan = flights.plan[i]
        miss = flights.miss[i]
        lost = flights.lost[i]
        shortest = flights.tau[i]
        shortest_at = flights.tau_at[i]
        taken = wp.int32(0)
        evaluations = wp.int32(0)
        for _ in range(leg.steps):
            if t >= leg.until or lost == 1:
                break
            left = (window.end - t) - t_rest
            place(gravity, window, stage, t, t_rest)
            _f, a = field(x, gravity, stage)
            evaluations += 1
            if plan == wp.float64(0.0):
                plan = first_step(x, v, a, leg.extent)
            if plan * wp.length(v) > leg.stride:
                plan = leg.stride / wp.length(v)
            h = fitted(plan, left)
            for n in range(ORDER):
                place(gravity, window, stage + n + 1, t, t_rest + NODES[n] * h)
            expected = Series()
            known = last > wp.float64(0.0) and h < EXTRAPOLATION * last
            if known:
                expected = continued(b, h / last) + miss
            g = in_newton_form(expected)
            d = node_offsets(v, x_rest, a, g, h)
            g, pull, good, sweeps = settled(x, a, d, g, h, gravity, stage)
            evaluations += ORDER * sweeps
            b_new = in_powers(g)
            noise = ROUNDING * (leg.extent + wp.length(x)) / (h * h)
            longer = lengthening(a, b_new, noise)
            growth = leg.eta * longer
            if good == 1 and growth * CHANGE >= wp.float64(1.0):
                taken += 1
                x0 = x
                v0 = v
                a0 = a
                t0 = t
                t0_rest = t_rest
                x0_rest = x_rest
                v0_rest = v_rest
                last = h
                b = b_new
                miss = Series()
                if known:
                    miss = b - expected
                dx, dv, dv_rest = travelled(v, v_rest, a, pull, h)
                x, x_rest = exactly_added(x, x_rest, h * v)
                x, x_rest = exactly_added(x, x_rest, dx)
                v, v_rest = exactly_added(v, v_rest, dv)
                v, v_rest = exactly_added(v, v_rest, dv_rest)
                t, t_rest = exactly_added(t, t_rest, h)
                if h * longer < shortest:
                    shortest = h * longer
                    shortest_at = t
                if h == left:
                    t = window.end
                    t_rest = wp.float64(0.0)
                plan = wp.min(growth * h, CHANGE * wp.max(plan, h))
            else:
                # Not (growth > ...), so that a NaN shortens as well.
                plan = wp.float64(0.25) * h
                if good == 1 and growth > wp.float64(0.02):
                    plan = growth * h
            if not (plan > SHORTEST * wp.abs(t - leg.begin)):
                lost = wp.int32(1)
        flights.x[i] = x
        flights.x_rest[i] = x_rest
        flights.v[i] = v
        flights.v_rest[i] = v_rest
        flights.t[i] = t
        flights.t_rest[i] = t_rest
        flights.x0[i] = x0
        flights.v0[i] = v0
        flights.x0_rest[i] = x0_rest
        flights.v0_rest[i] = v0_rest
        flights.a0[i] = a0
        flights.t0[i] = t0
        flights.t0_rest[i] = t0_rest
        flights.h[i] = last
        flights.b[i] = b
        flights.plan[i] = plan
        flights.miss[i] = miss
        flights.lost[i] = lost
        flights.tau[i] = shortest
        flights.tau_at[i] = shortest_at
        flights.steps[i] = flights.steps[i] + wp.int64(taken)
        flights.evaluations[i] = flights.evaluations[i] + wp.int64(evaluations)
        running[i] = wp.where(t < leg.until and lost == 0, 1, 0)

    return radau


@functools.cache
def dense_kernel(kinds_used):
    """Kernel (first, flights, gravity, window, times; positions, velocities): dense output within each last step.

    The step is repeated up to that time, as the polynomial's error inside a step is far larger than at its end. NaN for
    lost particles.
    """
    settled = settled_path(kinds_used)
    place = place_rows(kinds_used)

    @wp.kernel(module="unique", enable_backward=False)
    def dense(
        start: int,
        first: int,
        flights: Flights,
        gravity: Stages,
        window: Window,
        times: wp.array(dtype=wp.float64),
        positions: wp.array(dtype=wp.vec3d),
        velocities: wp.array(dtype=wp.vec3d),
    ):
        stage = (start + wp.tid()) * STAGES
        i = first + start + wp.tid()
        x = flights.x[i]
        v = flights.v[i]
        if flights.h[i] > wp.float64(0.0) and times[i] != flights.t[i]:
            t = flights.t0[i]
            h = (times[i] - t) - flights.t0_rest[i]
            for n in range(ORDER):
                place(gravity, window, stage + n + 1, t, flights.t0_rest[i] + NODES[n] * h)
            x = flights.x0[i]
            v = flights.v0[i]
            a = flights.a0[i]
            g = in_newton_form(shortened(flights.b[i], h / flights.h[i]))
            d = node_offsets(v, flights.x0_rest[i], a, g, h)
            _g, pull, _good, _sweeps = settled(x, a, d, g, h, gravity, stage)
            dx, dv, dv_rest = travelled(v, flights.v0_rest[i], a, pull, h)
            x, rest = exactly_added(x, flights.x0_rest[i], h * v)
            x = x + (rest + dx)
            v, rest = exactly_added(v, flights.v0_rest[i], dv)
            v = v + (rest + dv_rest)
        if flights.lost[i] == 1:
            x = wp.float64(wp.nan) * x
            v = wp.float64(wp.nan) * v
        positions[i] = x
        velocities[i] = v

    return dense
