"""When a particle in free flight first meets the surface F = 1, as Warp functions.

Within a step a particle follows the parabola x + t v + t^2/2 a, which is leapfrog's drift for every t. Far from
surfaces the path is walked by the margin (see `surfaces`), near them by a grain of the surface, with a cubic Hermite
interpolant of the gap (see `touch`) that tells of a hump between two outside ends. Crossings are bracketed and refined
on the true gap, and the outside end is taken: nothing tunnels, however fast.
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.gap import REFINEMENTS, TOLERANCE, Moment, Touch, touch_at
from fieldsim.dynamics.contact.surfaces import margin_at, sweep_at
from fieldsim.sources.stages import Stages

# A hump of the interpolant above this is looked at in truth.
HUMP = wp.constant(wp.float64(-0.05))
# Pieces of a path at most.
PIECES = wp.constant(100_000)


@wp.struct
class Motion:
    """A particle under way: position, velocity, acceleration there, the time within the step, spin and state.

    known: 1 where `here` is the touch at that position and time.
    """

    x: wp.vec3d
    v: wp.vec3d
    a: wp.vec3d
    t: wp.float64
    spin: wp.vec3d
    state: wp.int32
    known: wp.int32
    here: Touch


@wp.func
def path(m: Motion, t: wp.float64):
    """Position after a further time t of free flight."""
    return m.x + t * (m.v + wp.float64(0.5) * t * m.a)


@wp.func
def closing(m: Motion, touch: Touch, t: wp.float64):
    """Rate of change of the gap after a further time t of free flight."""
    return touch.slope * (touch.speed - wp.dot(touch.normal, m.v + t * m.a))


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
