"""The state of free bodies as kernels keep it, and what an impulse does to it."""

import warp as wp

from fieldsim.dynamics.rigid.gravity import Masses
from fieldsim.numerics.running_sums import added

HALF = wp.constant(wp.float64(0.5))


@wp.struct
class Rigids:
    """State of B bodies, in the world's frame.

    x (B,): centres of mass; p, spin (B,): momenta and angular momenta about them; e (B,): energies of rotation; q (B,):
    turns from the principal to the world's frame; x_rest, ...: what rounding has kept from their sums. force, torque
    (B,): of the moment, about the centres of mass.
    places, turns (stages, B): x and q at every stage of a launch: stage n s + j is after drift j of step n, of s drifts
    a step; stage 0 is the start. speeds, rates (steps + 1, B): velocities and angular velocities at the steps' ends.
    """

    x: wp.array(dtype=wp.vec3d)
    x_rest: wp.array(dtype=wp.vec3d)
    p: wp.array(dtype=wp.vec3d)
    p_rest: wp.array(dtype=wp.vec3d)
    q: wp.array(dtype=wp.quatd)
    spin: wp.array(dtype=wp.vec3d)
    spin_rest: wp.array(dtype=wp.vec3d)
    e: wp.array(dtype=wp.float64)
    e_rest: wp.array(dtype=wp.float64)
    force: wp.array(dtype=wp.vec3d)
    torque: wp.array(dtype=wp.vec3d)
    places: wp.array2d(dtype=wp.vec3d)
    turns: wp.array2d(dtype=wp.quatd)
    speeds: wp.array2d(dtype=wp.vec3d)
    rates: wp.array2d(dtype=wp.vec3d)


@wp.func
def turning(q: wp.quatd, spin: wp.vec3d, inverse: wp.vec3d):
    """Angular velocity of a body of the given angular momentum, both in the world's frame."""
    return wp.quat_rotate(q, wp.cw_mul(inverse, wp.quat_rotate_inv(q, spin)))


@wp.func
def struck(b: int, push: wp.vec3d, turn: wp.vec3d, state: Rigids, masses: Masses):
    """Give body b an impulse and its moment about the centre of mass."""
    p, p_rest = added(state.p[b], state.p_rest[b], push)
    state.p[b] = p
    state.p_rest[b] = p_rest
    # The work of the torque: on the mean of the angular velocities before and after.
    work = wp.dot(turn, turning(state.q[b], state.spin[b] + HALF * turn, masses.inverse[b]))
    e, e_rest = added(state.e[b], state.e_rest[b], work)
    state.e[b] = e
    state.e_rest[b] = e_rest
    spin, spin_rest = added(state.spin[b], state.spin_rest[b], turn)
    state.spin[b] = spin
    state.spin_rest[b] = spin_rest
