"""Contact of free bodies: a conservative, short-range repulsion of surfaces, as Warp functions.

Points spread over a body's surface feel the other's surface field: where log F > 0 they lie inside, and

    U = stiffness * sum over points of area * (log F)^3 / 3

pushes them out. The cube makes the force smooth where contact begins, so that an integrator keeps its order. Two free
bodies share one energy, the mean of both ways; prescribed bodies are felt by the points of the free ones.
"""

import functools

import warp as wp

from fieldsim.dynamics.rigid_gravity import field_of_body
from fieldsim.dynamics.sources import Stages, field_at


@wp.struct
class Shells:
    """Surfaces of B free bodies, in their principal frames.

    points, areas: surface points and their shares of area times stiffness, those of body b from first_point[b] to
    first_point[b + 1]; rows, kinds: elements of the surface fields, likewise by first_row; reach (B,): radius about the
    centre of mass that holds the surface.
    """

    points: wp.array(dtype=wp.vec3d)
    areas: wp.array(dtype=wp.float64)
    first_point: wp.array(dtype=wp.int32)
    rows: wp.array2d(dtype=wp.float64)
    kinds: wp.array(dtype=wp.int32)
    first_row: wp.array(dtype=wp.int32)
    reach: wp.array(dtype=wp.float64)


@wp.func
def pressed(f: wp.float64, g: wp.vec3d, area: wp.float64):
    """Energy and force on a surface point where the other's field is f, its gradient g."""
    u = wp.float64(0.0)
    push = wp.vec3d()
    if f > wp.float64(1.0):
        depth = wp.log(f)
        u = area * depth * depth * depth / wp.float64(3.0)
        push = -(area * depth * depth / f) * g
    return u, push


@functools.cache
def contact_wrenches(prescribed_kinds, free_kinds):
    """Warp function (stage, surfaces, shells, x, q, force, torque) -> energy; adds to force and torque."""
    outer = field_at(prescribed_kinds)
    inner = field_of_body(free_kinds)
    anything = any(prescribed_kinds)

    @wp.func
    def against_prescribed(
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
        for k in range(shells.first_point[b], shells.first_point[b + 1]):
            arm = wp.quat_rotate(q[b], shells.points[k])
            f, g = outer(x[b] + arm, surfaces, stage)
            energy, push = pressed(f, g, shells.areas[k])
            u = u + energy
            force[b] = force[b] + push
            torque[b] = torque[b] + wp.cross(arm, push)
        return u

    @wp.func
    def against_body(
        b: int,
        other: int,
        shells: Shells,
        x: wp.array(dtype=wp.vec3d),
        q: wp.array(dtype=wp.quatd),
        force: wp.array(dtype=wp.vec3d),
        torque: wp.array(dtype=wp.vec3d),
    ):
        """Points of body b in the surface of another."""
        u = wp.float64(0.0)
        first = shells.first_row[other]
        end = shells.first_row[other + 1]
        reach = shells.reach[other]
        for k in range(shells.first_point[b], shells.first_point[b + 1]):
            arm = wp.quat_rotate(q[b], shells.points[k])
            p = x[b] + arm
            away = p - x[other]
            if wp.dot(away, away) < reach * reach:
                f, g = inner(p, x[other], q[other], shells.rows, shells.kinds, first, end)
                energy, push = pressed(f, g, wp.float64(0.5) * shells.areas[k])
                u = u + energy
                force[b] = force[b] + push
                torque[b] = torque[b] + wp.cross(arm, push)
                force[other] = force[other] - push
                torque[other] = torque[other] - wp.cross(away, push)
        return u

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
            if wp.static(anything):
                u = u + against_prescribed(b, stage, surfaces, shells, x, q, force, torque)
            for other in range(x.shape[0]):
                if other != b and shells.first_row[other + 1] > shells.first_row[other]:
                    if wp.length(x[b] - x[other]) < shells.reach[b] + shells.reach[other]:
                        u = u + against_body(b, other, shells, x, q, force, torque)
        return u

    return wrenches
