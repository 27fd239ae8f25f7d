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
    copy_contacts,
    displace_over,
    tolerance,
    touching,
)
from fieldsim.dynamics.contact.event_detection import ALIKE, REFINEMENTS, Motion
from fieldsim.dynamics.contact.impulses import grounds_of, settle
from fieldsim.dynamics.contact.particle_state import ContactParticle
from fieldsim.dynamics.contact.placing import push_out, set_down
from fieldsim.dynamics.contact.search import contacts_at
from fieldsim.dynamics.contact.selection import entry, row
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
    def still(p: wp.vec3d, gravity: wp.ref[Stages], stage: int, s: wp.float64):
        _f, g = field(p, gravity, stage)
        return g

    @wp.func
    def changing(p: wp.vec3d, gravity: wp.ref[Stages], stage: int, s: wp.float64):
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
def touched(contacts: wp.ref[Contacts], x: wp.vec3d, ball: wp.ref[ContactParticle]):
    """1 for the contacts that touch."""
    active = Numbers()
    close = touching(x, ball.radius, ball.grain)
    for k in range(contacts.count):
        if entry(contacts.gaps, k) <= close:
            active[k] = wp.float64(1.0)
    return active


@functools.cache
def carry_along(kinds_used):
    """Warp function (motion, ball, surfaces, moment, duration) that moves a ball with the material for a time."""
    moving = len(kinds_used[1]) > 0
    down = set_down(kinds_used)

    @wp.func
    def stay(m: wp.ref[Motion], ball: wp.ref[ContactParticle], surfaces: wp.ref[Stages], moment: Moment,
             duration: wp.float64):  # fmt: skip
        m.v = wp.vec3d()

    @wp.func
    def carry(m: wp.ref[Motion], ball: wp.ref[ContactParticle], surfaces: wp.ref[Stages], moment: Moment,
              duration: wp.float64):  # fmt: skip
        turn = row(m.here.turns, m.here.which)
        shift = row(m.here.shifts, m.here.which)
        share = duration / moment.dt
        # What grows or melts together comes nearer or goes away besides.
        x = screw(m.x, share * turn, share * shift)
        horizon = wp.max(m.here.horizon, wp.float64(0.5) * ball.grain)
        m.x = down(x, ball, surfaces, moment, duration, horizon, m.here)
        u = (wp.cross(turn, m.x) + shift) / moment.dt
        if m.here.count > 0:
            n = row(m.here.normals, m.here.which)
            u = u + (entry(m.here.speeds, m.here.which) - wp.dot(u, n)) * n
        m.v = u

    return carry if moving else stay


@wp.func
def sticks(m: wp.ref[Motion], active: wp.ref[Numbers], grounds: wp.ref[Vectors], ball: wp.ref[ContactParticle],
           h: wp.float64, dt: wp.float64):  # fmt: skip
    """Whether the contacts can end all motion relative to the material within h, and hold the ball there."""
    which = m.here.which
    ground = row(grounds, which)
    turn = row(m.here.turns, which)
    # In the frame of the material, which is accelerated towards its axis.
    a = m.a - wp.cross(turn, ground) / dt
    v = m.v + h * a
    spin = wp.vec3d(m.spin)
    presses = Numbers()
    _settle(v, spin, m.here, active, m.here.speeds, presses, grounds, ball)
    size = HELD * (wp.length(m.v - ground) + h * wp.length(a))
    rest = v - ground
    n = row(m.here.normals, which)
    rest = rest - (entry(m.here.speeds, which) - wp.dot(ground, n)) * n
    held = wp.length(rest) <= size and wp.length(presses) > wp.float64(0.0)
    if ball.mobility != wp.float64(1.0):
        held = held and ball.radius * wp.length(spin - turn / dt) <= size
    return held


