"""Contact of free bodies: a conservative, short-range repulsion of surfaces, as Warp functions.

The points spread over a body's surface are tested in the other body's surface field: where F > 1 they lie inside, as
deep as the nearest point of the surface F = 1 is away (see `depth`), and

    U = sum over points of stiffness * area * depth^3 / 3

pushes them out, along the normal there. The cube makes the force smooth where contact begins, so that an integrator
keeps its order. Two free bodies share one energy, the mean of both directions, so that each presses with its own
stiffness. Prescribed bodies act on the points of the free ones; those that are thinner than these are apart have points
as well, on which the free bodies act.

`note`, where it is asked for, is told of each point that touches (see `touches`).
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.laws import pressed
from fieldsim.dynamics.rigid.depth import within_body, within_prescribed
from fieldsim.dynamics.rigid.gravity import field_of_body
from fieldsim.dynamics.rigid.shells import Shells, Thin, begin_of
from fieldsim.dynamics.rigid.touches import PRESCRIBED, Touches
from fieldsim.dynamics.rigid.wrenches import act_on_both
from fieldsim.sources.field import field_at
from fieldsim.sources.margins import margin_of
from fieldsim.sources.stages import Stages

_pressed = pressed.warp(wp.float64)


@functools.cache
def room_at(prescribed_kinds):
    """Warp function (point, surfaces, stage) -> a distance within which no prescribed surface can be."""
    fixed, moving = (margin_of(kinds).warp(wp.float64) for kinds in prescribed_kinds)

    @wp.func
    def room(p: wp.vec3d, surfaces: Stages, stage: int):
        still = fixed(p[0], p[1], p[2], surfaces.rows, surfaces.kinds, 0, surfaces.kinds.shape[0])
        first = stage * surfaces.moving
        changing = moving(p[0], p[1], p[2], surfaces.moving_rows, surfaces.moving_kinds, first, surfaces.moving)
        return wp.min(still, changing)

    return room


@functools.cache
def against_prescribed(kinds, note):
    """Warp function (body, stage, surfaces, shells, touches, x, q, force, torque) -> energy against prescribed ones."""
    field = field_at(kinds)
    within = within_prescribed(kinds)
    room = room_at(kinds)

    @wp.func
    def contact(
        b: int,
        stage: int,
        surfaces: Stages,
        shells: Shells,
        touches: Touches,
        x: wp.array(dtype=wp.vec3d),
        q: wp.array(dtype=wp.quatd),
        force: wp.array(dtype=wp.vec3d),
        torque: wp.array(dtype=wp.vec3d),
    ):
        u = wp.float64(0.0)
        grain = shells.grains[x.shape[0]]
        if room(x[b], surfaces, stage) < shells.reach[b]:
            for block in range(shells.first_block[b], shells.first_block[b + 1]):
                ball = shells.blocks[block]
                middle = x[b] + wp.quat_rotate(q[b], wp.vec3d(ball[0], ball[1], ball[2]))
                if room(middle, surfaces, stage) < ball[3]:
                    for k in range(begin_of(shells.block_end, block), shells.block_end[block]):
                        arm = wp.quat_rotate(q[b], shells.points[k])
                        p = x[b] + arm
                        f, _g = field(p, surfaces, stage)
                        if f > wp.float64(1.0):
                            depth, normal = within(p, surfaces, stage, grain)
                            energy, press = _pressed(depth, shells.weights[k])
                            u = u + energy
                            force[b] = force[b] + press * normal
                            torque[b] = torque[b] + wp.cross(arm, press * normal)
                            note(touches, b, PRESCRIBED, k, p, normal, depth, press)
        return u

    return contact


@functools.cache
def under_thin(kinds, note):
    """Warp function (body, stage, thin, shells, touches, x, q, force, torque) -> energy under thin prescribed ones."""
    field = field_of_body(kinds)
    within = within_body(kinds)
    margin = margin_of(kinds).warp(wp.float64)

    @wp.func
    def contact(
        b: int,
        stage: int,
        thin: Thin,
        shells: Shells,
        touches: Touches,
        x: wp.array(dtype=wp.vec3d),
        q: wp.array(dtype=wp.quatd),
        force: wp.array(dtype=wp.vec3d),
        torque: wp.array(dtype=wp.vec3d),
    ):
        u = wp.float64(0.0)
        row = stage * thin.moving
        first = shells.first_row[b]
        end = shells.first_row[b + 1]
        for block in range(thin.width.shape[0]):
            ball = thin.blocks[row, block]
            middle = wp.vec3d(ball[0], ball[1], ball[2])
            near = wp.length(middle - x[b]) < shells.reach[b] + ball[3]
            if near and thin.width[block] < shells.spacing[b]:
                at = wp.quat_rotate_inv(q[b], middle - x[b])
                if margin(at[0], at[1], at[2], shells.rows, shells.kinds, first, end - first) < ball[3]:
                    for k in range(begin_of(thin.block_end, block), thin.block_end[block]):
                        p = thin.points[row, k]
                        f, _g = field(p, x[b], q[b], shells.rows, shells.kinds, first, end)
                        if f > wp.float64(1.0):
                            depth, outward = within(wp.quat_rotate_inv(q[b], p - x[b]), shells, b, shells.grains[b])
                            normal = -wp.quat_rotate(q[b], outward)
                            energy, press = _pressed(depth, thin.areas[k] * shells.stiffness[b])
                            u = u + energy
                            force[b] = force[b] + press * normal
                            torque[b] = torque[b] + wp.cross(p - x[b], press * normal)
                            note(touches, b, PRESCRIBED, shells.points.shape[0] + k, p, normal, depth, press)
        return u

    return contact


@functools.cache
def contact_between(kinds, note):
    """Warp function (b, other, shells, touches, x, q) -> (energy, force on b, torque on b, torque on the other).

    Of b's points in the other's surface; the force on the other is the opposite one.
    """
    field = field_of_body(kinds)
    within = within_body(kinds)
    margin = margin_of(kinds).warp(wp.float64)

    @wp.func
    def between(
        b: int, other: int, shells: Shells, touches: Touches, x: wp.array(dtype=wp.vec3d), q: wp.array(dtype=wp.quatd)
    ):
        u = wp.float64(0.0)
        force = wp.vec3d()
        torque = wp.vec3d()
        back = wp.vec3d()
        first = shells.first_row[other]
        end = shells.first_row[other + 1]
        if wp.length(x[b] - x[other]) < shells.reach[b] + shells.reach[other]:
            for block in range(shells.first_block[b], shells.first_block[b + 1]):
                ball = shells.blocks[block]
                middle = x[b] + wp.quat_rotate(q[b], wp.vec3d(ball[0], ball[1], ball[2]))
                at = wp.quat_rotate_inv(q[other], middle - x[other])
                if margin(at[0], at[1], at[2], shells.rows, shells.kinds, first, end - first) < ball[3]:
                    for k in range(begin_of(shells.block_end, block), shells.block_end[block]):
                        arm = wp.quat_rotate(q[b], shells.points[k])
                        p = x[b] + arm
                        f, _g = field(p, x[other], q[other], shells.rows, shells.kinds, first, end)
                        if f > wp.float64(1.0):
                            at = wp.quat_rotate_inv(q[other], p - x[other])
                            depth, outward = within(at, shells, other, shells.grains[other])
                            normal = wp.quat_rotate(q[other], outward)
                            energy, press = _pressed(depth, wp.float64(0.5) * shells.weights[k])
                            u = u + energy
                            push = press * normal
                            force = force + push
                            torque = torque + wp.cross(arm, push)
                            back = back - wp.cross(p - x[other], push)
                            note(touches, b, other, k, p, normal, depth, press)
        return u, force, torque, back

    return between


@functools.cache
def contact_wrenches(prescribed_kinds, free_kinds, note):
    """Warp function (stage, surfaces, thin, shells, touches, x, q, force, torque) -> energy; adds to force, torque."""
    ground = against_prescribed(prescribed_kinds, note)
    under = under_thin(free_kinds, note)
    between = contact_between(free_kinds, note)

    @wp.func(inline=False)
    def wrenches(
        stage: int,
        surfaces: Stages,
        thin: Thin,
        shells: Shells,
        touches: Touches,
        x: wp.array(dtype=wp.vec3d),
        q: wp.array(dtype=wp.quatd),
        force: wp.array(dtype=wp.vec3d),
        torque: wp.array(dtype=wp.vec3d),
    ):
        u = wp.float64(0.0)
        for b in range(x.shape[0]):
            u = u + ground(b, stage, surfaces, shells, touches, x, q, force, torque)
            u = u + under(b, stage, thin, shells, touches, x, q, force, torque)
            for other in range(x.shape[0]):
                if other != b and shells.apart == 0:
                    energy, push, turn, back = between(b, other, shells, touches, x, q)
                    u = u + energy
                    act_on_both(b, other, push, turn, back, force, torque)
        return u

    return wrenches
