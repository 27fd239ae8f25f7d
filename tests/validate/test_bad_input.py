"""What users give wrongly is refused at the gate: every public callable, every parameter, some fifty bad values each.

`CALLS` holds one right call of every public callable, with a value for every parameter; the test puts each bad value in
the place of each. Right is a FieldsimError, or success where the value is one that the parameter may have (`means`).
"""

import inspect
import itertools
import shutil
import types
import warnings

import calls_of_fields
import calls_of_runs
import calls_of_world
import pytest
from bad_values import BAD, Hostile, means
from right_values import BASES, OPEN, Or, folder

import fieldsim as fs
from fieldsim import validate
from fieldsim.potentials.kernels import Kernel
from fieldsim.potentials.primitives.base import Primitive

CALLS = {**calls_of_fields.CALLS, **calls_of_world.CALLS, **calls_of_runs.CALLS}

# Made by fieldsim as results, not by users.
RESULTS = {"Choice", "Crossings", "Drift", "Energy", "EnergyReport", "Lyapunov", "Report", "Status"}

# For fieldsim itself: rows of tables, and what a run and its log tell each other.
OWN = {"pack", "account", "measured", "manoeuvred"}

# What kernels and primitives declare for the package: functions of packed numbers.
TRAITS = {name for root in (Kernel, Primitive) for name in vars(root) if not name.startswith("_")}
TRAITS -= {"at", "turns_about"}  # which users call
TRAITS |= {"coefficients", "softening_of"}  # of families of kernels

# Methods with special names that take what users give.
OPERATORS = {"__call__", "__add__", "__sub__", "__mul__", "__matmul__"}


@pytest.fixture(scope="module", autouse=True)
def _nothing_left():
    yield
    OPEN.close()
    shutil.rmtree(folder())


# What messages call what was called, where it is something else.
ALIASES = {
    "Body.surface_mesh": ("mesh",),
    "Snapshot.surface_mesh": ("mesh",),
    "World.replace": ("World",),
    "Primitive.at": ("Point",),
    "Recorded": ("recording",),
    "ShapeGroup": ("World.add_shape",),
    "ShapeGroup.poses_at": ("World.add_shape",),
    "Simulation.advance": ("Leapfrog",),
    "Splitting.steps": ("Leapfrog",),
    "World.add_particles": ("Particles",),
    "film": ("Film", "Recording", "recording"),
    "gravity": ("skeleton",),
    "load": ("scenario",),
    "lyapunov": ("Leapfrog",),
    "mesh": ("TriangleMesh",),
    "poincare": ("Leapfrog",),
}
NAMES = {"primitives": "skeleton", "path_or_vertices": "vertices", "x": "shape"}


def _public():
    """Every public callable: its name in `CALLS`, and itself."""
    for name in fs.__all__:
        thing = getattr(fs, name)
        if isinstance(thing, types.ModuleType):
            functions = {n: f for n, f in vars(thing).items() if not n.startswith("_") and inspect.isfunction(f)}
            yield from ((f"{name}.{n}", f) for n, f in functions.items() if f.__module__ == thing.__name__)
        elif not isinstance(thing, type):
            yield name, thing
        elif not issubclass(thing, BaseException):
            if name not in RESULTS | BASES:
                yield name, thing
            yield from _methods(thing)


def _methods(kind):
    for owner in kind.__mro__:
        if owner.__module__.startswith("fieldsim"):
            for name, raw in vars(owner).items():
                public = name in OPERATORS or not name.startswith("_")
                inner = name in OWN or (issubclass(kind, Kernel | Primitive) and name in TRAITS)
                if public and not inner and isinstance(raw, types.FunctionType | classmethod | staticmethod):
                    yield f"{owner.__name__}.{name}", getattr(kind, name)


def test_every_public_callable_and_parameter_is_tried():
    public = dict(_public())
    aliases = {"profile.profiled", "plots.checked_path"}
    assert set(public) - aliases == set(CALLS)
    for name, (_make, arguments) in CALLS.items():
        taken = set(inspect.signature(public[name]).parameters) - {"self", "options", "changes", "cls"}
        assert taken <= set(arguments), name


def test_every_public_callable_says_what_it_returns():
    silent = [
        name
        for name, function in _public()
        if not isinstance(function, type) and inspect.signature(function).return_annotation is inspect.Signature.empty
    ]
    assert not silent


def _first(right):
    return right.first if isinstance(right, Or) else right


def _flaw(said, callable_name, name, bad):
    """What a message lacks: the object as the user called it, what is wrong by its name or value, a remedy."""
    owners = {callable_name, *callable_name.split("."), *ALIASES.get(callable_name, ()), "device"}
    if not any(owner in said for owner in owners):
        return f"names no {callable_name}: {said}"
    if (
        NAMES.get(name, name) not in said
        and name not in said
        and validate.shown(bad) not in said
        and (isinstance(bad, Hostile) or str(bad) not in said)
    ):
        return f"names neither {name} nor its value: {said}"
    return "" if "; " in said else f"no remedy: {said}"


def _outcome(callable_name, function, arguments, name, label):
    """What a call with one bad value did: "" where that is right."""
    right, bad = arguments[name], BAD[label]
    default = inspect.signature(function).parameters.get(name)
    allowed = means(bad, right) or (bad is None and default is not None and default.default is None)
    given = {key: _first(value) for key, value in arguments.items()} | {name: bad}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", fs.FieldsimWarning)
            function(**given)
    except fs.FieldsimError as error:
        return "" if allowed else _flaw(str(error), callable_name, name, bad)
    except SystemExit:
        return "" if allowed and name in ("build", "argv") else "left the process"
    except BaseException as error:
        return f"{type(error).__name__}: {error}"
    return "" if allowed else "was taken"


@pytest.mark.parametrize("callable_name", CALLS)
def test_bad_values_are_refused(callable_name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make, arguments = CALLS[callable_name]
    wrong = {}
    for name, label in itertools.product(arguments, BAD):
        outcome = _outcome(callable_name, make(), arguments, name, label)
        if outcome:
            wrong[name, label] = outcome
    assert not wrong, "\n".join(f"{name} = {label}: {outcome}" for (name, label), outcome in wrong.items())
