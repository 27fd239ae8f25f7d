"""Types: what users may give is declared, all of it, and what is declared is so."""

import ast
import dataclasses
import enum
import functools
import inspect
import pathlib
import re

import pytest

import fieldsim as fs
import fieldsim.mujoco
from fieldsim.dynamics.integrators.propagator import Propagator, StepTables
from fieldsim.mujoco.experiment import Run as ExperimentRun
from fieldsim.portable import Portable
from fieldsim.render.output.formats import Writer, format_of
from fieldsim.render.solvers.by_name import SOLVERS
from fieldsim.render.solvers.protocol import PrimarySolver
from fieldsim.scenario import ScenarioRun
from fieldsim.world.run import Run

PACKAGE = pathlib.Path(fs.__file__).parent
# Operators and the like that users call; other names with underscores are Python's or nobody's.
CALLED = {"__init__", "__call__", "__enter__", "__exit__", "__len__", "__add__", "__radd__", "__sub__", "__rsub__"}
CALLED |= {"__mul__", "__neg__", "__matmul__"}


def own(thing):
    return getattr(thing, "__module__", "").startswith("fieldsim")


def plain(member):
    """The function behind a method, property or wrapped function, or None."""
    if isinstance(member, Portable):
        return None
    member = getattr(member, "__func__", getattr(member, "fget", getattr(member, "func", member)))
    member = inspect.unwrap(member) if callable(member) else member
    return member if inspect.isfunction(member) and own(member) else None


def reachable(module):
    """Functions, methods and constructors that `__all__` of a module leads to, by their names."""
    names = getattr(module, "__all__", None) or [
        n for n, v in vars(module).items() if n[0] != "_" and own(v) and v.__module__ == module.__name__
    ]
    for name in names:
        thing = getattr(module, name)
        if inspect.ismodule(thing):
            yield from reachable(thing)
        elif inspect.isclass(thing) and not issubclass(thing, enum.Enum):
            for key in dir(thing):
                if key[0] != "_" or key in CALLED:
                    yield f"{name}.{key}", plain(inspect.getattr_static(thing, key))
        else:
            yield name, plain(thing)


FUNCTIONS = {function: name for m in (fs, fieldsim.mujoco) for name, function in reachable(m) if function}
EXPORTED = [getattr(m, name) for m in (fs, fieldsim.mujoco) for name in m.__all__]
DATA = sorted({c for c in EXPORTED if inspect.isclass(c) and dataclasses.is_dataclass(c)}, key=lambda c: c.__name__)


def test_every_argument_and_return_of_the_public_api_has_a_type():
    bare = []
    for function, name in FUNCTIONS.items():
        signature = inspect.signature(function)
        first = next(iter(signature.parameters), None)
        bare += [
            f"{name}({p.name})"
            for p in signature.parameters.values()
            if p.annotation is p.empty and not (p.name == first and p.name in ("self", "cls"))
        ]
        if signature.return_annotation is signature.empty and function.__name__ != "__init__":
            bare.append(f"{name} -> ?")
    assert not bare
    assert len(FUNCTIONS) > 300


@pytest.mark.parametrize("cls", DATA, ids=lambda cls: cls.__name__)
def test_no_field_is_of_any_type(cls):
    assert not [f.name for f in dataclasses.fields(cls) if str(f.type) in ("<class 'object'>", "typing.Any", "object")]


def declared(cls):
    """The constructor that a class declares beside its fields, for type checkers, or None."""
    source = ast.parse(pathlib.Path(inspect.getsourcefile(cls)).read_text(encoding="utf-8"))
    body = next(n.body for n in source.body if isinstance(n, ast.ClassDef) and n.name == cls.__name__)
    for node in body:
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            return next((n for n in node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__"), None)
    return None


@pytest.mark.parametrize("cls", [c for c in DATA if declared(c)], ids=lambda cls: cls.__name__)
def test_declared_constructors_are_the_dataclasses_own(cls):
    arguments = declared(cls).args
    names = [a.arg for a in arguments.args[1:]] + [a.arg for a in arguments.kwonlyargs]
    optional = {a.arg for a in arguments.args[len(arguments.args) - len(arguments.defaults) :]}
    optional |= {a.arg for a, d in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True) if d is not None}
    made = list(inspect.signature(cls.__init__).parameters.values())[1:]
    assert names == [p.name for p in made]
    assert optional == {p.name for p in made if p.default is not p.empty}
    assert [a.arg for a in arguments.kwonlyargs] == [p.name for p in made if p.kind is p.KEYWORD_ONLY]


def test_suppressions_are_few_and_name_their_rules():
    found = [
        line
        for path in [*PACKAGE.rglob("*.py"), pathlib.Path(__file__).with_name("typed_user.py")]
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(r"#\s*(type|pyrefly|pyright)\s*:\s*ignore", line)
    ]
    assert len(found) < 40
    assert all(re.search(r"# pyrefly: ignore\[[a-z-]+\]", line) for line in found)


# Declared interfaces


@functools.cache
def falling():
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian()))
    world.add_particles([(1.0, 0.0, 0.0)], [(0.0, 1.0, 0.0)])
    return world


def recorded(path):
    with fs.Recording(path) as recording:
        for snapshot in fs.Simulation(falling()).snapshots([0.0, 0.1, 0.2]):
            recording.add(snapshot)
    return fs.Recorded(path).replay(falling())


def experiment():
    camera = fs.Camera((3, 0, 0))
    body = "<body pos='1 0 0'><freejoint/><geom size='.1'/></body>"
    model = f"<mujoco><option gravity='0 0 0'/><worldbody>{body}</worldbody></mujoco>"
    return fs.mujoco.Experiment(falling(), camera, duration=1, model=model).begin()[0]


def test_whatever_runs_is_a_run(tmp_path):
    runs = [fs.Simulation(falling()), experiment(), recorded(tmp_path / "run.npz")]
    for run in runs:
        assert isinstance(run, Run)
        run.advance(0.1)
        assert run.time == run.snapshot().time == 0.1
    assert all(isinstance(run, ScenarioRun) for run in runs[:2])
    assert isinstance(runs[1], ExperimentRun)


def test_a_replay_does_not_go_back(tmp_path):
    replay = recorded(tmp_path / "run.npz")
    replay.advance(0.2)
    with pytest.raises(fs.InputError, match=r"until is 0\.1, before the present time 0\.2"):
        replay.advance(0.1)


@pytest.mark.parametrize("method", fs.Splitting.__subclasses__(), ids=lambda method: method.__name__)
def test_every_splitting_has_the_tables_of_a_step(method):
    assert isinstance(method(), StepTables)


def test_radau_flies_by_itself():
    assert isinstance(fs.Simulation(falling(), fs.Radau()).radau, Propagator)


@pytest.mark.parametrize("ending", ["a.mp4", "a.gif", "a.png", "frames/"])
def test_every_format_of_films_has_a_writer(ending, tmp_path):
    format = format_of(str(tmp_path / ending) + ("/" if ending.endswith("/") else ""))
    wanted = {name for name in vars(Writer) if name[0] != "_"}
    assert wanted == {"check", "write", "finish", "publish", "keep", "abandon"}
    assert all(callable(getattr(format, name)) for name in wanted)


@pytest.mark.parametrize("name", SOLVERS)
def test_every_solver_is_one(name):
    solver: PrimarySolver = SOLVERS[name]
    assert isinstance(solver, PrimarySolver)
    assert solver.name == name
