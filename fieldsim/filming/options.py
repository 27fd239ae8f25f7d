"""Options of a film, and the plan that follows from them: every default filled in, every refusal made."""

import dataclasses
import os
from collections.abc import Callable

import numpy as np

from fieldsim import validate
from fieldsim.dynamics.auto import integrator_of
from fieldsim.dynamics.integrators.splittings import Integrator
from fieldsim.errors import InputError
from fieldsim.launch import device_named
from fieldsim.recording.recording import Recorded
from fieldsim.render.layers import LAYERS
from fieldsim.render.output.video import Film
from fieldsim.render.renderer import QUALITIES
from fieldsim.render.solids.skeleton import MODES
from fieldsim.scenario import Scenario
from fieldsim.world.motion import timeline

SIZE = (640, 360)
HALF_SIZE = (320, 180)
PREVIEW_FPS = 10.0

# How each option is checked where it is given.
_CHECKS = {
    "fps": (validate.number, {"above": 0.0}),
    "duration": (validate.number, {"above": 0.0}),
    "quality": (validate.choice, {"choices": QUALITIES}),
    "record": (validate.path, {}),
    "replay": (validate.path, {}),
    "mode": (validate.choice, {"choices": MODES}),
    "layer": (validate.choice, {"choices": LAYERS}),
    "beside": (validate.function, {}),
    "watch": (validate.function, {}),
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """Options of `film` besides a scenario and a path, checked; None stands for the default.

    The meanings are those of `film`'s arguments of the same names.
    """

    integrator: Integrator | str | None = None
    size: tuple[int, int] | None = None
    fps: float | None = None
    duration: float | None = None
    device: str | None = None
    quality: str | None = None
    preview: bool = False
    record: str | os.PathLike | None = None
    replay: str | os.PathLike | None = None
    mode: str | None = None
    layer: str | None = None
    beside: Callable | None = None
    watch: Callable[[int, int], object] | None = None

    def __post_init__(self):
        checked: dict[str, object] = {"preview": validate.flag("film", "preview", self.preview)}
        for name, (check, limits) in _CHECKS.items():
            checked[name] = validate.optional(check, "film", name, getattr(self, name), **limits)
        if self.size is not None:
            checked["size"] = validate.size("film", self.size)
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        if self.record and self.replay and os.path.realpath(self.record) == os.path.realpath(self.replay):
            raise InputError(f"film: record and replay are one file, {os.fspath(self.replay)!r}; give two names")


@dataclasses.dataclass(frozen=True, kw_only=True)
class FilmPlan:
    """A film that can be made.

    scenario: with the integrator of the options; options: as given; recorded: the run that is replayed;
    times: of the frames that are simulated; size: (width, height) of the scenario's picture, frame: of the film's;
    still: whether only the last frame is drawn; warnings: words on what the user may not expect.
    """

    scenario: Scenario
    out: str | os.PathLike
    options: FilmOptions
    recorded: Recorded | None
    times: list[float]
    fps: float
    size: tuple[int, int]
    frame: tuple[int, int]
    quality: str
    still: bool
    warnings: tuple[str, ...]


def plan_of(scenario: Scenario, out, options: FilmOptions) -> FilmPlan:
    """The plan of a film of `scenario` into the path `out`.

    Raises InputError or DeviceError, before any work, for what cannot be.
    """
    recorded = Recorded(options.replay) if options.replay else None
    words = _differences(recorded, scenario, options) if recorded else []
    if options.integrator is not None:
        scenario = dataclasses.replace(scenario, integrator=integrator_of("film", options.integrator))
    fps = _rate(scenario, recorded, options)
    width, height = size = options.size or (HALF_SIZE if options.preview else SIZE)
    frame = (2 * width if options.beside else width), height
    still = Film(out, frame, fps).still
    times = _times(scenario, recorded, options.duration, fps)
    device_named(options.device)
    if _shows_nothing(scenario.shown):
        words.append(
            "nothing to see: no body has a surface, and there are no particles; give a body a surface=fs.Material()"
        )
    return FilmPlan(
        scenario=scenario,
        out=out,
        options=options,
        recorded=recorded,
        times=times[-1:] if still and not options.record else times,
        fps=fps,
        size=size,
        frame=frame,
        quality=options.quality or ("draft" if options.preview else "final"),
        still=still,
        warnings=tuple(words),
    )


def _rate(scenario, recorded, options):
    """Frames per second."""
    if options.fps is not None:
        return options.fps
    if recorded:
        return recorded.fps
    return min(PREVIEW_FPS, scenario.fps) if options.preview else scenario.fps


def _times(scenario, recorded, duration, fps):
    """The times of the frames: the recorded ones, or those of a timeline."""
    if not recorded:
        return timeline(scenario.duration if duration is None else duration, fps)
    times = recorded.times[recorded.times < (np.inf if duration is None else duration)].tolist()
    if not times:
        begin = recorded.times[0]
        raise InputError(f"film: duration is {duration:g}, the recording begins at time {begin:g}; give more")
    return times


def _differences(recorded, scenario, options):
    """Words on how a recorded run differs from the scenario's, and on the options that cannot change it."""
    words = recorded.differences(scenario)
    integrator, duration = options.integrator, options.duration
    if integrator is not None and str(integrator_of("film", integrator)) != recorded.about.get("integrator"):
        words.append(f"integrator {integrator} has no effect")
    if duration is not None and duration > recorded.times[-1] + 1.5 / recorded.fps:
        words.append(f"it ends at time {recorded.times[-1]:g}, before duration {duration:g}")
    if not words:
        return []
    return [f"{os.fspath(options.replay)!r} is replayed, and what moves is as recorded: {'; '.join(words)}"]


def _shows_nothing(world):
    return not world.particles and not world.shapes and all(body.surface is None for body in world.bodies)