@wp.func
def matching(contacts: wp.ref[Contacts], normal: wp.vec3d):
    """Which contact's normal is most like the given one; -1 if none is like it."""
    found = wp.int32(-1)
    best = ALIKE
    for j in range(contacts.count):
        like = wp.dot(row(contacts.normals, j), normal)
        if like > best:
            best = like
            found = j
    return found


@wp.func
def in_place(here: wp.ref[Contacts], there: wp.ref[Contacts], active: wp.ref[Numbers], lifts: wp.ref[Numbers],
             close: wp.float64):  # fmt: skip
    """Whether all active contacts are as they must be: touching where there is a lift, else not reached into."""
    for k in range(here.count):
        if entry(active, k) != wp.float64(0.0):
            j = matching(there, row(here.normals, k))
            gap = wp.float64(wp.inf)
            if j >= 0:
                gap = entry(there.gaps, j)
            if gap < wp.float64(0.0) or (entry(lifts, k) > wp.float64(0.0) and gap > close):
                return False
    return True


@wp.func
def lifted(here: wp.ref[Contacts], there: wp.ref[Contacts], active: wp.ref[Numbers], lifts: wp.ref[Numbers],
           close: wp.float64):  # fmt: skip
    """Lifts along the normals at the start that, to first order, put all contacts in place at the end."""
    result = Numbers(lifts)
    for _ in range(SWEEPS):
        change = wp.float64(0.0)
        for k in range(here.count):
            if entry(active, k) != wp.float64(0.0):
                normal = row(here.normals, k)
                j = matching(there, normal)
                value = wp.float64(0.0)
                if j >= 0:
                    outward = row(there.normals, j)
                    gap = entry(there.gaps, j) - wp.float64(0.5) * close
                    for i in range(here.count):
                        gap += (entry(result, i) - entry(lifts, i)) * wp.dot(row(here.normals, i), outward)
                    rise = wp.max(wp.dot(normal, outward), LEAST_LIFT)
                    value = wp.max(entry(result, k) - gap / rise, wp.float64(0.0))
                change = wp.max(change, wp.abs(value - entry(result, k)))
                result[k] = value
        if change <= wp.float64(0.01) * close:
            break
    return result


@functools.cache
def slide_on(surface_kinds):
    """Warp function: half a kick and a drift along the surface -> how far each contact lifted the ball.

    Moves m.x, m.v and m.spin; m.here stays, and there become the contacts at the end.
    """
    find = contacts_at(surface_kinds)
    displace = displace_over(surface_kinds)

    @wp.func
    def slide(
        m: wp.ref[Motion],
        there: wp.ref[Contacts],
        active: wp.ref[Numbers],
        grounds: wp.ref[Vectors],
        ball: wp.ref[ContactParticle],
        surfaces: wp.ref[Stages],
        moment: Moment,
        h: wp.float64,
        horizon: wp.float64,
    ):
        count = m.here.count
        lifts = Numbers()
        nothing = Numbers()
        m.v = m.v + wp.float64(0.5) * h * m.a
        x = m.x + h * m.v
        close = tolerance(x, ball.radius, ball.grain)
        rub = ball.friction > wp.float64(0.0)
        copy_contacts(m.here, there)
        find(x, ball.radius, horizon, ball.grain, surfaces, moment, h, there)
        for _ in range(REFINEMENTS):
            if not rub and in_place(m.here, there, active, lifts, close):
                break
            further = lifted(m.here, there, active, lifts, close)
            for k in range(count):
                x = x + (entry(further, k) - entry(lifts, k)) * row(m.here.normals, k)
            lifts = further
            if rub:
                # What the lifts take away is no slip.
                along = wp.vec3d(m.v)
                for k in range(count):
                    along = along + (entry(lifts, k) / h) * row(m.here.normals, k)
                rubbed = wp.vec3d(along)
                presses = lifts / h
                _rub(rubbed, m.spin, m.here, active, nothing, presses, grounds, ball)
                x = x + h * (rubbed - along)
                m.v = m.v + (rubbed - along)
                rub = False
            if not displace(there, x, ball.radius, ball.grain):
                find(x, ball.radius, horizon, ball.grain, surfaces, moment, h, there)
        m.x = x
        for k in range(count):
            m.v = m.v + (entry(lifts, k) / h) * row(m.here.normals, k)
        return lifts

    return slide


