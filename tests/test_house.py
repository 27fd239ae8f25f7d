"""The house itself: what importing costs, what is public, who may import whom, what the README promises."""

import ast
import functools
import inspect
import pathlib
import re
import subprocess
import sys

import house_counts
import import_graph
import near_duplicates
import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim import launch
from fieldsim.potentials.kernels import Kernel
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.world.light import Light

ROOT = pathlib.Path(__file__).parents[1]
PACKAGE = pathlib.Path(fs.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))
README = (ROOT / "README.md").read_text(encoding="utf-8")


def python(script, **options):
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, **options)


# Imports


@pytest.mark.parametrize("name", ["mujoco", "numba", "imageio", "imageio_ffmpeg", "rich", "scipy", "matplotlib"])
def test_import_leaves_out_what_only_some_need(name):
    done = python(f"import sys, fieldsim; print({name!r} in sys.modules)")
    assert (done.stdout, done.stderr) == ("False\n", "")


# Who may import whom: each part knows those named, and the base; the base knows only itself.
BASE = {
    "arrays",
    "copies",
    "errors",
    "files",
    "interrupts",
    "kernel_cache",
    "launch",
    "numerics",
    "portable",
    "types",
    "validate",
}
KNOWS = {
    "potentials": set(),
    "sampling": set(),
    "plots": set(),
    "world": {"potentials"},
    "sources": {"potentials", "world"},
    "dynamics": {"potentials", "world", "sources"},
    "orbits": {"potentials", "world", "sources", "dynamics"},
    "render": {"potentials", "world", "sources"},
    "scenario": {"potentials", "world", "dynamics", "render", "plots"},
    "native": set(),
    "mujoco": {"potentials", "world", "sources", "dynamics", "render", "scenario", "native"},
    "recording": {"potentials", "world"},
    "filming": {"recording", "potentials", "world", "dynamics", "render", "scenario", "plots"},
    "cli": {"dynamics", "render", "scenario", "mujoco", "recording", "filming", "plots"},
    "__main__": {"cli"},
}


