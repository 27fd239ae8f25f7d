"""Pages for builders: their code runs, their links and paths lead somewhere, what they say of the code is so."""

import json
import os
import pathlib
import re
import subprocess
import sys

import draw_floors
import pytest
from PIL import Image

import fieldsim as fs
from benchmarks import chart
from fieldsim.potentials import registry

ROOT = pathlib.Path(__file__).parents[1]
FILES = [*sorted((ROOT / "docs").glob("*.md")), ROOT / "CONTRIBUTING.md"]
PAGES = {path.name: path.read_text(encoding="utf-8") for path in FILES}
BLOCKS = [
    (name, k, code)
    for name, text in PAGES.items()
    for k, code in enumerate(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
]
# Question, file and word of the table "One guess".
GUESSES = re.findall(r"^\| ([^|]+) \| `(fieldsim/[^`]+)` \| `([^`]+)` \|$", PAGES["architecture.md"], re.MULTILINE)
FORMULAS = re.findall(r"^\| (\w+) \| (\w+) \| [^|]+ \| `([^`]+)` \|", PAGES["fields.md"], re.MULTILINE)


@pytest.mark.parametrize(("name", "k", "code"), BLOCKS, ids=[f"{name}-{k}" for name, k, _code in BLOCKS])
def test_code_of_pages_runs(name, k, code, tmp_path):
    """Each block is a script of its own, as Warp reads functions from their files."""
    script = tmp_path / f"block_{k}.py"
    script.write_text(code, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", PAGES)
def test_links_and_paths_of_pages_lead_somewhere(name):
    folder = ROOT if name == "CONTRIBUTING.md" else ROOT / "docs"
    links = re.findall(r"\]\((?!http)([^)#]+)", PAGES[name])
    paths = re.findall(r"`((?:fieldsim|tests|tools|scenarios)/[a-z_0-9./]+)`", PAGES[name])
    assert not [link for link in links if not (folder / link).exists()]
    assert not [path for path in paths if not (ROOT / path).exists()]


def test_readme_leads_to_the_pages():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in ("CONTRIBUTING.md", "docs/architecture.md", "docs/extending.md", "docs/glossary.md"):
        assert f"]({name})" in readme


NUMBERS = "no one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen".split()


def test_the_readmes_numbers_in_words_are_of_today():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    counts = re.search(r"(\w+) kernels on (\w+) primitives: ", readme).groups()
    assert [NUMBERS.index(word.lower()) for word in counts] == [len(chart.KERNELS), len(chart.PRIMITIVES)]
    count, least, most = re.search(r"(\w+) symplectic methods of order (\d+) to (\d+)", readme).groups()
    methods = [kind for kind in fs.Splitting.__subclasses__() if kind.__module__.startswith("fieldsim.")]
    assert NUMBERS.index(count.lower()) == len(methods)
    assert (int(least), int(most)) == (min(kind.order for kind in methods), max(kind.order for kind in methods))


@pytest.mark.parametrize(("question", "path", "word"), GUESSES, ids=[question for question, _path, _word in GUESSES])
def test_one_guess(question, path, word):
    assert len(GUESSES) >= 10
    assert word in (ROOT / path).read_text(encoding="utf-8")


def test_the_picture_of_the_floors_is_of_today():
    with Image.open(draw_floors.PICTURE) as picture:
        drawn = json.loads(picture.text["Edges"])
    assert drawn == draw_floors.edges(), "run python tools/draw_floors.py"


@pytest.mark.parametrize(("kernel", "primitive", "file"), FORMULAS)
def test_formulas_are_in_the_files_named(kernel, primitive, file):
    kernel, primitive = getattr(fs, kernel), getattr(fs, primitive)
    assert file == chart.file_of(kernel, primitive), "run python -m benchmarks.chart --files"
    path = ROOT / "fieldsim" / "potentials" / file
    module = "fieldsim." + str(path.relative_to(ROOT / "fieldsim").with_suffix("")).replace("/", ".")
    called = chart.functions_of(registry.FORMULAS[kernel, primitive].jet)
    functions = {name for where, name in called if where == module}
    defined = set(re.findall(r"^def (\w+)\(", path.read_text(encoding="utf-8"), re.MULTILINE))
    assert functions & defined


def test_every_formula_has_a_line():
    assert len(FORMULAS) == len(chart.KERNELS) * len(chart.PRIMITIVES)
