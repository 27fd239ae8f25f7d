"""The command line: every way in, every way to go wrong, and what is left on the disk afterwards."""

import os
import pathlib
import re
import signal
import subprocess
import sys
import textwrap
import time

import imageio.v3 as imageio
import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim import files
from fieldsim.cli import film, program
from fieldsim.dynamics.auto import integrator_named

SCENARIOS = pathlib.Path(__file__).parents[2] / "scenarios"

# A planet and pebbles, with the cells of the donut scenario, so that its kernels serve here, too.
PLANET = """
    '''A small planet.

    pebbles: number of pebbles
    '''

    import fieldsim as fs


    def build(pebbles: int = 3, duration: float = 0.2, threshold: float = 1.0) -> fs.Scenario:
        ring = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
        world = fs.World()
        clay = fs.Material("terracotta", radius=0.25, threshold=threshold)
        world.add_body(fs.Body(ring, gravity=fs.Newtonian(), surface=clay))
        world.add_particles(**fs.sampling.shell(pebbles, radius=2.0, seed=1), contact=fs.Bounce(0.5))
        return fs.Scenario(world, fs.Camera((4, 0, 2)), duration=duration, fps=10)


    if __name__ == "__main__":
        fs.main(build)
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with scenarios/planet.py, to work in."""
    files.appeared.clear()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "planet.py").write_text(textwrap.dedent(PLANET))
    return tmp_path


def fieldsim(*arguments):
    """Exit status of the command."""
    with pytest.raises(SystemExit) as end:
        program.main(argv=[str(a) for a in arguments])
    return end.value.code


def start(*arguments, **options):
    """The command as a process."""
    command = [sys.executable, "-m", "fieldsim", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def films(folder):
    return sorted(p.name for p in folder.iterdir() if p.name != "scenarios")


# Films


def test_run_films_a_scenario_and_reports(here, capsys):
    assert fieldsim("run", "planet", "--size", "32x18", "--pebbles", 5, "--quality", "draft") == 0
    told = capsys.readouterr()
    assert told.err == ""
    first, *rest = told.out.splitlines()
    assert first.startswith("planet.mp4: 2 frames of 32x18 in ")
    assert "particle-steps/s" in rest[0]
    assert "rays/s" in rest[1]
    assert rest[-1].strip().startswith("energy drift at most")
    assert "5 of 5 particles" in rest[-1]
    assert films(here) == ["planet.mp4"]


def test_options_of_the_film(here, capsys):
    arguments = ("--out", "p_%d.png", "--size", "31x17", "--fps", 20, "--duration", 0.25, "--quality", "draft")
    assert fieldsim("run", *arguments, "scenarios/planet.py") == 0
    assert films(here) == [f"p_{i}.png" for i in range(5)]
    picture = imageio.imread("p_0.png")
    assert picture.shape == (17, 31, 3)
    assert picture.std() > 5


def test_preview_is_small(here, capsys):
    assert fieldsim("run", "planet", "--preview", "--fps", 5, "--size", "32x18") == 0
    assert films(here) == ["planet-preview.mp4"]
    assert "1 frame of 32x18" in capsys.readouterr().out


def test_any_integrator_and_a_plot_of_the_energy(here, capsys):
    arguments = ("run", "planet", "--size", "32x18", "--quality", "draft", "--integrator", "omelyan4:0.01")
    assert fieldsim(*arguments, "--energy-plot", "energy.png") == 0
    told = capsys.readouterr().out
    assert "particle-steps/s, Omelyan4(dt=0.01)" in told
    assert told.endswith("  energy.png: how well energy was kept\n")
    assert imageio.imread("energy.png").shape[:2] == (720, 960)
    # Radau does not know these pebbles' bounces.
    assert fieldsim("run", "planet", "--integrator", "radau") == 1
    assert "contact Bounce" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "integrator"),
    [
        ("auto", fs.Auto()),
        ("Auto:1e-6", fs.Auto(1e-6)),
        ("radau", fs.Radau()),
        ("leapfrog:1e-3", fs.Leapfrog(1e-3)),
        ("KahanLi8:0.05", fs.KahanLi8(0.05)),
    ],
)
def test_integrators_have_names(text, integrator):
    assert integrator_named(text) == integrator


