"""Rotations as unit quaternions (w, x, y, z), arrays of shape (4,), and as rotation vectors (3,): axis times angle."""

import math

import numpy as np


def multiply(p, q) -> np.ndarray:
    """The rotation q followed by p."""
    pw, pv, qw, qv = p[0], np.asarray(p[1:]), q[0], np.asarray(q[1:])
    return np.array([pw * qw - pv @ qv, *(pw * qv + qw * pv + np.cross(pv, qv))])


def inverse(q) -> np.ndarray:
    """The rotation back."""
    return np.array([q[0], -q[1], -q[2], -q[3]])


def exponential(vector) -> np.ndarray:
    """The rotation by |vector| radians about `vector`."""
    half = 0.5 * np.asarray(vector, dtype=float)
    angle = math.sqrt(half @ half)
    return np.array([math.cos(angle), *(np.sinc(angle / math.pi) * half)])


def logarithm(q) -> np.ndarray:
    """The rotation vector of q, the shorter way round: at most pi long."""
    vector = np.asarray(q[1:])
    size = math.sqrt(vector @ vector)
    if size == 0.0:
        return np.zeros(3)
    return 2.0 * math.atan2(math.copysign(size, q[0]), abs(q[0])) / size * vector
