"""One evaluation of the callback: the wrench on every body, and what it does to the degrees of freedom.

`turns` (G, 9), of gravity's and of the surfaces' groups, is scratch.
"""

import functools

from fieldsim.mujoco.callback.evaluate import maker, turning, vectors
from fieldsim.mujoco.callback.wrenches import pull_at_center, pull_on_points
from fieldsim.mujoco.contact.potential import touch


@functools.cache
def wrench_on(accuracy: str, contact: bool, native: bool):
    """Function (k, plan, views, turns of gravity, of surfaces) -> force, torque, energies of field and contact."""
    pull = pull_at_center(native) if accuracy == "torque" else pull_on_points(native, accuracy == "points")
    push = touch(native)

    @maker(native)
    def gravity_alone(k, plan, views, gravity_turns, surface_turns):
        force, torque, u = pull(k, plan, views, gravity_turns)
        return force, torque, u, 0.0

    @maker(native)
    def both(k, plan, views, gravity_turns, surface_turns):
        f, t, u = pull(k, plan, views, gravity_turns)
        fc, tc, uc = push(k, plan, views, surface_turns)
        return (f[0] + fc[0], f[1] + fc[1], f[2] + fc[2]), (t[0] + tc[0], t[1] + tc[1], t[2] + tc[2]), u, uc

    return both if contact else gravity_alone


@functools.cache
def actor(accuracy: str, contact: bool, native: bool):
    """Function (plan, views, turns, turns, subtree_wrench, found): add generalised forces to views.qfrc_passive.

    subtree_wrench (nbody, 6): scratch; torque and force on each body's subtree. found (n, 8) or (0, 8): where forces,
    torques and energies of field and contact of every body are left, if anywhere.
    """
    wrench = wrench_on(accuracy, contact, native)
    fill = turning(native)
    dot, cross, _ = vectors(native)

    @maker(native)
    def felt(k, plan, views, gravity_turns, surface_turns, found):
        """Torque and force on one body, about the centre of mass of its whole tree, as MuJoCo's motion axes are."""
        force, torque, u, u_contact = wrench(k, plan, views, gravity_turns, surface_turns)
        if found.shape[0] > 0:
            for i in range(3):
                found[k, i] = force[i]
                found[k, 3 + i] = torque[i]
            found[k, 6] = u
            found[k, 7] = u_contact
        b = plan.bodies[k]
        x, origin, r = views.xipos, views.subtree_com, plan.roots[b]
        tx, ty, tz = cross((x[b, 0] - origin[r, 0], x[b, 1] - origin[r, 1], x[b, 2] - origin[r, 2]), force)
        return torque[0] + tx, torque[1] + ty, torque[2] + tz, force[0], force[1], force[2]

    @maker(native)
    def act(plan, views, gravity_turns, surface_turns, subtree_wrench, found):
        fill(plan.gravity, views.time, gravity_turns)
        fill(plan.surface, views.time, surface_turns)
        subtree_wrench[:] = 0.0
        c = views.cdof
        # From the leaves to the roots: a body's joints carry the wrench on its subtree.
        for b in range(subtree_wrench.shape[0] - 1, 0, -1):
            tx, ty, tz = subtree_wrench[b, 0], subtree_wrench[b, 1], subtree_wrench[b, 2]
            fx, fy, fz = subtree_wrench[b, 3], subtree_wrench[b, 4], subtree_wrench[b, 5]
            if plan.places[b] >= 0:
                own = felt(plan.places[b], plan, views, gravity_turns, surface_turns, found)
                tx, ty, tz = tx + own[0], ty + own[1], tz + own[2]
                fx, fy, fz = fx + own[3], fy + own[4], fz + own[5]
            for i in range(plan.first_dof[b], plan.first_dof[b + 1]):
                turning = dot((c[i, 0], c[i, 1], c[i, 2]), (tx, ty, tz))
                views.qfrc_passive[i] += turning + dot((c[i, 3], c[i, 4], c[i, 5]), (fx, fy, fz))
            parent = plan.parents[b]
            if parent > 0:
                for i, one in enumerate((tx, ty, tz, fx, fy, fz)):
                    subtree_wrench[parent, i] += one

    return act
