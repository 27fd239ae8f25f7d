"""Scenario scripts: found, loaded, their parameters read; and what they get wrong told in one message."""

import textwrap
from typing import Literal

import pytest

import fieldsim as fs
from fieldsim import scenario
from fieldsim.errors import FieldsimWarning, InputError, ScenarioError

ORIGIN = (0.0, 0.0, 0.0)


def still(**options):
    """A scenario of one ball, for its checks."""
    world = fs.World()
    world.add_body(fs.Body(fs.Point(ORIGIN), surface=fs.Material()))
    return fs.Scenario(world, fs.Camera((3, 0, 0)), **{"duration": 1.0, **options})


@pytest.fixture
def script(tmp_path, monkeypatch):
    """A function that writes scenarios/planet.py and changes to its folder's parent."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").mkdir()

    def write(text, name="planet"):
        (tmp_path / "scenarios" / f"{name}.py").write_text(textwrap.dedent(text))
        return f"scenarios/{name}.py"

    return write


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"duration": -1}, "duration is -1"),
        ({"duration": 0}, "duration is 0"),
        ({"duration": float("nan")}, "duration is nan"),
        ({"fps": 0}, "fps is 0"),
        ({"integrator": 1e-3}, r"integrator is 0\.001; give one such as fs\.Leapfrog"),
    ],
)
def test_bad_scenarios_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        still(**options)
    with pytest.raises(InputError, match=r"camera is None; give a fs\.Camera"):
        fs.Scenario(fs.World(), None, duration=1)


def test_found_by_path_and_by_name(script):
    path = script("def build(): pass")
    assert str(scenario.find(path)) == str(scenario.find("planet")) == path
    assert [str(p) for p in scenario.available()] == [path]


def test_unknown_scenarios_name_near_ones(script):
    with pytest.raises(ScenarioError, match=r"no scenario 'x'; .*there is none here"):
        scenario.find("x")
    script("def build(): pass")
    with pytest.raises(ScenarioError, match=r"no scenario 'plant'; did you mean planet\?"):
        scenario.load("plant")
    with pytest.raises(ScenarioError, match="no scenario 'x'; in scenarios/ there are planet"):
        scenario.find("x")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", r"scenarios/planet\.py defines no function build"),
        ("def build(:\n    pass", r"scenarios/planet\.py:1: syntax error"),
        (
            "\nimport nothing_of_this_name",
            r"planet\.py:2: ModuleNotFoundError: No module .*\n    import nothing_of_this",
        ),
        ("x = '\0'", "cannot be read as Python|syntax error"),
    ],
)
def test_scripts_that_cannot_be_loaded(script, text, words):
    with pytest.raises(ScenarioError, match=words):
        scenario.load(script(text))


def test_a_failing_build_names_its_line(script):
    build = scenario.load(
        script(
            """
            import fieldsim as fs

            def wire():
                return fs.Segment((0, 0, 0), (0, 0, 0))

            def build(wrong: bool = False):
                return 1 / 0 if wrong else wire()
            """
        )
    )
    with pytest.raises(ScenarioError, match=r"^scenarios/planet\.py:8 in build: ZeroDivisionError: division by zero\n"):
        scenario.call(build, {"wrong": True})
    with pytest.raises(ScenarioError, match=r"^scenarios/planet\.py:5 in wire: Segment: start and end are both"):
        scenario.call(build, {})


def test_build_must_give_a_scenario(script):
    with pytest.raises(ScenarioError, match=r"build returned 7; return a fs\.Scenario"):
        scenario.call(scenario.load(script("def build(): return 7")), {})


def test_scripts_find_their_neighbours_and_main_does_nothing_while_they_load(script):
    script("NUMBER = 7", "neighbour_of_planet")
    path = script(
        """
        import fieldsim as fs
        from neighbour_of_planet import NUMBER

        def build(number: int = NUMBER): ...

        fs.main(build)
        """
    )
    assert scenario.parameters(scenario.load(path))[0].default == 7


def test_parameters_come_from_the_signature_and_the_docstrings(script):
    build = scenario.load(
        script(
            '''
            """A planet.

            It turns.

            moons: number of moons,
                all alike
            """

            def build(moons: int, mass=2.5, name: str | None = None, spin: bool = True):
                """mass: of the planet"""
            '''
        )
    )
    found = scenario.parameters(build)
    assert [(p.name, p.kind, p.help) for p in found] == [
        ("moons", int, "number of moons, all alike"),
        ("mass", float, "of the planet"),
        ("name", str, ""),
        ("spin", bool, ""),
    ]
    assert [p.required for p in found] == [True, False, False, False]
    assert scenario.summary("scenarios/planet.py") == "A planet."


def test_description_leaves_the_parameters_out():
    def build(moons: int = 3):
        """A planet.

        moons: number
        """

    assert scenario.description(build) == "A planet."


def test_choices_and_types_that_cannot_be_options():
    def choose(shape: Literal["ring", "cigar"] = "ring"): ...

    def wrong(places: list = ()): ...

    assert scenario.parameters(choose)[0].kind == ("ring", "cigar")
    with pytest.raises(ScenarioError, match="parameter 'places' cannot be an option"):
        scenario.parameters(wrong)


# What there is to see


def still_of(*bodies, path):
    world = fs.World()
    for body in bodies:
        world.add_body(body)
    return fs.film(fs.Scenario(world, fs.Camera((3, 0, 0)), duration=1.0), path, size=(16, 9), quality="draft")


def test_a_threshold_that_no_field_reaches_is_warned_of(tmp_path):
    dim = fs.Material(radius=0.3, blobbiness=-2, threshold=8.0)  # exp(2) = 7.4 in the middle
    with pytest.warns(FieldsimWarning, match="nothing to see: the surface field stays below"):
        still_of(fs.Body(fs.Point(ORIGIN), surface=dim), path=tmp_path / "a.png")
    # Together they reach it.
    still_of(fs.Body([fs.Point(ORIGIN), fs.Point((0.1, 0, 0))], surface=dim), path=tmp_path / "a.png")


def test_an_empty_world_is_warned_of(tmp_path):
    with pytest.warns(FieldsimWarning, match="no body has a surface, and there are no particles"):
        still_of(path=tmp_path / "a.png")


def test_a_report_counts(tmp_path):
    report = fs.film(still(fps=4), tmp_path / "a.gif", size=(16, 9), quality="draft", duration=0.5)
    assert (report.frames, report.size, report.particle_steps, report.energy) == (2, (16, 9), 0, None)
    assert report.rays >= 2 * 16 * 9
    assert report.seconds >= report.rendering.seconds + report.writing.seconds > 0
    assert str(report).startswith(f"{tmp_path}/a.gif: 2 frames of 16x9 in ")


def test_films_are_the_same_byte_for_byte(tmp_path):
    world = fs.World()
    world.add_body(fs.Body(fs.Point(ORIGIN), gravity=fs.Newtonian(), surface=fs.Material()))
    world.add_particles(**fs.sampling.shell(20, radius=1.0, seed=1), contact=fs.Bounce(0.5))
    scenario = fs.Scenario(world, fs.Camera.orbit(radius=3.0), duration=0.5, fps=8)
    for name in ("a.mp4", "b.mp4"):
        fs.film(scenario, tmp_path / name, size=(48, 27))
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
