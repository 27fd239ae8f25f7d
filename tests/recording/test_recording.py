"""Recordings: what goes in comes out, films of them are those of the run, and a failed run keeps what it had."""

import signal
import threading
import zipfile

import numpy as np
import pytest

import fieldsim as fs
from fieldsim import scenario as scenarios


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
    with pytest.raises(
        fs.FieldsimError, match=r"run\.npz keeps the 4 of 5 snapshots .*run\.gif keeps the 4 of 5 frames"
    ):
        fs.film(scenario(fail_at=0.7), tmp_path / "run.gif", size=(16, 8), record=tmp_path / "run.npz")
    assert len(fs.Recorded(tmp_path / "run.npz")) == 4
    assert not list(tmp_path.glob(".*"))


def test_a_failed_run_replaces_nothing(tmp_path):
    options = {"size": (16, 8), "quality": "draft", "record": tmp_path / "run.npz"}
    fs.film(scenario(), tmp_path / "run.gif", **options)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(fs.FieldsimError, match=r"run\.partial\.npz keeps the 4 .*run\.partial\.gif keeps the 4"):
        fs.film(scenario(fail_at=0.7), tmp_path / "run.gif", **options)
    assert {path: path.read_bytes() for path in before} == before
    assert len(fs.Recorded(tmp_path / "run.partial.npz")) == 4
    assert len(list(tmp_path.iterdir())) == 4


def record(path, snapshots, error=None):
    with fs.Recording(path) as recording:
        for snapshot in snapshots:
            recording.add(snapshot)
        if error:
            raise error


@pytest.mark.parametrize("at", range(5))
def test_a_snapshot_that_is_interrupted_is_left_out(tmp_path, monkeypatch, at):
    world = scenario().world
    made = [world.at(t) for t in (0.0, 0.1, 0.2)]
    write, left = np.lib.format.write_array, [4 * 2 + at]

    def interrupted(target, array, **options):
        left[0] -= 1
        if left[0] < 0:
            target.write(b"torn")
            raise KeyboardInterrupt
        write(target, array, **options)

    monkeypatch.setattr(np.lib.format, "write_array", interrupted)
    with pytest.raises(KeyboardInterrupt) as raised:
        record(tmp_path / "run.npz", made, KeyboardInterrupt())
    count = 3 if at == 4 else 2
    assert raised.value.__notes__ == [f"{tmp_path / 'run.npz'} keeps the {count} snapshots made before"]
    with np.load(tmp_path / "run.npz") as arrays:
        assert len(arrays.files) == 4 * count
        assert all(len(np.atleast_1d(arrays[name])) for name in arrays.files)


def test_an_interrupt_at_the_very_end_comes_after_it(tmp_path, monkeypatch):
    recording = fs.Recording(tmp_path / "run.npz")
    close = zipfile.ZipFile.close
    with pytest.raises(KeyboardInterrupt), monkeypatch.context() as patch, recording:  # noqa: PT012
        recording.add(scenario().world.at(0.0))
        patch.setattr(zipfile.ZipFile, "close", lambda file: (signal.raise_signal(signal.SIGINT), close(file)))
    assert len(fs.Recorded(tmp_path / "run.npz")) == 1


def test_a_full_disk_is_told_of(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np.lib.format, "write_array", full)
    with pytest.raises(fs.FieldsimError, match=r"run\.npz: writing failed: No space left on device"):
        record(tmp_path / "run.npz", [scenario().world.at(0.0)])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("begun", [True, False])
