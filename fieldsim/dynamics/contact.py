"""Bounces of spherical particles on the surface F = 1, found as events within a step, as Warp functions.

Within a step a particle follows the parabola x + t v + t^2/2 a, which is leapfrog's drift for every t, so a step that
is cut at an event stays a chain of leapfrog steps and keeps its order. The *gap* of a sphere of radius r at x is
log F(x + r n) with n = grad F / |grad F|: zero where the sphere touches the surface, negative outside. The logarithm
makes it smooth (quadratic along a line for one Gaussian) and never steep. While a step lasts, the field of a moving
surface is the blend (1 - s) F(stage) + s F(stage + 1); its speed along the normal is (dF/dt) / |grad F|.

Far away, a step that stays within the margin (see `surfaces`) cannot hit. Otherwise the path is walked: by the margin
where that is large, else by a grain of the surface, with a cubic Hermite interpolant of the gap that tells of a hump
between two outside ends; crossings are bracketed and refined on the true gap, and the outside end is taken.

A touching particle that is slower than gravity would make it within a few steps rests: it is held on the surface by a
constraint force that can only push (RATTLE, Andersen 1983), without friction. So nothing at rest sinks or jitters.
"""

import functools

import warp as wp

from fieldsim.dynamics.sources import Stages, field_at
from fieldsim.dynamics.surfaces import margin_at, sweep_at

# In units of the gap: where a touching sphere is put, and what still counts as touching.
TOLERANCE = wp.constant(wp.float64(1e-10))
TOUCHING = wp.constant(wp.float64(1e-9))
# A hump of the interpolant above this is looked at in truth.
HUMP = wp.constant(wp.float64(-0.05))
# Approach speeds below so many times (gravity along the normal) * dt count as rest.
RESTING = wp.constant(wp.float64(4.0))
# Events, pieces of a path, and refinements at most.
EVENTS = wp.constant(256)
PIECES = wp.constant(100_000)
REFINEMENTS = wp.constant(64)

TINY = wp.constant(wp.float64(1e-300))


@wp.struct
class Touch:
    """A sphere's relation to the surface: gap, outward unit normal, |grad gap|, the surface's speed along it."""

    gap: wp.float64
    normal: wp.vec3d
    slope: wp.float64
    speed: wp.float64


@wp.struct
class Moment:
    """Where in time: the step's first stage, its length dt, and the time t elapsed within it."""

    stage: int
    dt: wp.float64
    t: wp.float64


@wp.struct
class Motion:
    """A particle under way: position, velocity, acceleration there, and the time within the step."""

    x: wp.vec3d
    v: wp.vec3d
    a: wp.vec3d
    t: wp.float64


@wp.func
def path(m: Motion, t: wp.float64):
    """Position after a further time t of free flight."""
    return m.x + t * (m.v + wp.float64(0.5) * t * m.a)


@wp.func
def closing(m: Motion, touch: Touch, t: wp.float64):
    """Rate of change of the gap after a further time t of free flight."""
    return touch.slope * (touch.speed - wp.dot(touch.normal, m.v + t * m.a))


@functools.cache
def blended_field(kinds_used):
    """Warp function (point, stages, stage, s) -> (F, gradient, F(stage + 1) - F(stage)) at the fraction s of a step."""
    field = field_at(kinds_used)
    moving_kinds = kinds_used[1]

    @wp.func
    def still(p: wp.vec3d, stages: Stages, stage: int, s: wp.float64):
        f, g = field(p, stages, stage)
        return f, g, wp.float64(0.0)

    @wp.func
    def changing(p: wp.vec3d, stages: Stages, stage: int, s: wp.float64):
        f0, g0 = field(p, stages, stage)
        f1, g1 = field(p, stages, stage + 1)
        return f0 + s * (f1 - f0), g0 + s * (g1 - g0), f1 - f0

    return changing if moving_kinds else still


@functools.cache
def touch_at(kinds_used):
    """Warp function (point, radius, surfaces, moment, time after it) -> Touch."""
    surface = blended_field(kinds_used)

    @wp.func
    def touch(p: wp.vec3d, radius: wp.float64, surfaces: Stages, moment: Moment, later: wp.float64):
        s = (moment.t + later) / moment.dt
        _f, inward, _change = surface(p, surfaces, moment.stage, s)
        f, g, change = surface(p + radius * wp.normalize(inward), surfaces, moment.stage, s)
        f = wp.max(f, TINY)
        size = wp.length(g)
        result = Touch()
        result.gap = wp.log(f)
        result.slope = wp.max(size / f, TINY)
        result.normal = -wp.normalize(g)
        if size == wp.float64(0.0):  # at the very centre of a body every way is out
            result.normal = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(1.0))
        result.speed = change / (moment.dt * wp.max(size, TINY))
        return result

    return touch


