"""Cameras: what they look at, how they move, what they refuse."""

import math

import numpy as np
import pytest

from fieldsim.errors import InputError
from fieldsim.render.camera import Camera
from fieldsim.world.motion import Keyframes


def test_axes_are_a_right_handed_frame_with_up_upwards():
    right, up, forward = Camera((3, -2, 1), (0.5, 0, 0), up=(0, 0.2, 2)).axes()
    np.testing.assert_allclose([right @ up, up @ forward, forward @ right], 0, atol=1e-15)
    np.testing.assert_allclose(np.cross(right, up), -forward, atol=1e-15)
    np.testing.assert_allclose(forward, np.array([-2.5, 2, -1]) / np.sqrt(11.25), atol=1e-15)
    assert up[2] > 0
    assert right @ np.array([0, 0.2, 2]) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 1, 0), (1, 0, 0)])
def test_looking_along_up_still_gives_a_frame(up):
    axes = np.array(Camera(tuple(3 * np.array(up)), up=up).axes())
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)


def test_every_field_may_move():
    camera = Camera(
        eye=Keyframes([0, 1], [(1, 0, 0), (3, 0, 0)], interpolation="linear"),
        look_at=lambda t: (0, t, 0),
        up=lambda t: (0, math.sin(t), math.cos(t)),
        fov=lambda t: 30 + t,
    )
    assert camera.animated
    still = camera.at(0.5)
    assert still.eye == (2, 0, 0)
    assert still.look_at == (0, 0.5, 0)
    assert still.fov == 30.5
    assert not still.animated
    assert still.at(7.0) is still


def test_an_orbit_closes_and_keeps_its_distance():
    camera = Camera.orbit((1, 2, 3), radius=4, height=0.5, period=8, phase=0.3, fov=25)
    for t in (0.0, 1.7, 8.0):
        offset = np.array(camera.at(t).eye) - (1, 2, 3)
        assert math.hypot(*offset[:2]) == pytest.approx(4)
        assert offset[2] == pytest.approx(0.5)
        assert math.atan2(offset[1], offset[0]) == pytest.approx((0.3 + 2 * math.pi * t / 8) % (2 * math.pi))
    assert camera.at(0.0).fov == 25


def test_an_orbit_may_follow_a_moving_target():
    camera = Camera.orbit(lambda t: (t, 0, 0), radius=lambda t: 2 + t, period=4)
    np.testing.assert_allclose(camera.at(2.0).eye, (2 - 4, 0, 2), atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"eye": (1, 1, 1), "look_at": (1, 1, 1)}, "eye and look_at"),
        ({"eye": (1, 0)}, "eye"),
        ({"eye": (math.nan, 0, 0)}, "finite"),
        ({"eye": (1, 0, 0), "fov": 0}, "fov"),
        ({"eye": (1, 0, 0), "fov": 180}, "below 180"),
        ({"eye": (1, 0, 0), "up": (0, 0, 0)}, "up"),
    ],
)
def test_what_cannot_be_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        Camera(**options)
    with pytest.raises(InputError, match=message):
        Camera(**{**options, "eye": lambda t: options["eye"]}).at(0.0)


def test_an_orbit_without_a_period_is_refused():
    with pytest.raises(InputError, match="period"):
        Camera.orbit(period=0)
