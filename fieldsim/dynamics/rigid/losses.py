"""Restitution and friction of free bodies, as Warp functions: impulses that follow each kick.

Damping: the elastic force f of a patch becomes f (1 + c v / v0) with the speed of approach v, that of the first meeting
v0, and the number c of the pair's restitution (see `contact.laws.damping`): whatever the shape and however deep, what
comes at v0 leaves at restitution v0. It never pulls. Friction: at each point the impulse that ends the slip, at most mu
times the normal one of that kick. Both act on the velocities after the kick, together, by projected Gauss-Seidel: a
body at rest has no velocity after any kick, and does not creep.

Impulses act at one place on both bodies, so momentum and angular momentum are kept to rounding. About axes without a
moment of inertia (see `Rigid`) friction and damping turn nothing.
"""

import warp as wp

from fieldsim.dynamics.contact.laws import coulomb, late_share
from fieldsim.dynamics.contact.nearest import beside
from fieldsim.dynamics.rigid.gravity import Masses
from fieldsim.dynamics.rigid.rigids import Rigids, struck
from fieldsim.dynamics.rigid.touches import PRESCRIBED, Touches, length_of
from fieldsim.numerics.running_sums import added

_coulomb = coulomb.warp(wp.float64)
_late_share = late_share.warp(wp.float64)
_beside = beside.warp(wp.float64)
HALF = wp.constant(wp.float64(0.5))
# Greatest number of sweeps of Gauss-Seidel; they end where none changes a velocity by more than this share of what the
# contact's own force does in the kick. As the next kick goes on from there, what rests comes to rest to rounding.
SWEEPS = wp.constant(16)
SETTLED = wp.constant(wp.float64(1e-8))


@wp.struct
class Losses:
    """Laws of B bodies, and what the solution needs.

    frictions, dampings (B, B + 1): of pairs, the last column with what is prescribed. axes (B,): 1 for the principal
    axes that have a moment, else 0. lost, lost_rest (1,): the energy that damping and friction have taken.

    Of bodies (B,): velocities, rates: of the moment; old_velocities, old_rates: before the kick; answers: inverse
    inertia, world frame; pushes, turns: impulses. Of
    points (C,): yields: change of slip per impulse. Of patches, at their first point (C,): sums of the elastic force;
    ways, levers, rears: mean normal, and its mean moments about both bodies; winds: mean speed of the ground along it;
    eases: change of speed per impulse; befores: speed of approach before the kick; drags: impulse of damping.
    """

    frictions: wp.array2d(dtype=wp.float64)
    dampings: wp.array2d(dtype=wp.float64)
    axes: wp.array(dtype=wp.vec3d)
    lost: wp.array(dtype=wp.float64)
    lost_rest: wp.array(dtype=wp.float64)
    velocities: wp.array(dtype=wp.vec3d)
    rates: wp.array(dtype=wp.vec3d)
    old_velocities: wp.array(dtype=wp.vec3d)
    old_rates: wp.array(dtype=wp.vec3d)
    answers: wp.array(dtype=wp.mat33d)
    pushes: wp.array(dtype=wp.vec3d)
    turns: wp.array(dtype=wp.vec3d)
    yields: wp.array(dtype=wp.float64)
    sums: wp.array(dtype=wp.float64)
    ways: wp.array(dtype=wp.vec3d)
    levers: wp.array(dtype=wp.vec3d)
    rears: wp.array(dtype=wp.vec3d)
    winds: wp.array(dtype=wp.float64)
    eases: wp.array(dtype=wp.float64)
    befores: wp.array(dtype=wp.float64)
    drags: wp.array(dtype=wp.float64)


@wp.func
def other_column(other: int, losses: Losses):
    """The column of a pair's laws."""
    return wp.where(other == PRESCRIBED, losses.axes.shape[0], other)


@wp.func
def velocities_of(state: Rigids, masses: Masses, losses: Losses):
    """Set velocities and rates from the momenta, and the inverse inertias."""
    for b in range(state.x.shape[0]):
        turn = wp.quat_to_matrix(state.q[b])
        answer = turn * wp.diag(wp.cw_mul(losses.axes[b], masses.inverse[b])) * wp.transpose(turn)
        losses.answers[b] = answer
        losses.velocities[b] = state.p[b] / masses.mass[b]
        losses.rates[b] = answer * state.spin[b]


