"""What goes wrong on the command line: the exit status, the words, and that nothing is left on the disk."""

import os
import subprocess
import sys
import textwrap

import pytest
import warp as wp
from commands import PLANET, fieldsim, films, start


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plant"], "did you mean planet?"),
        (["nowhere/planet.py"], "no scenario 'nowhere/planet.py'"),
        (["planet", "--pebles", "3"], "No such option '--pebles'"),
        (["planet", "--pebbles", "many"], "'many' is not a valid integer"),
        (["planet", "--size", "0x0"], "size is 0x0"),
        (["planet", "--size", "-4x4"], "size is -4x4"),
        (["planet", "--size", "big"], "'big' is no size; write it like 640x360"),
        (["planet", "--duration", "-1"], "-1 is not a positive number"),
        (["planet", "--duration", "nan"], "nan is not a positive number"),
        (["planet", "--fps", "0"], "0 is not a positive number"),
        (["planet", "--fps", "x"], "'x' is no number"),
        (["planet", "--device", "tpu"], "'tpu' is no device"),
        (["planet", "--quality", "best"], "'best' is not one of"),
        (["planet", "--integrator", "euler"], "'euler' is no integrator; give one of Auto, BlanesMoan4, "),
        (["planet", "--integrator", "leapfrog:0"], "Leapfrog: dt is 0; give a number above 0"),
        (["planet", "--integrator", "auto:x"], "Auto: tolerance is 'x'; give a number"),
        (["planet", "--energy-plot", "e.txt"], "a picture ends in .png, .svg or .pdf"),
        (["planet", "--energy-plot", "nowhere/e.png"], "the folder 'nowhere' does not exist"),
        (["planet", "--out", "nowhere/a.mp4"], "the folder 'nowhere' does not exist; create it first"),
        (["planet", "--record", "nowhere/a.npz"], "the folder 'nowhere' does not exist; create it first"),
        (["planet", "--record", "a.mp4"], "should end in .npz"),
        (["planet", "--out", "a.avi"], "this ending is not known; give name.mp4"),
        (["planet", "more"], "unexpected extra argument"),
    ],
)
def test_wrong_usage_is_status_2(here, capsys, arguments, words):
    assert fieldsim("run", *arguments) == 2
    told = capsys.readouterr()
    assert words in told.err
    assert told.err.startswith("fieldsim: ")
    assert told.out == ""
    assert len(told.err.splitlines()) <= 2
    assert films(here) == []


def test_no_command_shows_the_help(capsys):
    assert fieldsim() == 2
    assert "Examples:" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("x = 1", "bad.py defines no function build"),
        ("def build(", "bad.py:1: syntax error"),
        ("def build(): return 1 / 0", "bad.py:1 in build: ZeroDivisionError"),
        ("def build(): return None", "build returned None"),
        ("import fieldsim as fs\ndef build(): fs.Segment((0, 0, 0), (0, 0, 0))", "bad.py:2 in build: Segment: "),
        ("import fieldsim as fs\ndef build(): fs.Circle((0, 0, 0), (0, 0, 1), 0)", "radius is 0"),
        (
            "import fieldsim as fs\ndef build(): fs.World().add_particles([(0, 0)], [(0, 0)])",
            "give an array of shape (N, 3)",
        ),
        (
            "import fieldsim as fs\ndef build(): fs.World().add_particles([(0, 0, float('nan'))], [(0, 0, 0)])",
            "positions[0] is (0.0, 0.0, nan)",
        ),
    ],
)
def test_scripts_that_fail_are_status_1(here, capsys, script, words):
    (here / "scenarios" / "bad.py").write_text(script)
    assert fieldsim("run", "bad") == 1
    told = capsys.readouterr()
    assert words in told.err
    assert "Traceback" not in told.err
    assert films(here) == []


def test_debug_shows_the_traceback(here, monkeypatch):
    (here / "scenarios" / "bad.py").write_text("def build(): return 1 / 0")
    with start("run", "bad", "--debug") as process:
        _, errors = process.communicate()
    assert process.returncode == 1
    assert "Traceback" in errors
    assert "ZeroDivisionError" in errors


@pytest.mark.skipif(wp.is_cuda_available(), reason="there is a CUDA device")
def test_no_cuda_is_told_before_any_work(here, capsys):
    (here / "scenarios" / "slow.py").write_text("def build(): raise AssertionError('built')")
    assert fieldsim("run", "slow", "--device", "cuda") == 1
    assert "device 'cuda' is not available: no CUDA device was found; available: cpu" in capsys.readouterr().err


