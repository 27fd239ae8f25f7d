"""Rows of bodies whose strengths alone change: as those packed anew at every time."""

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.potentials.row import POINT, STRENGTH
from fieldsim.sources.elements import Sources, elements_of

TIMES = np.array([0.0, 0.3, 1.7])


@pytest.mark.parametrize(
    "skeleton",
    [
        fs.Point((1, 0, 0)),
        (fs.Circle((0, 0, 0), (0, 0, 1), 1.0), fs.Segment((-1, 0, 0), (1, 0, 0)), fs.Circle((0, 1, 0), (1, 0, 0), 0.5)),
    ],
    ids=["point", "grouped by formula"],
)
@pytest.mark.parametrize("mass", [lambda t: 1.0 + 0.5 * np.sin(t), lambda t: t - 0.3], ids=["swings", "vanishes"])
def test_only_strengths_differ(skeleton, mass):
    world = fs.World()
    world.add_body(fs.Body(skeleton, gravity=fs.Newtonian(), mass=mass, motion=fs.Pose((0, 0, 2))))
    rows = Sources(world, "gravity", 0.0).rows_at(TIMES)
    for time, found in zip(TIMES, rows, strict=True):
        (body,) = world.bodies
        packed = elements_of(body, "gravity", time).placed(np.eye(3), (0, 0, 2))
        np.testing.assert_array_equal(found, packed.rows)


def test_a_skeleton_that_changes_is_packed_anew():
    world = fs.World()
    world.add_body(fs.Body(fs.Point(lambda t: (t, 0, 0)), gravity=fs.Newtonian(), mass=lambda t: 1.0 + t))
    rows = Sources(world, "gravity", 0.0).rows_at(TIMES)
    np.testing.assert_allclose(rows[:, 0, POINT.start], TIMES)
    np.testing.assert_allclose(rows[:, 0, STRENGTH], 1.0 + TIMES)


def test_a_mass_that_is_no_number_names_its_time():
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), mass=lambda t: np.nan if t > 1.0 else 1.0))
    with pytest.raises(fs.InputError, match=r"Body 0, between times 0 and 1\.7: .*mass"):
        Sources(world, "gravity", 0.0).rows_at(TIMES)
