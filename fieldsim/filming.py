"""From a scenario to a film: simulate, render, write, frame by frame; and the report on it."""

import contextlib
import dataclasses
import time
import warnings

import numpy as np

from fieldsim import launch
from fieldsim.dynamics.diagnostics import EnergyLog, EnergyReport
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import FieldsimWarning
from fieldsim.potentials import cells
from fieldsim.render.image import Renderer
from fieldsim.render.video import Film
from fieldsim.scenario import Scenario
from fieldsim.world.motion import timeline

SIZE = (640, 360)

# A load of kernels that takes longer than this compiles them.
COMPILING = 2.0

# At most so many points are asked whether the surface reaches them.
PROBES = 64


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
    """What making a film took. Times in seconds of wall time; `energy` is None in a world without particles."""

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
            steps = f"{_short(self.particle_steps / self.simulating.seconds)} particle-steps/s{bounces}"
            lines.append(f"  simulating {self.simulating.seconds:6.1f} s  {steps}")
        rays = _short(self.rays / self.rendering.seconds)
        lines.append(f"  rendering  {self.rendering.seconds:6.1f} s  {rays} rays/s")
        if self.compiling > COMPILING:
            lines.append(f"  compiling  {self.compiling:6.1f} s  first run only")
        if self.energy is not None:
            lines.append(f"  {self.energy}")
        return "\n".join(lines)


def _short(number):
    """Three digits and a unit: 12.3 million."""
    for unit, name in ((1e9, " billion"), (1e6, " million"), (1e3, " thousand")):
        if number >= unit:
            return f"{number / unit:.3g}{name}"
    return f"{number:.3g}"


def film(
    scenario: Scenario,
    out,
    *,
    size=None,
    fps: float | None = None,
    duration: float | None = None,
    device: str | None = None,
    quality: str | None = None,
    preview: bool = False,
    watch=None,
) -> Report:
    """Film `scenario` into `out` (see `Film` for what its ending means) and say what it took.

    size: (width, height), 640x360 unless told; fps, duration: the scenario's unless told; quality: "draft" or "final".
    preview: a quick look: half the width and height, draft quality, 10 frames per second, where nothing else is told.
    watch: called with (frames done, frames in all) as the work goes on. A path that ends in .png gets the last frame.
    """
    duration = scenario.duration if duration is None else duration
    fps = (min(10.0, scenario.fps) if preview else scenario.fps) if fps is None else fps
    size = size or (tuple(n // 2 for n in SIZE) if preview else SIZE)
    quality = quality or ("draft" if preview else "final")
    times = timeline(duration, fps)
    begun = time.perf_counter()
    with Film(out, size, fps) as target:
        warn_of_unseen(scenario.world, (times[0], times[len(times) // 2], times[-1]))
        if target.still:
            times = times[-1:]
        report = Report(target.path, target.size, len(times))
        _shoot(
            scenario, target, times, report, watch=watch, renderer=Renderer(target.size, quality, device), device=device
        )
    report.seconds = time.perf_counter() - begun
    return report


def _shoot(scenario, target, times, report, *, watch, renderer, device):
    """Make the frames at `times`, in order."""
    world = scenario.world
    moving = any(len(particles) for particles in world.particles)
    with report.simulating.running():
        simulation = Simulation(world, scenario.integrator, device=device) if moving else None
        log = EnergyLog(simulation) if moving else None
    snapshots = simulation.snapshots(times) if moving else map(world.at, times)
    for done in range(len(times)):
        if watch is not None:
            watch(done, len(times))
        with report.simulating.running():
            snapshot = next(snapshots)
            if moving:
                log.record()
        with report.rendering.running():
            image = renderer.frame(snapshot, scenario.camera)
        with report.writing.running():
            target.write(image)
    if watch is not None:
        watch(len(times), len(times))
    report.rays = renderer.rays
    if moving:
        report.particle_steps, report.bounces, report.energy = simulation.steps_done, simulation.bounces, log.report()


def warn_of_unseen(world, times) -> None:
    """Warn of bodies whose surface exists at none of `times`, since their field reaches the threshold nowhere."""
    snapshots = [world.at(time) for time in times]
    shown = [body for body in world.bodies if body.surface is not None]
    if not shown and not any(len(particles) for particles in world.particles):
        _warn("there is nothing to see: no body has a surface, and there are no particles")
    for owner, body in enumerate(shown):
        most = max(_largest_field(snapshot.surface, owner) for snapshot in snapshots)
        if most < 1.0:
            name = body.name or f"body {world.bodies.index(body)}"
            _warn(
                f"{name}: nothing to see, its field comes to {most:.2g} of the threshold at most; "
                "give its material a lower threshold"
            )


def _largest_field(surface, owner):
    """The field, in units of the threshold, where a body's skeleton is: 1 or more as soon as that is found anywhere."""
    elements = surface.elements
    total = cells.field_sum(elements.kinds_used)
    largest = 0.0
    for x, y, z in _middles(elements.rows[surface.owner == owner][:PROBES]).tolist():
        largest = max(largest, total(x, y, z, elements.rows, elements.kinds, 0, len(elements))[0])
        if largest >= 1.0:
            break
    return largest


def _middles(rows):
    """The middle of each element's primitive, (N, 3)."""
    place = rows[:, cells.POSITIONS][:, :3]
    start, normal = rows[:, cells.DIRECTIONS][:, :3], rows[:, cells.DIRECTIONS][:, 3:]
    size, half = rows[:, cells.SIZE, None], 0.5 * rows[:, cells.ANGLE, None]
    # Only arcs have an angle, and a point's size is 0.
    return place + size * np.where(half > 0, np.cos(half) * start + np.sin(half) * np.cross(normal, start), 0.5 * start)


def _warn(words):
    warnings.warn(words, FieldsimWarning, stacklevel=4)