def test_a_full_disk_leaves_nothing_and_says_so(tmp_path, begun):
    """Within the snapshots, and where only the directory of the file does not fit."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    recording = fs.Recording(tmp_path / "run.npz", {"a": "b"})
    limit, count = (60_000, 1000) if begun else (200, 1)
    try:
        with pytest.raises(fs.FilmError, match=r"run\.npz: writing failed.*nothing .*is kept"), recording:  # noqa: PT012
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
            for _ in range(count):
                recording.add(scenario().world.at(0.0))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(tmp_path.iterdir())


def test_a_recording_is_entered_once_at_a_time_and_added_to_within(tmp_path):
    recording = fs.Recording(tmp_path / "run.npz")
    with pytest.raises(fs.FieldsimError, match="the recording is not open"):
        recording.add(scenario().world.at(0.0))
    with recording, pytest.raises(fs.FieldsimError, match="the recording is open already"):
        recording.__enter__()
    assert not list(tmp_path.iterdir())


def test_a_recording_tells_of_its_run_and_a_replay_of_what_differs(tmp_path):
    def build(restitution: float = 0.5, seed: int = 1, duration: float = 1.0):
        return scenario()

    options = {"size": (16, 8), "quality": "draft"}
    first = scenarios.call(build, {"restitution": 0.7})
    fs.film(first, tmp_path / "run.gif", record=tmp_path / "run.npz", **options)
    about = fs.Recorded(tmp_path / "run.npz").about
    assert about["scenario"] == "test_recording"
    assert about["parameters"] == {"restitution": 0.7, "seed": 1, "duration": 1.0}
    assert (about["integrator"], about["fps"]) == ("Leapfrog(dt=0.01)", 5.0)
    assert about["fieldsim"].startswith("0.")
    options["replay"] = tmp_path / "run.npz"
    fs.film(first, tmp_path / "run.gif", integrator=fs.Leapfrog(0.01), **options)
    other = scenarios.call(build, {"seed": 3, "duration": 2.0})
    with pytest.warns(fs.FieldsimWarning) as told:
        fs.film(other, tmp_path / "run.gif", integrator=fs.Radau(), duration=4.0, **options)
    (words,) = (str(one.message) for one in told)
    assert "parameter restitution was 0.7, here it is 0.5; parameter seed was 1, here it is 3" in words
    assert "integrator Radau(tolerance=1e-09) has no effect; it ends at time 0.8, before duration 4" in words
    assert "parameter duration" not in words
    object.__setattr__(other, "name", "other")
    assert "scenario test_recording, here it is other" in fs.Recorded(tmp_path / "run.npz").differences(other)[0]


def test_a_replay_goes_as_far_as_the_recording(tmp_path):
    options = {"size": (16, 8), "quality": "draft"}
    fs.film(scenario(), tmp_path / "run.gif", duration=2.0, record=tmp_path / "run.npz", **options)
    for duration, count in ((None, 10), (0.5, 3)):
        report = fs.film(scenario(), tmp_path / "a.gif", replay=tmp_path / "run.npz", duration=duration, **options)
        assert report.frames == count


def test_a_replay_that_ends_before_it_begins(tmp_path):
    record(tmp_path / "run.npz", [scenario().world.at(0.1), scenario().world.at(0.2)])
    with pytest.raises(fs.InputError, match=r"duration is 0\.05, the recording begins at time 0\.1"):
        fs.film(scenario(), tmp_path / "a.gif", replay=tmp_path / "run.npz", duration=0.05)


def test_what_could_not_be_read_is_not_written(tmp_path):
    longest = {"a": "x" * ((1 << 20) - 9)}
    with fs.Recording(tmp_path / "run.npz", longest) as recording:
        recording.add(scenario().world.at(0.0))
    assert fs.Recorded(tmp_path / "run.npz").about == longest
    with pytest.raises(fs.InputError, match="about takes 1048577 bytes"):
        fs.Recording(tmp_path / "run.npz", {"a": longest["a"] + "x"})


def test_threads_may_add_to_one_recording(tmp_path):
    snapshot = scenario().world.at(0.0)
    with fs.Recording(tmp_path / "run.npz") as recording:
        threads = [threading.Thread(target=lambda: [recording.add(snapshot) for _ in range(20)]) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len(fs.Recorded(tmp_path / "run.npz")) == 80


def test_a_still_is_recorded_with_all_before_it(tmp_path):
    fs.film(scenario(), tmp_path / "run.png", size=(16, 8), quality="draft", record=tmp_path / "run.npz")
    assert len(fs.Recorded(tmp_path / "run.npz")) == 5
    fs.film(scenario(), tmp_path / "last.png", size=(16, 8), quality="draft")
    assert (tmp_path / "run.png").read_bytes() == (tmp_path / "last.png").read_bytes()


def test_replaying_and_recording_one_file_is_refused(tmp_path):
    fs.film(scenario(), tmp_path / "run.gif", size=(16, 8), quality="draft", record=tmp_path / "run.npz")
    before = (tmp_path / "run.npz").read_bytes()
    (tmp_path / "link.npz").symlink_to(tmp_path / "run.npz")
    for other in ("run.npz", "link.npz"):
        with pytest.raises(fs.InputError, match="record and replay are one file"):
            fs.film(scenario(), tmp_path / "a.png", record=tmp_path / other, replay=tmp_path / "run.npz")
    assert (tmp_path / "run.npz").read_bytes() == before


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
