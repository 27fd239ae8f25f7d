"""Windows of moving sources: as long as their interpolants allow, whatever the time; poses of many times."""

import itertools
import math

import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim.potentials.row import POINT, STRENGTH
from fieldsim.sources.elements import Sources
from fieldsim.sources.poses import body_poses
from fieldsim.sources.windows import Windows, interpolated


def circling(t):
    return math.cos(t), math.sin(t), 0.0


def windows(start, motion=circling):
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), motion=motion))
    return Windows(Sources(world, "gravity", start), world, start, wp.get_device("cpu"))


@pytest.mark.parametrize("start", [0.0, 1e4, 1e7])
def test_windows_stay_long_where_times_are_coarse(start):
    found = windows(start)
    lengths = []
    for _ in range(12):
        found.advance()
        lengths += np.diff(found.window.bounds.numpy()).tolist()
    # What is above the rounding of 1e7, 2e-9, takes fewer degrees, and so the windows are longer.
    assert min(lengths[10:]) > 3.0
    assert max(lengths) < 60.0


def test_interpolants_are_exact_to_rounding():
    found = windows(0.0)
    for _ in range(12):
        found.advance()
        window = found.window
        coefficients, columns = window.coefficients.numpy(), window.columns.numpy().tolist()
        assert window.numbers == 2
        numbers = [window.which.numpy()[columns.index(POINT.start + axis)] for axis in range(2)]
        for part, (start, end) in enumerate(itertools.pairwise(window.bounds.numpy())):
            for u in (-1.0, -0.3, 0.7, 1.0):
                expected = circling(0.5 * (start + end) + u * 0.5 * (end - start))
                values = [interpolated(u, coefficients, 2 * part + number) for number in numbers]
                np.testing.assert_allclose(values, expected[:2], rtol=0, atol=1e-14 + np.spacing(end))


def test_a_motion_that_ends_is_followed_to_its_last_windows():
    def ending(t):
        if t > 100.0:
            raise ValueError("no more")
        return circling(t)

    found, endless = windows(0.0, ending), windows(0.0)
    while found.end < 90.0:
        found.advance()
    with pytest.raises(fs.InputError, match="no more"):
        list(iter(found.advance, None))
    assert found.end > 90.0
    while endless.end < 100.0:
        endless.advance()
    assert endless.window.parts > 4


def test_numbers_that_stay_are_told_from_those_that_change():
    found = windows(0.0)
    assert not found.advance()
    assert found.advance()
    np.testing.assert_array_equal(np.isnan(found.rows[0, POINT]), [True, True, False])
    assert found.rows[0, STRENGTH] == 1.0


def body(motion):
    return fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), motion=motion)


TURNED = fs.Pose.turned((0, 0, 1), 0.5, (1, 2, 3))


@pytest.mark.parametrize(
    "motion",
    [
        circling,
        lambda t: [1, 2, int(t)],
        lambda t: np.array([t, 0.0, 0.0]),
        lambda t: TURNED,
        lambda t: TURNED if t > 1 else (t, 0, 0),
        fs.Spin((0, 1, 0), 2.0, center=(1, 0, 0)),
        TURNED,
    ],
)
def test_poses_of_many_times_are_those_of_each(motion):
    times = np.linspace(0.0, 2.0, 7)
    rotations, positions = body_poses(body(motion), times)
    each = [body(motion).pose_at(time) for time in times]
    np.testing.assert_allclose(rotations, [pose.matrix for pose in each], atol=1e-15)
    np.testing.assert_allclose(positions, [pose.position for pose in each], atol=1e-15)


@pytest.mark.parametrize("answer", [(1.0, math.nan, 0.0), ("1", "2", "3"), (1.0, 2.0), 3.0])
def test_what_is_no_position_is_refused_with_its_time(answer):
    with pytest.raises(fs.InputError, match=r"motion .*at time 1"):
        body_poses(body(lambda t: answer if t >= 1 else (0.0, 0.0, 0.0)), np.array([0.0, 1.0]))
