"""Gravity on free bodies, as Warp functions: every source's field acts on the mass points of every free body.

Two free bodies share one energy: minus the mean of each one's field at the mass points of the other (of one
alone, if only one pulls). Forces and torques are its derivatives on both, so that momentum, angular momentum and
energy are kept whatever the kernel, and however few the mass points.
"""

import functools

import warp as wp

from fieldsim.dynamics.rigid.wrenches import act_on_both
from fieldsim.potentials import registry
from fieldsim.sources.field import field_at
from fieldsim.sources.stages import Stages


@wp.struct
class Masses:
    """B free bodies as gravity sees them, in their principal frames.

    mass (B,), inverse (B,): inverse principal moments, descending. points, weights: mass points and their masses, those
    of body b from first_point[b] to first_point[b + 1]; rows, kinds: elements of their fields, likewise by first_row.
    """

    mass: wp.array(dtype=wp.float64)
    inverse: wp.array(dtype=wp.vec3d)
    points: wp.array(dtype=wp.vec3d)
    weights: wp.array(dtype=wp.float64)
    first_point: wp.array(dtype=wp.int32)
    rows: wp.array2d(dtype=wp.float64)
    kinds: wp.array(dtype=wp.int32)
    first_row: wp.array(dtype=wp.int32)


@functools.cache
def field_of_body(kinds):
    """Warp function (point, x, q, rows, kinds, first row, end) -> (F, gradient), world frame, of a body at (x, q)."""
    total = registry.field_sum(kinds).warp(wp.float64)

    @wp.func
    def field(
        p: wp.vec3d,
        x: wp.vec3d,
        q: wp.quatd,
        rows: wp.array2d(dtype=wp.float64),
        kinds: wp.array(dtype=wp.int32),
        first: int,
        end: int,
    ):
        local = wp.quat_rotate_inv(q, p - x)
        f, fx, fy, fz = total(local[0], local[1], local[2], rows, kinds, first, end - first)
        return f, wp.quat_rotate(q, wp.vec3d(fx, fy, fz))

    return field


@functools.cache
def gravity_between(kinds):
    """Warp function (b, other, masses, x, q) -> (energy, force on b, torque on b, torque on the other).

    Of the other's field on the mass points of b; the force on the other is the opposite one.
    """
    inner = field_of_body(kinds)

    @wp.func
    def between(b: int, other: int, masses: Masses, x: wp.array(dtype=wp.vec3d), q: wp.array(dtype=wp.quatd)):
        u = wp.float64(0.0)
        force = wp.vec3d()
        torque = wp.vec3d()
        back = wp.vec3d()
        first = masses.first_row[other]
        end = masses.first_row[other + 1]
        if end > first:
            share = wp.float64(1.0)
            if masses.first_row[b + 1] > masses.first_row[b]:
                share = wp.float64(0.5)
            for k in range(masses.first_point[b], masses.first_point[b + 1]):
                arm = wp.quat_rotate(q[b], masses.points[k])
                p = x[b] + arm
                weight = share * masses.weights[k]
                f, g = inner(p, x[other], q[other], masses.rows, masses.kinds, first, end)
                pull = weight * g
                u = u - weight * f
                force = force + pull
                torque = torque + wp.cross(arm, pull)
                back = back - wp.cross(p - x[other], pull)
        return u, force, torque, back

    return between


@functools.cache
def gravity_wrenches(prescribed_kinds, free_kinds):
    """Warp function (stage, sources, masses, x, q, force, torque) -> energy; adds to force and torque."""
    outer = field_at(prescribed_kinds)
    between = gravity_between(free_kinds)

    @wp.func(inline=False)
    def wrenches(
        stage: int,
        sources: Stages,
        masses: Masses,
        x: wp.array(dtype=wp.vec3d),
        q: wp.array(dtype=wp.quatd),
        force: wp.array(dtype=wp.vec3d),
        torque: wp.array(dtype=wp.vec3d),
    ):
        u = wp.float64(0.0)
        for b in range(x.shape[0]):
            for k in range(masses.first_point[b], masses.first_point[b + 1]):
                arm = wp.quat_rotate(q[b], masses.points[k])
                f, g = outer(x[b] + arm, sources, stage)
                pull = masses.weights[k] * g
                u = u - masses.weights[k] * f
                force[b] = force[b] + pull
                torque[b] = torque[b] + wp.cross(arm, pull)
            for other in range(x.shape[0]):
                if other != b:
                    energy, pulled, turn, back = between(b, other, masses, x, q)
                    u = u + energy
                    act_on_both(b, other, pulled, turn, back, force, torque)
        return u

    return wrenches
