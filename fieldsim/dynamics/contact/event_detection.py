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

from fieldsim.dynamics.contact.contacts import Contacts, copy_contacts, tolerance
from fieldsim.dynamics.contact.particle_state import ContactParticle
from fieldsim.dynamics.contact.search import contacts_at
from fieldsim.dynamics.contact.selection import entry, row
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

    here: contacts; known: 1 if they are those at that position and time, else they are some known before.
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
def position_at(m: wp.ref[Motion], t: wp.float64):
    """Position after a further time t of free flight."""
    return m.x + t * (m.v + wp.float64(0.5) * t * m.a)


@wp.func
def gap_rate(contacts: wp.ref[Contacts], k: int, v: wp.vec3d):
    """Rate of change of a contact's gap at the velocity v."""
    return wp.dot(row(contacts.normals, k), v) - entry(contacts.speeds, k)


@functools.cache
def refined_contact(kinds_used):
    """Warp function (motion, ball, surfaces, moment, low, high, horizon, there) -> time of contact in between.

    low: outside; high: inside. Newton's method within the bracket, halving it where Newton leaves it; the outside end
    is returned. there: contacts known near, and then those at the last time tried.
    """
    find = contacts_at(kinds_used)

    @wp.func
    def refined(
        m: wp.ref[Motion],
        ball: wp.ref[ContactParticle],
        surfaces: wp.ref[Stages],
        moment: Moment,
        low: wp.float64,
        high: wp.float64,
        horizon: wp.float64,
        there: wp.ref[Contacts],
    ):
        t = wp.float64(0.5) * (low + high)
        for k in range(REFINEMENTS):
            p = position_at(m, t)
            find(p, ball.radius, horizon, ball.grain, surfaces, moment, t, there)
            close = tolerance(p, ball.radius, ball.grain)
            if there.least < wp.float64(0.0):
                high = t
            else:
                low = t
                if there.least <= close:
                    break
            step = wp.float64(wp.nan)
            if there.count > 0:
                step = -(there.least - wp.float64(0.5) * close) / gap_rate(there, there.which, m.v + t * m.a)
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
    """Warp function (motion, ball, surfaces, moment, begin, contacts at the end, end, horizon) -> a time inside, or -1.

    Of a piece of path between the times `begin`, at which m.here are the contacts, and `end`.
    """
    find = contacts_at(kinds_used)

    @wp.func
    def crossing(
        m: wp.ref[Motion],
        ball: wp.ref[ContactParticle],
        surfaces: wp.ref[Stages],
        moment: Moment,
        begin: wp.float64,
        last: wp.ref[Contacts],
        end: wp.float64,
        horizon: wp.float64,
    ):
        if last.least < wp.float64(0.0):
            return end
        span = end - begin
        dip = Contacts()
        for k in range(m.here.count):
            d0 = span * gap_rate(m.here, k, m.v + begin * m.a)
            if d0 < wp.float64(0.0):
                for j in range(last.count):
                    d1 = span * gap_rate(last, j, m.v + end * m.a)
                    if wp.dot(row(m.here.normals, k), row(last.normals, j)) > ALIKE and d1 > wp.float64(0.0):
                        u, value = minimum_of(entry(m.here.gaps, k), d0, entry(last.gaps, j), d1)
                        if value < CHECK_BELOW * ball.grain and u > wp.float64(0.0) and u < wp.float64(1.0):
                            t = begin + u * span
                            copy_contacts(m.here, dip)
                            find(position_at(m, t), ball.radius, horizon, ball.grain, surfaces, moment, t, dip)
                            if dip.least < wp.float64(0.0):
                                return t
        return wp.float64(-1.0)

    return crossing


@functools.cache
def first_contact(kinds_used):
    """Warp function (motion, ball, surfaces, moment, duration) -> the time of first contact of a flight, or -1.

    The motion's contacts become others of the flight: known, at its end, or where none are known.
    """
    find = contacts_at(kinds_used)
    crossing = contact_within(kinds_used)
    refined = refined_contact(kinds_used)
    margin = margin_at(kinds_used)
    sweep = sweep_at(kinds_used)

    @wp.func
    def first(
        m: wp.ref[Motion],
        ball: wp.ref[ContactParticle],
        surfaces: wp.ref[Stages],
        moment: Moment,
        duration: wp.float64,
    ):
        speed = wp.length(m.v) + duration * wp.length(m.a) + sweep(surfaces, moment.stage) / moment.dt
        piece = duration
        if speed * duration > ball.grain:
            piece = ball.grain / speed
        found = wp.float64(-1.0)
        there = Contacts()
        m.known = wp.int32(1)
        t = wp.float64(0.0)
        for _ in range(PIECES):
            p = position_at(m, t)
            room = wp.float64(0.0)
            if m.known == 0 or m.here.count == 0:
                room = margin(p, surfaces, moment.stage, fraction(moment, t)) - ball.radius
            if room > ball.grain:
                t = t + room / speed
                m.known = wp.int32(0)
            else:
                span = wp.min(piece, duration - t)
                # What is nearer than a piece is long can be touched in it.
                horizon = wp.float64(1.01) * speed * span
                if m.known == 0 or m.here.horizon < horizon:
                    find(p, ball.radius, horizon, ball.grain, surfaces, moment, t, m.here)
                if m.here.least >= speed * span:
                    t = t + m.here.least / speed
                    m.known = wp.int32(0)
                else:
                    end = t + span
                    copy_contacts(m.here, there)
                    find(position_at(m, end), ball.radius, horizon, ball.grain, surfaces, moment, end, there)
                    if m.here.least + there.least < speed * span:
                        high = crossing(m, ball, surfaces, moment, t, there, end, horizon)
                        if high >= wp.float64(0.0):
                            found = refined(m, ball, surfaces, moment, t, high, horizon, there)
                            m.here = there
                            m.known = wp.int32(0)
                            break
                    m.here = there
                    m.known = wp.int32(1)
                    t = end
            if not (t < duration):
                break
        return found

    return first