@wp.func
def give_of(way: wp.vec3d, lever: wp.vec3d, rear: wp.vec3d, body: int, other: int, masses: Masses, losses: Losses):
    """Change of speed along `way` per impulse along it, of moments `lever` and `rear` about both bodies."""
    size2 = wp.dot(way, way)
    give = size2 / masses.mass[body] + wp.dot(lever, losses.answers[body] * lever)
    if other != PRESCRIBED:
        give = give + size2 / masses.mass[other] + wp.dot(rear, losses.answers[other] * rear)
    return give


@wp.func
def push_pair(push: wp.vec3d, lever: wp.vec3d, rear: wp.vec3d, body: int, other: int, masses: Masses, losses: Losses):
    """Change the velocities by an impulse on a body of moment `lever`, and the opposite one, -`rear`, on the other."""
    losses.velocities[body] = losses.velocities[body] + push / masses.mass[body]
    losses.rates[body] = losses.rates[body] + losses.answers[body] * lever
    if other != PRESCRIBED:
        losses.velocities[other] = losses.velocities[other] - push / masses.mass[other]
        losses.rates[other] = losses.rates[other] - losses.answers[other] * rear


@wp.func
def relative_at(i: int, state: Rigids, touches: Touches, losses: Losses):
    """Velocity of the pushed body's material at point i relative to the other's."""
    now = touches.now[0]
    body = touches.bodies[now, i]
    other = touches.others[now, i]
    p = touches.places[i]
    v = losses.velocities[body] + wp.cross(losses.rates[body], p - state.x[body]) - touches.grounds[i]
    if other != PRESCRIBED:
        v = v - losses.velocities[other] - wp.cross(losses.rates[other], p - state.x[other])
    return v


@wp.func
def approach_of(k: int, touches: Touches, losses: Losses):
    """Speed of approach of patch k: the mean over its points, weighted by their forces."""
    now = touches.now[0]
    body = touches.bodies[now, k]
    other = touches.others[now, k]
    speed = wp.dot(losses.ways[k], losses.velocities[body]) + wp.dot(losses.levers[k], losses.rates[body])
    if other != PRESCRIBED:
        speed = speed - wp.dot(losses.ways[k], losses.velocities[other]) - wp.dot(losses.rears[k], losses.rates[other])
    return losses.winds[k] - speed


@wp.func
def measure_patches(state: Rigids, masses: Masses, touches: Touches, losses: Losses):
    """Sums and means over the points of each patch."""
    now = touches.now[0]
    count = length_of(touches, now)
    for k in range(count):
        losses.sums[k] = wp.float64(0.0)
        losses.ways[k] = wp.vec3d()
        losses.levers[k] = wp.vec3d()
        losses.rears[k] = wp.vec3d()
        losses.winds[k] = wp.float64(0.0)
    for i in range(count):
        k = touches.patches[i]
        losses.sums[k] = losses.sums[k] + touches.presses[i]
    for i in range(count):
        k = touches.patches[i]
        other = touches.others[now, i]
        if losses.sums[k] > wp.float64(0.0):
            way = touches.presses[i] / losses.sums[k] * touches.normals[i]
            losses.ways[k] = losses.ways[k] + way
            losses.levers[k] = losses.levers[k] + wp.cross(touches.places[i] - state.x[touches.bodies[now, i]], way)
            losses.winds[k] = losses.winds[k] + wp.dot(way, touches.grounds[i])
            if other != PRESCRIBED:
                losses.rears[k] = losses.rears[k] + wp.cross(touches.places[i] - state.x[other], way)
    for k in range(count):
        if touches.patches[k] == k:
            body = touches.bodies[now, k]
            other = touches.others[now, k]
            losses.eases[k] = give_of(losses.ways[k], losses.levers[k], losses.rears[k], body, other, masses, losses)


