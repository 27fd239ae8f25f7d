"""Films of MuJoCo models from the command line, and beside MuJoCo's own pictures."""

import re
import types

import imageio.v3 as imageio
import mujoco
import numpy as np
import pytest
from mujoco_scenes import BALL, CAMERA, CHECKERED, HUMANOID, ball_experiment, posed

import fieldsim as fs
from fieldsim.cli import program
from fieldsim.mujoco.models import model_of
from fieldsim.mujoco.scene.mujoco_renderer import MujocoRenderer


def fieldsim(*arguments):
    """Exit status of the command."""
    with pytest.raises(SystemExit) as end:
        program.main(argv=[str(a) for a in arguments])
    return end.value.code


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with scenarios/still.py, a donut, and ball.xml, to work in."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "still.py").write_text(
        '"""A donut.\n\nmass: its mass\n"""\nimport fieldsim as fs\n\n'
        "def build(mass: float = 1.0):\n"
        "    world = fs.World()\n"
        "    ring = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)\n"
        "    clay = fs.Material(radius=0.25, blobbiness=-8.0)\n"
        "    world.add_body(fs.Body(ring, gravity=fs.Newtonian(), mass=mass, surface=clay))\n"
        "    return fs.Scenario(world, fs.Camera((2.5, -3.5, 2.0)), duration=0.2, fps=10)\n"
    )
    (tmp_path / "ball.xml").write_text(BALL.format(gravity="0 0 -9.81"))
    return tmp_path


DRAFT = ("--size", "48x27", "--quality", "draft")


def test_the_command_films_a_model_in_a_scenario(here, capsys):
    assert fieldsim("mujoco", "ball.xml", "still", *DRAFT, "--mass", 2) == 0
    told = capsys.readouterr()
    assert told.err == ""
    assert told.out.startswith("ball-still.mp4: 2 frames of 48x27 in ")
    assert "MuJoCo steps/s" in told.out
    assert (
        fieldsim("mujoco", "--skin", *DRAFT, HUMANOID, "--duration", 1, "--fps", 2, "still", "--out", "p_%d.png") == 0
    )
    first, last = (imageio.imread(f"p_{k}.png").astype(int) for k in range(2))
    assert np.abs(last - first).max() > 20


