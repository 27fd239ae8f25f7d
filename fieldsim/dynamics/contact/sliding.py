"""Balls on the surface F = 1: stuck to it, sliding or rolling along it, or leaving it, as Warp functions.

A sliding ball is held on all surfaces it touches by constraint forces that can push but not pull (RATTLE, Andersen
1983). The impulses along the normals of each half step limit friction's in that half, so that sliding keeps the order
of leapfrog. A ball sticks if friction within its cones can stop it and hold it for the rest of the step: it moves with
the material, and on a surface that does not move it stays exactly in place. So does one that no force can move, as in
a groove without friction.
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.contacts import (
    Contacts,
    Numbers,
    Vectors,
    contacts_at,
    tolerance,
    touching,
)
from fieldsim.dynamics.contact.event_detection import ALIKE, REFINEMENTS, Motion
from fieldsim.dynamics.contact.impulses import Settled, grounds_of, settle
from fieldsim.dynamics.contact.particle_state import ContactParticle
from fieldsim.dynamics.contact.placing import push_out, set_down
from fieldsim.sources.field import field_at
from fieldsim.sources.moments import Moment
from fieldsim.sources.stages import Stages
from fieldsim.sources.surface_velocity import screw

# Approach speeds below SLOW * (gravity along the normal) * dt count as rest.
SLOW = wp.constant(wp.float64(4.0))
# What is left of the forces on a ball that is held, as a share of them.
HELD = wp.constant(wp.float64(1e-11))
# Sweeps of the linear problem within a step of the constraints, and the least share of a lift that opens a gap.
SWEEPS = wp.constant(100)
LEAST_LIFT = wp.constant(wp.float64(0.1))

_settle = settle(True)
_rub = settle(False)


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
        _f1, g = field(p, gravity, stage + 1)
        if s < wp.float64(1.0):
            _f0, g0 = field(p, gravity, stage)
            g = g0 + s * (g - g0)
        return g

    return changing if kinds_used[1] else still


@wp.func
def slow_at(normal: wp.vec3d, a: wp.vec3d, dt: wp.float64):
    """The speed of approach to a contact below which a ball under the acceleration a rests."""
    return SLOW * dt * wp.max(-wp.dot(a, normal), wp.float64(0.0))


@wp.func
def touched(contacts: Contacts, x: wp.vec3d, ball: ContactParticle):
    """1 for the contacts that touch."""
    active = Numbers()
    close = touching(x, ball.radius, ball.grain)
    for k in range(contacts.count):
        if contacts.gaps[k] <= close:
            active[k] = wp.float64(1.0)
    return active


@functools.cache
def carry_along(kinds_used):
    """Warp function that moves a ball with the material for a time -> (position, velocity, contacts there)."""
    moving = len(kinds_used[1]) > 0
    contacts_of = contacts_at(kinds_used)
    down = set_down(kinds_used)

    @wp.func
    def stay(
        x: wp.vec3d, here: Contacts, ball: ContactParticle, surfaces: Stages, moment: Moment, duration: wp.float64
    ):
        return x, wp.vec3d(), here

    @wp.func
    def carry(
        x: wp.vec3d, here: Contacts, ball: ContactParticle, surfaces: Stages, moment: Moment, duration: wp.float64
    ):
        turn = here.turns[here.which]
        shift = here.shifts[here.which]
        share = duration / moment.dt
        x = screw(x, share * turn, share * shift)
        # What grows or melts together comes nearer or goes away besides.
        x = down(x, ball, surfaces, moment, duration, wp.float64(0.5) * ball.grain)
        there = contacts_of(x, ball.radius, here.horizon, ball.grain, surfaces, moment, duration, here)
        u = (wp.cross(turn, x) + shift) / moment.dt
        if there.count > 0:
            n = there.normals[there.which]
            u = u + (there.speeds[there.which] - wp.dot(u, n)) * n
        return x, u, there

    return carry if moving else stay


@wp.func
def sticks(m: Motion, here: Contacts, active: Numbers, grounds: Vectors, ball: ContactParticle, h: wp.float64,
           dt: wp.float64):  # fmt: skip
    """Whether the contacts can end all motion relative to the material within h, and hold the ball there."""
    ground = grounds[here.which]
    turn = here.turns[here.which]
    # In the frame of the material, which is accelerated towards its axis.
    a = m.a - wp.cross(turn, ground) / dt
    end = _settle(m.v + h * a, m.spin, here.count, here.normals, active, here.speeds, Numbers(), grounds, ball)
    size = HELD * (wp.length(m.v - ground) + h * wp.length(a))
    rest = end.v - ground
    n = here.normals[here.which]
    rest = rest - (here.speeds[here.which] - wp.dot(ground, n)) * n
    held = wp.length(rest) <= size and wp.length(end.presses) > wp.float64(0.0)
    if ball.mobility != wp.float64(1.0):
        held = held and ball.radius * wp.length(end.spin - turn / dt) <= size
    return held


@wp.func
def matching(count: int, normals: Vectors, normal: wp.vec3d):
    """Which of `count` normals is most like the given one; -1 if none is like it."""
    found = wp.int32(-1)
    best = ALIKE
    for j in range(count):
        like = wp.dot(normals[j], normal)
        if like > best:
            best = like
            found = j
    return found


@wp.func
def in_place(here: Contacts, there: Contacts, active: Numbers, lifts: Numbers, close: wp.float64):
    """Whether all active contacts are as they must be: touching where there is a lift, else not reached into."""
    for k in range(here.count):
        if active[k] != wp.float64(0.0):
            j = matching(there.count, there.normals, here.normals[k])
            gap = wp.float64(wp.inf)
            if j >= 0:
                gap = there.gaps[j]
            if gap < wp.float64(0.0) or (lifts[k] > wp.float64(0.0) and gap > close):
                return False
    return True


@wp.func
def lifted(here: Contacts, there: Contacts, active: Numbers, lifts: Numbers, close: wp.float64):
    """Lifts along the normals at the start that, to first order, put all contacts in place at the end."""
    result = lifts
    for _ in range(SWEEPS):
        change = wp.float64(0.0)
        for k in range(here.count):
            if active[k] != wp.float64(0.0):
                normal = here.normals[k]
                j = matching(there.count, there.normals, normal)
                value = wp.float64(0.0)
                if j >= 0:
                    outward = there.normals[j]
                    gap = there.gaps[j] - wp.float64(0.5) * close
                    for i in range(here.count):
                        gap += (result[i] - lifts[i]) * wp.dot(here.normals[i], outward)
                    rise = wp.max(wp.dot(normal, outward), LEAST_LIFT)
                    value = wp.max(result[k] - gap / rise, wp.float64(0.0))
                change = wp.max(change, wp.abs(value - result[k]))
                result[k] = value
        if change <= wp.float64(0.01) * close:
            break
    return result


@wp.struct
class Slide:
    """A drift along the surface: place, velocity, spin, contacts there, and how far each contact lifted the ball."""

    x: wp.vec3d
    v: wp.vec3d
    spin: wp.vec3d
    there: Contacts
    lifts: Numbers


@functools.cache
def slide_on(surface_kinds):
    """Warp function: half a kick and a drift along the surface -> Slide."""
    contacts_of = contacts_at(surface_kinds)

    @wp.func
    def slide(
        m: Motion,
        here: Contacts,
        active: Numbers,
        grounds: Vectors,
        ball: ContactParticle,
        surfaces: Stages,
        moment: Moment,
        h: wp.float64,
        horizon: wp.float64,
    ):
        result = Slide()
        result.v = m.v + wp.float64(0.5) * h * m.a
        result.spin = m.spin
        result.there = here
        x = m.x + h * result.v
        close = tolerance(x, ball.radius, ball.grain)
        rub = ball.friction > wp.float64(0.0)
        for _ in range(REFINEMENTS):
            result.there = contacts_of(x, ball.radius, horizon, ball.grain, surfaces, moment, h, result.there)
            if not rub and in_place(here, result.there, active, result.lifts, close):
                break
            lifts = lifted(here, result.there, active, result.lifts, close)
            for k in range(here.count):
                x = x + (lifts[k] - result.lifts[k]) * here.normals[k]
            result.lifts = lifts
            if rub:
                # What the lifts take away is no slip.
                along = result.v
                for k in range(here.count):
                    along = along + (lifts[k] / h) * here.normals[k]
                rubbed = _rub(along, result.spin, here.count, here.normals, active, Numbers(), lifts / h, grounds, ball)
                x = x + h * (rubbed.v - along)
                result.v = result.v + (rubbed.v - along)
                result.spin = rubbed.spin
                rub = False
        result.x = x
        for k in range(here.count):
            result.v = result.v + (result.lifts[k] / h) * here.normals[k]
        return result

    return slide


@wp.func
def held_on(here: Contacts, slid: Slide, ball: ContactParticle):
    """1 for the contacts at the end of a slide that hold the ball: they touch, and their likes lifted it."""
    active = Numbers()
    close = touching(slid.x, ball.radius, ball.grain)
    for k in range(here.count):
        if slid.lifts[k] > wp.float64(0.0):
            j = matching(slid.there.count, slid.there.normals, here.normals[k])
            if j >= 0 and slid.there.gaps[j] <= close:
                active[j] = wp.float64(1.0)
    return active


@wp.func
def time_along(m: Motion, here: Contacts, active: Numbers, ball: ContactParticle, h: wp.float64, dt: wp.float64):
    """How long a ball may slide at once: no farther than a grain, nor into what it is yet to hit."""
    speed = wp.length(m.v)
    if speed * h > ball.grain:
        h = ball.grain / speed
    for k in range(here.count):
        if active[k] == wp.float64(0.0):
            closing = here.speeds[k] - wp.dot(m.v, here.normals[k])
            if closing > slow_at(here.normals[k], m.a, dt) and here.gaps[k] < closing * h:
                h = wp.max(here.gaps[k] / closing, wp.float64(1e-6) * h)
    return h


@functools.cache
def supported(gravity_kinds, surface_kinds):
    """Warp function that moves a touching ball: with the surface, along it, or off it where no force presses it on."""
    contacts_of = contacts_at(surface_kinds)
    push = push_out(surface_kinds)
    pull = pull_between(gravity_kinds)
    carry = carry_along(surface_kinds)
    slide = slide_on(surface_kinds)

    @wp.func
    def support(
        m: Motion,
        here: Contacts,
        active: Numbers,
        ball: ContactParticle,
        gravity: Stages,
        surfaces: Stages,
        moment: Moment,
        horizon: wp.float64,
    ):
        h = moment.dt - moment.t
        grounds = grounds_of(here, m.x, ball, moment.dt)
        # Landing: remove what is left of the approach; its impulses allow friction.
        landed = _settle(m.v, m.spin, here.count, here.normals, active, here.speeds, Numbers(), grounds, ball)
        m.v = landed.v
        m.spin = landed.spin
        result = m
        result.t = moment.dt
        if sticks(m, here, active, grounds, ball, h, moment.dt):
            x, v, there = carry(m.x, here, ball, surfaces, moment, h)
            result.x = x
            result.v = v
            if ball.mobility != wp.float64(1.0):
                result.spin = here.turns[here.which] / moment.dt
            result.here = there
            a = pull(x, gravity, moment.stage, wp.float64(1.0))
            result.a = a
            return result
        part = time_along(m, here, active, ball, h, moment.dt)
        if part < h:
            h = part
            result.t = moment.t + h
        slid = slide(m, here, active, grounds, ball, surfaces, moment, h, horizon)
        x = slid.x
        there = slid.there
        holds = held_on(here, slid, ball)
        if there.least < -touching(x, ball.radius, ball.grain):
            x = push(x, ball, surfaces, moment, h)
            there = contacts_of(x, ball.radius, horizon, ball.grain, surfaces, moment, h, there)
            slid.x = x
            slid.there = there
            holds = held_on(here, slid, ball)
        a = pull(x, gravity, moment.stage, result.t / moment.dt)
        end = Settled()
        end.v = slid.v + wp.float64(0.5) * h * a
        end.spin = slid.spin
        if wp.length(holds) > wp.float64(0.0):
            grounds = grounds_of(there, x, ball, moment.dt)
            end = _settle(end.v, end.spin, there.count, there.normals, holds, there.speeds, Numbers(), grounds, ball)
        result.x = x
        result.v = end.v
        result.a = a
        result.spin = end.spin
        result.here = there
        return result

    return support
