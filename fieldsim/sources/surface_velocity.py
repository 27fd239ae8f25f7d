"""Surface velocity: how the material of a surface moves.

The material of a body moves with the body's pose; where several bodies make the surface, it moves as their mean,
weighted by their fields, as their colours are mixed. (A body that grows or bends also carries its surface along the
normal; that part follows from the field.) Between two stages a pose changes by a screw motion, whose
*twist* (turn, shift) gives the displacement velocity turn x p + shift per step at every point p.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.potentials import registry
from fieldsim.sources.elements import Sources
from fieldsim.sources.field import field_at
from fieldsim.sources.rows import shift_of, turn_of
from fieldsim.sources.stages import Stages
from fieldsim.world.motion import Keyframes, Motion, Spin, pose_at

# Half the time over which the twist of a motion is measured that is any function of time.
STEP = 1e-5


def twists(rotations, positions):
    """Twists (stages, elements, 6), turn and shift, from one stage to the next; 0 for the last.

    rotations (stages, elements, 3, 3), positions (stages, elements, 3): the poses of the elements' bodies.
    """
    relative = rotations[1:] @ np.swapaxes(rotations[:-1], -1, -2)
    moved = positions[1:] - np.einsum("...ij,...j->...i", relative, positions[:-1])
    # sin(angle) times the axis is the antisymmetric part.
    axis = 0.5 * np.stack([relative[..., k - 1, k - 2] - relative[..., k - 2, k - 1] for k in range(3)], axis=-1)
    sine, cosine = np.linalg.norm(axis, axis=-1), 0.5 * (np.trace(relative, axis1=-2, axis2=-1) - 1.0)
    angle = np.arctan2(sine, cosine)
    turn = axis * np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 1.0)[..., None]
    # The shift whose screw motion ends at `moved`: the inverse of the left Jacobian of the rotation.
    small = angle < 1e-2
    safe = np.where(small, 1.0, angle)
    bend = np.where(small, 1.0 / 12.0 + angle**2 / 720.0, (1.0 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2)
    across = np.cross(turn, moved)
    shift = moved - 0.5 * across + bend[..., None] * np.cross(turn, across)
    steps = np.concatenate([turn, shift], axis=-1)
    return np.concatenate([steps, np.zeros_like(steps, shape=(1, *steps.shape[1:]))])


def twist_rate(motion: Motion, time: float) -> np.ndarray:
    """Twist per unit of time (6,) of what moves so: angular velocity, and velocity of what is at the world's origin.

    Exact for a Pose, a Spin and Keyframes; of other functions of time the screw from shortly before to shortly after,
    which errs by the third derivative times STEP^2 / 6, and by roundings of what the function gives over STEP.
    """
    if isinstance(motion, Spin):
        turn = motion.rate * np.array(motion.axis)
        return np.concatenate([turn, -np.cross(turn, motion.center)])
    if isinstance(motion, Keyframes):
        velocity, turn = motion.rates(time)
        return np.concatenate([turn, velocity - np.cross(turn, pose_at(motion, time).position)])
    if not callable(motion):
        return np.zeros(6)
    # Rounded times are not 2 STEP apart.
    before, after = time - STEP, time + STEP
    poses = [pose_at(motion, before), pose_at(motion, after)]
    rotations, positions = (np.array([getattr(pose, name) for pose in poses]) for name in ("matrix", "position"))
    return twists(rotations[:, None], positions[:, None])[0, 0] / (after - before)


def twist_rates(sources: Sources, times) -> np.ndarray:
    """Twists per unit of time (stages, elements, 6) of the bodies that changing elements belong to, none free."""
    rates = [np.zeros((len(times), 0, 6))]
    for body, count in sources.changing:
        own = np.array([twist_rate(body.motion, time) for time in times])
        rates.append(np.repeat(own[:, None], count, axis=1))
    return np.concatenate(rates, axis=1)


@wp.func
def screw(p: wp.vec3d, turn: wp.vec3d, shift: wp.vec3d):
    """The point p after the screw motion of a twist: the exponential series, summed."""
    w = wp.cross(turn, p) + shift
    angle2 = wp.dot(turn, turn)
    b = wp.float64(0.5) - angle2 / wp.float64(24.0)
    c = (wp.float64(1.0) - angle2 / wp.float64(20.0)) / wp.float64(6.0)
    if angle2 > wp.float64(1e-6):
        angle = wp.sqrt(angle2)
        half = wp.sin(wp.float64(0.5) * angle)
        b = wp.float64(2.0) * half * half / angle2
        c = (angle - wp.sin(angle)) / (angle2 * angle)
    across = wp.cross(turn, w)
    return p + w + b * across + c * wp.cross(turn, across)


@functools.cache
def twist_at(kinds_used):
    """Warp function (point, surfaces, stage) -> (turn, shift) of the material there, from `stage` to the next."""
    fixed_kinds, moving_kinds = kinds_used
    one = registry.element_field(moving_kinds).warp(wp.float64)
    rest = field_at((fixed_kinds, ()))

    @wp.func
    def still(p: wp.vec3d, surfaces: Stages, stage: int):
        return wp.vec3d(), wp.vec3d()

    @wp.func
    def changing(p: wp.vec3d, surfaces: Stages, stage: int):
        first = stage * surfaces.moving
        rows = surfaces.moving_rows
        if surfaces.moving == 1 and surfaces.kinds.shape[0] == 0:  # a world of one element needs no weights
            return turn_of(rows, first), shift_of(rows, first)
        total, _g = rest(p, surfaces, stage)
        total = wp.max(total, wp.float64(1e-300))
        turn = wp.vec3d()
        shift = wp.vec3d()
        for i in range(first, first + surfaces.moving):
            f, _x, _y, _z = one(p[0], p[1], p[2], surfaces.moving_rows, surfaces.moving_kinds, i)
            turn += f * turn_of(rows, i)
            shift += f * shift_of(rows, i)
            total += f
        return turn / total, shift / total

    return changing if moving_kinds else still