def imported(path):
    """Parts of fieldsim that a module imports, also inside its functions."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            if name.startswith("fieldsim."):
                yield name.split(".")[1]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_go_one_way(path):
    part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    if part == "__init__":
        return
    allowed = BASE if part in BASE else BASE | KNOWS[part] | {part}
    assert set(imported(path)) <= allowed


# Names


def test_all_is_sorted_and_complete():
    assert fs.__all__ == sorted(fs.__all__)
    assert len(set(fs.__all__)) == len(fs.__all__)
    visible = {name for name, value in vars(fs).items() if name[0] != "_" and not inspect.ismodule(value)}
    assert visible | {"planets", "plots", "profile", "sampling"} == set(fs.__all__)


def families(root):
    for one in root.__subclasses__():
        yield one
        yield from families(one)


@pytest.mark.parametrize("root", [Kernel, Primitive, Light, fs.FieldsimError, fs.FieldsimWarning])
def test_whole_families_are_public(root):
    # (What only others are made of, such as Compact, is no kernel.)
    made = [one for one in families(root) if not getattr(one, "abstract", False)]
    members = {one.__name__ for one in made if one.__module__.startswith("fieldsim.")}
    assert members <= set(fs.__all__)


@pytest.mark.parametrize("name", fs.__all__)
def test_public_names_are_documented(name):
    value = getattr(fs, name)
    text = inspect.getdoc(value) or ""
    assert text, name
    assert not text.startswith(f"{name}("), f"{name} has only dataclass's own docstring"


# Warp, launched


@wp.kernel(module="unique", enable_backward=False)
def _square(start: int, values: wp.array(dtype=float), squares: wp.array(dtype=float)):
    i = start + wp.tid()
    squares[i] = values[i] * values[i]


@pytest.mark.parametrize(("count", "threads"), [(0, None), (1, None), (511, 2), (512, 2), (5000, 3), (5000, 1)])
def test_a_launch_covers_every_item_once(count, threads):
    values = wp.array(np.arange(count, dtype=np.float32), device="cpu")
    squares = wp.full(count, np.nan, dtype=float, device="cpu")
    launch.launch(_square, count, [values], [squares], device="cpu", threads=threads)
    np.testing.assert_array_equal(squares.numpy(), np.arange(count, dtype=np.float32) ** 2)


def test_loads_are_timed_and_done_once():
    values = wp.zeros(1, dtype=float, device="cpu")
    launch.launch(_square, 1, [values], [values], device="cpu")
    before = launch.load_seconds()
    launch.launch(_square, 1, [values], [values], device="cpu")
    assert launch.load_seconds() == before > 0
    # For one block size only: a module loaded ahead for another would be compiled twice.
    assert len(_square.module.execs) == 1
    assert launch.loading_for() == 0.0


def test_warp_keeps_quiet(tmp_path, monkeypatch):
    """Neither its banner, nor its word on a missing driver, nor on a kernel compiled."""
    monkeypatch.setenv("WARP_CACHE_PATH", str(tmp_path))
    done = python("import fieldsim as fs; print(fs.Field(fs.Point((0, 0, 0)), fs.Gaussian()).value((0, 0, 0)))")
    assert (done.stdout, done.stderr) == ("1.0\n", "")
    assert any(tmp_path.iterdir()), "nothing was compiled"


def test_importing_without_standard_error_works():
    """A process started with standard error closed, as by some daemons."""
    script = "import os; os.close(2); import fieldsim; print('fine')"
    assert python(script).stdout == "fine\n"


def test_unknown_devices_name_those_there():
    with pytest.raises(fs.DeviceError, match=r"device 'tpu' is not available: .*; available: cpu"):
        launch.device_named("tpu")
    assert launch.device_named(None).alias == launch.device_named("cpu").alias == "cpu"


# The README and the scenarios


@pytest.mark.parametrize("name", ["film", "tests"])
def test_the_readmes_commands_are_where_ci_looks(name):
    found = re.search(rf"^<!-- {name} -->\n```sh\n(.+)\n```$", README, re.MULTILINE)
    assert found, f"no code block after <!-- {name} -->"
    assert found[1].startswith("python3 -m venv .venv && .venv/bin/pip install")


def promised(line):
    """(name, number or shape) that the comment of an assignment promises of its value; None where it promises none."""
    found = re.match(r"(\w+) = .*  # .*?(-?\d+\.\d+|\(\d+(?:, \d+)*\))", line)
    return found and (found[1], ast.literal_eval(found[2]))


def test_the_readmes_examples_run_and_give_what_their_comments_say(tmp_path, monkeypatch):
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert blocks
    monkeypatch.chdir(tmp_path)
    names, kept = {}, 0
    for block in blocks:
        exec(block, names)
        for name, value in filter(None, map(promised, block.splitlines())):
            kept += 1
            if isinstance(value, tuple):
                assert np.shape(names[name]) == value, name
            else:
                assert names[name] == pytest.approx(value, abs=0.5 * 10.0 ** -len(str(value).split(".")[1])), name
    assert kept >= 3
    # What they say in words.
    assert abs(np.trace(names["tide"])) < 1e-14 * np.linalg.norm(names["tide"])
    assert {"depth", "normal", "weights", "owner", "steps"} <= set(names["layers"])


def test_the_readmes_links_lead_somewhere():
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


@pytest.mark.parametrize("script", sorted((ROOT / "scenarios").glob("*.py")), ids=lambda path: path.stem)
def test_scenarios_stay_short_and_are_shown(script):
    assert len(script.read_text(encoding="utf-8").splitlines()) <= 60
    assert f"scenarios/{script.name}" in README


# The house's counts: limits that are reached stay

# What may be longer or have more branches: kernels of the tracer, of contact and of Radau, which one propagator and one
# tracer are to replace.
GIANTS = {
    "contact_kernel", "contact_step", "first_hit", "march_kernel", "packet_kernel", "radau", "radau_kernel", "recorder",
    "shade_kernel", "sweep", "trace_kernel",
}  # fmt: skip


@functools.cache
def counted(folder):
    return list(house_counts.sources(ROOT, folder))


@pytest.mark.parametrize("folder", ["fieldsim", "tests"])
def test_files_are_short(folder):
    assert not house_counts.long_files(folder, counted(folder)).places


@pytest.mark.parametrize(
    ("measure", "limit"),
    [(house_counts.length, house_counts.LONG_FUNCTION), (house_counts.mccabe, house_counts.COMPLEX)],
    ids=["lines", "branches"],
)
def test_functions_are_short_and_simple(measure, limit):
    places = house_counts.over("functions", counted("fieldsim"), measure, limit).places
    assert {place.split()[-1] for place in places} <= GIANTS


def test_no_undefined_name_is_silenced():
    assert not [place for place in house_counts.silenced(counted("fieldsim")).places if "F821" in place]


def test_nothing_imports_in_a_circle():
    graph = import_graph.graph_of({source.path: source.tree for source in counted("fieldsim")})
    assert not import_graph.circles(graph)
    assert not import_graph.circles(import_graph.parts_of(graph, "fieldsim"))


def test_the_counts_are_of_any_revision():
    """And of what they count: a class, a silenced line, a private name, near-duplicates."""
    lines = "".join(f"    total{k} = total{k} + first[{k}] * second\n" for k in range(6))
    text = f"def one(first, second: int):\n    x = row[3]  # noqa: F821\n{lines}\ndef two(a, b):\n{lines}"
    source = house_counts.Source("fieldsim/one.py", text, ast.parse(text))
    test = "from fieldsim.one import two\n\ntwo._own\nself._own = 1\n"
    other = house_counts.Source("tests/test_one.py", test, ast.parse(test))
    assert house_counts.literal_columns([source]).value == "1"
    assert house_counts.silenced([source]).value == "1, 1"
    assert house_counts.annotated("", [("", node) for node in source.functions()]).value == "25 % of 4"
    assert house_counts.private_accesses([other], [other]).value == "1"
    ((length, where),) = near_duplicates.near_duplicates({source.path: text})
    assert (length, where) == (6, "fieldsim/one.py:3 ~ fieldsim/one.py:11")
