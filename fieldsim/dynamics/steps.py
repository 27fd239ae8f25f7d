"""The fused kernels: all steps of a launch inside.

On a CPU a thread moves a few particles stage by stage together: what one does waits for nothing that another does, so
the processor works on several at a time where one alone would leave it waiting. On a GPU, which has threads enough, it
moves one particle and keeps it in registers. The arithmetic of a particle is the same, whoever its neighbours are.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics.contact import contact_step
from fieldsim.dynamics.encounter import Motion
from fieldsim.dynamics.sources import Stages, field_at, hessian_at
from fieldsim.dynamics.state import State, added
from fieldsim.dynamics.surfaces import margin_at, sweep_at
from fieldsim.dynamics.touch import TOUCHING, Moment, push_out, touch_at

# Particles that a CPU thread moves together.
LANES = 8


@wp.struct
class Balls:
    """Particles as contact sees them: radii (N,), restitutions (N,), negative for those that touch nothing.

    grain: the length over which the surfaces' fields vary little.
    """

    radii: wp.array(dtype=wp.float64)
    restitutions: wp.array(dtype=wp.float64)
    grain: wp.float64


@wp.struct
class Method:
    """A splitting's tables (see `Splitting`) with the step put in: drifts, kicks and gradients (stages,) from 1 to s.

    opening: stage 0's kick, whose acceleration is the last of the step before. evaluations: of a step.
    """

    opening: wp.float64
    drifts: wp.array(dtype=wp.float64)
    kicks: wp.array(dtype=wp.float64)
    gradients: wp.array(dtype=wp.float64)
    stages: int
    evaluations: int


def method_of(splitting, dt: float, device) -> Method:
    """The `Method` of a splitting for steps of length dt."""
    method = Method()
    method.opening = dt * splitting.kicks[0]
    method.stages = len(splitting.drifts)
    method.evaluations = splitting.evaluations
    for name, table in (
        ("drifts", dt * np.array(splitting.drifts)),
        ("kicks", dt * np.array(splitting.kicks[1:])),
        ("gradients", dt * (dt * (dt * np.array(splitting.gradients[1:])))),
    ):
        setattr(method, name, wp.array(table, dtype=wp.float64, device=device))
    return method


@wp.struct
class Particle:
    """One particle of a `State`."""

    x: wp.vec3d
    v: wp.vec3d
    x_rest: wp.vec3d
    v_rest: wp.vec3d
    a: wp.vec3d


@wp.func
def particle_at(state: State, i: int):
    """Particle i of the state."""
    return Particle(state.x[i], state.v[i], state.x_rest[i], state.v_rest[i], state.a[i])


@wp.func
def put(state: State, i: int, p: Particle):
    """Write particle i into the state."""
    state.x[i] = p.x
    state.v[i] = p.v
    state.x_rest[i] = p.x_rest
    state.v_rest[i] = p.v_rest
    state.a[i] = p.a


@functools.cache
def acceleration_at(kinds_used, gradients: bool):
    """Warp function (point, gravity, stage, factor) -> (acceleration g, factor H g), the latter 0 without gradients."""
    field = field_at(kinds_used)

    @wp.func
    def plain(p: wp.vec3d, gravity: Stages, stage: int, factor: wp.float64):
        _f, g = field(p, gravity, stage)
        return g, wp.vec3d()

    if not gradients:
        return plain
    hessian = hessian_at(kinds_used)

    @wp.func
    def with_gradient(p: wp.vec3d, gravity: Stages, stage: int, factor: wp.float64):
        g = wp.vec3d()
        push = wp.vec3d()
        if factor == wp.float64(0.0):
            g, push = plain(p, gravity, stage, factor)
        else:
            g, bend = hessian(p, gravity, stage)
            push = factor * (bend * g)
        return g, push

    return with_gradient


@functools.cache
def stage_of(kinds_used, gradients: bool):
    """Warp function (particle, method, gravity, step, j): from stage j to stage j + 1 of a step."""
    acceleration = acceleration_at(kinds_used, gradients)

    @wp.func
    def stage(p: Particle, method: Method, gravity: Stages, step: int, j: int):
        x = p.x
        v = p.v
        x_rest = p.x_rest
        v_rest = p.v_rest
        a = p.a
        if j == 0 and method.opening != wp.float64(0.0):
            v, v_rest = added(v, v_rest, method.opening * a)
        x, x_rest = added(x, x_rest, method.drifts[j] * v)
        kick = method.kicks[j]
        factor = method.gradients[j]
        if kick != wp.float64(0.0) or factor != wp.float64(0.0):
            g, push = acceleration(x, gravity, step * method.stages + j + 1, factor)
            a = g
            v, v_rest = added(v, v_rest, kick * g + push)
        return Particle(x, v, x_rest, v_rest, a)

    return stage


@functools.cache
def splitting_kernel(kinds_used, gradients: bool, together: bool):
    """Kernel (steps, method, gravity, state): a splitting in the given cells of gravity.

    gradients: whether the method has any. together: for a launch of groups of LANES particles, else of particles.
    The last acceleration is carried along, also from launch to launch, so a run cut into launches anywhere gives the
    same bytes.
    """
    stage = stage_of(kinds_used, gradients)

    @wp.kernel(module="unique", enable_backward=False)
    def grouped(start: int, steps: int, method: Method, gravity: Stages, state: State):
        first = (start + wp.tid()) * LANES
        end = wp.min(first + LANES, state.x.shape[0])
        for step in range(steps):
            for j in range(method.stages):
                for i in range(first, end):
                    put(state, i, stage(particle_at(state, i), method, gravity, step, j))

    @wp.kernel(module="unique", enable_backward=False)
    def single(start: int, steps: int, method: Method, gravity: Stages, state: State):
        i = start + wp.tid()
        p = particle_at(state, i)
        for step in range(steps):
            for j in range(method.stages):
                p = stage(p, method, gravity, step, j)
        put(state, i, p)

    return grouped if together else single


@functools.cache
def contact_kernel(gravity_kinds, surface_kinds, gradients: bool):
    """`splitting_kernel` for worlds with surfaces: particles of restitution >= 0 bounce, the others pass through.

    A step that may come near a surface is taken as leapfrog steps, one per evaluation of the method, which are cut at
    contacts; gravity_near and surfaces have their stages at those steps' ends. bounces (N,) counts each particle's
    contacts.
    """
    field = field_at(gravity_kinds)
    stage = stage_of(gravity_kinds, gradients)
    margin = margin_at(surface_kinds)
    sweep = sweep_at(surface_kinds)
    near = contact_step(gravity_kinds, surface_kinds)

    @wp.kernel(module="unique", enable_backward=False)
    def colliding(
        start: int,
        steps: int,
        dt: wp.float64,
        method: Method,
        gravity: Stages,
        gravity_near: Stages,
        surfaces: Stages,
        balls: Balls,
        state: State,
        bounces: wp.array(dtype=wp.int32),
    ):
        i = start + wp.tid()
        p = particle_at(state, i)
        radius = balls.radii[i]
        hits = wp.int32(0)
        parts = method.evaluations
        # How far the particle may still travel before it could touch anything.
        room = wp.float64(-1.0)
        if balls.restitutions[i] < wp.float64(0.0):
            room = wp.float64(wp.inf)
        for step in range(steps):
            q = p
            # No point of the path is farther from its start than the drifts add up to, and what the kicks may bend.
            travel = wp.float64(0.0)
            for j in range(method.stages):
                r = stage(q, method, gravity, step, j)
                travel = travel + wp.length(r.x - q.x) + dt * wp.length(r.v - q.v)
                q = r
            for k in range(parts):
                travel = travel + sweep(surfaces, step * parts + k)
            room = room - travel
            if room < wp.float64(0.0):
                room = margin(p.x, surfaces, step * parts) - radius - travel
            if room < wp.float64(0.0):
                m = Motion()
                m.x = p.x
                m.v = p.v
                m.a = p.a
                if method.opening == wp.float64(0.0):
                    _f, g = field(p.x, gravity_near, step * parts)
                    m.a = g
                for k in range(parts):
                    m.t = wp.float64(0.0)
                    m, found = near(
                        m,
                        radius,
                        balls.restitutions[i],
                        balls.grain,
                        gravity_near,
                        surfaces,
                        step * parts + k,
                        dt / wp.float64(parts),
                    )
                    hits += found
                p = Particle(m.x, m.v, wp.vec3d(), wp.vec3d(), m.a)
            else:
                p = q
        put(state, i, p)
        bounces[i] = bounces[i] + hits

    return colliding


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