@wp.func
def slip_yield(i: int, state: Rigids, masses: Masses, touches: Touches, losses: Losses):
    """The greatest change of slip per impulse along the surface at point i."""
    now = touches.now[0]
    body = touches.bodies[now, i]
    other = touches.others[now, i]
    n = touches.normals[i]
    ax, ay, az, bx, by, bz = _beside(n[0], n[1], n[2])
    a = wp.vec3d(ax, ay, az)
    b = wp.vec3d(bx, by, bz)
    arm = touches.places[i] - state.x[body]
    lever_a = wp.cross(arm, a)
    lever_b = wp.cross(arm, b)
    rear_a = wp.vec3d()
    rear_b = wp.vec3d()
    mixed = wp.dot(lever_a, losses.answers[body] * lever_b)
    if other != PRESCRIBED:
        rear = touches.places[i] - state.x[other]
        rear_a = wp.cross(rear, a)
        rear_b = wp.cross(rear, b)
        mixed = mixed + wp.dot(rear_a, losses.answers[other] * rear_b)
    one = give_of(a, lever_a, rear_a, body, other, masses, losses)
    two = give_of(b, lever_b, rear_b, body, other, masses, losses)
    return HALF * (one + two) + wp.sqrt(HALF * (one - two) * HALF * (one - two) + mixed * mixed)


@wp.func(inline=False)
def before_kick(state: Rigids, masses: Masses, touches: Touches, losses: Losses):
    """Measure patches, and how fast they approach before the kick."""
    now = touches.now[0]
    count = length_of(touches, now)
    if count > 0:
        velocities_of(state, masses, losses)
        for b in range(state.x.shape[0]):
            losses.old_velocities[b] = losses.velocities[b]
            losses.old_rates[b] = losses.rates[b]
        measure_patches(state, masses, touches, losses)
        for k in range(count):
            if touches.patches[k] == k:
                losses.befores[k] = approach_of(k, touches, losses)
        # The speed of the first meeting: of any point of the patch, or what is more by now.
        for i in range(count):
            k = touches.patches[i]
            touches.speeds[now, k] = wp.max(touches.speeds[now, k], touches.speeds[now, i])
        for i in range(count):
            k = touches.patches[i]
            if k == i:
                touches.speeds[now, k] = wp.max(touches.speeds[now, k], wp.max(losses.befores[k], wp.float64(0.0)))
            touches.speeds[now, i] = touches.speeds[now, k]


@wp.func
def damp(k: int, t: wp.float64, masses: Masses, touches: Touches, losses: Losses):
    """Improve the impulse of damping of patch k; returns the change of speed."""
    now = touches.now[0]
    body = touches.bodies[now, k]
    other = touches.others[now, k]
    met = touches.speeds[now, k]
    change = wp.float64(0.0)
    if met > wp.float64(0.0):
        strength = t * losses.sums[k] * losses.dampings[body, other_column(other, losses)] / met
        share = _late_share(strength * losses.eases[k])
        after = approach_of(k, touches, losses)
        wanted = strength * ((wp.float64(1.0) - share) * losses.befores[k] + share * after)
        step = (wanted - losses.drags[k]) / (wp.float64(1.0) + strength * share * losses.eases[k])
        drag = wp.max(losses.drags[k] + step, -t * losses.sums[k])
        step = drag - losses.drags[k]
        losses.drags[k] = drag
        push_pair(step * losses.ways[k], step * losses.levers[k], step * losses.rears[k], body, other, masses, losses)
        change = wp.abs(step) * losses.eases[k]
    return change


@wp.func
def push_point(i: int, impulse: wp.vec3d, state: Rigids, masses: Masses, touches: Touches, losses: Losses):
    """Change the velocities by an impulse at point i."""
    now = touches.now[0]
    body = touches.bodies[now, i]
    other = touches.others[now, i]
    lever = wp.cross(touches.places[i] - state.x[body], impulse)
    rear = wp.vec3d()
    if other != PRESCRIBED:
        rear = wp.cross(touches.places[i] - state.x[other], impulse)
    push_pair(impulse, lever, rear, body, other, masses, losses)


@wp.func
def normal_impulse(i: int, t: wp.float64, touches: Touches, losses: Losses):
    """The impulse along the normal at point i in a kick of time t: its share of its patch's."""
    k = touches.patches[i]
    press = touches.presses[i]
    drag = wp.float64(0.0)
    if losses.sums[k] > wp.float64(0.0):
        drag = press / losses.sums[k] * losses.drags[k]
    return t * press + drag