def test_a_film_in_which_nothing_moves_has_no_energy(here, capsys):
    arguments = ("run", "planet", "--pebbles", 0, "--size", "8x8", "--quality", "draft", "--out", "p.png")
    assert fieldsim(*arguments, "--energy-plot", "energy.png") == 0
    assert "warning: nothing is drawn to energy.png" in capsys.readouterr().err
    assert films(here) == ["p.png"]


def test_a_still_needs_only_its_frame(here, capsys):
    assert fieldsim("run", "planet", "--out", "p.png", "--size", "32x18", "--quality", "draft") == 0
    assert "1 frame of 32x18" in capsys.readouterr().out


def test_a_parameter_named_like_an_option_of_films_gets_its_value(here, capsys):
    (here / "scenarios" / "odd.py").write_text(
        "def build(duration: float = 3.0, fps: float = 5.0):\n    raise ValueError(f'{duration} {fps}')"
    )
    assert fieldsim("run", "odd", "--duration", 7) == 1
    assert "ValueError: 7.0 5.0" in capsys.readouterr().err


def test_a_script_runs_by_itself_as_through_the_command(here):
    script = [sys.executable, "scenarios/planet.py"]
    shown = subprocess.run([*script, "--help"], capture_output=True, text=True, check=True)
    assert "--pebbles INTEGER" in shown.stdout
    wrong = subprocess.run([*script, "--size", "0x0"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2
    made = subprocess.run(
        [*script, "--size", "32x18", "--quality", "draft"], capture_output=True, text=True, check=True
    )
    assert made.stderr == ""
    assert films(here) == ["planet.mp4"]


PICTURES = {"poincare": ("--orbits", 4)}
FILMS = sorted(path for path in SCENARIOS.glob("*.py") if path.stem not in PICTURES)


@pytest.mark.parametrize("name", PICTURES)
def test_every_picture_is_drawn(name, here, capsys):
    script = SCENARIOS / f"{name}.py"
    assert fieldsim("run", script, "--duration", 60, "--size", "320x240", "--out", "p.png", *PICTURES[name]) == 0
    assert capsys.readouterr() == ("p.png\n", "")
    assert imageio.imread("p.png").shape[:2] == (240, 320)
    assert fieldsim("run", script, "--integrator", "radau") == 2
    assert "--integrator and --energy-plot are for films" in capsys.readouterr().err
    assert fieldsim("run", script, "--record", "p.npz") == 2
    assert "are for films" in capsys.readouterr().err
    assert fieldsim("run", script, "--out", "p.mp4") == 2
    assert "a picture ends in .png, .svg or .pdf" in capsys.readouterr().err


@pytest.mark.parametrize("script", FILMS, ids=lambda path: path.stem)
def test_every_scenario_films(script, here, capsys):
    size = ("--size", "64x36", "--quality", "draft", "--out", "p_%d.png")
    assert fieldsim("run", script, "--duration", 1, "--fps", 2, *size) == 0
    assert capsys.readouterr().err == ""
    first, last = (imageio.imread(f"p_{i}.png").astype(int) for i in range(2))
    # There is something to see, and it moves.
    assert first.std() > 5
    assert np.abs(last - first).max() > 20


# Help


def test_help_teaches(here, capsys):
    assert fieldsim("--help") == 0
    assert "fieldsim run donut --preview" in capsys.readouterr().out
    assert fieldsim("run", "--help") == 0
    assert "planet  A small planet." in capsys.readouterr().out
    assert fieldsim("run", "planet", "--help") == 0
    shown = capsys.readouterr().out
    assert "--pebbles INTEGER" in shown
    assert "number of pebbles" in shown
    assert shown.count("pebbles:") == 0
    assert shown.count("--duration") == 1


@pytest.mark.parametrize("script", sorted(SCENARIOS.glob("*.py")), ids=lambda path: path.stem)
def test_every_scenario_shows_its_own_options(script, capsys):
    assert fieldsim("run", script, "--help") == 0
    shown = capsys.readouterr().out
    assert "[default:" in shown


def test_version_and_info(capsys):
    assert fieldsim("--version") == 0
    assert capsys.readouterr().out.startswith("fieldsim 0.")
    assert fieldsim("info") == 0
    shown = capsys.readouterr().out
    for word in ("python", "numpy", "warp-lang", "numba", "mujoco", "encoder", "cpu", "kernel cache"):
        assert word in shown


# What goes wrong


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


# Runs that are ended

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


def test_a_motion_that_ends_the_script_is_status_1_and_named(here, capsys):
    script = textwrap.dedent(SLOW).replace("time.sleep(0.01)", "raise SystemExit(0) if t > 0.25 else None")
    (here / "scenarios" / "bad.py").write_text(script.replace("raise SystemExit(0) if", "_ = exit(0) if"))
    assert fieldsim("run", "bad", "--size", "8x8", "--out", "p.gif") == 1
    told = capsys.readouterr().err
    assert "bad.py" in told
    assert "p.gif keeps the 3 of 1000000 frames made before" in told


# What scripts call their parameters

ODD = """
    import functools
    import fieldsim as fs


    def made(*values, **named):
        world = fs.World()
        world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(radius=0.5)))
        scenario = fs.Scenario(world, fs.Camera((0, -5, 1)), duration=0.1, fps=10)
        print("given", *values)
        return scenario

"""


@pytest.mark.parametrize(
    ("build", "arguments", "printed"),
    [
        ("def build(debug: bool = False): return made(debug)", (), "given False"),
        ("def build(preview: bool = False): return made(preview)", ("--preview",), "given True"),
        ("def build(out: str = 'x'): return made(out)", (), "given p.gif"),
        ("def build(fps: int = 7): return made(fps)", ("--fps", 20), "given 20"),
        ("def build(fps: int = 7): return made(fps)", (), "given 7"),
        ("build = functools.partial(made, 2.0)", (), "given 2.0"),
        (
            "class Maker:\n    def __call__(self, x: float = 3.0): return made(x)\nbuild = Maker()",
            ("--x", 4),
            "given 4.0",
        ),
        ("build = lambda x=3: made(x)", ("--x", 5), "given 5"),
        ("class build:\n    def __new__(cls, x: int = 6): return made(x)", (), "given 6"),
    ],
)
def test_builds_of_every_kind(here, capsys, build, arguments, printed):
    (here / "scenarios" / "odd.py").write_text(textwrap.dedent(ODD) + build)
    assert fieldsim("run", "odd", "--size", "8x8", "--quality", "draft", "--out", "p.gif", *arguments) == 0
    told = capsys.readouterr()
    assert (told.err, told.out.splitlines()[0]) == ("", printed)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        ("def build(help: bool = False): return made()", "parameter 'help' has the name of an option"),
        ("def build(size: float = 1.0): return made()", "parameter 'size' has the name of an option"),
        ("def build(integrator='x'): return made()", "parameter 'integrator' has the name of an option"),
        ("def build(debug: float = 1.0): return made()", "parameter 'debug' has the name of an option"),
        ("def build(x: bool = True, no_x: int = 1): return made()", "'x' and 'no_x' would both be the option --no-x"),
    ],
)
def test_parameters_that_cannot_be_options_are_refused_by_name(here, capsys, build, words):
    (here / "scenarios" / "odd.py").write_text(textwrap.dedent(ODD) + build)
    assert fieldsim("run", "odd", "--out", "p.gif") == 1
    told = capsys.readouterr().err
    assert words in told
    assert len(told.splitlines()) == 1
    assert films(here) == []


def test_a_required_parameter_that_shares_an_option_is_asked_for(here, capsys):
    (here / "scenarios" / "odd.py").write_text(textwrap.dedent(ODD) + "def build(fps: int): return made(fps)")
    assert fieldsim("run", "odd") == 2
    assert "Missing option '--fps'" in capsys.readouterr().err
    assert fieldsim("run", "odd", "--fps", 2.5) == 2
    assert "--fps is 2.5; this scenario takes a whole number" in capsys.readouterr().err


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