@functools.cache
def push_out(kinds_used):
    """Warp function (point, radius, grain, surfaces, moment) -> the point moved along the gradient until it touches."""
    touch_of = touch_at(kinds_used)

    @wp.func
    def push(p: wp.vec3d, radius: wp.float64, grain: wp.float64, surfaces: Stages, moment: Moment):
        longest = wp.float64(4.0) * grain
        for _ in range(REFINEMENTS):
            touch = touch_of(p, radius, surfaces, moment, wp.float64(0.0))
            if touch.gap <= wp.float64(0.0) and touch.gap >= -TOLERANCE:
                break
            step = (touch.gap + wp.float64(0.5) * TOLERANCE) / touch.slope
            p = p + wp.clamp(step, -longest, longest) * touch.normal
        return p

    return push


@functools.cache
def refined_contact(kinds_used):
    """Warp function (motion, radius, surfaces, moment, low, high) -> time of contact between low (out) and high (in).

    Newton's method within the bracket, halving it where Newton leaves it; the outside end is returned.
    """
    touch_of = touch_at(kinds_used)

    @wp.func
    def refined(m: Motion, radius: wp.float64, surfaces: Stages, moment: Moment, low: wp.float64, high: wp.float64):
        t = wp.float64(0.5) * (low + high)
        for k in range(REFINEMENTS):
            touch = touch_of(path(m, t), radius, surfaces, moment, t)
            if touch.gap > wp.float64(0.0):
                high = t
            else:
                low = t
                if touch.gap >= -TOLERANCE:
                    break
            t = t - (touch.gap + wp.float64(0.5) * TOLERANCE) / closing(m, touch, t)
            # Not (low < t < high), so that a NaN is caught as well; every fourth time the bracket is halved anyway.
            if not (t > low and t < high) or k % 4 == 3:
                t = wp.float64(0.5) * (low + high)
        return low

    return refined


@wp.func
def hump_of(g0: wp.float64, d0: wp.float64, g1: wp.float64, d1: wp.float64):
    """The highest point (u, value) of the cubic with values g0, g1 and slopes d0 > 0 > d1 at u = 0, 1."""
    rise = g1 - g0
    c2 = wp.float64(3.0) * rise - wp.float64(2.0) * d0 - d1
    c3 = d0 + d1 - wp.float64(2.0) * rise
    u = d0 / (wp.sqrt(wp.max(c2 * c2 - wp.float64(3.0) * c3 * d0, wp.float64(0.0))) - c2)
    return u, g0 + u * (d0 + u * (c2 + u * c3))


@functools.cache
def contact_within(kinds_used):
    """Warp function (..., two ends of a piece of path) -> a time in it when the particle is inside, or -1."""
    touch_of = touch_at(kinds_used)

    @wp.func
    def crossing(
        m: Motion,
        radius: wp.float64,
        surfaces: Stages,
        moment: Moment,
        first: Touch,
        begin: wp.float64,
        last: Touch,
        end: wp.float64,
    ):
        high = wp.float64(-1.0)
        if last.gap > wp.float64(0.0):
            high = end
        else:
            span = end - begin
            d0 = span * closing(m, first, begin)
            d1 = span * closing(m, last, end)
            if d0 > wp.float64(0.0) and d1 < wp.float64(0.0):
                u, value = hump_of(first.gap, d0, last.gap, d1)
                if value > HUMP:
                    t = begin + u * span
                    touch = touch_of(path(m, t), radius, surfaces, moment, t)
                    if touch.gap > wp.float64(0.0):
                        high = t
        return high

    return crossing


@functools.cache
def first_contact(kinds_used):
    """Warp function (motion, touch there, radius, grain, surfaces, moment, duration) -> time of contact, or -1."""
    touch_of = touch_at(kinds_used)
    crossing = contact_within(kinds_used)
    refined = refined_contact(kinds_used)
    margin = margin_at(kinds_used)
    sweep = sweep_at(kinds_used)

    @wp.func
    def first(
        m: Motion,
        here: Touch,
        radius: wp.float64,
        grain: wp.float64,
        surfaces: Stages,
        moment: Moment,
        duration: wp.float64,
    ):
        speed = wp.length(m.v) + duration * wp.length(m.a) + sweep(surfaces, moment.stage) / moment.dt
        piece = duration
        if speed * duration > grain:
            piece = grain / speed
        found = wp.float64(-1.0)
        known = wp.int32(1)
        t = wp.float64(0.0)
        for _ in range(PIECES):
            p = path(m, t)
            room = margin(p, surfaces, moment.stage) - radius
            if room > grain:
                t = t + room / speed
                known = wp.int32(0)
            else:
                if known == 0:
                    here = touch_of(p, radius, surfaces, moment, t)
                end = wp.min(t + piece, duration)
                there = touch_of(path(m, end), radius, surfaces, moment, end)
                high = crossing(m, radius, surfaces, moment, here, t, there, end)
                if high >= wp.float64(0.0):
                    found = refined(m, radius, surfaces, moment, t, high)
                    break
                here = there
                known = wp.int32(1)
                t = end
            if not (t < duration):
                break
        return found

    return first


