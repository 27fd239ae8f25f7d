"""Rotations about an axis by an angle (Rodrigues 1840), right-handed. Axes are unit vectors, angles in radians.

Turns composed and interpolated are unit quaternions: see `quaternion`.
"""

import math

import numpy as np

from fieldsim.portable import portable, real


@portable
def rotation(x: real, y: real, z: real, angle: real):
    """The nine entries, by rows, of the matrix that turns by `angle` about (x, y, z). Error 2e-15."""
    s = math.sin(angle)
    c = math.cos(angle)
    # 1 - cos, without cancellation.
    half = math.sin(real(0.5) * angle)
    v = real(2.0) * (half * half)
    return (
        c + v * x * x,
        v * x * y - s * z,
        v * x * z + s * y,
        v * x * y + s * z,
        c + v * y * y,
        v * y * z - s * x,
        v * x * z - s * y,
        v * y * z + s * x,
        c + v * z * z,
    )


def about_axis(axis, angles) -> np.ndarray:
    """Matrices (N, 3, 3) of the turns by `angles` (N,) about one axis (3,). Error 2e-15."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angles = np.asarray(angles)[:, None, None]
    return np.eye(3) + np.sin(angles) * cross + (1.0 - np.cos(angles)) * (cross @ cross)


def turned(vectors, axes, angles) -> np.ndarray:
    """Vectors (N, 3), each turned by its own angle (N,) about its own axis (N, 3). Error 2e-15 of their lengths."""
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    along = np.einsum("ij,ij->i", axes, vectors)[:, None] * axes
    return cos * vectors + sin * np.cross(axes, vectors) + (1.0 - cos) * along
