"""Contact of free bodies: a conservative, short-range repulsion of surfaces, as Warp functions.

The points spread over a body's surface are tested in the other body's surface field: where log F > 0 they lie inside,
and

    U = sum over points of stiffness * area * (log F)^3 / 3

pushes them out. The cube makes the force smooth where contact begins, so that an integrator keeps its order. Two free
bodies share one energy, the mean of both directions; prescribed bodies act on the points of the free ones. Nothing is
lost in a contact: it is elastic and without friction.
"""

import functools

import warp as wp

from fieldsim.dynamics.rigid.gravity import field_of_body
from fieldsim.dynamics.rigid.wrenches import act_on_both
from fieldsim.sources.field import field_at
from fieldsim.sources.margins import margin_of
from fieldsim.sources.stages import Stages


@wp.struct
class Shells:
    """Surfaces of B free bodies, in their principal frames.

    points, weights: surface points and their area times stiffness. blocks: centres and radii of spheres around the
    points of each block, which end at block_end; those of body b begin at first_block[b]. rows, kinds: elements of the
    surface fields with their reach (see `sources.margins`), those of body b from first_row[b]. reach (B,): radius about
    the centre of mass that holds the surface.
    """

    points: wp.array(dtype=wp.vec3d)
    weights: wp.array(dtype=wp.float64)
    blocks: wp.array(dtype=wp.vec4d)
    block_end: wp.array(dtype=wp.int32)
    first_block: wp.array(dtype=wp.int32)
    rows: wp.array2d(dtype=wp.float64)
    kinds: wp.array(dtype=wp.int32)
    first_row: wp.array(dtype=wp.int32)
    reach: wp.array(dtype=wp.float64)


@wp.func
def pressed(f: wp.float64, g: wp.vec3d, weight: wp.float64):
    """Energy of a surface point, and force on it, where the other's field is f > 1 with gradient g."""
    depth = wp.log(f)
    push = weight * depth * depth
    return push * depth / wp.float64(3.0), -(push / f) * g


@wp.func
def begin_of(shells: Shells, block: int):
    """Where the points of a block begin."""
    begin = wp.int32(0)
    if block > 0:
        begin = shells.block_end[block - 1]
    return begin


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
def against_prescribed(kinds):
    """Warp function (body, stage, surfaces, shells, x, q, force, torque) -> energy of contact with prescribed ones."""
    field = field_at(kinds)
    room = room_at(kinds)

    @wp.func
    def contact(
        b: int,
        stage: int,
        surfaces: Stages,
        shells: Shells,
        x: wp.array(dtype=wp.vec3d),
        q: wp.array(dtype=wp.quatd),
        force: wp.array(dtype=wp.vec3d),
        torque: wp.array(dtype=wp.vec3d),
    ):
        u = wp.float64(0.0)
        if room(x[b], surfaces, stage) < shells.reach[b]:
            for block in range(shells.first_block[b], shells.first_block[b + 1]):
                ball = shells.blocks[block]
                middle = x[b] + wp.quat_rotate(q[b], wp.vec3d(ball[0], ball[1], ball[2]))
                if room(middle, surfaces, stage) < ball[3]:
                    for k in range(begin_of(shells, block), shells.block_end[block]):
                        arm = wp.quat_rotate(q[b], shells.points[k])
                        f, g = field(x[b] + arm, surfaces, stage)
                        if f > wp.float64(1.0):
                            energy, push = pressed(f, g, shells.weights[k])
                            u = u + energy
                            force[b] = force[b] + push
                            torque[b] = torque[b] + wp.cross(arm, push)
        return u

    return contact


@functools.cache
def contact_between(kinds):
    """Warp function (b, other, shells, x, q) -> (energy, force on b, torque on b, torque on the other).

    Of b's points in the other's surface; the force on the other is the opposite one.
    """
    field = field_of_body(kinds)
    margin = margin_of(kinds).warp(wp.float64)

    @wp.func
    def between(b: int, other: int, shells: Shells, x: wp.array(dtype=wp.vec3d), q: wp.array(dtype=wp.quatd)):
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
                    for k in range(begin_of(shells, block), shells.block_end[block]):
                        arm = wp.quat_rotate(q[b], shells.points[k])
                        p = x[b] + arm
                        f, g = field(p, x[other], q[other], shells.rows, shells.kinds, first, end)
                        if f > wp.float64(1.0):
                            energy, push = pressed(f, g, wp.float64(0.5) * shells.weights[k])
                            u = u + energy
                            force = force + push
                            torque = torque + wp.cross(arm, push)
                            back = back - wp.cross(p - x[other], push)
        return u, force, torque, back

    return between


@functools.cache
def contact_wrenches(prescribed_kinds, free_kinds):
    """Warp function (stage, surfaces, shells, x, q, force, torque) -> energy; adds to force and torque."""
    ground = against_prescribed(prescribed_kinds)
    between = contact_between(free_kinds)

    @wp.func
    def wrenches(
        stage: int,
        surfaces: Stages,
        shells: Shells,
        x: wp.array(dtype=wp.vec3d),
        q: wp.array(dtype=wp.quatd),
        force: wp.array(dtype=wp.vec3d),
        torque: wp.array(dtype=wp.vec3d),
    ):
        u = wp.float64(0.0)
        for b in range(x.shape[0]):
            u = u + ground(b, stage, surfaces, shells, x, q, force, torque)
            for other in range(x.shape[0]):
                if other != b:
                    energy, push, turn, back = between(b, other, shells, x, q)
                    u = u + energy
                    act_on_both(b, other, push, turn, back, force, torque)
        return u

    return wrenches
