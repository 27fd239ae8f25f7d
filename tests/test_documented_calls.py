"""Calls of fieldsim in README, docs and docstrings: the names are there, and the arguments fit the signatures."""

import ast
import inspect
import pathlib
import re

import pytest

import fieldsim as fs

ROOT = pathlib.Path(__file__).parents[1]
FILES = {
    "README": [ROOT / "README.md"],
    "docs": [*(ROOT / "docs").glob("*.md")],
    "docstrings": [*pathlib.Path(fs.__file__).parent.rglob("*.py")],
}


def calls_in(text):
    """The calls `fs.name(...)` of a text, with values in the place of what it leaves out: `name=`."""
    for start in re.finditer(r"\bfs((?:\.\w+)+)\(", text):
        depth, end = 1, start.end()
        while depth and end < len(text):
            depth += {"(": 1, ")": -1}.get(text[end], 0)
            end += 1
        inner = re.sub(r"=\s*(?=[,)]|$)", "=0", text[start.end() : end - 1])
        yield start[1][1:], inner


def _fits(name, inner):
    """Why a call cannot be as it is written, or ""."""
    thing = fs
    for part in name.split("."):
        if part == "mujoco":
            pytest.importorskip("mujoco")
        thing = getattr(thing, part, None)
        if thing is None:
            return "there is no such name"
    try:
        call = ast.parse(f"f({inner})", mode="eval").body
    except SyntaxError:
        return ""  # words
    if any(isinstance(one, ast.Starred) for one in call.args) or any(k.arg is None for k in call.keywords):
        return ""
    # An ellipsis stands for any other arguments.
    given = [one for one in call.args if not (isinstance(one, ast.Constant) and one.value is ...)]
    try:
        inspect.signature(thing).bind_partial(*given, **{k.arg: k.value for k in call.keywords})
    except TypeError as reason:
        return str(reason)
    return ""


@pytest.mark.parametrize("files", FILES)
def test_calls_fit_their_signatures(files):
    texts = [path.read_text(encoding="utf-8") for path in FILES[files] if path.is_file()]
    calls = ((f"fs.{name}({inner})", _fits(name, inner)) for text in texts for name, inner in calls_in(text))
    assert not {call: reason for call, reason in calls if reason}


def test_a_light_as_documented_works():
    assert fs.DirectionalLight((0, 0, -2), angle=0.5).direction == (0, 0, -1)
    assert fs.PointLight((1, 2, 3), radius=0.1).position == (1, 2, 3)


def test_remedies_can_be_followed():
    solid = fs.mesh(fs.box((0, 0, 0), (1, 1, 1)))
    with pytest.raises(fs.InputError, match=r"mesh\.triangles\(\).* or fs\.solid_faces\(mesh\)"):
        fs.Body(solid, surface=fs.Material())
    fs.Body(solid.triangles(), surface=fs.Material())
    fs.Body(fs.solid_faces(solid), gravity=fs.Newtonian())
    with pytest.raises(fs.InputError, match=r"give fs\.rectangle\(\.\.\.\) or fs\.disc"):
        fs.Body(fs.Plane((0, 0, 0), (0, 0, 1)), gravity=fs.Newtonian()).gravity_field()
    fs.Body(fs.disc((0, 0, 0), (0, 0, 1), 1.0), gravity=fs.Newtonian())


@pytest.mark.parametrize(("seconds", "fps", "count"), [(0.24, 10, 2), (2.5, 1, 2), (0.34, 10, 3), (0.01, 10, 1)])
def test_a_timeline_has_the_rounded_number_of_frames(seconds, fps, count):
    assert len(fs.timeline(seconds, fps)) == count
    assert "round(seconds * fps)" in fs.timeline.__doc__
