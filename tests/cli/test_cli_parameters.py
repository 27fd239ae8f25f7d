"""The parameters of scripts as options of the command."""

import textwrap

import pytest
from commands import fieldsim, films

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
