"""Runs that are killed or interrupted at random moments: what there was before stays, whole."""

import os
import random
import shutil
import signal
import subprocess
import sys
import textwrap
import time

import pytest

import fieldsim as fs

RUNS = 60

# The old run is longer than the new one, which takes about two seconds.
SCRIPT = """
    import time

    import fieldsim as fs


    def build(frames: int = 40, pause: float = 0.02) -> fs.Scenario:
        def motion(t):
            time.sleep(pause)
            return (0, 0, 0.1 * t)

        world = fs.World()
        world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(radius=0.5), motion=motion))
        return fs.Scenario(world, fs.Camera((0, -5, 1)), duration=frames / 10, fps=10)
"""
COMMAND = ["run", "scene.py", "--size", "32x18", "--quality", "draft", "--out", "film.mp4", "--record", "run.npz"]
KEPT = ("film.mp4", "run.npz")


def start(folder, *options):
    """The run as a process."""
    command = [sys.executable, "-m", "fieldsim", *COMMAND, *options]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def finish(folder, *options):
    """Contents of the files that a whole run writes, and how long it took."""
    begin = time.monotonic()
    with start(folder, *options) as process:
        _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    return {name: (folder / name).read_bytes() for name in KEPT}, time.monotonic() - begin


@pytest.fixture
def matrix(tmp_path):
    """A folder, the files of an old run in it, those that a new one leaves when it ends, and how long that takes."""
    (tmp_path / "scene.py").write_text(textwrap.dedent(SCRIPT))
    old, _ = finish(tmp_path, "--frames", "90", "--pause", "0")
    new, seconds = finish(tmp_path)
    assert all(old[name] != new[name] for name in KEPT)
    shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
    return tmp_path, old, new, seconds


def end_at_random(matrix, signum):
    """End RUNS runs by a signal; yields for each its status and what it said."""
    folder, old, new, seconds = matrix
    moments = random.Random(signum)
    intact = began = 0
    for _ in range(RUNS):
        for name in KEPT:
            (folder / name).write_bytes(old[name])
        with start(folder) as process:
            time.sleep(moments.uniform(0.1, 1.1) * seconds)
            began += any(path.name.startswith(".") for path in folder.iterdir())
            process.send_signal(signum)
            _, errors = process.communicate(timeout=120)
        found = {name: (folder / name).read_bytes() for name in KEPT}
        intact += sum(found[name] in (old[name], new[name]) for name in KEPT) == len(KEPT)
        yield process.returncode, errors
    print(f"{intact} of {RUNS} intact, {began} while files were being written")
    assert intact == RUNS
    assert began > RUNS // 6, "most were ended before they began to write"


@pytest.mark.full
@pytest.mark.timeout(3600)
def test_killed_runs_leave_what_there_was_before(matrix):
    folder = matrix[0]
    for status, _ in end_at_random(matrix, signal.SIGKILL):
        assert status in (-signal.SIGKILL, 0)
    finish(folder)
    assert sorted(path.name for path in folder.iterdir()) == ["film.mp4", "run.npz", "scene.py"]


@pytest.mark.full
@pytest.mark.timeout(3600)
def test_interrupted_runs_leave_what_there_was_before_and_what_they_have(matrix):
    folder = matrix[0]
    for status, errors in end_at_random(matrix, signal.SIGINT):
        # Python itself ends by the signal while it is still importing.
        assert status in (130, -signal.SIGINT, 0), errors
        kept = [word for word in errors.replace(";", "").split() if ".partial" in word]
        left = {path.name for path in folder.iterdir()} - {"film.mp4", "run.npz", "scene.py"}
        assert left == set(kept), errors
        for name in kept:
            if name.endswith(".npz"):
                count = len(fs.Recorded(folder / name))
                assert f"{name} keeps the {count} of 40 snapshots made before" in errors
            os.remove(folder / name)
