"""One evaluation of the callback: the wrench on every body, and what it does to the degrees of freedom."""

import functools

from fieldsim.mujoco.callback.evaluate import maker, turning, vectors
from fieldsim.mujoco.callback.rows import FIELD_ENERGY, FORCE_X, PULL_ENERGY, PULL_TORQUE_X, TORQUE_X
from fieldsim.mujoco.callback.wrenches import pulling
from fieldsim.mujoco.contact.losses import losses
from fieldsim.mujoco.contact.potential import touch
from fieldsim.mujoco.contact.rows import BODY


@functools.cache
def _pushing(native: bool):
    """Function (plan, views, room): fill room.pushes with what contacts do to every body."""
    push, lose = touch(native), losses(native)
    fill = turning(native)

    @maker(native)
    def pushes(plan, views, room):
        fill(plan.surface, views.time, room.surface_turns)
        room.hits[0, BODY] = 0
        for k in range(plan.bodies.shape[0]):
            push(k, plan, views, room.surface_turns, room)
        lose(plan, views, room.surface_turns, room)

    return pushes


@functools.cache
def actor(accuracy: str, contact: bool, native: bool):
    """Function (plan, views, room, found): add generalised forces to views.qfrc_passive.

    room: a `Room`. found (n, FOUND_WIDTH) or (0, FOUND_WIDTH): where forces, torques and energies of field and contact
    of every body are left, if anywhere.
    """
    pull = pulling(accuracy, native)
    fill = turning(native)
    push = _pushing(native)
    dot, cross, _ = vectors(native)

    @maker(native)
    def felt(k, plan, views, room, found):
        """Torque and force on one body, about the centre of mass of its whole tree, as MuJoCo's motion axes are."""
        pulls, pushes = room.pulls, room.pushes
        force = (
            pulls[k, 0] + pushes[k, FORCE_X],
            pulls[k, 1] + pushes[k, FORCE_X + 1],
            pulls[k, 2] + pushes[k, FORCE_X + 2],
        )
        torque = (
            pulls[k, PULL_TORQUE_X] + pushes[k, TORQUE_X],
            pulls[k, PULL_TORQUE_X + 1] + pushes[k, TORQUE_X + 1],
            pulls[k, PULL_TORQUE_X + 2] + pushes[k, TORQUE_X + 2],
        )
        if found.shape[0] > 0:
            for i in range(found.shape[1]):
                found[k, i] = pushes[k, i]
            for i in range(3):
                found[k, FORCE_X + i] = force[i]
                found[k, TORQUE_X + i] = torque[i]
            found[k, FIELD_ENERGY] = pulls[k, PULL_ENERGY]
        b = plan.bodies[k]
        x, origin, r = views.xipos, views.subtree_com, plan.roots[b]
        tx, ty, tz = cross((x[b, 0] - origin[r, 0], x[b, 1] - origin[r, 1], x[b, 2] - origin[r, 2]), force)
        return torque[0] + tx, torque[1] + ty, torque[2] + tz, force[0], force[1], force[2]

    @maker(native)
    def add(plan, views, room, found):
        fill(plan.gravity, views.time, room.gravity_turns)
        pull(plan, views, room, found.shape[0] > 0)
        subtree_wrench = room.subtree_wrench
        subtree_wrench[:] = 0.0
        c = views.cdof
        # From the leaves to the roots: a body's joints carry the wrench on its subtree.
        for b in range(subtree_wrench.shape[0] - 1, 0, -1):
            tx, ty, tz = subtree_wrench[b, 0], subtree_wrench[b, 1], subtree_wrench[b, 2]
            fx, fy, fz = subtree_wrench[b, 3], subtree_wrench[b, 4], subtree_wrench[b, 5]
            if plan.places[b] >= 0:
                own = felt(plan.places[b], plan, views, room, found)
                tx, ty, tz = tx + own[0], ty + own[1], tz + own[2]
                fx, fy, fz = fx + own[3], fy + own[4], fz + own[5]
            for i in range(plan.first_dof[b], plan.first_dof[b + 1]):
                turning = dot((c[i, 0], c[i, 1], c[i, 2]), (tx, ty, tz))
                views.qfrc_passive[i] += turning + dot((c[i, 3], c[i, 4], c[i, 5]), (fx, fy, fz))
            parent = plan.parents[b]
            if parent > 0:
                for i, one in enumerate((tx, ty, tz, fx, fy, fz)):
                    subtree_wrench[parent, i] += one

    @maker(native)
    def add_alone(plan, views, room, found):
        room.pushes[:] = 0.0
        add(plan, views, room, found)

    if not contact:
        return add_alone

    @maker(native)
    def add_both(plan, views, room, found):
        push(plan, views, room)
        add(plan, views, room, found)

    return add_both
