"""How a film is made: snapshots of a run, or of a recording, are gathered into frames, drawn and written one by one."""

import contextlib
import time
from collections.abc import Iterator, Sequence

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.filming.options import SIZE, FilmPlan
from fieldsim.filming.report import Report
from fieldsim.recording.recording import Recording, about_run
from fieldsim.render.layers import LayerPictures
from fieldsim.render.output.video import Film
from fieldsim.render.renderer import Renderer
from fieldsim.scenario import Scenario
from fieldsim.world.run import Run
from fieldsim.world.world import Snapshot

# What a frame is drawn from: one snapshot, or several in the order of time while a shutter is open.
Moments = Sequence[Snapshot]


def make_film(plan: FilmPlan) -> Report:
    """Make a film and say what it took."""
    begun = time.perf_counter()
    count, watch = len(plan.times), plan.options.watch
    with contextlib.ExitStack() as stack:
        target = stack.enter_context(Film(plan.out, plan.frame, plan.fps, planned=count))
        report = Report(target.path, plan.frame, 1 if plan.still else count)
        drawing = Drawing(plan)
        frames = frames_of(plan, drawing.exposures, report)
        if plan.options.record:
            recording = Recording(plan.options.record, about_run(plan.scenario, plan.fps), planned=count)
            frames = _recorded(frames, stack.enter_context(recording))
        for done, moments in enumerate(frames, 1):
            if done == count or not plan.still:
                with report.rendering.running():
                    image = drawing.frame(moments)
                with report.writing.running():
                    target.write(image)
            if watch:
                validate.answer("film", "watch", watch, done, count)
    report.rays = drawing.renderer.rays
    report.seconds = time.perf_counter() - begun
    return report


# Snapshots


def snapshots(scenario: Scenario, times: Sequence[float], device: str | None, report: Report) -> Iterator[Snapshot]:
    """The scenario's snapshots at `times`, simulated where anything moves by forces, and their part of the report."""
    with report.simulating.running():
        run, log = scenario.begin(device)
    if run is None or log is None:
        yield from map(scenario.shown.at, times)
        return
    report.log = log
    report.counted = getattr(run, "counted", report.counted)
    report.integrator = str(run.choice or run.integrator)
    for moment in times:
        with report.simulating.running():
            run.advance(moment)
            log.record()
            snapshot = run.snapshot()
        yield snapshot
    report.particle_steps, report.bounces, report.energy = run.steps_done, run.bounces, log.report()


def snapshot_at(scenario: Scenario, time: float, device: str | None = None) -> Snapshot:
    """The scenario's snapshot at `time`, simulated up to then where anything moves by forces."""
    return next(snapshots(scenario, [time], device, Report("", SIZE)))


# Frames


def frames_of(plan: FilmPlan, exposures: int, report: Report) -> Iterator[Moments]:
    """What each frame is drawn from: `exposures` snapshots, of which the first is at the frame's own time."""
    if plan.recorded:
        return ((moment,) for moment in _moments(plan.recorded.replay(plan.scenario.shown), plan.times))
    camera = plan.scenario.camera
    times = [time + camera.at(time).shutter * k / exposures for time in plan.times for k in range(exposures)]
    moments = snapshots(plan.scenario, times, plan.options.device, report)
    return zip(*[moments] * exposures, strict=False)


def _moments(run: Run, times: Sequence[float]) -> Iterator[Snapshot]:
    """The run's snapshots at `times`."""
    for moment in times:
        run.advance(moment)
        yield run.snapshot()


def _recorded(frames: Iterator[Moments], recording: Recording) -> Iterator[Moments]:
    """The frames' snapshots, of each the first recorded as it passes."""
    for moments in frames:
        recording.add(moments[0])
        yield moments


class Drawing:
    """Draws a film's frames: in colours or as a layer, and what else the user draws beside them.

    exposures: how many snapshots make a frame.
    """

    def __init__(self, plan: FilmPlan):
        options = plan.options
        self.camera = plan.scenario.camera
        self.renderer = Renderer(plan.size, plan.quality, options.device, mode=options.mode or "soft")
        self._pictures = LayerPictures(self.renderer, options.layer) if options.layer else self.renderer
        self._other = _drawn_beside(options.beside, plan.size) if options.beside else None
        self.exposures = 1 if options.layer or plan.recorded else _exposures(plan, self.renderer)

    def frame(self, moments: Moments) -> np.ndarray:
        """The frame's picture, (height, width, 3) uint8."""
        image = self._pictures.frame(moments if self.exposures > 1 else moments[0], self.camera)
        if self._other is None:
            return image
        return _side_by_side(image, validate.answer("film", "beside", self._other.frame, moments[0], self.camera))


def _exposures(plan, renderer):
    """How many snapshots make a frame: one, or as many as the renderer blurs where a shutter stays open."""
    longest = max(plan.scenario.camera.at(time).shutter for time in plan.times)
    # A time divided by the rate, and multiplied by it again, is rounded.
    if longest * plan.fps > 1.0 + 1e-9:
        raise InputError(
            f"Camera: shutter is {longest:g} but a frame lasts {1.0 / plan.fps:g}; give at most that, or fewer fps"
        )
    return renderer.exposures if longest > 0.0 else 1


def _drawn_beside(beside, size):
    """What the user's function `beside` gives to draw the right half of each frame."""
    other = validate.answer("film", "beside", beside, size)
    if other is None:
        return None
    remedy = "give something with frame(snapshot, camera)"
    return validate.having("film", "what beside gave", other, ("frame",), remedy)


def _side_by_side(image, other):
    """Two pictures of one size as one."""
    other = validate.array("film", "what beside drew", other, "give (H, W, 3) of uint8")
    if other.shape != image.shape or other.dtype != image.dtype:
        raise InputError(
            f"film: what beside drew has shape {other.shape} of {other.dtype}; give {image.shape} of {image.dtype}"
        )
    return np.hstack([image, other])
