"""Free bodies under a splitting, as one Warp kernel: all bodies, all steps of a launch, in one thread.

Bodies live in their principal frames: origin at the centre of mass, axes along the principal ones, moments ascending.
The state is kept in the world's frame, where without forces momenta are constant: they are stored, not computed.
A drift is exact: a straight line and the free rotor. A kick adds impulses and their moments.

The energy of rotation is stored as well, and grows by what torques do. It is another constant of free rotation: each
drift first turns the body by the small angle that restores this energy, so that rounding errors of turns do not add up.
"""

import functools

import warp as wp

from fieldsim.dynamics.rigid.contact import contact_between, contact_wrenches
from fieldsim.dynamics.rigid.gravity import Masses, gravity_between, gravity_wrenches
from fieldsim.dynamics.rigid.losses import Losses, before_kick, lose
from fieldsim.dynamics.rigid.rigids import HALF, Rigids, struck, turning
from fieldsim.dynamics.rigid.rotor import free_rotor
from fieldsim.dynamics.rigid.shells import Shells, Thin
from fieldsim.dynamics.rigid.touches import Touches, begun, ignored, listed, met
from fieldsim.numerics.running_sums import added
from fieldsim.sources.stages import Stages

_rotor = free_rotor.warp(wp.float64)
# A correction of the turn is one of rounding if it is a small angle, and a small share of that to where the energy is
# extreme (a sphere's is everywhere).
SMALL = wp.constant(wp.float64(1e-9))
ROUNDING = wp.constant(wp.float64(1e-6))


@wp.struct
class RigidSplitting:
    """Shares of a step: kicks (s + 1,) and drifts (s,)."""

    kicks: wp.array(dtype=wp.float64)
    drifts: wp.array(dtype=wp.float64)


@wp.func
def lift(m: wp.vec3d, inverse: wp.vec3d, energy: wp.float64):
    """The least change of m, to first order, that keeps |m| and makes `energy` the energy of rotation."""
    rate = wp.cw_mul(inverse, m)
    now = HALF * wp.dot(m, rate)
    slope = rate - (wp.float64(2.0) * now / wp.dot(m, m)) * m
    steep = wp.dot(slope, slope)
    lacking = energy - now
    change = wp.vec3d()
    near = wp.abs(lacking) * (inverse[0] - inverse[2]) < ROUNDING * steep
    if near and lacking * lacking < SMALL * SMALL * wp.dot(m, m) * steep:
        change = (lacking / steep) * slope
    return change


@wp.func
def drift(state: Rigids, masses: Masses, t: wp.float64):
    """Move all bodies freely for a time t."""
    for b in range(state.x.shape[0]):
        x, x_rest = added(state.x[b], state.x_rest[b], t / masses.mass[b] * state.p[b])
        state.x[b] = x
        state.x_rest[b] = x_rest
        inverse = masses.inverse[b]
        q = state.q[b]
        m = wp.quat_rotate_inv(q, state.spin[b])
        size2 = wp.dot(m, m)
        if size2 > wp.float64(0.0):
            change = lift(m, inverse, state.e[b])
            if wp.dot(change, change) > wp.float64(0.0):
                # Turn the body by the inverse change, so that its angular momentum is constant in the world's frame.
                back = HALF / size2 * wp.cross(change, m)
                q = q * wp.quatd(back[0], back[1], back[2], wp.float64(1.0))
                m = m + change
            else:
                state.e[b] = HALF * wp.dot(m, wp.cw_mul(inverse, m))
                state.e_rest[b] = wp.float64(0.0)
            _m1, _m2, _m3, w, i, j, k = _rotor(m[0], m[1], m[2], inverse[0], inverse[1], inverse[2], t)
            state.q[b] = wp.normalize(q * wp.quatd(i, j, k, w))


@wp.func
def kick(state: Rigids, masses: Masses, t: wp.float64):
    """Kick: apply the present forces and torques for a time t."""
    for b in range(state.x.shape[0]):
        struck(b, t * state.force[b], t * state.torque[b], state, masses)


@wp.func
def record(state: Rigids, stage: int):
    """Record the poses of all bodies."""
    for b in range(state.x.shape[0]):
        state.places[stage, b] = state.x[b]
        state.turns[stage, b] = state.q[b]


@wp.func
def record_end(state: Rigids, masses: Masses, step: int):
    """Record the velocities of all bodies at the end of a step."""
    for b in range(state.x.shape[0]):
        state.speeds[step, b] = state.p[b] / masses.mass[b]
        state.rates[step, b] = turning(state.q[b], state.spin[b], masses.inverse[b])


@functools.cache
def all_wrenches(gravity_kinds, surface_kinds, note=ignored):
    """Warp function (stage, gravity, surfaces, thin, masses, shells, touches, state) -> the energy.

    Sets state.force and state.torque. kinds: pairs, each of the prescribed sources' kinds (as `field_at` takes them)
    and the free bodies' own. note: see `contact`.
    """
    pull = gravity_wrenches(*gravity_kinds)
    push = contact_wrenches(*surface_kinds, note)

    @wp.func
    def wrenches(
        stage: int,
        gravity: Stages,
        surfaces: Stages,
        thin: Thin,
        masses: Masses,
        shells: Shells,
        touches: Touches,
        state: Rigids,
    ):
        for b in range(state.x.shape[0]):
            state.force[b] = wp.vec3d()
            state.torque[b] = wp.vec3d()
        u = pull(stage, gravity, masses, state.x, state.q, state.force, state.torque)
        return u + push(stage, surfaces, thin, shells, touches, state.x, state.q, state.force, state.torque)

    return wrenches


