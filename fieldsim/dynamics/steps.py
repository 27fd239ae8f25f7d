"""The fused kernels: one thread per particle, all steps of a launch inside."""

import functools

import warp as wp

from fieldsim.dynamics.contact import contact_step
from fieldsim.dynamics.encounter import Motion
from fieldsim.dynamics.sources import Stages, field_at
from fieldsim.dynamics.surfaces import margin_at, sweep_at
from fieldsim.dynamics.touch import TOUCHING, Moment, push_out, touch_at


@wp.struct
class Balls:
    """Particles as contact sees them: radii (N,), restitutions (N,), negative for those that touch nothing.

    grain: the length over which the surfaces' fields vary little.
    """

    radii: wp.array(dtype=wp.float64)
    restitutions: wp.array(dtype=wp.float64)
    grain: wp.float64


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
    """`leapfrog_kernel` for worlds with surfaces: particles of restitution >= 0 bounce, the others pass through.

    radii, restitutions (N,); bounces (N,) counts each particle's contacts. grain: see `Surfaces`.
    """
    field = field_at(gravity_kinds)
    margin = margin_at(surface_kinds)
    sweep = sweep_at(surface_kinds)
    near = contact_step(gravity_kinds, surface_kinds)

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
        bounces: wp.array(dtype=wp.int32),
    ):
        i = start + wp.tid()
        m = Motion()
        m.x = positions[i]
        m.v = velocities[i]
        m.a = accelerations[i]
        radius = balls.radii[i]
        half = wp.float64(0.5) * dt
        hits = wp.int32(0)
        # How far the particle may still travel before it could touch anything.
        room = wp.float64(-1.0)
        if balls.restitutions[i] < wp.float64(0.0):
            room = wp.float64(wp.inf)
        for step in range(steps):
            travel = dt * (wp.length(m.v) + half * wp.length(m.a))
            room = room - travel - sweep(surfaces, step)
            if room < wp.float64(0.0):
                room = margin(m.x, surfaces, step) - radius - travel
            if room < wp.float64(0.0):
                m.t = wp.float64(0.0)
                m, found = near(m, radius, balls.restitutions[i], balls.grain, gravity, surfaces, step, dt)
                hits += found
            else:
                m.v = m.v + half * m.a
                m.x = m.x + dt * m.v
                _f, g = field(m.x, gravity, step + 1)
                m.a = g
                m.v = m.v + half * m.a
        positions[i] = m.x
        velocities[i] = m.v
        accelerations[i] = m.a
        bounces[i] = bounces[i] + hits

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
        if balls.restitutions[i] >= wp.float64(0.0) and margin(x, surfaces, 0) < radius:
            touch = touch_of(x, radius, surfaces, moment, wp.float64(0.0))
            if touch.gap > TOUCHING:
                inside[i] = 1
                positions[i] = push(x, radius, balls.grain, surfaces, moment)

    return release
