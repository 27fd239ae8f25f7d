"""Poses of bodies at many times at once."""

import numpy as np

from fieldsim import validate
from fieldsim.numerics import quaternion
from fieldsim.numerics.rotations import about_axis
from fieldsim.world.motion import IDENTITY, Pose, Spin


def body_poses(body, times) -> tuple[np.ndarray, np.ndarray]:
    """Rotation matrices (stages, 3, 3) and positions (stages, 3) of a body at `times`; of a free one, of its start."""
    motion = body.motion
    if motion == IDENTITY:
        return np.broadcast_to(np.eye(3), (len(times), 3, 3)), np.zeros((len(times), 3))
    if isinstance(motion, Spin):
        return spin_poses(motion, times)
    if not callable(motion):
        pose = body.pose_at(times[0])
        return np.broadcast_to(pose.matrix, (len(times), 3, 3)), np.broadcast_to(pose.position, (len(times), 3))
    answers = [validate.answer(body.label, "motion", motion, time) for time in np.asarray(times).tolist()]
    positions = _positions(answers)
    if positions is not None:
        return np.broadcast_to(np.eye(3), (len(times), 3, 3)), positions
    # Others are looked at one by one, by what has words for what is wrong.
    poses = answers if all(isinstance(one, Pose) for one in answers) else [body.pose_at(time) for time in times]
    rotations = quaternion.matrices(np.array([pose.rotation for pose in poses]))
    return rotations, np.array([pose.position for pose in poses])


def _positions(answers):
    """What a motion answers as (N, 3) where that is positions, finite and not too far, else None.

    All are checked at once, as each alone would cost more than most motions.
    """
    if any(isinstance(answer, Pose) for answer in answers):
        return None
    try:
        positions = np.array(answers)
    except ValueError:  # of different shapes
        return None
    is_good = positions.dtype.kind in "if" and positions.shape == (len(answers), 3)
    return positions.astype(float) if is_good and (np.abs(positions) <= validate.FARTHEST).all() else None


def spin_poses(spin: Spin, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All times at once: spins are common, and pose by pose would cost more than the forces."""
    turns = about_axis(spin.axis, spin.phase + spin.rate * times)
    center = np.asarray(spin.center)
    return turns, center - turns @ center
