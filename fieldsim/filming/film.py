"""From a scenario to a film: simulate, render, write, frame by frame; and the report on it."""

import contextlib
import dataclasses
import functools
import os
import time
import warnings

import numpy as np

from fieldsim import interrupts, launch, validate
from fieldsim.dynamics.auto import integrator_of
from fieldsim.dynamics.diagnostics.energy_log import EnergyLog, EnergyReport
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.launch import device_named
from fieldsim.recording.recording import Recorded, Recording, about_run
from fieldsim.render.layers import LAYERS, LayerPictures
from fieldsim.render.output.video import Film
from fieldsim.render.renderer import QUALITIES, Renderer
from fieldsim.render.solids.skeleton import MODES
from fieldsim.scenario import Scenario
from fieldsim.world.motion import timeline

SIZE = (640, 360)

# What `film` may be given, or None, and how it is checked.
CHECKS = {
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

# A load of kernels that takes longer than this compiles them.
COMPILING = 2.0


@dataclasses.dataclass
class Clock:
    """Seconds of work, without those spent compiling kernels."""

    seconds: float = 0.0
    compiling: float = 0.0

    @contextlib.contextmanager
    def running(self):
        """Time a block."""
        start, loaded = time.perf_counter(), launch.load_seconds()
        try:
            yield
        finally:
            compiling = launch.load_seconds() - loaded
            self.compiling += compiling
            self.seconds += time.perf_counter() - start - compiling


@dataclasses.dataclass
class Report:
    """What making a film took. Times in seconds of wall time.

    energy, log: how well energy was kept; None in a world where the dynamics move nothing. counted: what was done in
    particle_steps; compiled: why it took what `compiling` says.
    """

    path: str
    size: tuple[int, int]
    frames: int = 0
    seconds: float = 0.0
    simulating: Clock = dataclasses.field(default_factory=Clock)
    rendering: Clock = dataclasses.field(default_factory=Clock)
    writing: Clock = dataclasses.field(default_factory=Clock)
    particle_steps: int = 0
    bounces: int = 0
    rays: int = 0
    energy: EnergyReport | None = None
    log: EnergyLog | None = None
    integrator: str = ""
    counted: str = "particle-steps"
    compiled: str = "first run only"

    @property
    def compiling(self) -> float:
        """Seconds that went into loading kernels: a few the first time, next to none later."""
        return self.simulating.compiling + self.rendering.compiling

    def __str__(self):
        width, height = self.size
        many = "1 frame" if self.frames == 1 else f"{self.frames} frames"
        speed = self.frames / self.seconds
        lines = [f"{self.path}: {many} of {width}x{height} in {self.seconds:.1f} s ({speed:.1f} frames/s)"]
        if self.particle_steps:
            bounces = f", {self.bounces} bounces" if self.bounces else ""
            steps = (
                f"{_short(self.particle_steps / self.simulating.seconds)} {self.counted}/s{bounces}, {self.integrator}"
            )
            lines.append(f"  simulating {self.simulating.seconds:6.1f} s  {steps}")
        rays = _short(self.rays / self.rendering.seconds)
        lines.append(f"  rendering  {self.rendering.seconds:6.1f} s  {rays} rays/s")
        if self.compiling > COMPILING:
            lines.append(f"  compiling  {self.compiling:6.1f} s  {self.compiled}")
        if self.energy is not None:
            lines.append(f"  {self.energy}")
        return "\n".join(lines)


def _short(number):
    """Three digits and a unit: 12.3 million."""
    for unit, name in ((1e9, " billion"), (1e6, " million"), (1e3, " thousand")):
        if number >= unit:
            return f"{number / unit:.3g}{name}"
    return f"{number:.3g}"


@interrupts.obeyed()
def film(
    scenario: Scenario,
    out,
    *,
    integrator=None,
    size=None,
    fps: float | None = None,
    duration: float | None = None,
    device: str | None = None,
    quality: str | None = None,
    preview: bool = False,
    record=None,
    replay=None,
    mode: str | None = None,
    layer: str | None = None,
    beside=None,
    watch=None,
) -> Report:
    """Film `scenario` into `out` (see `Film` for what its ending means) and say what it took.

    size: (width, height), 640x360 unless told; fps, duration, integrator: the scenario's unless told.
    quality: "draft" or "final". mode: how bodies are drawn, "soft" unless told, see `Renderer`; layer: instead of
    colours, "depth", "normal", "weights" or "steps".
    preview: a quick look: half the width and height, draft quality, 10 frames per second, where nothing else is told.
    A camera's shutter takes more of them while it is open; a replay and a layer are sharp.
    record: path of a `Recording` to keep of the snapshots; replay: path of one to film instead of simulating, at its
    own times and as far as it goes unless duration ends before, with another camera or size, say. A warning names the
    parameters that are not those of its run, and what has no effect on what moves.
    beside: a function of the size that gives what else draws every frame: its `frame(snapshot, camera)` stands to the
    right, and the film is twice as wide.
    watch: called with (frames done, frames in all) as the work goes on. A path that ends in .png gets the last frame.
    A film that fails or is interrupted under way keeps the frames and snapshots so far, beside what was there before
    (see `Film` and `Recording`), and the error says where.
    """
    validate.instance("film", "scenario", scenario, Scenario, "give a fs.Scenario")
    preview = validate.flag("film", "preview", preview)
    given = (fps, duration, quality, record, replay, mode, layer, beside, watch)
    fps, duration, quality, record, replay, mode, layer, beside, watch = (
        validate.optional(check, "film", name, value, **limits)
        for (name, (check, limits)), value in zip(CHECKS.items(), given, strict=True)
    )
    recorded = _recorded(replay, scenario, record, integrator, duration) if replay else None
    if integrator is not None:
        scenario = dataclasses.replace(scenario, integrator=integrator)
    if fps is None:
        fps = recorded.fps if recorded else min(10.0, scenario.fps) if preview else scenario.fps
    size = (tuple(n // 2 for n in SIZE) if preview else SIZE) if size is None else validate.size("film", size)
    # Names and rates that cannot be are refused before any work.
    width, height = size
    frame = (2 * width if beside else width), height
    Film(out, frame, fps)
    quality = quality or ("draft" if preview else "final")
    if recorded:
        times = recorded.times[recorded.times < (np.inf if duration is None else duration)].tolist()
        if not times:
            begin = recorded.times[0]
            raise InputError(f"film: duration is {duration:g}, the recording begins at time {begin:g}; give more")
    else:
        times = timeline(scenario.duration if duration is None else duration, fps)
    device_named(device)
    world = scenario.shown
    if not world.particles and not world.shapes and all(body.surface is None for body in world.bodies):
        words = "nothing to see: no body has a surface, and there are no particles; give a body a surface=fs.Material()"
        warnings.warn(words, FieldsimWarning, stacklevel=2)
    begun = time.perf_counter()
    with contextlib.ExitStack() as stack:
        target = Film(out, frame, fps, planned=len(times))
        stack.enter_context(target)
        if target.still and not record:
            times = times[-1:]
        report = Report(target.path, target.size, 1 if target.still else len(times))
        renderer = Renderer((width, height), quality, device, mode=mode or "soft")
        pictures = LayerPictures(renderer, layer) if layer else renderer
        other = validate.answer("film", "beside", beside, size) if beside else None
        if other is not None:
            validate.having(
                "film", "what beside gave", other, ("frame",), "give something with frame(snapshot, camera)"
            )
        exposures = 1 if layer or recorded else _exposures(scenario.camera, times, fps, renderer)
        moments = _snapshots(scenario, _exposed(scenario.camera, times, exposures), device, report)
        if recorded:
            moments = map(functools.partial(recorded.at, world=scenario.shown), times)
        frames = zip(*[iter(moments)] * exposures, strict=False)
        if record:
            recording = Recording(record, about_run(scenario, fps), planned=len(times))
            frames = _kept(frames, stack.enter_context(recording))
        for done, snapshots in enumerate(frames, 1):
            if done == len(times) or not target.still:
                with report.rendering.running():
                    image = pictures.frame(snapshots if exposures > 1 else snapshots[0], scenario.camera)
                    if other is not None:
                        image = _beside(
                            image, validate.answer("film", "beside", other.frame, snapshots[0], scenario.camera)
                        )
                with report.writing.running():
                    target.write(image)
            if watch:
                validate.answer("film", "watch", watch, done, len(times))
    report.rays = renderer.rays
    report.seconds = time.perf_counter() - begun
    return report


def _beside(image, other):
    """Two pictures of one size side by side."""
    other = validate.array("film", "what beside drew", other, "give (H, W, 3) of uint8")
    if other.shape != image.shape or other.dtype != image.dtype:
        raise InputError(
            f"film: what beside drew has shape {other.shape} of {other.dtype}; give {image.shape} of {image.dtype}"
        )
    return np.hstack([image, other])


def _recorded(replay, scenario, record, integrator, duration):
    """The recording to replay; warns of what differs from its run, and of what has no effect on it."""
    if record and os.path.realpath(record) == os.path.realpath(replay):
        raise InputError(f"film: record and replay are one file, {os.fspath(replay)!r}; give two names")
    recorded = Recorded(replay)
    words = recorded.differences(scenario)
    if integrator is not None and str(integrator_of("film", integrator)) != recorded.about.get("integrator"):
        words.append(f"integrator {integrator} has no effect")
    if duration is not None and duration > recorded.times[-1] + 1.5 / recorded.fps:
        words.append(f"it ends at time {recorded.times[-1]:g}, before duration {duration:g}")
    if words:
        warnings.warn(
            f"{os.fspath(replay)!r} is replayed, and what moves is as recorded: {'; '.join(words)}",
            FieldsimWarning,
            stacklevel=3,
        )
    return recorded


def _exposures(camera, times, fps, renderer):
    """How many moments make a frame: one, or as many as the renderer blurs where a shutter stays open."""
    longest = max(camera.at(time).shutter for time in times)
    # A time divided by the rate, and multiplied by it again, is rounded.
    if longest * fps > 1.0 + 1e-9:
        raise InputError(
            f"Camera: shutter is {longest:g} but a frame lasts {1.0 / fps:g}; give at most that, or fewer fps"
        )
    return renderer.exposures if longest > 0.0 else 1


def _exposed(camera, times, exposures):
    """The times, each followed by others while the shutter is open."""
    return [time + camera.at(time).shutter * k / exposures for time in times for k in range(exposures)]


def _kept(frames, recording):
    """The frames' snapshots, of each the first recorded as it passes."""
    for snapshots in frames:
        recording.add(snapshots[0])
        yield snapshots


def snapshot_at(scenario: Scenario, time: float, device: str | None = None):
    """The scenario's moment at `time`, simulated up to then where anything moves by forces."""
    return next(_snapshots(scenario, [time], device, Report("", SIZE)))


def _snapshots(scenario, times, device, report):
    """The scenario's moments at `times`, and their part of the report."""
    with report.simulating.running():
        simulation, log = scenario.begin(device)
    if simulation is None:
        yield from map(scenario.shown.at, times)
        return
    report.log = log
    for name in ("counted", "compiled"):
        setattr(report, name, getattr(simulation, name, getattr(report, name)))
    report.integrator = str(simulation.choice or simulation.integrator)
    for moment in times:
        with report.simulating.running():
            simulation.advance(moment)
            log.record()
            snapshot = simulation.snapshot()
        yield snapshot
    report.particle_steps, report.bounces, report.energy = simulation.steps_done, simulation.bounces, log.report()
