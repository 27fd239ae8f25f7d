"""Scenarios: a world, a camera and a time span; and the scripts that build them."""

import ast
import contextlib
import contextvars
import dataclasses
import difflib
import functools
import inspect
import linecache
import os
import pathlib
import re
import sys
import traceback
import types
import typing
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, runtime_checkable

from fieldsim import validate
from fieldsim.dynamics.auto import Choice, IntegratorLike, integrator_of
from fieldsim.dynamics.diagnostics.energy_log import EnergyLog, EnergyReport, History
from fieldsim.dynamics.integrators.splittings import Integrator, Leapfrog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import FieldsimError, ScenarioError
from fieldsim.plots import DriftLog, Picture
from fieldsim.render.camera import Camera
from fieldsim.types import PathLike, RealLike
from fieldsim.world.run import Run
from fieldsim.world.world import World

FOLDER = pathlib.Path("scenarios")
DEFAULT_INTEGRATOR = Leapfrog()


class RunLog(DriftLog, Protocol):
    """Follows how well a run keeps its energy and other invariants: an `EnergyLog`, or a MuJoCo experiment's."""

    @property
    def history(self) -> History:
        """Drifts of the particles at the moments recorded so far."""
        ...

    def record(self) -> None:
        """Take the present moment into account."""
        ...

    def report(self) -> EnergyReport:
        """The drift over all moments recorded so far."""
        ...


@runtime_checkable
class ScenarioRun(Run, Protocol):
    """A run that a scenario begins: it computes, and counts what it took, for the report on a film.

    integrator: what moves things, by its text; choice: what `Auto` chose, or None.
    """

    @property
    def integrator(self) -> object:
        """What moves things, by its text."""
        ...

    @property
    def choice(self) -> Choice | None:
        """What `Auto` has chosen."""
        ...

    @property
    def steps_done(self) -> int:
        """Steps of all particles, or of the model, so far."""
        ...

    @property
    def bounces(self) -> int:
        """Contacts of particles so far."""
        ...


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scenario:
    """What a film shows.

    world: what there is; camera: who looks; duration: length in seconds, of the film and of the world's time;
    fps: frames per second; title: for the report, else the script's name.
    integrator: how particles and free bodies move: None for `Leapfrog()`, a splitting with its step such as
    `BlanesMoan6(0.05)`, `Radau()`, or "auto" for `Auto()`, which chooses; docs/motion.md says which when.
    name, parameters: of the script that built it and of its `build`, for recordings; the command fills them in.
    """

    world: World = dataclasses.field(kw_only=False)
    camera: Camera = dataclasses.field(kw_only=False)
    duration: float
    fps: float = 30.0
    integrator: Integrator = DEFAULT_INTEGRATOR
    title: str = ""
    name: str = ""
    parameters: dict[str, Any] = dataclasses.field(default_factory=dict)

    if TYPE_CHECKING:

        def __init__(
            self,
            world: World,
            camera: Camera,
            *,
            duration: RealLike,
            fps: RealLike = ...,
            integrator: IntegratorLike | None = ...,
            title: str = ...,
            name: str = ...,
            parameters: dict[str, Any] = ...,
        ) -> None: ...

    def __post_init__(self):
        validate.fields(self, validate.instance, "world", kinds=World, remedy="give a fs.World")
        validate.fields(self, validate.instance, "camera", kinds=Camera, remedy="give a fs.Camera")
        validate.fields(self, validate.text, "title", "name")
        object.__setattr__(self, "integrator", integrator_of("Scenario", self.integrator))
        validate.fields(self, validate.number, "duration", "fps", above=0.0)
        validate.instance("Scenario", "parameters", self.parameters, dict, "give a dict")

    @property
    def shown(self) -> World:
        """The world that its snapshots are of."""
        return self.world

    def begin(self, device: str | None = None) -> tuple[ScenarioRun, RunLog] | tuple[None, None]:
        """A run from the start, with `advance(time)` and `snapshot()`, and the log of its energy.

        None and None where nothing is moved by forces: `shown.at(time)` then knows every moment.
        """
        if not any(map(len, self.world.particles)) and not any(body.free for body in self.world.bodies):
            return None, None
        simulation = Simulation(self.world, self.integrator, device=device)
        return simulation, EnergyLog(simulation)


