"""Poses of bodies at many times at once."""

import numpy as np

from fieldsim.numerics import quaternion
from fieldsim.numerics.rotations import about_axis
from fieldsim.world.motion import IDENTITY, Spin


def body_poses(body, times) -> tuple[np.ndarray, np.ndarray]:
    """Rotation matrices (stages, 3, 3) and positions (stages, 3) of a body at `times`; of a free one, of its start."""
    motion = body.motion
    if motion == IDENTITY:
        return np.broadcast_to(np.eye(3), (len(times), 3, 3)), np.zeros((len(times), 3))
    if isinstance(motion, Spin):
        return spin_poses(motion, times)
    poses = [body.pose_at(time) for time in times]
    rotations = quaternion.matrices(np.array([pose.rotation for pose in poses]))
    return rotations, np.array([pose.position for pose in poses])


def spin_poses(spin: Spin, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All times at once: spins are common, and pose by pose would cost more than the forces."""
    turns = about_axis(spin.axis, spin.phase + spin.rate * times)
    center = np.asarray(spin.center)
    return turns, center - turns @ center