@functools.cache
def supported(gravity_kinds, surface_kinds):
    """Warp function that moves a touching particle along the surface, or off it where nothing presses it on."""
    touch_of = touch_at(surface_kinds)
    push = push_out(surface_kinds)
    pull = blended_field(gravity_kinds)

    @wp.func
    def support(
        m: Motion,
        here: Touch,
        radius: wp.float64,
        grain: wp.float64,
        gravity: Stages,
        surfaces: Stages,
        moment: Moment,
    ):
        left = moment.dt - moment.t
        h = left
        v = m.v + wp.max(here.speed - wp.dot(m.v, here.normal), wp.float64(0.0)) * here.normal
        speed = wp.length(v)
        if speed * h > grain:
            h = grain / speed
        v = v + wp.float64(0.5) * h * m.a
        x = m.x + h * v
        there = touch_of(x, radius, surfaces, moment, h)
        held = there.gap > wp.float64(0.0)
        if held:
            lift = wp.float64(0.0)
            for _ in range(REFINEMENTS):
                if there.gap <= wp.float64(0.0) and there.gap >= -TOLERANCE:
                    break
                rise = there.slope * wp.max(wp.dot(there.normal, here.normal), wp.float64(0.1))
                step = (there.gap + wp.float64(0.5) * TOLERANCE) / rise
                x = x + step * here.normal
                lift = lift + step
                there = touch_of(x, radius, surfaces, moment, h)
            v = v + (lift / h) * here.normal
        result = Motion()
        result.t = moment.dt
        if h < left:
            result.t = moment.t + h
        if there.gap > TOUCHING:
            ending = moment
            ending.t = result.t
            x = push(x, radius, grain, surfaces, ending)
            there = touch_of(x, radius, surfaces, ending, wp.float64(0.0))
        _f, a, _change = pull(x, gravity, moment.stage, result.t / moment.dt)
        v = v + wp.float64(0.5) * h * a
        if held:
            v = v + wp.max(there.speed - wp.dot(v, there.normal), wp.float64(0.0)) * there.normal
        result.x = x
        result.v = v
        result.a = a
        return result

    return support


@functools.cache
def flight(gravity_kinds, surface_kinds):
    """Warp function that flies a particle to its next contact or to the step's end -> (motion, whether it hit)."""
    first = first_contact(surface_kinds)
    pull = blended_field(gravity_kinds)

    @wp.func
    def fly(
        m: Motion,
        here: Touch,
        radius: wp.float64,
        grain: wp.float64,
        gravity: Stages,
        surfaces: Stages,
        moment: Moment,
    ):
        h = moment.dt - moment.t
        found = first(m, here, radius, grain, surfaces, moment, h)
        result = Motion()
        result.t = moment.dt
        if found >= wp.float64(0.0):
            h = found
            result.t = moment.t + found
        half = wp.float64(0.5) * h
        v = m.v + half * m.a
        result.x = m.x + h * v
        _f, a, _change = pull(result.x, gravity, moment.stage, result.t / moment.dt)
        result.a = a
        result.v = v + half * a
        return result, wp.where(found >= wp.float64(0.0), 1, 0)

    return fly


@functools.cache
def contact_step(gravity_kinds, surface_kinds):
    """Warp function: one whole step near a surface -> (x, v, a, number of hits)."""
    touch_of = touch_at(surface_kinds)
    push = push_out(surface_kinds)
    support = supported(gravity_kinds, surface_kinds)
    fly = flight(gravity_kinds, surface_kinds)
    pull = blended_field(gravity_kinds)

    @wp.func
    def step(
        m: Motion,
        radius: wp.float64,
        restitution: wp.float64,
        grain: wp.float64,
        gravity: Stages,
        surfaces: Stages,
        stage: int,
        dt: wp.float64,
    ):
        hits = wp.int32(0)
        hit = wp.int32(0)
        moment = Moment()
        moment.stage = stage
        moment.dt = dt
        for _ in range(EVENTS):
            moment.t = m.t
            here = touch_of(m.x, radius, surfaces, moment, wp.float64(0.0))
            if here.gap > TOUCHING:
                m.x = push(m.x, radius, grain, surfaces, moment)
                here = touch_of(m.x, radius, surfaces, moment, wp.float64(0.0))
                _f, a, _change = pull(m.x, gravity, stage, m.t / dt)
                m.a = a
            leaving = wp.dot(m.v, here.normal) - here.speed
            slow = RESTING * dt * wp.max(-wp.dot(m.a, here.normal), wp.float64(0.0))
            touching = here.gap >= -TOUCHING
            if touching and leaving < -slow:
                m.v = m.v - (wp.float64(1.0) + restitution) * leaving * here.normal
                leaving = -restitution * leaving
                hit = wp.int32(1)
            hits += hit
            hit = wp.int32(0)
            if touching and leaving <= slow and slow > wp.float64(0.0):
                m = support(m, here, radius, grain, gravity, surfaces, moment)
            else:
                m, hit = fly(m, here, radius, grain, gravity, surfaces, moment)
            if m.t >= dt:
                break
        if m.t < dt:  # more events than anyone can follow: it stays where it is until the step is over
            _f, a, _change = pull(m.x, gravity, stage, wp.float64(1.0))
            m.a = a
        return m, hits

    return step