# A script's function `build`, of its own parameters.
Build: TypeAlias = Callable[..., Scenario | Picture]


@dataclasses.dataclass(frozen=True)
class Parameter:
    """One parameter of a scenario's `build`. kind: int, float, str, bool, or a tuple of the strings to choose from."""

    name: str
    kind: type | tuple[str, ...]
    default: object
    help: str

    @property
    def required(self) -> bool:
        """Whether `build` gives no default."""
        return self.default is inspect.Parameter.empty


def find(name: str) -> pathlib.Path:
    """The script of a scenario given by its path, or by its bare name in the folder `scenarios`."""
    path = pathlib.Path(name)
    if os.path.isfile(path):
        return path
    if path.name == name and os.path.isfile(FOLDER / f"{name}.py"):
        return FOLDER / f"{name}.py"
    known = {script.stem: str(script) for script in available()}
    near = difflib.get_close_matches(path.stem, known, n=3, cutoff=0.5)
    if near:
        advice = "did you mean " + " or ".join(near) + "?"
    elif known:
        advice = f"in {FOLDER}/ there are " + ", ".join(known)
    else:
        advice = f"give the path of a script, or a name in the folder {FOLDER}/ (there is none here)"
    raise ScenarioError(f"no scenario {name!r}; {advice}")


def available() -> list[pathlib.Path]:
    """The scripts in the folder `scenarios` of the present directory."""
    return sorted(FOLDER.glob("[!_]*.py"))


def summary(path: PathLike) -> str:
    """First line of a script's docstring, without running it."""
    try:
        text = ast.get_docstring(ast.parse(pathlib.Path(path).read_text(encoding="utf-8")))
    except (OSError, SyntaxError, ValueError):
        return ""
    return (text or "").partition("\n")[0]


def load(name: PathLike) -> Build:
    """The function `build` of the scenario script with this path or bare name.

    Raises ScenarioError when there is none, or the script fails.
    """
    path = find(str(validate.path("load", "name", name)))
    module = types.ModuleType(f"scenario_{path.stem}")
    module.__file__ = os.path.abspath(path)  # as Python says it: scripts may go to other folders
    try:
        code = compile(path.read_bytes(), str(path), "exec")
    except SyntaxError as error:
        where = f"{path}:{error.lineno}" if error.lineno else path
        raise ScenarioError(f"{where}: syntax error: {error.msg}") from error
    except (OSError, ValueError, RecursionError, MemoryError) as error:
        raise ScenarioError(f"{path} cannot be read as Python: {error}") from error
    # As `python script.py` does, so that a script finds its neighbours; under its name, as dataclasses need.
    if str(path.parent.resolve()) not in sys.path:
        sys.path.insert(0, str(path.parent.resolve()))
    sys.modules[module.__name__] = module
    with _told(path), _loading():
        exec(code, module.__dict__)
    build = getattr(module, "build", None)
    if not callable(build):
        raise ScenarioError(f"{path} defines no function build; a scenario needs `def build(...) -> fs.Scenario`")
    return build


_under_load = contextvars.ContextVar("under_load", default=False)


@contextlib.contextmanager
def _loading():
    token = _under_load.set(True)
    try:
        yield
    finally:
        _under_load.reset(token)


def being_loaded() -> bool:
    """Whether a script is being loaded: a `fs.main(build)` without `if __name__ == "__main__"` then does nothing."""
    return _under_load.get()


def call(build: Build, values: dict) -> Scenario | Picture:
    """`build(**values)`; raises ScenarioError, naming the line of the script, when it fails or gives something else."""
    path = source_of(build)
    with _told(path):
        scenario = build(**values)
    if not isinstance(scenario, Scenario | Picture):
        if inspect.iscoroutine(scenario):
            scenario.close()
        raise ScenarioError(
            f"{_short(path)}: build returned {validate.shown(scenario)}; return a fs.Scenario or a fs.Picture"
        )
    if isinstance(scenario, Scenario) and not scenario.name:
        object.__setattr__(scenario, "name", path.stem)
        object.__setattr__(scenario, "parameters", _defaults(build) | values)
    return scenario


def _defaults(build):
    return {p.name: p.default for p in parameters(build) if not p.required}