def test_the_commands_help_teaches(here, capsys):
    assert fieldsim("mujoco", "--help") == 0
    shown = capsys.readouterr().out
    for words in ("MODEL.xml SCENARIO", "fieldsim mujoco humanoid.xml donut", "still  A donut."):
        assert words in shown
    assert fieldsim("mujoco", "ball.xml", "--help") == 0
    assert capsys.readouterr().out == shown
    assert fieldsim("mujoco") == 2
    assert capsys.readouterr().err.strip() == shown.strip()
    assert fieldsim("mujoco", "ball.xml", "still", "--help") == 0
    shown = capsys.readouterr().out
    for words in ("--skin", "--mass FLOAT", "--beside", "--size WxH", "--keep-gravity"):
        assert words in shown


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["nothing.xml", "still"], 2, "there is no model 'nothing.xml'"),
        (["bad.xml", "still"], 2, "MuJoCo cannot read 'bad.xml': "),
        (["ball.xml", "stil"], 2, "did you mean still?"),
        (["ball.xml"], 2, "name a SCENARIO besides the options"),
        ([], 2, "name MODEL.xml and a SCENARIO besides the options"),
        (["ball.xml", "still", "--speed", "-1"], 2, "-1 is not a positive number"),
        (["ball.xml", "still", "--beside", "--replay", "a.npz"], 2, "not a recording"),
        (["ball.xml", "still", "--damping", "-1"], 1, "Contact: damping is -1"),
        (["fixed.xml", "still", "--no-contact"], 1, "the model has no degree of freedom"),
        (["fixed.xml", "still"], 1, "no body of the model has mass and can move"),
        (["ball.xml", "own"], 1, "own has a model of its own; film it with: fieldsim run own"),
        (["ball.xml", "empty"], 1, "there are no sources"),
        (["ball.xml", "plot"], 2, "the scenario is a picture"),
    ],
)
def test_wrong_models_and_scenarios_are_told(here, capsys, arguments, status, words):
    (here / "bad.xml").write_text("<mujoco><worldbody><geom type='cube'/></worldbody></mujoco>")
    (here / "fixed.xml").write_text("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    imports = "import fieldsim as fs\n"
    start = "fs.World(), fs.Camera((3, 0, 0)), duration=1.0"
    (here / "scenarios" / "own.py").write_text(
        f"{imports}def build(): return fs.mujoco.Experiment({start}, model='ball.xml')"
    )
    (here / "scenarios" / "empty.py").write_text(f"{imports}def build(): return fs.Scenario({start})")
    (here / "scenarios" / "plot.py").write_text(f"{imports}def build(): return fs.Picture(fs.plots.figure)")
    assert fieldsim("mujoco", *arguments, *DRAFT) == status
    told = capsys.readouterr()
    assert re.search(re.escape(words), told.err), told.err
    assert told.out == ""
    assert not list(here.glob("*.mp4"))


def test_mujocos_own_picture_needs_opengl(here, capsys, monkeypatch):
    def fail(*arguments):
        raise RuntimeError("no display")

    monkeypatch.setattr(mujoco, "Renderer", fail)
    assert fieldsim("mujoco", "ball.xml", "still", "--beside", *DRAFT) == 1
    assert "no OpenGL context here (no display); set the environment variable MUJOCO_GL=egl" in capsys.readouterr().err
    assert not list(here.glob("*.mp4"))


@pytest.fixture
def opengl():
    """Skip where MuJoCo has nothing to draw with."""
    try:
        MujocoRenderer(model_of(BALL.format(gravity="0 0 0")), (8, 8))
    except fs.FieldsimError:
        pytest.skip("no OpenGL context here")


@pytest.mark.parametrize("uniform", ["true", "false"])
def test_checkers_lie_as_mujoco_has_them(opengl, uniform):
    model, data = posed(CHECKERED.format(uniform=uniform))
    snapshot = fs.mujoco.Scene(fs.World(), model).snapshot(data)
    above = fs.Camera((0, 0, 20), up=(0, 1, 0), fov=11.0)
    own = MujocoRenderer(model, (180, 180)).frame(snapshot, above).astype(int)
    ours = fs.render(snapshot, above, size=(180, 180)).astype(int)
    # All but pixels on the edges of squares.
    assert np.mean((own[..., 0] > own[..., 2]) == (ours[..., 0] > ours[..., 2])) > 0.95


def test_mujocos_own_picture_stands_beside(opengl, tmp_path):
    """Both see the same ball at the same pixels."""
    experiment = ball_experiment(fps=10)
    beside = lambda size: MujocoRenderer(experiment.model, size)  # noqa: E731
    fs.film(experiment, tmp_path / "p_%d.png", size=(64, 48), beside=beside)
    picture = imageio.imread(tmp_path / "p_0.png")
    assert picture.shape == (48, 128, 3)
    snapshot = experiment.begin()[0].snapshot()
    own = MujocoRenderer(experiment.model, (64, 48)).frame(snapshot, CAMERA)
    ours = fs.Renderer((64, 48)).layers(snapshot, CAMERA)["thing"] == 3
    theirs = own.sum(axis=2) > 0
    assert theirs.sum() > 10
    assert np.sum(ours ^ theirs) < 0.5 * theirs.sum()


class _NoRenderer:
    """In place of MuJoCo's, where there is no OpenGL."""

    def __init__(self, model, height, width):
        self.scene, self._picture = types.SimpleNamespace(camera=[]), np.zeros((height, width, 3), np.uint8)

    def update_scene(self, data):
        pass

    def render(self):
        return self._picture


def test_what_is_changed_in_the_model_is_seen_beside(monkeypatch):
    monkeypatch.setattr(mujoco, "Renderer", _NoRenderer)
    model, data = posed(BALL.format(gravity="0 0 0"))
    beside, scene = MujocoRenderer(model, (8, 8)), fs.mujoco.Scene(fs.World(), model)
    model.geom_rgba[0], model.geom_size[0, 0] = (1, 0, 0, 1), 0.3
    beside.frame(scene.snapshot(data), CAMERA)
    np.testing.assert_array_equal(beside.model.geom_rgba[0], (1, 0, 0, 1))
    assert beside.model.geom_size[0, 0] == 0.3


def test_a_recording_of_a_model_names_what_it_depends_on(here, capsys):
    run = ("mujoco", "ball.xml", "still", "--size", "8x8", "--quality", "draft", "--duration", 0.2, "--out", "a.gif")
    assert fieldsim(*run, "--friction", 0.3, "--record", "a.npz") == 0
    assert fs.Recorded("a.npz").about["parameters"] == {"friction": 0.3, "mass": 1.0, "model": "ball.xml"}
    capsys.readouterr()
    assert fieldsim(*run, "--friction", 0.9, "--replay", "a.npz") == 0
    assert "parameter friction was 0.3, here it is 0.9" in capsys.readouterr().err
