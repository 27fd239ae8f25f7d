"""Runs that are killed or interrupted at random moments: what there was before stays, whole."""

import os
import random
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


def hidden(folder):
    return {path.name for path in folder.iterdir() if path.name.startswith(".")}


def wait_until_it_writes(folder, process, before):
    """Wait for hidden files beyond those that were there before."""
    while process.poll() is None and hidden(folder) <= before:
        time.sleep(0.005)


def finish(folder, *options):
    """Contents of the files that a whole run writes; how long it took before it began to write, and from then on."""
    begin = time.monotonic()
    with start(folder, *options) as process:
        wait_until_it_writes(folder, process, set())
        began = time.monotonic()
        _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    files = {name: (folder / name).read_bytes() for name in KEPT}
    return files, began - begin, time.monotonic() - began


@pytest.fixture
def matrix(tmp_path):
    """A folder, the files of an old run in it, those that a new one leaves when it ends, and what `finish` measures."""
    (tmp_path / "scene.py").write_text(textwrap.dedent(SCRIPT))
    old, *_ = finish(tmp_path, "--frames", "90", "--pause", "0")
    new, before, writing = finish(tmp_path)
    assert all(old[name] != new[name] for name in KEPT)
    return tmp_path, old, new, before, writing


def end_at_random(matrix, signum):
    """End RUNS runs by a signal, a quarter of them before they write; yields for each its status and what it said."""
    folder, old, new, before, writing = matrix
    moments = random.Random(int(signum))
    intact = amid = 0
    for k in range(RUNS):
        for name in KEPT:
            (folder / name).write_bytes(old[name])
        left = hidden(folder)
        with start(folder) as process:
            if k % 4:
                wait_until_it_writes(folder, process, left)
                time.sleep(moments.uniform(0.0, 1.1) * writing)
            else:
                time.sleep(moments.uniform(0.0, 1.0) * before)
            amid += not hidden(folder) <= left
            process.send_signal(signum)
            _, errors = process.communicate(timeout=120)
        found = {name: (folder / name).read_bytes() for name in KEPT}
        intact += all(found[name] in (old[name], new[name]) for name in KEPT)
        yield process.returncode, errors
    print(f"{intact} of {RUNS} intact, {amid} of them ended while files were being written")
    assert intact == RUNS
    assert amid > RUNS // 4, "most were not ended while they wrote"


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