def source_of(build: Build) -> pathlib.Path:
    """The script that defines `build`."""
    try:
        file = inspect.getsourcefile(_function_of(build))
    except TypeError:  # made in no file
        file = None
    return pathlib.Path(file or "scenario.py")


def _function_of(build):
    """The function behind a `functools.partial`, an object that can be called, or a class."""
    while isinstance(build, functools.partial):
        build = build.func
    if inspect.isclass(build):
        return build
    return build if inspect.isroutine(build) else type(build).__call__


@contextlib.contextmanager
def _told(path):
    """Turn what a script raises into one message with the script's line, and stay in the folder where we are."""
    try:
        with here():
            yield
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        frames = [f for f in traceback.extract_tb(error.__traceback__) if _same(f.filename, path)]
        where = f"{_short(path)}:{frames[-1].lineno} in {frames[-1].name}" if frames else _short(path)
        line = f"\n    {linecache.getline(frames[-1].filename, frames[-1].lineno or 0).strip()}" if frames else ""
        raise ScenarioError(f"{where.removesuffix(' in <module>')}: {_words(error)}{line}") from error


@contextlib.contextmanager
def here():
    """Come back to the working folder: the names that a user gave are of there, wherever a script goes to."""
    try:
        folder = os.getcwd()
    except OSError:  # it is gone
        yield
        return
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            os.chdir(folder)


def _words(error):
    """What an error says, in a few lines at most."""
    if isinstance(error, SystemExit):
        return f"the script ended itself, by sys.exit({validate.shown(error.code)}), before there was a film"
    try:
        text = str(error)
    except Exception:
        text = "an error without words"
    text = text if len(text) <= 500 else f"{text[:500]} ..."
    return text if isinstance(error, FieldsimError) else f"{type(error).__name__}: {text}"


def _same(one, other):
    return pathlib.Path(one).resolve() == pathlib.Path(other).resolve()


def _short(path):
    """The path as seen from here, where that is shorter."""
    with contextlib.suppress(ValueError):
        return str(pathlib.Path(path).resolve().relative_to(pathlib.Path.cwd()))
    return str(path)


def parameters(build: Build) -> list[Parameter]:
    """What `build` takes: its signature, with help from lines `name: text` in its docstring or its script's.

    Raises ScenarioError for a parameter whose type is none of int, float, str, bool or a Literal of strings.
    """
    try:
        signature = inspect.signature(build, eval_str=True)
    except Exception as error:  # annotations are code of the script's
        raise ScenarioError(f"the signature of build cannot be read: {_words(error)}") from error
    text = "\n".join(_docstrings(build))
    return [
        Parameter(p.name, _kind(p), p.default, _help(text, p.name))
        for p in signature.parameters.values()
        if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)
    ]


def description(build: Build) -> str:
    """The text of a scenario without its lines on parameters."""
    text = next(iter(_docstrings(build)), "")
    for parameter in parameters(build):
        text = _help_pattern(parameter.name).sub("", text)
    return text.strip()


def _docstrings(build):
    function = _function_of(build)
    script = getattr(function, "__globals__", {}).get("__doc__")
    return [inspect.cleandoc(text) for text in (function.__doc__, script) if isinstance(text, str) and text]


def _help_pattern(name):
    """A line `name: text` and the indented lines that go on from it."""
    return re.compile(rf"^{name}: *(.*(?:\n[ \t]+\S.*)*)\n?", re.MULTILINE)


def _help(text, name):
    found = _help_pattern(name).search(text)
    return " ".join(found[1].split()) if found else ""


def _kind(parameter):
    """Type of a parameter, from its annotation or else its default."""
    kind = parameter.annotation
    if kind is parameter.empty:
        kind = str if parameter.default in (parameter.empty, None) else type(parameter.default)
    options = [k for k in typing.get_args(kind) if k is not types.NoneType]
    if typing.get_origin(kind) in (typing.Union, types.UnionType) and len(options) == 1:
        kind = options[0]
    if typing.get_origin(kind) is typing.Literal and all(isinstance(option, str) for option in typing.get_args(kind)):
        return typing.get_args(kind)
    if kind not in (int, float, str, bool) or parameter.kind is parameter.POSITIONAL_ONLY:
        raise ScenarioError(
            f"build: parameter {parameter.name!r} cannot be an option; "
            "annotate it as int, float, str, bool or a Literal of strings, and let it be given by name"
        )
    return kind