def test_nothing_to_see_is_warned_of(here, capsys):
    assert fieldsim("run", "planet", "--threshold", 1e9, "--size", "8x8", "--out", "p.png", "--quality", "draft") == 0
    assert "fieldsim: warning: nothing to see" in capsys.readouterr().err


def test_a_full_disk_leaves_no_film(here):
    """A limit on the size of files stands in for the full disk."""
    resource = pytest.importorskip("resource")
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))  # noqa: E731
    arguments = ("--duration", 2, "--size", "160x90", "--quality", "draft", "--out", "p.mp4")
    # Compile first: the cache, too, is on the disk.
    assert fieldsim("run", "planet", "--size", "160x90", "--quality", "draft", "--out", "p.png") == 0
    with start("run", "planet", *arguments, preexec_fn=limit) as process:
        _, errors = process.communicate()
    assert process.returncode == 1
    assert errors.startswith("fieldsim: p.mp4: writing failed, nothing is kept: ffmpeg says: ")
    assert films(here) == ["p.png"]


def test_a_script_may_go_to_another_folder(here, capsys):
    """What the user named is where the user is."""
    (here / "else").mkdir()
    moved = f"os.chdir({str(here / 'else')!r})"
    text = textwrap.dedent(PLANET).replace("import fieldsim", f"import os\n\n{moved}\nimport fieldsim")
    text = text.replace("    world =", f"    assert os.path.isfile(__file__)\n    {moved}\n    world =")
    (here / "mover.py").write_text(text)
    options = ("--size", "32x18", "--quality", "draft", "--record", "m.npz", "--energy-plot", "m.svg")
    assert fieldsim("run", "mover.py", *options) == 0, capsys.readouterr().err
    assert {path.name for path in here.iterdir() if path.is_file()} == {"mover.py", "mover.mp4", "m.npz", "m.svg"}
    assert not any((here / "else").iterdir())


@pytest.mark.parametrize("option", ["--out", "--record", "--replay", "--energy-plot"])
def test_a_name_without_letters_is_none(here, capsys, option):
    """As of a shell's variable that is not set."""
    assert fieldsim("run", "planet", option, "") == 2
    assert f"Invalid value for '{option}': '' is no path of a file" in capsys.readouterr().err
    assert films(here) == []


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("import sys\nsys.exit(0)\ndef build(): pass", "bad.py:2: the script ended itself, by sys.exit(0)"),
        ("import sys\ndef build(): sys.exit('no')", "bad.py:2 in build: the script ended itself, by sys.exit('no')"),
        ("class Stop(BaseException): pass\ndef build(): raise Stop('now')", "bad.py:2 in build: Stop: now"),
        ("class Odd(Exception):\n  def __str__(self): 1 / 0\ndef build(): raise Odd", "Odd: an error without words"),
        ("def build(): raise ValueError('long ' * 10000)", "bad.py:1 in build: ValueError: long long"),
        ("def build(): return [1] * 100000", "build returned [1, 1, 1, 1, 1, 1, ...]; return a fs.Scenario"),
        ("async def build(): pass", "build returned <coroutine object build at "),
        ("def build(x: 'nowhere'): pass", "the signature of build cannot be read: NameError"),
        ("def build(x: '1 / 0'): pass", "the signature of build cannot be read: ZeroDivisionError"),
    ],
)
def test_scripts_that_end_or_return_oddly_are_status_1(here, capsys, script, words):
    (here / "scenarios" / "bad.py").write_text(script)
    assert fieldsim("run", "bad", "--size", "8x8") == 1
    told = capsys.readouterr().err
    assert words in told
    assert len(told) < 1000
    assert films(here) == []


# Where it is said


def test_a_reader_that_has_gone_is_no_failure(here):
    with start("run", "planet", "--size", "8x8", "--quality", "draft", "--out", "p.gif", bufsize=0) as process:
        process.stdout.close()
        errors = process.stderr.read()
    assert (process.returncode, errors) == (0, "")
    assert films(here) == ["p.gif"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="/dev/full")
def test_what_cannot_be_said_is_a_failure(here):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "fieldsim", "info"], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 1
    assert done.stderr.startswith("fieldsim: ")
    assert len(done.stderr.splitlines()) == 1


def test_one_file_for_two_things_is_refused(here, capsys):
    assert fieldsim("run", "planet", "--out", "p.png", "--energy-plot", "./p.png") == 2
    assert "--out and --energy-plot are one file" in capsys.readouterr().err
    assert films(here) == []
