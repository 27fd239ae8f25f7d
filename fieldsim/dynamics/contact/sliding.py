"""ContactParticles on the surface F = 1: stuck to it, sliding or rolling along it, or leaving it, as Warp functions.

A sliding ball is held on the surface by a constraint force that can push but not pull (RATTLE, Andersen 1983). The
normal impulse of each half step limits the friction impulse of that half, so that sliding keeps the order of leapfrog.
A point mass sticks if friction within its cone can stop it and hold it for the rest of the step: it moves with the
material, and on a surface that does not move it stays exactly in place.
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.event_detection import Motion
from fieldsim.dynamics.contact.friction import after_friction, slip_of
from fieldsim.dynamics.contact.gap import REFINEMENTS, TOLERANCE, TOUCHING, Gap, Moment, gap_at, push_out
from fieldsim.dynamics.contact.particle_state import ContactParticle
from fieldsim.sources.field import field_at
from fieldsim.sources.stages import Stages
from fieldsim.sources.surface_velocity import screw, twist_at


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


@functools.cache
def ground_at(kinds_used):
    """Warp function (center, normal, ball, surfaces, moment) -> (velocity of the ground, turn, shift).

    For a ball that rolls this is the velocity of the material at its lowest point. Other balls are assumed to rotate
    with the ground, so theirs is the velocity of the material extended to their centre.
    """
    twist = twist_at(kinds_used)

    @wp.func
    def ground(x: wp.vec3d, normal: wp.vec3d, ball: ContactParticle, surfaces: Stages, moment: Moment):
        p = x - ball.radius * normal
        turn, shift = twist(p, surfaces, moment.stage)
        if ball.mobility == wp.float64(1.0):
            p = x
        return (wp.cross(turn, p) + shift) / moment.dt, turn, shift

    return ground


@functools.cache
def carry_along(kinds_used):
    """Warp function that moves a ball with the twist of its ground for a time -> (position, velocity, gap there)."""
    moving = len(kinds_used[1]) > 0
    gap_of = gap_at(kinds_used)
    push = push_out(kinds_used)

    @wp.func
    def stay(
        x: wp.vec3d,
        here: Gap,
        turn: wp.vec3d,
        shift: wp.vec3d,
        ball: ContactParticle,
        surfaces: Stages,
        moment: Moment,
        duration: wp.float64,
    ):
        return x, wp.vec3d(), here

    @wp.func
    def carry(
        x: wp.vec3d,
        here: Gap,
        turn: wp.vec3d,
        shift: wp.vec3d,
        ball: ContactParticle,
        surfaces: Stages,
        moment: Moment,
        duration: wp.float64,
    ):
        share = duration / moment.dt
        x = screw(x, share * turn, share * shift)
        end = moment
        end.t = moment.t + duration
        there = gap_of(x, ball.radius, surfaces, end, wp.float64(0.0))
        if there.value > wp.float64(0.0) or there.value < -TOLERANCE:
            x = push(x, ball.radius, ball.grain, surfaces, end)
            there = gap_of(x, ball.radius, surfaces, end, wp.float64(0.0))
        u = (wp.cross(turn, x) + shift) / moment.dt
        return x, u + (there.speed - wp.dot(u, there.normal)) * there.normal, there

    return carry if moving else stay


@wp.func
def sticks(
    m: Motion,
    here: Gap,
    ball: ContactParticle,
    slip: wp.vec3d,
    ground: wp.vec3d,
    turn: wp.vec3d,
    h: wp.float64,
    dt: wp.float64,
):
    """Whether friction can end the slip within h, and hold the ball against the tangential force."""
    # In the frame of the material, which is accelerated towards its axis.
    a = m.a - wp.cross(turn, ground) / dt
    press = -wp.dot(a, here.normal)
    along = slip + h * (a + press * here.normal)
    holds = press > wp.float64(0.0) and wp.length(along) <= ball.friction * press * h
    return holds and ball.mobility == wp.float64(1.0)


@functools.cache
def slide_on(surface_kinds):
    """Warp function: half a kick and a drift along the surface -> (x, v, spin, gap there, held)."""
    gap_of = gap_at(surface_kinds)

    @wp.func
    def slide(
        m: Motion, here: Gap, ball: ContactParticle, ground: wp.vec3d, surfaces: Stages, moment: Moment, h: wp.float64
    ):
        v = m.v + wp.float64(0.5) * h * m.a
        spin = m.spin
        free = m.x + h * v
        # First as on a plane; then corrected in both directions, down to the point where the force would pull.
        lift = h * wp.max(here.speed - wp.dot(v, here.normal), wp.float64(0.0))
        x = free + lift * here.normal
        there = gap_of(x, ball.radius, surfaces, moment, h)
        rub = ball.friction > wp.float64(0.0)
        held = wp.int32(1)
        for _ in range(REFINEMENTS):
            if there.value <= wp.float64(0.0) and there.value >= -TOLERANCE and not rub:
                break
            step = wp.float64(0.0)
            if there.value > wp.float64(0.0) or there.value < -TOLERANCE:
                rise = there.slope * wp.max(wp.dot(there.normal, here.normal), wp.float64(0.1))
                step = (there.value + wp.float64(0.5) * TOLERANCE) / rise
            if lift + step <= wp.float64(0.0):
                held = wp.int32(0)
                x = free
                there = gap_of(x, ball.radius, surfaces, moment, h)
                break
            x = x + step * here.normal
            lift = lift + step
            if rub:
                slip = slip_of(v, spin, ground, here.normal, ball.radius)
                faster, spin = after_friction(v, spin, slip, here.normal, ball, lift / h)
                x = x + h * (faster - v)
                v = faster
                rub = False
            there = gap_of(x, ball.radius, surfaces, moment, h)
        if held == 1:
            v = v + (lift / h) * here.normal
        return x, v, spin, there, held

    return slide


@functools.cache
def supported(gravity_kinds, surface_kinds):
    """Warp function that moves a touching ball: with the surface, along it, or off it where no force presses it on."""
    gap_of = gap_at(surface_kinds)
    push = push_out(surface_kinds)
    pull = pull_between(gravity_kinds)
    ground_of = ground_at(surface_kinds)
    carry = carry_along(surface_kinds)
    slide = slide_on(surface_kinds)

    @wp.func
    def support(m: Motion, here: Gap, ball: ContactParticle, gravity: Stages, surfaces: Stages, moment: Moment):
        h = moment.dt - moment.t
        ground, turn, shift = ground_of(m.x, here.normal, ball, surfaces, moment)
        # Landing: remove the remaining approach velocity; its normal impulse allows friction.
        press = wp.max(here.speed - wp.dot(m.v, here.normal), wp.float64(0.0))
        m.v = m.v + press * here.normal
        slip = slip_of(m.v, m.spin, ground, here.normal, ball.radius)
        v, spin = after_friction(m.v, m.spin, slip, here.normal, ball, press)
        m.v = v
        m.spin = spin
        slip = slip_of(m.v, m.spin, ground, here.normal, ball.radius)
        result = m
        result.t = moment.dt
        if sticks(m, here, ball, slip, ground, turn, h, moment.dt):
            x, v, there = carry(m.x, here, turn, shift, ball, surfaces, moment, h)
            result.x = x
            result.v = v
            result.here = there
            a = pull(x, gravity, moment.stage, wp.float64(1.0))
            result.a = a
            return result
        speed = wp.length(m.v)
        if speed * h > ball.grain:
            h = ball.grain / speed
            result.t = moment.t + h
        x, v, spin, there, held = slide(m, here, ball, ground, surfaces, moment, h)
        if there.value > TOUCHING:
            ending = moment
            ending.t = result.t
            x = push(x, ball.radius, ball.grain, surfaces, ending)
            there = gap_of(x, ball.radius, surfaces, ending, wp.float64(0.0))
        a = pull(x, gravity, moment.stage, result.t / moment.dt)
        v = v + wp.float64(0.5) * h * a
        if held == 1:
            press = wp.max(there.speed - wp.dot(v, there.normal), wp.float64(0.0))
            v = v + press * there.normal
            ground, _t, _s = ground_of(x, there.normal, ball, surfaces, moment)
            slip = slip_of(v, spin, ground, there.normal, ball.radius)
            v, spin = after_friction(v, spin, slip, there.normal, ball, press)
        result.x = x
        result.v = v
        result.a = a
        result.spin = spin
        result.here = there
        return result

    return support