@wp.func
def rub(i: int, t: wp.float64, state: Rigids, masses: Masses, touches: Touches, losses: Losses):
    """Improve the impulse of friction at point i, t times its force; returns the change of speed."""
    now = touches.now[0]
    mu = losses.frictions[touches.bodies[now, i], other_column(touches.others[now, i], losses)]
    change = wp.float64(0.0)
    if mu > wp.float64(0.0):
        n = touches.normals[i]
        v = relative_at(i, state, touches, losses)
        slip = v - wp.dot(v, n) * n
        sum = t * touches.rubs[now, i]
        limit = mu * normal_impulse(i, t, touches, losses)
        x, y, z = _coulomb(slip[0], slip[1], slip[2], sum[0], sum[1], sum[2], losses.yields[i], limit)
        impulse = wp.vec3d(x, y, z)
        touches.rubs[now, i] = impulse / t
        step = impulse - sum
        push_point(i, step, state, masses, touches, losses)
        change = wp.length(step) * losses.yields[i]
    return change


@wp.func(inline=False)
def lose(t: wp.float64, state: Rigids, masses: Masses, touches: Touches, losses: Losses):
    """Damping and friction of a kick of time t, after it."""
    now = touches.now[0]
    count = length_of(touches, now)
    if count == 0:
        return
    velocities_of(state, masses, losses)
    scale = wp.float64(0.0)
    for i in range(count):
        losses.drags[i] = wp.float64(0.0)
        losses.yields[i] = slip_yield(i, state, masses, touches, losses)
        n = touches.normals[i]
        # What rubbed in the kick before is the first guess, turned along the surface as it is now.
        guess = touches.rubs[now, i]
        guess = guess - wp.dot(guess, n) * n
        touches.rubs[now, i] = guess
        push_point(i, t * guess, state, masses, touches, losses)
        scale = wp.max(scale, t * touches.presses[i] * losses.yields[i])
    for _ in range(SWEEPS):
        change = wp.float64(0.0)
        for i in range(count):
            if touches.patches[i] == i:
                change = wp.max(change, damp(i, t, masses, touches, losses))
        for i in range(count):
            change = wp.max(change, rub(i, t, state, masses, touches, losses))
        if change <= SETTLED * scale:
            break
    strike(t, state, masses, touches, losses)


@wp.func
def strike(t: wp.float64, state: Rigids, masses: Masses, touches: Touches, losses: Losses):
    """Apply the impulses found to the bodies, and count what energy they took."""
    now = touches.now[0]
    for b in range(state.x.shape[0]):
        losses.pushes[b] = wp.vec3d()
        losses.turns[b] = wp.vec3d()
    for i in range(length_of(touches, now)):
        body = touches.bodies[now, i]
        other = touches.others[now, i]
        press = normal_impulse(i, t, touches, losses) - t * touches.presses[i]
        impulse = t * touches.rubs[now, i] + press * touches.normals[i]
        p = touches.places[i]
        losses.pushes[body] = losses.pushes[body] + impulse
        losses.turns[body] = losses.turns[body] + wp.cross(p - state.x[body], impulse)
        if other != PRESCRIBED:
            losses.pushes[other] = losses.pushes[other] - impulse
            losses.turns[other] = losses.turns[other] - wp.cross(p - state.x[other], impulse)
    for b in range(state.x.shape[0]):
        local = wp.quat_rotate_inv(state.q[b], losses.turns[b])
        turn = wp.quat_rotate(state.q[b], wp.cw_mul(losses.axes[b], local))
        struck(b, losses.pushes[b], turn, state, masses)
        # The work on the mean of the velocities before and after the whole kick: what rests loses nothing.
        speed = losses.old_velocities[b] + state.p[b] / masses.mass[b]
        rate = losses.old_rates[b] + losses.answers[b] * state.spin[b]
        work = HALF * (wp.dot(losses.pushes[b], speed) + wp.dot(turn, rate))
        lost, rest = added(losses.lost[0], losses.lost_rest[0], -work)
        losses.lost[0] = lost
        losses.lost_rest[0] = rest
