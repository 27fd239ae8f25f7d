"""The report on a film: what making it took, and how well energy was kept."""

import contextlib
import dataclasses
import time
from collections.abc import Generator

from fieldsim import launch
from fieldsim.dynamics.diagnostics.energy_log import EnergyReport
from fieldsim.scenario import RunLog

# A load of kernels that takes longer than this, in seconds, compiles them.
COMPILING = 2.0


@dataclasses.dataclass
class Clock:
    """Seconds of work, without those spent compiling kernels."""

    seconds: float = 0.0
    compiling: float = 0.0

    @contextlib.contextmanager
    def running(self) -> Generator[None, None, None]:
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
    particle_steps.
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
    log: RunLog | None = None
    integrator: str = ""
    counted: str = "particle-steps"

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
