"""What contacts lose: damping along the normal, and friction, as forces on top of the elastic ones.

Coulomb's friction resists what slides with the coefficient times the push. So that a time step does not reverse the
sliding, it is no more than what would stop it within one, each contact by its part of the tree's load: at a
contact's place the tree has the effective mass 1 / (j . M^-1 j), j the generalised force of a unit force along the
sliding there. Over all contacts of a tree the rates at which sliding decays add up to no more than 1 / timestep.
"""

import ctypes
import functools
import math

from fieldsim.dynamics.contact.laws import coulomb
from fieldsim.mujoco.callback.addresses import SOLVE, address_of, call_five, library
from fieldsim.mujoco.callback.evaluate import group_field, maker, turns, vectors
from fieldsim.mujoco.callback.rows import DAMPING, FORCE_X, FRICTION, SHIFT_X, TORQUE_X, TURN_X
from fieldsim.mujoco.contact.rows import BODY, PLACE_X, PUSH, WAY_X
from fieldsim.native import known


@functools.cache
def _ground(native: bool):
    """Function (point, source, turns) -> velocity of the surface's material there, weighted by the fields."""
    alone = group_field(native)
    _, cross, _ = vectors(native)

    @maker(native)
    def velocity(p, source, turned):
        motions = source.motions
        total, vx, vy, vz = 0.0, 0.0, 0.0, 0.0
        for g in range(motions.shape[0]):
            f, _ = alone(p, source, turned, g)
            x, y, z = cross((motions[g, TURN_X], motions[g, TURN_X + 1], motions[g, TURN_X + 2]), p)
            total += f
            vx += f * (x + motions[g, SHIFT_X])
            vy += f * (y + motions[g, SHIFT_X + 1])
            vz += f * (z + motions[g, SHIFT_X + 2])
        if total <= 0.0:
            return 0.0, 0.0, 0.0
        return vx / total, vy / total, vz / total

    return velocity


@functools.cache
def _solver(native: bool):
    """Function (model, data, x, y): x = M^-1 y by MuJoCo's own factors of the inertia matrix."""
    if native:

        @maker(native)
        def solve_native(model, data, x, y):
            call_five(known(SOLVE), model, data, x.ctypes.data, y.ctypes.data, 1)

        return solve_native
    kind = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4, ctypes.c_int)
    solve_in_c = kind(address_of(library().mj_solveM))

    def solve(model, data, x, y):
        solve_in_c(model, data, x.ctypes.data, y.ctypes.data, 1)

    return solve


@functools.cache
def mobility(native: bool):
    """Function (b, plan, views, place, along, room) -> acceleration of body b there by a unit force; 0 if unknown."""
    dot, cross, _ = vectors(native)
    _, back = turns(native)
    solve = _solver(native)

    @maker(native)
    def of_free(b, views, place, along):
        """Of a body that nothing is joined to."""
        x = views.xipos
        spin = back(views.ximat, b, cross((place[0] - x[b, 0], place[1] - x[b, 1], place[2] - x[b, 2]), along))
        rate = 1.0 / views.mass[b]
        for j in range(3):
            if views.inertia[b, j] > 0.0:
                rate += spin[j] * spin[j] / views.inertia[b, j]
        return rate

    @maker(native)
    def rate(b, plan, views, place, along, room):
        if plan.alone[b]:
            return of_free(b, views, place, along)
        y, x, c, origin, r = room.efforts, room.answers, views.cdof, views.subtree_com, plan.roots[b]
        arm = place[0] - origin[r, 0], place[1] - origin[r, 1], place[2] - origin[r, 2]
        torque = cross(arm, along)
        y[:] = 0.0
        while b > 0:
            for i in range(plan.first_dof[b], plan.first_dof[b + 1]):
                y[i] = dot((c[i, 0], c[i, 1], c[i, 2]), torque) + dot((c[i, 3], c[i, 4], c[i, 5]), along)
            b = plan.parents[b]
        solve(views.model, views.data, x, y)
        total = 0.0
        for i in range(y.shape[0]):
            total += x[i] * y[i]
        return total

    return rate


@functools.cache
def _lost(native: bool):
    """Function (h, load, plan, views, turns, room) -> force of hit h on top of the elastic one, and where it acts."""
    ground = _ground(native)
    rate = mobility(native)
    dot, cross, _ = vectors(native)
    grip = coulomb.native if native else coulomb

    @maker(native, inline=False)
    def lost(h, load, plan, views, turned, room):
        hits = room.hits
        b = plan.bodies[int(hits[h, BODY])]
        p = hits[h, PLACE_X], hits[h, PLACE_X + 1], hits[h, PLACE_X + 2]
        n = hits[h, WAY_X], hits[h, WAY_X + 1], hits[h, WAY_X + 2]
        push, r, origin, v = hits[h, PUSH], plan.roots[b], views.subtree_com, views.cvel
        arm = p[0] - origin[r, 0], p[1] - origin[r, 1], p[2] - origin[r, 2]
        wx, wy, wz = cross((v[b, 0], v[b, 1], v[b, 2]), arm)
        gx, gy, gz = ground(p, plan.surface, turned)
        v = v[b, 3] + wx - gx, v[b, 4] + wy - gy, v[b, 5] + wz - gz
        rising = dot(v, n)
        damped = -min(push, plan.law[DAMPING] * push * rising)
        along = v[0] - rising * n[0], v[1] - rising * n[1], v[2] - rising * n[2]
        speed = math.sqrt(dot(along, along))
        limit = plan.law[FRICTION] * (push + damped)
        if not (limit > 0.0 and speed > 0.0):
            return (damped * n[0], damped * n[1], damped * n[2]), p
        moves = rate(b, plan, views, p, (along[0] / speed, along[1] / speed, along[2] / speed), room) * load / push
        step = views.timestep
        x, y, z = grip(along[0], along[1], along[2], 0.0, 0.0, 0.0, max(moves, 1e-300), limit * step)
        return (damped * n[0] + x / step, damped * n[1] + y / step, damped * n[2] + z / step), p

    return lost


@functools.cache
def losses(native: bool):
    """Function (plan, views, turns, room): add what all hits lose to room.pushes."""
    lost = _lost(native)
    _, cross, _ = vectors(native)

    @maker(native)
    def lose(plan, views, turned, room):
        hits, loads, x = room.hits, room.loads, views.xipos
        count = int(hits[0, BODY])
        if count == 0:
            return
        loads[:] = 0.0
        for h in range(1, count + 1):
            loads[plan.roots[plan.bodies[int(hits[h, BODY])]]] += hits[h, PUSH]
        for h in range(1, count + 1):
            k = int(hits[h, BODY])
            b = plan.bodies[k]
            force, p = lost(h, loads[plan.roots[b]], plan, views, turned, room)
            torque = cross((p[0] - x[b, 0], p[1] - x[b, 1], p[2] - x[b, 2]), force)
            for j in range(3):
                room.pushes[k, FORCE_X + j] += force[j]
                room.pushes[k, TORQUE_X + j] += torque[j]

    return lose