@wp.func
def held_on(m: wp.ref[Motion], there: wp.ref[Contacts], lifts: wp.ref[Numbers], ball: wp.ref[ContactParticle]):
    """1 for the contacts at the end of a slide that hold the ball: they touch, and their likes lifted it."""
    active = Numbers()
    close = touching(m.x, ball.radius, ball.grain)
    for k in range(m.here.count):
        if entry(lifts, k) > wp.float64(0.0):
            j = matching(there, row(m.here.normals, k))
            if j >= 0 and entry(there.gaps, j) <= close:
                active[j] = wp.float64(1.0)
    return active


@wp.func
def time_along(m: wp.ref[Motion], active: wp.ref[Numbers], ball: wp.ref[ContactParticle], h: wp.float64,
               dt: wp.float64):  # fmt: skip
    """How long a ball may slide at once: no farther than a grain, nor into what it is yet to hit."""
    speed = wp.length(m.v)
    if speed * h > ball.grain:
        h = ball.grain / speed
    for k in range(m.here.count):
        if entry(active, k) == wp.float64(0.0):
            closing = entry(m.here.speeds, k) - wp.dot(m.v, row(m.here.normals, k))
            if closing > slow_at(row(m.here.normals, k), m.a, dt) and entry(m.here.gaps, k) < closing * h:
                h = wp.max(entry(m.here.gaps, k) / closing, wp.float64(1e-6) * h)
    return h


@functools.cache
def supported(gravity_kinds, surface_kinds):
    """Warp function that moves a touching ball: with the surface, along it, or off it where no force presses it on."""
    find = contacts_at(surface_kinds)
    push = push_out(surface_kinds)
    pull = pull_between(gravity_kinds)
    carry = carry_along(surface_kinds)
    slide = slide_on(surface_kinds)

    @wp.func
    def support(
        m: wp.ref[Motion],
        active: wp.ref[Numbers],
        ball: wp.ref[ContactParticle],
        gravity: wp.ref[Stages],
        surfaces: wp.ref[Stages],
        moment: Moment,
        horizon: wp.float64,
    ):
        h = moment.dt - moment.t
        m.t = moment.dt
        grounds = grounds_of(m.here, m.x, ball, moment.dt)
        # Landing: remove what is left of the approach; its impulses allow friction.
        presses = Numbers()
        _settle(m.v, m.spin, m.here, active, m.here.speeds, presses, grounds, ball)
        if sticks(m, active, grounds, ball, h, moment.dt):
            if ball.mobility != wp.float64(1.0):
                m.spin = row(m.here.turns, m.here.which) / moment.dt
            carry(m, ball, surfaces, moment, h)
            m.a = pull(m.x, gravity, moment.stage, wp.float64(1.0))
            return
        part = time_along(m, active, ball, h, moment.dt)
        if part < h:
            h = part
            m.t = moment.t + h
        there = Contacts()
        lifts = slide(m, there, active, grounds, ball, surfaces, moment, h, horizon)
        if there.least < -touching(m.x, ball.radius, ball.grain):
            m.x = push(m.x, ball, surfaces, moment, h)
            find(m.x, ball.radius, horizon, ball.grain, surfaces, moment, h, there)
        holds = held_on(m, there, lifts, ball)
        m.here = there
        m.a = pull(m.x, gravity, moment.stage, m.t / moment.dt)
        m.v = m.v + wp.float64(0.5) * h * m.a
        if wp.length(holds) > wp.float64(0.0):
            grounds = grounds_of(m.here, m.x, ball, moment.dt)
            presses = Numbers()
            _settle(m.v, m.spin, m.here, holds, m.here.speeds, presses, grounds, ball)

    return support
