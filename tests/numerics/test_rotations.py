"""Rodrigues' formula in its three forms: against quaternions, and against each other."""

import math

import numpy as np
import pytest

from fieldsim.numerics import quaternion
from fieldsim.numerics.rotations import about_axis, rotation, turned


def axes_and_angles(count=100):
    rng = np.random.default_rng(6)
    axes = rng.normal(size=(count, 3))
    angles = np.concatenate([10 ** rng.uniform(-12, 1, count // 2), rng.uniform(-7, 7, count - count // 2)])
    return axes / np.linalg.norm(axes, axis=1)[:, None], angles


@pytest.mark.parametrize("of", [rotation, rotation.numba], ids=["python", "numba"])
def test_rotation(of):
    for axis, angle in zip(*axes_and_angles(), strict=True):
        exact = quaternion.matrices(quaternion.exponential(angle * axis))
        np.testing.assert_allclose(np.reshape(of(*axis, angle), (3, 3)), exact, rtol=0, atol=2e-15)


def test_matrices_about_one_axis():
    (axis, *_), angles = axes_and_angles()
    exact = [quaternion.matrices(quaternion.exponential(angle * axis)) for angle in angles]
    np.testing.assert_allclose(about_axis(axis, angles), exact, rtol=0, atol=2e-15)


def test_turned_vectors():
    axes, angles = axes_and_angles()
    vectors = np.random.default_rng(7).normal(size=(100, 3)) * 10.0 ** np.arange(-50, 50)[:, None]
    exact = [about_axis(axis, [angle])[0] @ v for axis, angle, v in zip(axes, angles, vectors, strict=True)]
    error = np.linalg.norm(turned(vectors, axes, angles) - exact, axis=1)
    assert (error <= 2e-15 * np.linalg.norm(vectors, axis=1)).all()


def test_right_handed():
    np.testing.assert_allclose(about_axis((0, 0, 1), [math.pi / 2])[0] @ [1, 0, 0], [0, 1, 0], atol=1e-15)
