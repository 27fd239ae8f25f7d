"""Response of spherical particles at the surface F = 1: one step near it, with bounces, as Warp functions.

A step is cut at each event: up to the event the particle takes a leapfrog step of its own. The step stays a chain of
leapfrog steps and keeps its order, so that elastic bounces conserve energy as free motion does.

A touching particle whose speed gravity could produce within a few steps rests (see `sliding`): a particle at rest
neither sinks nor jitters. What touches at several places answers to all of them together (see `impulses`).
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.contacts import Numbers, touching
from fieldsim.dynamics.contact.event_detection import Motion, first_contact
from fieldsim.dynamics.contact.impulses import grounds_of, settle
from fieldsim.dynamics.contact.particle_state import (
    ABSORB,
    ABSORBED,
    HIT,
    LAND,
    MOVING,
    REPULSION,
    RESTING,
    TAKEN,
    ContactParticle,
    ContactParticles,
    log_event,
)
from fieldsim.dynamics.contact.placing import push_out
from fieldsim.dynamics.contact.repulsion import repelled_step
from fieldsim.dynamics.contact.search import contacts_at
from fieldsim.dynamics.contact.selection import entry, row
from fieldsim.dynamics.contact.sliding import carry_along, pull_between, slow_at, supported, touched
from fieldsim.sources.margins import sweep_at
from fieldsim.sources.moments import Moment
from fieldsim.sources.stages import Stages

# After so many hits in one step a particle slides, as in a bowl that it would follow in ever shorter hops. One that
# loses nothing at a hit, between bodies that stay, does so only where it skims along: at an approach by no more than
# this share of its speed, whose square is the share of the energy that is lost then.
MOST_HITS = wp.constant(8)
SKIMMING = wp.constant(wp.float64(0.01))
# How many times as far as a step goes contacts are looked for.
SPARE = wp.constant(wp.float64(1.5))
# Greatest number of events within one step.
EVENTS = wp.constant(256)

_settle = settle(True)


@functools.cache
def flight(gravity_kinds, surface_kinds):
    """Warp function that flies a particle to its next contact or to the step's end -> 1 if it hit."""
    first = first_contact(surface_kinds)
    pull = pull_between(gravity_kinds)

    @wp.func
    def fly(m: wp.ref[Motion], ball: wp.ref[ContactParticle], gravity: wp.ref[Stages], surfaces: wp.ref[Stages],
            moment: Moment):  # fmt: skip
        h = moment.dt - moment.t
        m.t = moment.dt
        met = first(m, ball, surfaces, moment, h)
        if met >= wp.float64(0.0):
            h = met
            m.t = moment.t + h
        half = wp.float64(0.5) * h
        v = m.v + half * m.a
        m.x = m.x + h * v
        m.a = pull(m.x, gravity, moment.stage, m.t / moment.dt)
        m.v = v + half * m.a
        return wp.where(met >= wp.float64(0.0), 1, 0)

    return fly


@wp.struct
class Meeting:
    """How a ball meets what it touches: the contact that it approaches fastest, and whether that is a hit, or rest.

    active: 1 for the contacts that touch; leaving: speed away from the surface at contact `which`; targets: speeds at
    which the contacts send it away; hits: whether some contact is approached too fast for rest; rests: whether some
    contact is left too slowly for flight.
    """

    active: Numbers
    targets: Numbers
    which: wp.int32
    leaving: wp.float64
    hits: wp.bool
    rests: wp.bool


@wp.func
def meeting_of(m: wp.ref[Motion], ball: wp.ref[ContactParticle], dt: wp.float64):
    """What a ball does to the contacts that touch, and they to it."""
    result = Meeting()
    result.which = wp.int32(-1)
    result.active = touched(m.here, m.x, ball)
    result.leaving = wp.float64(wp.inf)
    for k in range(m.here.count):
        result.targets[k] = entry(m.here.speeds, k)
        if entry(result.active, k) != wp.float64(0.0):
            leaving = wp.dot(m.v, row(m.here.normals, k)) - entry(m.here.speeds, k)
            slow = slow_at(row(m.here.normals, k), m.a, dt)
            result.hits = result.hits or leaving < -slow
            if wp.abs(leaving) > slow:
                # What is being left, if the others press on it, throws back no more than came: else energy is made.
                result.targets[k] = entry(m.here.speeds, k) - ball.restitution * leaving
            if leaving <= slow and slow > wp.float64(0.0):
                result.rests = True
            if leaving < result.leaving:
                result.leaving = leaving
                result.which = k
    return result


@wp.func
def hops_no_more(m: wp.ref[Motion], meeting: wp.ref[Meeting], ball: wp.ref[ContactParticle], still: int):
    """Whether a ball that has hit many times in a step slides from now on; still: 1 if no surface moves."""
    elastic = still == 1 and ball.restitution == wp.float64(1.0)
    return not elastic or -meeting.leaving <= SKIMMING * wp.length(m.v)


