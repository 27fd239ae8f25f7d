"""Runs that are ended: what they keep, and what they say."""

import os
import re
import signal
import textwrap
import time

import imageio.v3 as imageio
import pytest
from commands import fieldsim, films, start

import fieldsim as fs
from fieldsim.cli import film

# Goes on for hours; the file `going` says that there are some frames.
SLOW = """
    import pathlib
    import time

    import fieldsim as fs


    def climb(t):
        if t > 0.5:
            pathlib.Path("going").touch()
        time.sleep(0.01)
        return (0, 0, 0.1 * t)


    def build():
        world = fs.World()
        world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(radius=0.5), motion=climb))
        return fs.Scenario(world, fs.Camera((0, -5, 1)), duration=1e5, fps=10)
"""


def ended_by(signum, *arguments):
    """(status, what was said) of the command, ended by a signal once it has some frames."""
    with start(*arguments) as process:
        deadline = time.monotonic() + 300
        while not os.path.exists("going") and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.05)
        process.send_signal(signum)
        _, errors = process.communicate(timeout=120)
    os.remove("going")
    return process.returncode, errors


@pytest.mark.parametrize(
    ("signum", "status"),
    [(signal.SIGINT, 130), (signal.SIGTERM, 143), pytest.param(getattr(signal, "SIGHUP", None), 129)],
)
def test_an_interrupted_run_keeps_what_it_has_beside_what_there_was(here, signum, status):
    (here / "scenarios" / "slow.py").write_text(textwrap.dedent(SLOW))
    for name in ("p.gif", "p.npz"):
        (here / name).write_bytes(b"the old one")
    arguments = ("run", "slow", "--size", "32x18", "--quality", "draft", "--out", "p.gif", "--record", "p.npz")
    code, errors = ended_by(signum, *arguments)
    assert code == status
    found = re.fullmatch(
        r"fieldsim: interrupted; p\.partial\.npz keeps the (\d+) of 1000000 snapshots made before; "
        r"p\.partial\.gif keeps the (\d+) of 1000000 frames made before",
        errors.strip().splitlines()[-1],
    )
    assert "Traceback" not in errors
    assert films(here) == ["p.gif", "p.npz", "p.partial.gif", "p.partial.npz"]
    assert [(here / name).read_bytes() for name in ("p.gif", "p.npz")] == [b"the old one"] * 2
    assert len(fs.Recorded("p.partial.npz")) == int(found[1]) >= 5
    assert len(imageio.imread("p.partial.gif")) == int(found[2]) >= 5


def test_an_interrupt_after_the_film_tells_what_is_whole(here, monkeypatch, capsys):
    monkeypatch.setattr(film, "_draw_energy", lambda *_: signal.raise_signal(signal.SIGINT))
    options = ("--size", "32x18", "--out", "p.png", "--record", "p.npz", "--energy-plot", "e.png")
    assert fieldsim("run", "planet", *options) == 130
    assert capsys.readouterr().err.strip() == "fieldsim: interrupted; p.npz is whole; p.png is whole"


def test_an_interrupted_run_keeps_what_it_has_under_its_own_name(here):
    (here / "scenarios" / "slow.py").write_text(textwrap.dedent(SLOW))
    code, errors = ended_by(signal.SIGINT, "run", "slow", "--size", "32x18", "--out", "f/", "--quality", "draft")
    assert code == 130
    assert re.search(r"interrupted; f keeps the \d+ of 1000000 frames made before\n", errors)
    assert films(here) == ["f"]
    assert (here / "f" / "frame_0004.png").exists()


def test_a_motion_that_ends_the_script_is_status_1_and_named(here, capsys):
    script = textwrap.dedent(SLOW).replace("time.sleep(0.01)", "raise SystemExit(0) if t > 0.25 else None")
    (here / "scenarios" / "bad.py").write_text(script.replace("raise SystemExit(0) if", "_ = exit(0) if"))
    assert fieldsim("run", "bad", "--size", "8x8", "--out", "p.gif") == 1
    told = capsys.readouterr().err
    assert "bad.py" in told
    assert "p.gif keeps the 3 of 1000000 frames made before" in told
