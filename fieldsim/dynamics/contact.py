"""Bounces, rest and sliding of spherical particles on the surface F = 1, as Warp functions.

A step that is cut at an event stays a chain of leapfrog steps, because up to the event the particle takes a leapfrog
step of its own, and so it keeps its order: elastic bounces conserve energy as free motion does.

A touching particle that is slower than gravity would make it within a few steps rests: it is held on the surface by a
constraint force that can only push (RATTLE, Andersen 1983), without friction. So nothing at rest sinks or jitters.
"""

import functools

import warp as wp

from fieldsim.dynamics.encounter import Motion, first_contact
from fieldsim.dynamics.sources import Stages, field_at
from fieldsim.dynamics.touch import REFINEMENTS, TOLERANCE, TOUCHING, Moment, Touch, push_out, touch_at

# Approach speeds below so many times (gravity along the normal) * dt count as rest.
RESTING = wp.constant(wp.float64(4.0))
# Events within one step at most.
EVENTS = wp.constant(256)


@functools.cache
def pull_between(kinds_used):
    """Warp function (point, gravity, stage, s) -> acceleration at the fraction s of a step, between its two stages."""
    field = field_at(kinds_used)

    @wp.func
    def still(p: wp.vec3d, gravity: Stages, stage: int, s: wp.float64):
        _f, g = field(p, gravity, stage)
        return g

    @wp.func
    def changing(p: wp.vec3d, gravity: Stages, stage: int, s: wp.float64):
        _f0, g0 = field(p, gravity, stage)
        _f1, g1 = field(p, gravity, stage + 1)
        return g0 + s * (g1 - g0)

    return changing if kinds_used[1] else still


@functools.cache
def supported(gravity_kinds, surface_kinds):
    """Warp function that moves a touching particle along the surface, or off it where nothing presses it on."""
    touch_of = touch_at(surface_kinds)
    push = push_out(surface_kinds)
    pull = pull_between(gravity_kinds)

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
        a = pull(x, gravity, moment.stage, result.t / moment.dt)
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
    pull = pull_between(gravity_kinds)

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
        a = pull(result.x, gravity, moment.stage, result.t / moment.dt)
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
    pull = pull_between(gravity_kinds)

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
                a = pull(m.x, gravity, stage, m.t / dt)
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
            a = pull(m.x, gravity, stage, wp.float64(1.0))
            m.a = a
        return m, hits

    return step
