"""Response of spherical particles at the surface F = 1: one step near it, with bounces, as Warp functions.

A step is cut at each event: up to the event the particle takes a leapfrog step of its own. The step stays a chain of
leapfrog steps and keeps its order, so that elastic bounces conserve energy as free motion does.

A touching particle whose speed gravity could produce within a few steps rests (see `sliding`): a particle at rest
neither sinks nor jitters.
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.event_detection import Motion, first_contact
from fieldsim.dynamics.contact.friction import after_friction, slip_of
from fieldsim.dynamics.contact.gap import TOUCHING, Gap, Moment, gap_at, push_out
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
from fieldsim.dynamics.contact.repulsion import repelled_step
from fieldsim.dynamics.contact.sliding import carry_along, ground_at, pull_between, supported
from fieldsim.sources.stages import Stages

# Approach speeds below SLOW * (gravity along the normal) * dt count as rest.
SLOW = wp.constant(wp.float64(4.0))
# After so many hits in one step a particle slides, as in a bowl that it would follow in ever shorter hops.
MOST_HITS = wp.constant(8)
# Greatest number of events within one step.
EVENTS = wp.constant(256)


@functools.cache
def flight(gravity_kinds, surface_kinds):
    """Warp function that flies a particle to its next contact or to the step's end -> (motion, whether it hit)."""
    first = first_contact(surface_kinds)
    pull = pull_between(gravity_kinds)

    @wp.func
    def fly(m: Motion, here: Gap, ball: ContactParticle, gravity: Stages, surfaces: Stages, moment: Moment):
        h = moment.dt - moment.t
        found = first(m, here, ball.radius, ball.grain, surfaces, moment, h)
        result = m
        result.known = wp.int32(0)
        result.t = moment.dt
        if found >= wp.float64(0.0):
            h = found
            result.t = moment.t + found
        half = wp.float64(0.5) * h
        v = m.v + half * m.a
        result.x = m.x + h * v
        a = pull(result.x, gravity, moment.stage, result.t / moment.dt)
        result.a = a
        result.v = v + half * a
        return result, wp.where(found >= wp.float64(0.0), 1, 0)

    return fly


@functools.cache
def rebound(surface_kinds):
    """Warp function: velocity and spin after a bounce."""
    ground_of = ground_at(surface_kinds)

    @wp.func
    def bounce(m: Motion, here: Gap, ball: ContactParticle, leaving: wp.float64, surfaces: Stages, moment: Moment):
        press = -(wp.float64(1.0) + ball.restitution) * leaving
        v = m.v + press * here.normal
        ground, _turn, _shift = ground_of(m.x, here.normal, ball, surfaces, moment)
        slip = slip_of(v, m.spin, ground, here.normal, ball.radius)
        v, spin = after_friction(v, m.spin, slip, here.normal, ball, press)
        return v, spin

    return bounce


@functools.cache
def contact_step(gravity_kinds, surface_kinds):
    """Warp function: one whole step near a surface, from `stage` to the next, begun at `time`.

    Returns (motion, number of hits). Where surfaces do not move, the gap at the end is reused by the next step.
    """
    still = wp.constant(wp.int32(0 if surface_kinds[1] else 1))
    gap_of = gap_at(surface_kinds)
    push = push_out(surface_kinds)
    support = supported(gravity_kinds, surface_kinds)
    fly = flight(gravity_kinds, surface_kinds)
    pull = pull_between(gravity_kinds)
    bounce = rebound(surface_kinds)
    carry = carry_along(surface_kinds)
    repelled = repelled_step(gravity_kinds, surface_kinds)
    ground_of = ground_at(surface_kinds)

    @wp.func
    def step(
        m: Motion,
        stage: int,
        time: wp.float64,
        ball: ContactParticle,
        balls: ContactParticles,
        gravity: Stages,
        surfaces: Stages,
        dt: wp.float64,
    ):
        if ball.law == REPULSION:
            m = repelled(m, stage, ball, balls, gravity, surfaces, dt)
            return m, wp.int32(0)
        hits = wp.int32(0)
        hit = wp.int32(0)
        moment = Moment()
        moment.stage = stage
        moment.dt = dt
        m.t = wp.float64(0.0)
        m.known = m.known * still
        for _ in range(EVENTS):
            moment.t = m.t
            here = m.here
            if m.known == 0:
                here = gap_of(m.x, ball.radius, surfaces, moment, wp.float64(0.0))
            if here.value > TOUCHING:
                m.x = push(m.x, ball.radius, ball.grain, surfaces, moment)
                here = gap_of(m.x, ball.radius, surfaces, moment, wp.float64(0.0))
                a = pull(m.x, gravity, stage, m.t / dt)
                m.a = a
            if m.state == ABSORBED:
                _u, turn, shift = ground_of(m.x, here.normal, ball, surfaces, moment)
                x, v, there = carry(m.x, here, turn, shift, ball, surfaces, moment, dt - m.t)
                m.x = x
                m.v = v
                m.here = there
                m.t = dt
                break
            leaving = wp.dot(m.v, here.normal) - here.speed
            slow = SLOW * dt * wp.max(-wp.dot(m.a, here.normal), wp.float64(0.0))
            touching = here.value >= -TOUCHING
            many_hits = hits >= MOST_HITS
            before = m.v
            if touching and ball.law == ABSORB:
                if leaving <= wp.float64(0.0):
                    m.state = ABSORBED
                    u, _turn, _shift = ground_of(m.x, here.normal, ball, surfaces, moment)
                    v = u + (here.speed - wp.dot(u, here.normal)) * here.normal
                    m.v = v
                    log_event(balls, ball.index, time + m.t, TAKEN, here.low, v - before)
                    hits += 1
                    hit = wp.int32(0)
                    m.here = here
                    m.known = wp.int32(1)
                    continue
            elif touching and leaving < -slow and not many_hits:
                v, spin = bounce(m, here, ball, leaving, surfaces, moment)
                m.v = v
                m.spin = spin
                log_event(balls, ball.index, time + m.t, HIT, here.low, v - before)
                leaving = -ball.restitution * leaving
                hit = wp.int32(1)
            hits += hit
            hit = wp.int32(0)
            if ball.law != ABSORB and touching and ((leaving <= slow and slow > wp.float64(0.0)) or many_hits):
                if m.state != RESTING:
                    m.state = RESTING
                    fall = wp.max(-leaving, wp.float64(0.0))
                    log_event(balls, ball.index, time + m.t, LAND, here.low, fall * here.normal)
                m = support(m, here, ball, gravity, surfaces, moment)
                m.known = wp.int32(1)
            else:
                m.state = MOVING
                m, hit = fly(m, here, ball, gravity, surfaces, moment)
            if m.t >= dt:
                break
        if m.t < dt:  # more than EVENTS events: the particle stays in place until the end of the step
            a = pull(m.x, gravity, stage, wp.float64(1.0))
            m.a = a
        return m, hits

    return step
