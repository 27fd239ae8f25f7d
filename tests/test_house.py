"""The house itself: what importing costs, what is public, who may import whom, what the README promises."""

import ast
import inspect
import pathlib
import re
import subprocess
import sys

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
    "mujoco": {"potentials", "world", "sources", "dynamics", "render", "scenario"},
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


def test_the_readmes_examples_run(tmp_path, monkeypatch):
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert blocks
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks:
        exec(block, names)


def test_the_readmes_links_lead_somewhere():
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


@pytest.mark.parametrize("script", sorted((ROOT / "scenarios").glob("*.py")), ids=lambda path: path.stem)
def test_scenarios_stay_short_and_are_shown(script):
    assert len(script.read_text(encoding="utf-8").splitlines()) <= 60
    assert f"scenarios/{script.name}" in README
