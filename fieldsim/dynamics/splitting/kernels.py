"""The fused kernels: all steps of a launch inside.

On a CPU a thread moves a few particles stage by stage together: their sums become vector instructions, and what one
particle does waits for nothing that another does, so that the processor works on several at a time where one alone
would leave it waiting. On a GPU, which has threads enough, a thread moves one particle and keeps it in registers.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics.contact.event_detection import Motion
from fieldsim.dynamics.contact.particle_state import (
    ABSORBED,
    ESCAPED,
    GONE,
    MOVING,
    NOTHING,
    ContactParticles,
    contact_particle,
    log_event,
    makes_events,
    step_start,
)
from fieldsim.dynamics.contact.response import contact_step
from fieldsim.dynamics.integrators.propagator import StepTables
from fieldsim.dynamics.state import State, drifted
from fieldsim.numerics.running_sums import added
from fieldsim.sources.field import field_at, hessian_at
from fieldsim.sources.margins import margin_at, sweep_at
from fieldsim.sources.stages import Stages

# Particles that a CPU thread moves together, and one vector of each.
LANES = 8
Group = wp.types.matrix((LANES, 3), wp.float64)


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


def method_of(splitting: StepTables, dt: float, device) -> Method:
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
class SubStep:
    """What of a `Method` leads to one stage: a kick by the old acceleration, a drift, a kick by the new one.

    factor: of the force gradient in the new kick; evaluating: whether there is a new kick.
    """

    opening: wp.float64
    drift: wp.float64
    kick: wp.float64
    factor: wp.float64
    evaluating: bool


@wp.func
def substep_of(method: Method, j: int):
    """The part of a step from stage j to stage j + 1."""
    part = SubStep()
    if j == 0:
        part.opening = method.opening
    part.drift = method.drifts[j]
    part.kick = method.kicks[j]
    part.factor = method.gradients[j]
    part.evaluating = part.kick != wp.float64(0.0) or part.factor != wp.float64(0.0)
    return part


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
    return Particle(state.x[i], state.v[i], state.x_rest[i], state.v_rest[i], state.a[i])  # pyrefly: ignore[bad-argument-count]


@wp.func
def put(state: State, i: int, p: Particle):
    """Write particle i into the state."""
    state.x[i] = p.x
    state.v[i] = p.v
    state.x_rest[i] = p.x_rest
    state.v_rest[i] = p.v_rest
    state.a[i] = p.a


@functools.cache
def pull_at(kinds_used, gradients: bool):
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
def advance_of(kinds_used, gradients: bool):
    """Warp function (particle, part, gravity, stage) -> the particle after the part of a step that ends at a stage."""
    pull = pull_at(kinds_used, gradients)

    @wp.func
    def advance(p: Particle, part: SubStep, gravity: Stages, stage: int):
        v = p.v
        v_rest = p.v_rest
        a = p.a
        kick = part.opening * a
        x, x_rest = drifted(p.x, p.x_rest, v, v_rest, kick, part.drift)
        if part.evaluating:
            a, push = pull(x, gravity, stage, part.factor)
            if wp.static(gradients):
                kick = kick + push
            v, v_rest = added(v, v_rest, kick + part.kick * a)
        return Particle(x, v, x_rest, v_rest, a)  # pyrefly: ignore[bad-argument-count]

    return advance


@functools.cache
def splitting_kernel(kinds_used, gradients: bool, together: bool):
    """Kernel (steps, method, gravity, state): a splitting for gravity of the given kinds.

    gradients: whether the method has any. together: for a launch of groups of LANES particles, else of particles.
    The last acceleration is carried along, also from launch to launch, so a run cut into launches anywhere gives the
    same bytes.
    """
    return _grouped_kernel(kinds_used, gradients) if together else _single_kernel(kinds_used, gradients)


def _single_kernel(kinds_used, gradients):
    advance = advance_of(kinds_used, gradients)

    @wp.kernel(module="unique", enable_backward=False)
    def single(start: int, steps: int, method: Method, gravity: Stages, state: State):
        i = start + wp.tid()
        p = particle_at(state, i)
        for step in range(steps):
            for j in range(method.stages):
                p = advance(p, substep_of(method, j), gravity, step * method.stages + j + 1)
        put(state, i, p)

    return single


def _grouped_kernel(kinds_used, gradients):
    pull = pull_at(kinds_used, gradients)

    @wp.kernel(module="unique", enable_backward=False)
    def grouped(start: int, steps: int, method: Method, gravity: Stages, state: State):
        first = (start + wp.tid()) * LANES
        count = wp.min(LANES, state.x.shape[0] - first)
        x = Group()
        v = Group()
        x_rest = Group()
        v_rest = Group()
        a = Group()
        for k in range(count):
            x[k] = state.x[first + k]
            v[k] = state.v[first + k]
            x_rest[k] = state.x_rest[first + k]
            v_rest[k] = state.v_rest[first + k]
            a[k] = state.a[first + k]
        for step in range(steps):
            for j in range(method.stages):
                part = substep_of(method, j)
                kick = part.opening * a
                x, x_rest = drifted(x, x_rest, v, v_rest, kick, part.drift)
                if part.evaluating:
                    for k in range(count):
                        g, push = pull(x[k], gravity, step * method.stages + j + 1, part.factor)
                        a[k] = g
                        if wp.static(gradients):
                            kick[k] = kick[k] + push
                    v, v_rest = added(v, v_rest, kick + part.kick * a)
        for k in range(count):
            state.x[first + k] = x[k]
            state.v[first + k] = v[k]
            state.x_rest[first + k] = x_rest[k]
            state.v_rest[first + k] = v_rest[k]
            state.a[first + k] = a[k]

    return grouped


@functools.cache
def contact_kernel(gravity_kinds, surface_kinds, gradients: bool):
    """`splitting_kernel` for worlds with contact laws, or an escape radius.

    A step that may come near a surface is taken as leapfrog steps, one per evaluation of the method, which are cut at
    contacts; gravity_near and surfaces have their stages at those steps' ends.
    """
    field = field_at(gravity_kinds)
    advance = advance_of(gravity_kinds, gradients)
    margin = margin_at(surface_kinds)
    sweep = sweep_at(surface_kinds)
    near = contact_step(gravity_kinds, surface_kinds)
    # In a world that stands still a step that changes nothing would change nothing ever after.
    still = wp.constant(wp.int32(0 if gravity_kinds[1] or surface_kinds[1] else 1))
    ground_still = wp.constant(wp.int32(0 if surface_kinds[1] else 1))

    @wp.kernel(module="unique", enable_backward=False)
    def colliding(
        start: int,
        steps: int,
        dt: wp.float64,
        method: Method,
        gravity: Stages,
        gravity_near: Stages,
        surfaces: Stages,
        balls: ContactParticles,
        state: State,
    ):
        i = start + wp.tid()
        ball = contact_particle(balls, i)
        p = particle_at(state, i)
        m = Motion()
        m.spin = balls.spins[i]
        m.state = balls.states[i]
        hits = wp.int32(0)
        parts = method.evaluations
        short = dt / wp.float64(parts)
        # Distance that the particle may travel before it could touch a surface.
        room = wp.float64(-1.0)
        if ball.law == NOTHING:
            room = wp.float64(wp.inf)
        for step in range(steps):
            if m.state == ESCAPED or (m.state == ABSORBED and ground_still == 1):
                break
            q = p
            # No point of the path is farther from its start than the drifts add up to, and what the kicks may bend.
            travel = wp.float64(0.0)
            for j in range(method.stages):
                r = advance(q, substep_of(method, j), gravity, step * method.stages + j + 1)
                travel = travel + wp.length(r.x - q.x) + dt * wp.length(r.v - q.v)
                q = r
            for k in range(parts):
                travel = travel + sweep(surfaces, step * parts + k)
            room = room - travel
            if room < wp.float64(0.0) and makes_events(ball.law):
                room = margin(p.x, surfaces, step * parts, wp.float64(0.0)) - ball.radius - travel
            if room < wp.float64(0.0):
                m.x = p.x
                m.v = p.v
                m.a = p.a
                if method.opening == wp.float64(0.0):
                    _f, g = field(p.x, gravity_near, step * parts)
                    m.a = g
                last = m
                begun = hits
                for k in range(parts):
                    time = step_start(balls, step, dt) + wp.float64(k) * short
                    m, found = near(m, step * parts + k, time, ball, balls, gravity_near, surfaces, short)
                    hits += found
                p = Particle(m.x, m.v, wp.vec3d(), wp.vec3d(), m.a)  # pyrefly: ignore[bad-argument-count]
                if (
                    still == 1
                    and hits == begun
                    and m.x == last.x
                    and m.v == last.v
                    and m.a == last.a
                    and m.spin == last.spin
                ):
                    break
            else:
                m.state = MOVING
                m.known = wp.int32(0)
                p = q
            if wp.dot(p.x, p.x) > balls.escape2:
                m.state = ESCAPED
                log_event(balls, i, step_start(balls, step + 1, dt), GONE, p.x, wp.vec3d())
        put(state, i, p)
        balls.spins[i] = m.spin
        balls.states[i] = m.state
        balls.bounces[i] = balls.bounces[i] + hits

    return colliding
