"""The fused kernels: all steps of a launch inside, for groups of particles (see `groups`)."""

import functools

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
from fieldsim.dynamics.splitting.groups import ROWS, A, V, X, column, load_of, place_of, replace_of, store_of
from fieldsim.dynamics.splitting.method import Method
from fieldsim.dynamics.splitting.step import advance_of, group_in
from fieldsim.dynamics.state import State
from fieldsim.sources.field import field_at
from fieldsim.sources.margins import margin_at, sweep_at
from fieldsim.sources.stages import Stages


@functools.cache
def splitting_kernel(kinds_used, gradients: bool, lanes: int):
    """Kernel over groups (steps, method, gravity, state): a splitting for gravity of the given kinds.

    gradients: whether the method has any.
    """
    advance = advance_of(kinds_used, gradients, lanes)
    load, store = load_of(lanes), store_of(lanes)

    @wp.kernel(module="unique", enable_backward=False)
    def free(start: int, steps: int, method: Method, gravity: Stages, state: State):
        first = (start + wp.tid()) * lanes
        count = wp.min(lanes, state.x.shape[0] - first)
        p = advance(load(state, first, count), method, 0, method.stages, steps, 0, gravity)
        store(p, state, first, count)

    return free


@wp.struct
class NearStep:
    """A particle after a step near a surface: x, v and acceleration a there.

    hits: in it; resting: 1 if no further step will change anything. room: the distance that it may travel before it
    could touch a surface; below 0 it is near one.
    """

    x: wp.vec3d
    v: wp.vec3d
    a: wp.vec3d
    room: wp.float64
    hits: wp.int32
    resting: wp.int32


@functools.cache
def near_step_of(gravity_kinds, surface_kinds):
    """Warp function: one step of one particle that may come near a surface, taken as leapfrog steps cut at contacts.

    Of (index, x, v, a, how far a free step may take it, step, dt, method, gravity at the stages of the leapfrog steps,
    surfaces, balls, motion) -> NearStep; motion: what is kept between steps.
    """
    field = field_at(gravity_kinds)
    near = contact_step(gravity_kinds, surface_kinds)
    margin = margin_at(surface_kinds)
    # In a world that stands still a step that changes nothing would change nothing ever after.
    still = wp.constant(wp.int32(0 if gravity_kinds[1] or surface_kinds[1] else 1))
    still_ground = wp.constant(wp.int32(0 if surface_kinds[1] else 1))

    @wp.func(inline=False)
    def near_step(
        i: int,
        x: wp.vec3d,
        v: wp.vec3d,
        a: wp.vec3d,
        travel: wp.float64,
        step: int,
        dt: wp.float64,
        method: wp.ref[Method],
        gravity: wp.ref[Stages],
        surfaces: wp.ref[Stages],
        balls: wp.ref[ContactParticles],
        m: wp.ref[Motion],
    ):
        result = NearStep()
        result.room = wp.float64(-1.0)
        ball = contact_particle(balls, i)
        parts = method.evaluations
        # A ball that is known to touch something within its step is near a surface.
        nearby = still_ground == 1 and m.known == 1 and m.here.count > 0 and m.here.least < travel
        if makes_events(ball.law) and not nearby:
            result.room = margin(x, surfaces, step * parts, wp.float64(0.0)) - ball.radius - travel
        if result.room >= wp.float64(0.0):
            return result
        m.x = x
        m.v = v
        m.a = a
        m.spin = balls.spins[i]
        m.state = balls.states[i]
        if method.continued == 0:
            _f, g = field(x, gravity, step * parts)
            m.a = g
        last_a = wp.vec3d(m.a)
        short = dt / wp.float64(parts)
        for k in range(parts):
            time = step_start(balls, step, dt) + wp.float64(k) * short
            result.hits += near(m, step * parts + k, time, ball, balls, gravity, surfaces, short)
        same = m.x == x and m.v == v and m.a == last_a and m.spin == balls.spins[i]
        if still == 1 and result.hits == 0 and same:
            result.resting = wp.int32(1)
        balls.spins[i] = m.spin
        balls.states[i] = m.state
        result.x = m.x
        result.v = m.v
        result.a = m.a
        return result

    return near_step


