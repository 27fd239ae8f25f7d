"""The command line: every way in, and its help."""

import pathlib
import subprocess
import sys

import imageio.v3 as imageio
import numpy as np
import pytest
from commands import fieldsim, films

import fieldsim as fs
from fieldsim.dynamics.auto import integrator_named

SCENARIOS = pathlib.Path(__file__).parents[2] / "scenarios"


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