@functools.cache
def _forces(gravity_kinds, surface_kinds, lossy):
    """Warp function as `all_wrenches` makes; lossy: lists what touches."""
    wrenches = all_wrenches(gravity_kinds, surface_kinds, listed if lossy else ignored)
    meet = met(surface_kinds[0])

    @wp.func
    def listing(
        stage: int,
        gravity: Stages,
        surfaces: Stages,
        thin: Thin,
        masses: Masses,
        shells: Shells,
        touches: Touches,
        state: Rigids,
    ):
        begun(touches)
        u = wrenches(stage, gravity, surfaces, thin, masses, shells, touches, state)
        meet(stage, surfaces, touches)
        return u

    return listing if lossy else wrenches


@wp.func
def kick_with_losses(state: Rigids, masses: Masses, touches: Touches, losses: Losses, t: wp.float64):
    """Kick, and what damping and friction make of it."""
    before_kick(state, masses, touches, losses)
    kick(state, masses, t)
    lose(t, state, masses, touches, losses)


@wp.func
def kick_without(state: Rigids, masses: Masses, touches: Touches, losses: Losses, t: wp.float64):
    """Kick alone."""
    kick(state, masses, t)


@functools.cache
def rigid_kernel(gravity_kinds, surface_kinds, lossy: bool = False):
    """Kernel that takes all bodies through `steps` steps of length dt and records every stage.

    lossy: whether some pair of bodies has friction, or a restitution below 1; else touches and losses are not read.
    """
    wrenches = _forces(gravity_kinds, surface_kinds, lossy)
    kicked = kick_with_losses if lossy else kick_without

    @wp.kernel(module="unique", enable_backward=False)
    def rigid(
        start: int,
        steps: int,
        dt: wp.float64,
        splitting: RigidSplitting,
        gravity: Stages,
        surfaces: Stages,
        thin: Thin,
        masses: Masses,
        shells: Shells,
        touches: Touches,
        losses: Losses,
        state: Rigids,
    ):
        drifts = splitting.drifts.shape[0]
        known = wp.int32(0)
        record(state, 0)
        record_end(state, masses, 0)
        for step in range(steps):
            for j in range(drifts + 1):
                if j > 0:
                    drift(state, masses, dt * splitting.drifts[j - 1])
                    record(state, step * drifts + j)
                    known = 0
                if splitting.kicks[j] != wp.float64(0.0):
                    if known == 0:
                        wrenches(step * drifts + j, gravity, surfaces, thin, masses, shells, touches, state)
                        known = 1
                    kicked(state, masses, touches, losses, dt * splitting.kicks[j])
            record_end(state, masses, step + 1)

    return rigid


@functools.cache
def energy_kernel(gravity_kinds, surface_kinds):
    """Kernel that finds the potential energy of all bodies, and their forces and torques, at the first stage."""
    wrenches = all_wrenches(gravity_kinds, surface_kinds)

    @wp.kernel(module="unique", enable_backward=False)
    def potential(
        start: int,
        gravity: Stages,
        surfaces: Stages,
        thin: Thin,
        masses: Masses,
        shells: Shells,
        state: Rigids,
        energy: wp.array(dtype=wp.float64),
    ):
        energy[0] = wrenches(0, gravity, surfaces, thin, masses, shells, Touches(), state)

    return potential


@functools.cache
def pair_kernel(gravity_kinds, surface_kinds):
    """Kernel over pairs, a B + b: what the fields of b do to a; kinds: the free bodies' own.

    forces, torques, backs (B, B) of row a, column b: force and torque on a, and the torque on b; 0 for a body itself.
    """
    pull = gravity_between(gravity_kinds)
    push = contact_between(surface_kinds, ignored)

    @wp.kernel(module="unique", enable_backward=False)
    def pairs(
        start: int,
        masses: Masses,
        shells: Shells,
        state: Rigids,
        forces: wp.array2d(dtype=wp.vec3d),
        torques: wp.array2d(dtype=wp.vec3d),
        backs: wp.array2d(dtype=wp.vec3d),
    ):
        count = state.x.shape[0]
        a = (start + wp.tid()) // count
        b = (start + wp.tid()) % count
        forces[a, b] = wp.vec3d()
        torques[a, b] = wp.vec3d()
        backs[a, b] = wp.vec3d()
        if a != b:
            _u, pulled, turn, back = pull(a, b, masses, state.x, state.q)
            _w, pushed, twist, rear = push(a, b, shells, Touches(), state.x, state.q)
            forces[a, b] = pulled + pushed
            torques[a, b] = turn + twist
            backs[a, b] = back + rear

    return pairs