@functools.cache
def contact_kernel(gravity_kinds, surface_kinds, gradients: bool, lanes: int):
    """`splitting_kernel` for worlds with contact laws, or an escape radius.

    A step that may come near a surface is taken as leapfrog steps, one per evaluation of the method, which are cut at
    contacts; gravity_near and surfaces have their stages at those steps' ends.
    """
    Numbers = wp.types.vector(lanes, wp.float64)
    Flags = wp.types.vector(lanes, wp.int32)
    advance, group = advance_of(gravity_kinds, gradients, lanes, measured=True), group_in(lanes)
    load, store = load_of(lanes), store_of(lanes)
    replace, place = replace_of(lanes), place_of(lanes)
    near_step = near_step_of(gravity_kinds, surface_kinds)
    sweep = sweep_at(surface_kinds)
    ground_still = wp.constant(wp.int32(0 if surface_kinds[1] else 1))

    @wp.kernel(module="unique", enable_backward=False)
    def colliding(
        start: int,
        steps: int,
        method: Method,
        gravity: Stages,
        gravity_near: Stages,
        surfaces: Stages,
        balls: ContactParticles,
        motions: wp.array(dtype=Motion),
        state: State,
    ):
        first = (start + wp.tid()) * lanes
        count = wp.min(lanes, state.x.shape[0] - first)
        dt = method.dt
        p = load(state, first, count)
        # Distances that particles may travel before they could touch a surface; those that are done; those near one.
        rooms = Numbers()
        done = Flags()
        near = Flags()
        left = count
        for k in range(count):
            rooms[k] = wp.float64(-1.0)
            near[k] = motions[first + k].known
            if balls.laws[first + k] == NOTHING:
                rooms[k] = wp.float64(wp.inf)
            status = balls.states[first + k]
            if status == ESCAPED or (status == ABSORBED and ground_still == 1):
                done[k] = wp.int32(1)
                left -= 1
        for step in range(steps):
            if left == 0:
                break
            results = advance(p, method, 0, method.stages, 1, step * method.stages, gravity)
            q = group(results)
            travels = results[ROWS]
            swept = wp.float64(0.0)
            for k in range(method.evaluations):
                swept += sweep(surfaces, step * method.evaluations + k)
            for k in range(count):
                i = first + k
                if done[k] == 1:
                    replace(q, k, p)
                    continue
                travel = travels[k] + swept
                passed = NearStep()
                rooms[k] = rooms[k] - travel
                if rooms[k] < wp.float64(0.0):
                    passed = near_step(
                        i, column(p, X, k), column(p, V, k), column(p, A, k), travel,
                        step, dt, method, gravity_near, surfaces, balls, motions[i],
                    )  # fmt: skip
                    rooms[k] = passed.room
                    balls.bounces[i] = balls.bounces[i] + passed.hits
                    done[k] = passed.resting
                if rooms[k] < wp.float64(0.0):
                    near[k] = wp.int32(1)
                    place(q, k, passed.x, passed.v, passed.a)
                else:
                    balls.states[i] = MOVING
                    if near[k] == 1:
                        near[k] = wp.int32(0)
                        motions[i].known = wp.int32(0)
                x = column(q, X, k)
                if done[k] == 0 and wp.dot(x, x) > balls.escape2:
                    balls.states[i] = ESCAPED
                    log_event(balls, i, step_start(balls, step + 1, dt), GONE, x, wp.vec3d())
                    done[k] = wp.int32(1)
                if balls.states[i] == ABSORBED and ground_still == 1:
                    done[k] = wp.int32(1)
                left -= done[k]
            p = q
        # Stages of the next launch are counted from this one's end.
        for k in range(count):
            motions[first + k].here.stage = motions[first + k].here.stage - steps * method.evaluations
        store(p, state, first, count)

    return colliding
