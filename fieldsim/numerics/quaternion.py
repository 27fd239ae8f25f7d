"""Unit quaternions (w, x, y, z) as arrays (..., 4)."""

import math

import numpy as np


def product(p, q) -> np.ndarray:
    """Products (..., 4): the turn q, then the turn p."""
    p, q = np.asarray(p), np.asarray(q)
    scalar = p[..., :1] * q[..., :1] - np.sum(p[..., 1:] * q[..., 1:], axis=-1, keepdims=True)
    vector = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def matrices(q) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(np.asarray(q), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def of_matrix(m) -> np.ndarray:
    """The quaternion (4,) of a rotation matrix: the eigenvector of Bar-Itzhack 2000, exact to rounding for any turn."""
    skew = (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1])
    k = np.zeros((4, 4))
    k[0, 0] = np.trace(m)
    k[0, 1:] = k[1:, 0] = skew
    k[1:, 1:] = m + m.T - np.trace(m) * np.eye(3)
    return np.linalg.eigh(k)[1][:, -1]


def inverse(q) -> np.ndarray:
    """The turn back, (4,)."""
    return np.array([q[0], -q[1], -q[2], -q[3]])


def exponential(vector) -> np.ndarray:
    """The turn (4,) by |vector| radians about `vector` (3,)."""
    half = 0.5 * np.asarray(vector, dtype=float)
    angle = math.sqrt(half @ half)
    return np.array([math.cos(angle), *(np.sinc(angle / math.pi) * half)])


def logarithm(q) -> np.ndarray:
    """The rotation vector (3,), axis times angle, of a turn (4,), the shorter way round: at most pi long."""
    vector = np.asarray(q[1:])
    size = math.sqrt(vector @ vector)
    if size == 0.0:
        return np.zeros(3)
    return 2.0 * math.atan2(math.copysign(size, q[0]), abs(q[0])) / size * vector
