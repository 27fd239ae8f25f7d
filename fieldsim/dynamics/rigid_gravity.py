"""Gravity on free bodies, as Warp functions: every source's field acts on the mass points of every free body.

Two free bodies share one energy: minus the mean of what the field of each does to the mass points of the other (of one
alone, where only one pulls). Forces and torques are its derivatives on both, so that momentum, angular momentum and
energy are kept whatever the kernel, and however few the mass points.
"""

import functools

import warp as wp

from fieldsim.dynamics.sources import Stages, field_at
from fieldsim.potentials import cells


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
    total = cells.field_sum(kinds).warp(wp.float64)

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
def gravity_wrenches(prescribed_kinds, free_kinds):
    """Warp function (stage, sources, masses, x, q, force, torque) -> energy; adds to force and torque."""
    outer = field_at(prescribed_kinds)
    inner = field_of_body(free_kinds)

    @wp.func
    def one_body(
        b: int,
        stage: int,
        sources: Stages,
        masses: Masses,
        x: wp.array(dtype=wp.vec3d),
        q: wp.array(dtype=wp.quatd),
        force: wp.array(dtype=wp.vec3d),
        torque: wp.array(dtype=wp.vec3d),
    ):
        """All that acts on the mass points of body b."""
        u = wp.float64(0.0)
        pulls = masses.first_row[b + 1] > masses.first_row[b]
        for k in range(masses.first_point[b], masses.first_point[b + 1]):
            arm = wp.quat_rotate(q[b], masses.points[k])
            p = x[b] + arm
            f, g = outer(p, sources, stage)
            total = masses.weights[k] * g
            u = u - masses.weights[k] * f
            for other in range(x.shape[0]):
                first = masses.first_row[other]
                end = masses.first_row[other + 1]
                if other != b and end > first:
                    share = masses.weights[k]
                    if pulls:
                        share = wp.float64(0.5) * share
                    f_other, g_other = inner(p, x[other], q[other], masses.rows, masses.kinds, first, end)
                    pull = share * g_other
                    u = u - share * f_other
                    total = total + pull
                    force[other] = force[other] - pull
                    torque[other] = torque[other] - wp.cross(p - x[other], pull)
            force[b] = force[b] + total
            torque[b] = torque[b] + wp.cross(arm, total)
        return u

    @wp.func
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
            u = u + one_body(b, stage, sources, masses, x, q, force, torque)
        return u

    return wrenches
