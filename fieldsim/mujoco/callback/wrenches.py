"""Forces and torques of the field on all bodies: where their points are, pulls on these, and sums over each body."""

import functools
import math

from fieldsim.mujoco.callback.addresses import call
from fieldsim.mujoco.callback.evaluate import maker
from fieldsim.mujoco.callback.pulls import INPUTS
from fieldsim.mujoco.callback.rows import (
    ARM_X,
    BODY_INERTIA,
    BODY_MATRIX_X,
    COMPENSATED,
    MASS,
    PLACE_NOW_X,
    PLACED_WIDTH,
)
from fieldsim.native import ONE_ITEM, known
from fieldsim.portable.lanes.words import HEAD, places

# Words that C functions of pulls take (see `portable.lanes.words`): those before the arguments', and theirs.
COUNT, RESULTS = range(HEAD)
BODIES, PLACED, *_, FRAMES, TURNED, GROUPS, ROWS, KINDS = places(INPUTS)


@functools.cache
def _spreading(accuracy: str, native: bool):
    """Function (m, i1, i2, i3) -> the units of the points' places, along each axis of a body of that mass and inertia.

    Of accuracy "points" sqrt(3 x the mean of x^2 over the mass), as of now.
    """

    @maker(native)
    def units(m, i1, i2, i3):
        return 1.0, 1.0, 1.0

    @maker(native)
    def spread(m, i1, i2, i3):
        if not m > 0.0:
            return 1.0, 1.0, 1.0
        half, three = 0.5 * (i1 + i2 + i3), 3.0 / m
        return (
            math.sqrt(three * max(half - i1, 0.0)),
            math.sqrt(three * max(half - i2, 0.0)),
            math.sqrt(three * max(half - i3, 0.0)),
        )

    return spread if accuracy == "points" else units


@functools.cache
def _placing(accuracy: str, native: bool):
    """Function (plan, views, room): fill room.placed and, for pulls at centres of mass, room.frames."""
    unit, at_centers = _spreading(accuracy, native), accuracy == "torque"

    @maker(native)
    def put(plan, placed, i, m, matrix, x, y, z):
        a, b, c, d, e, f, g, h, j = matrix
        px, py, pz = plan.points[0, i], plan.points[1, i], plan.points[2, i]
        ax, ay, az = a * px + b * py + c * pz, d * px + e * py + f * pz, g * px + h * py + j * pz
        placed[ARM_X, i], placed[ARM_X + 1, i], placed[ARM_X + 2, i] = ax, ay, az
        placed[PLACE_NOW_X, i], placed[PLACE_NOW_X + 1, i], placed[PLACE_NOW_X + 2, i] = x + ax, y + ay, z + az
        placed[MASS, i] = m * plan.points[3, i]

    @maker(native)
    def place(plan, views, room):
        count, placed, frames = plan.bodies.shape[0], room.placed, room.frames
        for k in range(count):
            b = plan.bodies[k]
            share = 1.0 - plan.law[COMPENSATED] * views.gravcomp[b]
            m, i1, i2, i3 = views.mass[b], views.inertia[b, 0], views.inertia[b, 1], views.inertia[b, 2]
            u, v, w = unit(m, i1, i2, i3)
            r, x = views.ximat, views.xipos
            matrix = (
                *(u * r[b, 0], v * r[b, 1], w * r[b, 2]),
                *(u * r[b, 3], v * r[b, 4], w * r[b, 5]),
                *(u * r[b, 6], v * r[b, 7], w * r[b, 8]),
            )
            # The last point is repeated until the last vector is whole.
            end = plan.first_point[k + 1] if k + 1 < count else plan.points.shape[1]
            for i in range(plan.first_point[k], end):
                put(plan, placed, i, share * m, matrix, x[b, 0], x[b, 1], x[b, 2])
            if at_centers:
                for c in range(9):
                    frames[k, BODY_MATRIX_X + c] = r[b, c]
                for c in range(3):
                    frames[k, BODY_INERTIA + c] = share * views.inertia[b, c]

    return place


@functools.cache
def _on_points(native: bool):
    """Function (plan, room, whole): fill room.pulled (PULL_WIDTH, P) with the pull on every point; see `pulls.pull_of`.

    whole: whether with its energy, which takes the field's value; else what stands there means nothing.
    """
    if not native:

        def evaluate(plan, room, whole):
            source = plan.gravity
            tables = room.frames, room.gravity_turns, len(source.groups), source.rows, source.kinds
            for i in range(plan.first_point[-1]):
                room.pulled[:, i] = source.pull(int(plan.point_bodies[i]), *room.placed[:, i].tolist(), *tables)

        return evaluate

    @maker(native)
    def evaluate_in_lanes(plan, room, whole):
        source, words, length = plan.gravity, room.words, room.placed.shape[1]
        # Behind its own address, which is what the call takes.
        words[0] = words.ctypes.data + 8
        words[1 + COUNT], words[1 + RESULTS] = length, room.pulled.ctypes.data
        words[1 + BODIES] = plan.point_bodies.ctypes.data
        for c in range(PLACED_WIDTH):
            words[1 + PLACED + c] = room.placed.ctypes.data + 8 * c * length
        words[1 + FRAMES], words[2 + FRAMES] = room.frames.ctypes.data, room.frames.shape[1]
        words[1 + TURNED], words[2 + TURNED] = room.gravity_turns.ctypes.data, room.gravity_turns.shape[1]
        words[1 + GROUPS] = source.groups.shape[0]
        words[1 + ROWS], words[2 + ROWS] = source.rows.ctypes.data, source.rows.shape[1]
        words[1 + KINDS] = source.kinds.ctypes.data
        call(source.pull if whole else source.force, known(ONE_ITEM), words.ctypes.data, 0, 0)

    return evaluate_in_lanes


@functools.cache
def pulling(accuracy: str, native: bool):
    """Function (plan, views, room, whole): fill room.pulls (n, PULL_WIDTH) with force, torque and energy of each body.

    whole: whether the energy is wanted.
    """
    place, evaluate = _placing(accuracy, native), _on_points(native)

    @maker(native)
    def pull(plan, views, room, whole):
        pulls, each = room.pulls, room.pulled
        if plan.gravity.groups.shape[0] == 0:
            pulls[:] = 0.0
            return
        place(plan, views, room)
        evaluate(plan, room, whole)
        for k in range(plan.bodies.shape[0]):
            fx, fy, fz, tx, ty, tz, u = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(plan.first_point[k], plan.first_point[k + 1]):
                fx, fy, fz = fx + each[0, i], fy + each[1, i], fz + each[2, i]
                tx, ty, tz = tx + each[3, i], ty + each[4, i], tz + each[5, i]
                u += each[6, i]
            pulls[k, 0], pulls[k, 1], pulls[k, 2] = fx, fy, fz
            pulls[k, 3], pulls[k, 4], pulls[k, 5] = tx, ty, tz
            pulls[k, 6] = u

    return pull
