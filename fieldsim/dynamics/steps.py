"""The fused kernels: one thread per particle, all steps of a launch inside."""

import functools

import warp as wp

from fieldsim.dynamics.balls import ABSORBED, ESCAPED, GONE, MOVING, NOTHING, Balls, ball_of, note, time_of, touches
from fieldsim.dynamics.contact import contact_step
from fieldsim.dynamics.encounter import Motion
from fieldsim.dynamics.sources import Stages, field_at
from fieldsim.dynamics.surfaces import margin_at, sweep_at
from fieldsim.dynamics.touch import TOUCHING, Moment, push_out, touch_at


@functools.cache
def leapfrog_kernel(kinds_used):
    """Kernel (positions, velocities, accelerations; steps, dt, gravity): leapfrog in the given cells of gravity.

    The acceleration is carried along, also from launch to launch, so each step evaluates the field once, and a run cut
    into launches anywhere gives the same bytes.
    """
    field = field_at(kinds_used)

    @wp.kernel(module="unique", enable_backward=False)
    def leapfrog(
        start: int,
        steps: int,
        dt: wp.float64,
        gravity: Stages,
        positions: wp.array(dtype=wp.vec3d),
        velocities: wp.array(dtype=wp.vec3d),
        accelerations: wp.array(dtype=wp.vec3d),
    ):
        i = start + wp.tid()
        x = positions[i]
        v = velocities[i]
        a = accelerations[i]
        half = wp.float64(0.5) * dt
        for step in range(steps):
            v = v + half * a
            x = x + dt * v
            _f, g = field(x, gravity, step + 1)
            a = g
            v = v + half * a
        positions[i] = x
        velocities[i] = v
        accelerations[i] = a

    return leapfrog


@functools.cache
def contact_kernel(gravity_kinds, surface_kinds):
    """`leapfrog_kernel` for worlds with contact laws, or an escape radius."""
    field = field_at(gravity_kinds)
    margin = margin_at(surface_kinds)
    sweep = sweep_at(surface_kinds)
    near = contact_step(gravity_kinds, surface_kinds)
    # In a world that stands still a step that changes nothing would change nothing ever after.
    still = wp.constant(wp.int32(0 if gravity_kinds[1] or surface_kinds[1] else 1))
    ground_still = wp.constant(wp.int32(0 if surface_kinds[1] else 1))

    @wp.kernel(module="unique", enable_backward=False)
    def leapfrog(
        start: int,
        steps: int,
        dt: wp.float64,
        gravity: Stages,
        surfaces: Stages,
        balls: Balls,
        positions: wp.array(dtype=wp.vec3d),
        velocities: wp.array(dtype=wp.vec3d),
        accelerations: wp.array(dtype=wp.vec3d),
    ):
        i = start + wp.tid()
        ball = ball_of(balls, i)
        m = Motion()
        m.x = positions[i]
        m.v = velocities[i]
        m.a = accelerations[i]
        m.spin = balls.spins[i]
        m.state = balls.states[i]
        half = wp.float64(0.5) * dt
        hits = wp.int32(0)
        # How far the particle may still travel before it could touch anything.
        room = wp.float64(-1.0)
        if ball.law == NOTHING:
            room = wp.float64(wp.inf)
        for step in range(steps):
            if m.state == ESCAPED or (m.state == ABSORBED and ground_still == 1):
                break
            travel = dt * (wp.length(m.v) + half * wp.length(m.a))
            room = room - travel - sweep(surfaces, step)
            if room < wp.float64(0.0) and touches(ball.law):
                room = margin(m.x, surfaces, step) - ball.radius - travel
            if room < wp.float64(0.0):
                last = m
                m, found = near(m, step, time_of(balls, step, dt), ball, balls, gravity, surfaces, dt)
                hits += found
                if (
                    still == 1
                    and found == 0
                    and m.x == last.x
                    and m.v == last.v
                    and m.a == last.a
                    and m.spin == last.spin
                ):
                    break
            else:
                m.state = MOVING
                m.known = wp.int32(0)
                m.v = m.v + half * m.a
                m.x = m.x + dt * m.v
                _f, g = field(m.x, gravity, step + 1)
                m.a = g
                m.v = m.v + half * m.a
            if wp.dot(m.x, m.x) > balls.escape2:
                m.state = ESCAPED
                note(balls, i, time_of(balls, step + 1, dt), GONE, m.x, wp.vec3d())
        positions[i] = m.x
        velocities[i] = m.v
        accelerations[i] = m.a
        balls.spins[i] = m.spin
        balls.states[i] = m.state
        balls.bounces[i] = balls.bounces[i] + hits

    return leapfrog


@functools.cache
def release_kernel(surface_kinds):
    """Kernel that moves colliding particles found inside a surface out of it; `inside` (N,) marks them."""
    touch_of = touch_at(surface_kinds)
    push = push_out(surface_kinds)
    margin = margin_at(surface_kinds)

    @wp.kernel(module="unique", enable_backward=False)
    def release(
        start: int,
        surfaces: Stages,
        balls: Balls,
        positions: wp.array(dtype=wp.vec3d),
        inside: wp.array(dtype=wp.int32),
    ):
        i = start + wp.tid()
        x = positions[i]
        radius = balls.radii[i]
        moment = Moment()
        moment.dt = wp.float64(1.0)
        inside[i] = 0
        if touches(balls.laws[i]) and margin(x, surfaces, 0) < radius:
            touch = touch_of(x, radius, surfaces, moment, wp.float64(0.0))
            if touch.gap > TOUCHING:
                inside[i] = 1
                positions[i] = push(x, radius, balls.grain, surfaces, moment)

    return release
