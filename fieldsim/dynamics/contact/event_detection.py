"""Event detection: when a particle in free flight first meets the surface F = 1, as Warp functions.

Within a step a particle follows the parabola x + t v + t^2/2 a, which is leapfrog's drift for every t. Far from
surfaces the search advances by the margin (see `sources.margins`), near them by the surface's grain, with a cubic
Hermite interpolant of the gap (see `gap`) that finds maxima between two outside ends. Crossings are bracketed and
refined on the true gap, and the outside end of the bracket is taken: fast particles do not tunnel.
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.gap import REFINEMENTS, TOLERANCE, Gap, Moment, gap_at
from fieldsim.sources.margins import margin_at, sweep_at
from fieldsim.sources.stages import Stages

# If the maximum of the interpolant exceeds this, the true gap is evaluated there.
CHECK_ABOVE = wp.constant(wp.float64(-0.05))
# Greatest number of pieces of a path.
PIECES = wp.constant(100_000)


@wp.struct
class Motion:
    """A particle under way: position, velocity, acceleration there, the time within the step, spin and state.

    known: 1 if `here` is the gap at that position and time.
    """

    x: wp.vec3d
    v: wp.vec3d
    a: wp.vec3d
    t: wp.float64
    spin: wp.vec3d
    state: wp.int32
    known: wp.int32
    here: Gap


@wp.func
def position_at(m: Motion, t: wp.float64):
    """Position after a further time t of free flight."""
    return m.x + t * (m.v + wp.float64(0.5) * t * m.a)


@wp.func
def gap_rate(m: Motion, gap: Gap, t: wp.float64):
    """Rate of change of the gap after a further time t of free flight."""
    return gap.slope * (gap.speed - wp.dot(gap.normal, m.v + t * m.a))


@functools.cache
def refined_contact(kinds_used):
    """Warp function (motion, radius, surfaces, moment, low, high) -> time of contact between low (out) and high (in).

    Newton's method within the bracket, halving it where Newton leaves it; the outside end is returned.
    """
    gap_of = gap_at(kinds_used)

    @wp.func
    def refined(m: Motion, radius: wp.float64, surfaces: Stages, moment: Moment, low: wp.float64, high: wp.float64):
        t = wp.float64(0.5) * (low + high)
        for k in range(REFINEMENTS):
            gap = gap_of(position_at(m, t), radius, surfaces, moment, t)
            if gap.value > wp.float64(0.0):
                high = t
            else:
                low = t
                if gap.value >= -TOLERANCE:
                    break
            t = t - (gap.value + wp.float64(0.5) * TOLERANCE) / gap_rate(m, gap, t)
            # Not (low < t < high), so that a NaN is caught as well; every fourth time the bracket is halved anyway.
            if not (t > low and t < high) or k % 4 == 3:
                t = wp.float64(0.5) * (low + high)
        return low

    return refined


@wp.func
def maximum_of(g0: wp.float64, d0: wp.float64, g1: wp.float64, d1: wp.float64):
    """The maximum (u, value) of the cubic with values g0, g1 and slopes d0 > 0 > d1 at u = 0, 1."""
    rise = g1 - g0
    c2 = wp.float64(3.0) * rise - wp.float64(2.0) * d0 - d1
    c3 = d0 + d1 - wp.float64(2.0) * rise
    u = d0 / (wp.sqrt(wp.max(c2 * c2 - wp.float64(3.0) * c3 * d0, wp.float64(0.0))) - c2)
    return u, g0 + u * (d0 + u * (c2 + u * c3))


@functools.cache
def contact_within(kinds_used):
    """Warp function (..., both ends of a piece of path) -> a time in it at which the particle is inside, or -1."""
    gap_of = gap_at(kinds_used)

    @wp.func
    def crossing(
        m: Motion,
        radius: wp.float64,
        surfaces: Stages,
        moment: Moment,
        first: Gap,
        begin: wp.float64,
        last: Gap,
        end: wp.float64,
    ):
        high = wp.float64(-1.0)
        if last.value > wp.float64(0.0):
            high = end
        else:
            span = end - begin
            d0 = span * gap_rate(m, first, begin)
            d1 = span * gap_rate(m, last, end)
            if d0 > wp.float64(0.0) and d1 < wp.float64(0.0):
                u, value = maximum_of(first.value, d0, last.value, d1)
                if value > CHECK_ABOVE:
                    t = begin + u * span
                    gap = gap_of(position_at(m, t), radius, surfaces, moment, t)
                    if gap.value > wp.float64(0.0):
                        high = t
        return high

    return crossing


@functools.cache
def first_contact(kinds_used):
    """Warp function (motion, gap there, radius, grain, surfaces, moment, duration) -> time of contact, or -1."""
    gap_of = gap_at(kinds_used)
    crossing = contact_within(kinds_used)
    refined = refined_contact(kinds_used)
    margin = margin_at(kinds_used)
    sweep = sweep_at(kinds_used)

    @wp.func
    def first(
        m: Motion,
        here: Gap,
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
            p = position_at(m, t)
            room = margin(p, surfaces, moment.stage) - radius
            if room > grain:
                t = t + room / speed
                known = wp.int32(0)
            else:
                if known == 0:
                    here = gap_of(p, radius, surfaces, moment, t)
                end = wp.min(t + piece, duration)
                there = gap_of(position_at(m, end), radius, surfaces, moment, end)
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
