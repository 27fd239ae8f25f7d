"""Adaptive Gauss-Radau of order 15, accurate to rounding; each particle has its own steps."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.arrays import kept
from fieldsim.dynamics.contact.particle_state import ContactParticles
from fieldsim.dynamics.integrators.splittings import Integrator
from fieldsim.dynamics.radau.kernels import FLYING, Flights, Leg, Step, dense_kernel, escapes, radau_kernel
from fieldsim.dynamics.radau.nodes import Pulling, Series, lanes_on
from fieldsim.dynamics.radau.tables import PLACES
from fieldsim.dynamics.state import columns, renew
from fieldsim.errors import InputError
from fieldsim.launch import launch
from fieldsim.potentials.row import POSITIONS, SIZE
from fieldsim.sources.elements import Sources
from fieldsim.sources.windows import Windows
from fieldsim.types import RealLike

# Limits of a launch: evaluations of an element, and rows of moving elements.
LAUNCH_WORK = 20_000_000
LAUNCH_STEPS = 4096
SCRATCH_ROWS = 400_000


@dataclasses.dataclass(frozen=True)
class Radau(Integrator):
    """Gauss-Radau of order 15 with adaptive steps (IAS15): errors at rounding level, also through close passages.

    Each particle has its own steps, about tau (5040 tolerance)^(1/7) long, tau the time in which its acceleration
    changes; particles that pull each other, and what they pull, have one, the shortest. From a tolerance of 1e-7 down
    rounding is all that is left on smooth orbits. Output at given times repeats a part of each last step: it changes
    nothing. A particle stops where it crosses the world's escape radius.

    Motions, masses and skeletons that are functions of time are sampled ahead, beyond the time asked for, too, and
    interpolated to rounding over spans as long as that allows; a change between samples only, such as a jolt that
    lasts a small part of a smooth span, is missed.
    Everhart 1985; Rein & Spiegel 2015; Pham, Rein & Spiegel 2024.
    """

    tolerance: float = 1e-9

    if TYPE_CHECKING:

        def __init__(self, tolerance: RealLike = ...) -> None: ...

    order = 15

    def __post_init__(self):
        value = validate.number("Radau", "tolerance", self.tolerance, above=0.0)
        if value > 1e-3:
            raise InputError(f"Radau: tolerance is {value:g}; give at most 1e-3, such as 1e-9")
        object.__setattr__(self, "tolerance", value)

    @property
    def eta(self) -> float:
        """Length of a step in units of the time in which the acceleration changes."""
        return (5040.0 * self.tolerance) ** (1.0 / 7.0)


class RadauRun:
    """The particles of a simulation under `Radau`: their state, and their dense output.

    positions, velocities: (N,) Warp arrays of vec3d as the particles start; time: when. `advance` flies all of them to
    a time or beyond it, `step` flies each by one step; `span` and `at` give the last step of each.
    """

    def __init__(self, radau: Radau, world, sources: Sources, positions, velocities, time: float, *, threads=None):
        self._sources, self._device, self._threads = sources, positions.device, threads
        self._lanes = lanes_on(self._device)
        self._world, self._windows = world, Windows(sources, world, time, self._device)
        self._count = len(positions)
        self._flights = self._start(positions, velocities, time)
        self._running = wp.zeros(self._count, dtype=wp.int32, device=self._device)
        self._leg = self._plan(radau, world, time)
        self._pulling = None

    def _start(self, positions, velocities, time):
        flights = Flights()
        flights.x, flights.v = wp.clone(positions), wp.clone(velocities)
        kinds = {
            wp.vec3d: ("x_rest", "v_rest", "a"),
            wp.float64: ("t_rest", "plan", "tau_at"),
            Step: ("last",),
            Series: ("miss",),
            wp.int32: ("ended",),
            wp.int64: ("steps", "evaluations"),
        }
        for dtype, names in kinds.items():
            for name in names:
                setattr(flights, name, wp.zeros(self._count, dtype=dtype, device=self._device))
        flights.t = wp.full(self._count, time, dtype=wp.float64, device=self._device)
        steps = flights.last.numpy()
        steps["t"] = time
        flights.last = wp.array(steps, dtype=Step, device=self._device)
        flights.tau = wp.full(self._count, math.inf, dtype=wp.float64, device=self._device)
        return flights

    def _plan(self, radau, world, time):
        rows = np.concatenate([self._sources.fixed.rows, self._sources.rows_at(np.array([time]))[0]])
        reaches = [body.gravity.short_reach for body in world.bodies if body.gravity is not None]
        leg = Leg()
        leg.eta, leg.begin = radau.eta, time
        leg.extent = float(np.abs(rows[:, POSITIONS]).max(initial=0.0) + rows[:, SIZE].max(initial=0.0))
        leg.stride = 0.5 * min(reaches, default=math.inf)
        leg.escape2 = math.inf if world.escape_radius is None else world.escape_radius**2
        return leg

    def restart(self, which, positions, velocities, time: float) -> None:
        """Let the particles `which` (N,) start anew at `time` from Warp arrays (N,) of vec3d; the others fly on.

        What was counted of them, and their closest passages, are kept.
        """
        if time < self._windows.start:  # an interrupted run had gone ahead
            self._windows, self._pulling = Windows(self._sources, self._world, time, self._device), None
            which = np.ones(self._count, dtype=bool)
        fresh = self._start(positions, velocities, time)
        names = [name for name in columns(Flights) if name not in ("steps", "evaluations", "tau", "tau_at")]
        renew(Flights, self._flights, fresh, which, names)

    @property
    def steps(self) -> int:
        """Steps taken so far by all particles."""
        return int(self._flights.steps.numpy().sum())

    @property
    def evaluations(self) -> int:
        """Evaluations of the field so far by all particles."""
        return int(self._flights.evaluations.numpy().sum())

    @property
    def span(self) -> tuple[np.ndarray, np.ndarray]:
        """Times when each particle's last step began and ended, each (N,)."""
        return kept(self._flights.last.numpy()["t"]), kept(self._flights.t.numpy())

    def advance(self, until: float) -> None:
        """Advance every particle by whole steps to the time `until` or beyond."""
        self._leg.steps = min(LAUNCH_STEPS, max(1, LAUNCH_WORK // self._work))
        while True:
            self._leg.until = min(until, self._windows.end)
            while self._fly():
                pass
            if until <= self._windows.end:
                return
            self._next_window()

    @property
    def closest(self) -> tuple[np.ndarray, np.ndarray]:
        """The shortest time in which each particle's acceleration changed so far, and when that was, each (N,)."""
        return kept(self._flights.tau.numpy()), kept(self._flights.tau_at.numpy())

    def step(self, until: float = math.inf) -> None:
        """Advance every particle that is not yet at `until` by one step, at most to the end of the sources' window."""
        flying = self._flights.ended.numpy() == FLYING
        if flying.any() and (self._flights.t.numpy()[flying] >= self._windows.end).all():
            self._next_window()
        self._leg.until, self._leg.steps = min(until, self._windows.end), 1
        self._fly()

    def flown(self, until: float, particles: ContactParticles) -> tuple[wp.array, wp.array]:
        """Positions and velocities, Warp arrays (N,) of vec3d, at the time `until`, to which all advance.

        Who has stopped at the escape radius by then is entered in the log and the states of `particles`, once.
        """
        self.advance(until)
        if math.isfinite(self._leg.escape2):
            launch(escapes, self._count, [until, self._flights], [particles], device=self._device)
        return self.read(np.full(self._count, until))

    def at(self, times) -> tuple[np.ndarray, np.ndarray]:
        """Positions and velocities, (N, 3), at `times`, a number or (N,), within each particle's last step."""
        times = np.broadcast_to(np.asarray(times, dtype=float), self._count)
        x, v = self.read(times)
        return kept(x.numpy()), kept(v.numpy())

    def read(self, times) -> tuple[wp.array, wp.array]:
        """The same as Warp arrays (N,) of vec3d; times (N,)."""
        times = wp.array(np.ascontiguousarray(times), dtype=wp.float64, device=self._device)
        x, v = (wp.empty(self._count, dtype=wp.vec3d, device=self._device) for _ in range(2))
        kernel = dense_kernel(self._sources.kinds_used, self._lanes)
        for first, count in self._batches():
            inputs = [first, self._flights, self._pulled_by(), self._windows.window, times]
            launch(kernel, count, inputs, [x, v], device=self._device, grain=16, threads=self._threads)
        return x, v

    def _fly(self):
        """Launch for all particles; returns whether some particle has not arrived."""
        kernel = radau_kernel(self._sources.kinds_used, self._lanes)
        for first, count in self._batches():
            self._leg.first = first
            inputs = [self._leg, self._pulled_by(), self._windows.window]
            outputs = [self._flights, self._running]
            launch(kernel, count, inputs, outputs, device=self._device, grain=1, threads=self._threads)
        return bool(self._running.numpy().any())

    @property
    def _work(self):
        """Evaluations of an element in a step of all particles of a launch."""
        return max(1, len(self._sources)) * 3 * PLACES * max(1, self._batch)

    @property
    def _batch(self):
        """Particles per launch: each has its own rows of moving elements, one set for each node."""
        rows = PLACES * len(self._sources.moving_kinds)
        return min(self._count, max(1, SCRATCH_ROWS // rows)) if rows else self._count

    def _batches(self):
        """First particle and number of particles of each launch."""
        return [(first, min(self._batch, self._count - first)) for first in range(0, self._count, max(1, self._batch))]

    def _next_window(self):
        if not self._windows.advance():
            self._pulling = None

    def _pulled_by(self):
        """Rows of still elements, and room for the moving rows that kernels write."""
        if self._pulling is None:
            device, sources, batch = self._device, self._sources, self._batch
            pulling = self._pulling = Pulling()
            pulling.rows = wp.array(sources.fixed.rows, dtype=wp.float64, device=device)
            pulling.kinds = wp.array(sources.fixed.kinds, dtype=wp.int32, device=device)
            pulling.moving = len(sources.moving_kinds)
            pulling.moving_kinds = wp.array(np.tile(sources.moving_kinds, batch), dtype=wp.int32, device=device)
            pulling.moving_rows = self._room(np.tile(self._windows.rows, (batch, 1)))
        return self._pulling

    def _room(self, rows):
        """Rows of all nodes that begin as `rows`, (PLACES, *): on a CPU the nodes' numbers lie side by side."""
        rows = np.repeat(rows[..., None], PLACES, axis=-1)
        if self._lanes == 1:
            return wp.array(np.moveaxis(rows, -1, 0), dtype=wp.float64, device=self._device)
        return wp.array(rows, dtype=wp.float64, device=self._device).transpose((2, 0, 1))
