"""Recordings: what goes in comes out, films of them are those of the run, and a failed run keeps what it had."""

import numpy as np
import pytest

import fieldsim as fs


def scenario(pebbles=5, fail_at=None):
    world = fs.World()

    def motion(t):
        return (np.nan if fail_at is not None and t > fail_at else 0.1 * t, 0, 0)

    surface = fs.Material(radius=0.3)
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(0.3), surface=surface, motion=motion))
    world.add_particles(**fs.sampling.shell(pebbles, radius=(1, 2), seed=1), radius=0.1)
    camera = fs.Camera(eye=(5, 0, 1), look_at=(0, 0, 0), fov=38)
    return fs.Scenario(world, camera, duration=1.0, fps=5, integrator=fs.Leapfrog(0.01))


def test_snapshots_come_back(tmp_path):
    world = scenario().world
    simulation = fs.Simulation(world, fs.Leapfrog(0.01))
    with fs.Recording(tmp_path / "run.npz") as recording:
        made = list(simulation.snapshots([0.0, 0.5, 1.0]))
        for snapshot in made:
            recording.add(snapshot)
    again = fs.Recorded(tmp_path / "run.npz")
    assert (len(again), again.fps) == (3, 2.0)
    for one, other in zip(made, again.snapshots(world), strict=True):
        assert (one.time, one.poses) == (other.time, other.poses)
        np.testing.assert_array_equal(one.positions, other.positions)
        np.testing.assert_array_equal(one.velocities, other.velocities)
    with np.load(tmp_path / "run.npz") as arrays:
        assert arrays["positions/0/000002"].shape == (5, 3)


def test_a_film_of_a_recording_is_that_of_the_run(tmp_path):
    options = {"size": (32, 18), "quality": "draft"}
    fs.film(scenario(), tmp_path / "run.gif", record=tmp_path / "run.npz", **options)
    fs.film(scenario(), tmp_path / "again.gif", replay=tmp_path / "run.npz", **options)
    assert (tmp_path / "run.gif").read_bytes() == (tmp_path / "again.gif").read_bytes()
    first = (tmp_path / "run.npz").read_bytes()
    fs.film(scenario(), tmp_path / "run.gif", record=tmp_path / "run.npz", **options)
    assert (tmp_path / "run.npz").read_bytes() == first


def test_a_failed_run_keeps_its_snapshots(tmp_path):
    with pytest.raises(fs.FieldsimError, match="keeps the"):
        fs.film(scenario(fail_at=0.7), tmp_path / "run.gif", size=(16, 8), record=tmp_path / "run.npz")
    assert len(fs.Recorded(tmp_path / "run.npz")) == 4
    assert not list(tmp_path.glob(".*"))


def test_bad_recordings_are_refused(tmp_path):
    with pytest.raises(fs.InputError, match=r"should end in .npz"):
        fs.Recording(tmp_path / "run.txt")
    with pytest.raises(fs.InputError, match="does not exist"):
        fs.Recording(tmp_path / "nowhere" / "run.npz")
    with fs.Recording(tmp_path / "empty.npz"):
        pass
    assert not list(tmp_path.iterdir())
    (tmp_path / "text.npz").write_text("no recording")
    with pytest.raises(fs.InputError, match="cannot be read as a recording"):
        fs.Recorded(tmp_path / "text.npz")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(fs.InputError, match="is no recording"):
        fs.Recorded(tmp_path / "other.npz")
    with fs.Recording(tmp_path / "run.npz") as recording:
        recording.add(scenario().world.at(0.0))
    with pytest.raises(fs.InputError, match="is of 5 particles in set 0, the world has 6"):
        fs.Recorded(tmp_path / "run.npz").snapshot(0, scenario(pebbles=6).world)
    with pytest.raises(fs.InputError, match="is of 1 bodies, the world has 0"):
        fs.Recorded(tmp_path / "run.npz").snapshot(0, fs.World())
