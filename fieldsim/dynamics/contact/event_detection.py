"""Event detection: when a particle in free flight first meets the surface F = 1, as Warp functions.

Within a step a particle follows the parabola x + t v + t^2/2 a, which is leapfrog's drift for every t. Far from
surfaces the search advances by the margin (see `sources.margins`). Near them it knows the gap, which changes no faster
than ball and surface move: where the gaps at both ends of a piece of path add up to more than its length, nothing is
touched between. Elsewhere pieces are as long as the surface's grain, and a cubic Hermite interpolant of each contact's
gap finds minima between two outside ends. Crossings are bracketed and refined, and the outside end of the bracket is
taken: fast particles do not tunnel.
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.contacts import Contacts, contacts_at, tolerance
from fieldsim.dynamics.contact.particle_state import ContactParticle
from fieldsim.sources.margins import margin_at, sweep_at
from fieldsim.sources.moments import Moment, fraction
from fieldsim.sources.stages import Stages

# If the minimum of the interpolant is below this share of the grain, the true gap is evaluated there.
CHECK_BELOW = wp.constant(wp.float64(0.05))
# Normals at both ends of a piece that belong to one contact differ by less than the angle of this cosine.
ALIKE = wp.constant(wp.float64(0.5))
# Greatest number of pieces of a path, and of iterations of a refinement.
PIECES = wp.constant(100_000)
REFINEMENTS = wp.constant(64)


@wp.struct
class Motion:
    """A particle under way: position, velocity, acceleration there, the time within the step, spin and state.

    known: 1 if `here` are the contacts at that position and time.
    """

    x: wp.vec3d
    v: wp.vec3d
    a: wp.vec3d
    t: wp.float64
    spin: wp.vec3d
    state: wp.int32
    known: wp.int32
    here: Contacts


@wp.func
def position_at(x: wp.vec3d, v: wp.vec3d, a: wp.vec3d, t: wp.float64):
    """Position after a further time t of free flight."""
    return x + t * (v + wp.float64(0.5) * t * a)


@wp.func
def gap_rate(normal: wp.vec3d, speed: wp.float64, v: wp.vec3d):
    """Rate of change of a contact's gap at the velocity v; normal, speed: the surface's."""
    return wp.dot(normal, v) - speed


@functools.cache
def refined_contact(kinds_used):
    """Warp function (motion, ball, surfaces, moment, low, high, horizon) -> time of contact between low and high.

    low: outside; high: inside. Newton's method within the bracket, halving it where Newton leaves it; the outside end
    is returned.
    """
    contacts_of = contacts_at(kinds_used)

    @wp.func
    def refined(
        m: Motion,
        ball: ContactParticle,
        surfaces: Stages,
        moment: Moment,
        low: wp.float64,
        high: wp.float64,
        horizon: wp.float64,
    ):
        t = wp.float64(0.5) * (low + high)
        there = Contacts()
        for k in range(REFINEMENTS):
            p = position_at(m.x, m.v, m.a, t)
            there = contacts_of(p, ball.radius, horizon, ball.grain, surfaces, moment, t, there)
            close = tolerance(p, ball.radius, ball.grain)
            if there.least < wp.float64(0.0):
                high = t
            else:
                low = t
                if there.least <= close:
                    break
            step = wp.float64(wp.nan)
            if there.count > 0:
                step = -(there.least - wp.float64(0.5) * close) / gap_rate(
                    there.normals[there.which], there.speeds[there.which], m.v + t * m.a
                )
            t = t + step
            # Not (low < t < high), so that a NaN is caught as well; every fourth time the bracket is halved anyway.
            if not (t > low and t < high) or k % 4 == 3:
                t = wp.float64(0.5) * (low + high)
        return low

    return refined


@wp.func
def minimum_of(g0: wp.float64, d0: wp.float64, g1: wp.float64, d1: wp.float64):
    """The minimum (u, value) of the cubic with values g0, g1 and slopes d0 < 0 < d1 at u = 0, 1."""
    fall = g1 - g0
    c2 = wp.float64(3.0) * fall - wp.float64(2.0) * d0 - d1
    c3 = d0 + d1 - wp.float64(2.0) * fall
    u = -d0 / (c2 + wp.sqrt(wp.max(c2 * c2 - wp.float64(3.0) * c3 * d0, wp.float64(0.0))))
    return u, g0 + u * (d0 + u * (c2 + u * c3))


@functools.cache
def contact_within(kinds_used):
    """Warp function (..., contacts at both ends of a piece of path) -> a time in it with the ball inside, or -1."""
    contacts_of = contacts_at(kinds_used)

    @wp.func
    def crossing(
        m: Motion,
        ball: ContactParticle,
        surfaces: Stages,
        moment: Moment,
        first: Contacts,
        begin: wp.float64,
        last: Contacts,
        end: wp.float64,
        horizon: wp.float64,
    ):
        high = wp.float64(-1.0)
        if last.least < wp.float64(0.0):
            high = end
        span = end - begin
        for k in range(first.count):
            d0 = span * gap_rate(first.normals[k], first.speeds[k], m.v + begin * m.a)
            if high < wp.float64(0.0) and d0 < wp.float64(0.0):
                for j in range(last.count):
                    d1 = span * gap_rate(last.normals[j], last.speeds[j], m.v + end * m.a)
                    same = wp.dot(first.normals[k], last.normals[j]) > ALIKE
                    if high < wp.float64(0.0) and same and d1 > wp.float64(0.0):
                        u, value = minimum_of(first.gaps[k], d0, last.gaps[j], d1)
                        if value < CHECK_BELOW * ball.grain and u > wp.float64(0.0) and u < wp.float64(1.0):
                            t = begin + u * span
                            p = position_at(m.x, m.v, m.a, t)
                            there = contacts_of(p, ball.radius, horizon, ball.grain, surfaces, moment, t, first)
                            if there.least < wp.float64(0.0):
                                high = t
        return high

    return crossing


@wp.struct
class Passage:
    """What a flight meets: the time of first contact, or -1; and the contacts at its end, if known is 1."""

    time: wp.float64
    known: wp.int32
    there: Contacts


@functools.cache
def first_contact(kinds_used):
    """Warp function (motion, contacts there, ball, surfaces, moment, duration) -> Passage."""
    contacts_of = contacts_at(kinds_used)
    crossing = contact_within(kinds_used)
    refined = refined_contact(kinds_used)
    margin = margin_at(kinds_used)
    sweep = sweep_at(kinds_used)

    @wp.func
    def first(
        m: Motion,
        here: Contacts,
        ball: ContactParticle,
        surfaces: Stages,
        moment: Moment,
        duration: wp.float64,
    ):
        speed = wp.length(m.v) + duration * wp.length(m.a) + sweep(surfaces, moment.stage) / moment.dt
        piece = duration
        if speed * duration > ball.grain:
            piece = ball.grain / speed
        passage = Passage()
        passage.time = wp.float64(-1.0)
        known = wp.int32(1)
        t = wp.float64(0.0)
        for _ in range(PIECES):
            p = position_at(m.x, m.v, m.a, t)
            room = margin(p, surfaces, moment.stage, fraction(moment, t)) - ball.radius
            if room > ball.grain:
                t = t + room / speed
                known = wp.int32(0)
            else:
                span = wp.min(piece, duration - t)
                # What is nearer than a piece is long can be touched in it.
                horizon = wp.float64(1.01) * speed * span
                if known == 0 or here.horizon < horizon:
                    here = contacts_of(p, ball.radius, horizon, ball.grain, surfaces, moment, t, here)
                if here.least >= speed * span:
                    t = t + here.least / speed
                    known = wp.int32(0)
                else:
                    end = t + span
                    q = position_at(m.x, m.v, m.a, end)
                    there = contacts_of(q, ball.radius, horizon, ball.grain, surfaces, moment, end, here)
                    if here.least + there.least < speed * span:
                        high = crossing(m, ball, surfaces, moment, here, t, there, end, horizon)
                        if high >= wp.float64(0.0):
                            passage.time = refined(m, ball, surfaces, moment, t, high, horizon)
                            break
                    here = there
                    known = wp.int32(1)
                    t = end
            if not (t < duration):
                if known == 1:
                    passage.known = wp.int32(1)
                    passage.there = here
                break
        return passage

    return first