@functools.cache
def contact_step(gravity_kinds, surface_kinds):
    """Warp function: one whole step near a surface, from `stage` to the next, begun at `time`.

    Returns the number of hits. Where surfaces do not move, the contacts at the end are reused by the next step.
    """
    still = wp.constant(wp.int32(0 if surface_kinds[1] else 1))
    find = contacts_at(surface_kinds)
    push = push_out(surface_kinds)
    sweep = sweep_at(surface_kinds)
    support = supported(gravity_kinds, surface_kinds)
    fly = flight(gravity_kinds, surface_kinds)
    pull = pull_between(gravity_kinds)
    carry = carry_along(surface_kinds)
    repelled = repelled_step(gravity_kinds, surface_kinds)

    @wp.func
    def horizon_of(m: wp.ref[Motion], ball: wp.ref[ContactParticle], surfaces: wp.ref[Stages], stage: int,
                   dt: wp.float64):  # fmt: skip
        """How far contacts matter: what can be reached within the step, or a grain."""
        path = dt * (wp.length(m.v) + dt * wp.length(m.a)) + sweep(surfaces, stage)
        least = wp.float64(2.0) * touching(m.x, ball.radius, ball.grain)
        return wp.max(wp.min(path, ball.grain), least)

    @wp.func
    def absorbed(m: wp.ref[Motion], ball: wp.ref[ContactParticle], dt: wp.float64):
        """The velocity of a ball that sticks at once."""
        grounds = grounds_of(m.here, m.x, ball, dt)
        u = row(grounds, m.here.which)
        n = row(m.here.normals, m.here.which)
        return u + (entry(m.here.speeds, m.here.which) - wp.dot(u, n)) * n

    @wp.func
    def bounce(m: wp.ref[Motion], met: wp.ref[Meeting], ball: wp.ref[ContactParticle], dt: wp.float64):
        """Change velocity and spin as all contacts that touch do together."""
        grounds = grounds_of(m.here, m.x, ball, dt)
        presses = Numbers()
        _settle(m.v, m.spin, m.here, met.active, met.targets, presses, grounds, ball)

    @wp.func
    def step(
        m: wp.ref[Motion],
        stage: int,
        time: wp.float64,
        ball: wp.ref[ContactParticle],
        balls: wp.ref[ContactParticles],
        gravity: wp.ref[Stages],
        surfaces: wp.ref[Stages],
        dt: wp.float64,
    ):
        if ball.law == REPULSION:
            repelled(m, stage, ball, balls, gravity, surfaces, dt)
            return wp.int32(0)
        hits = wp.int32(0)
        hit = wp.int32(0)
        moment = Moment()
        moment.stage = stage
        moment.dt = dt
        m.t = wp.float64(0.0)
        m.known = m.known * still
        for _ in range(EVENTS):
            moment.t = m.t
            needed = horizon_of(m, ball, surfaces, stage, dt)
            # Farther than needed, so that the next step, if a little faster, knows enough.
            horizon = SPARE * needed
            if m.known == 0 or m.here.horizon < needed:
                find(m.x, ball.radius, horizon, ball.grain, surfaces, moment, wp.float64(0.0), m.here)
            if m.here.least < -touching(m.x, ball.radius, ball.grain):
                m.x = push(m.x, ball, surfaces, moment, wp.float64(0.0))
                find(m.x, ball.radius, horizon, ball.grain, surfaces, moment, wp.float64(0.0), m.here)
                m.a = pull(m.x, gravity, stage, m.t / dt)
            if m.state == ABSORBED:
                carry(m, ball, surfaces, moment, dt - m.t)
                m.t = dt
                break
            met = meeting_of(m, ball, dt)
            touches = met.which >= 0
            many_hits = hits >= MOST_HITS and hops_no_more(m, met, ball, still)
            before = wp.vec3d(m.v)
            if touches and ball.law == ABSORB:
                if met.leaving <= wp.float64(0.0):
                    m.state = ABSORBED
                    m.v = absorbed(m, ball, dt)
                    log_event(balls, ball.index, time + m.t, TAKEN, row(m.here.points, m.here.which), m.v - before)
                    hits += 1
                    hit = wp.int32(0)
                    m.known = wp.int32(1)
                    continue
            elif touches and met.hits and not many_hits:
                bounce(m, met, ball, dt)
                log_event(balls, ball.index, time + m.t, HIT, row(m.here.points, met.which), m.v - before)
                met = meeting_of(m, ball, dt)
                hit = wp.int32(1)
            hits += hit
            hit = wp.int32(0)
            if ball.law != ABSORB and touches and (met.rests or many_hits):
                if m.state != RESTING:
                    m.state = RESTING
                    fall = wp.max(-met.leaving, wp.float64(0.0)) * row(m.here.normals, met.which)
                    log_event(balls, ball.index, time + m.t, LAND, row(m.here.points, met.which), fall)
                support(m, met.active, ball, gravity, surfaces, moment, horizon)
                m.known = wp.int32(1)
            else:
                m.state = MOVING
                hit = fly(m, ball, gravity, surfaces, moment)
            if m.t >= dt:
                break
        if m.t < dt:  # more than EVENTS events: the particle stays in place until the end of the step
            m.a = pull(m.x, gravity, stage, wp.float64(1.0))
        return hits

    return step
