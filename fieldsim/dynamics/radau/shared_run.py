"""Particles that pull each other under Radau: all with one step."""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics.radau.kernels import FLYING, LOST, Flights, Leg
from fieldsim.dynamics.radau.nodes import Pulling
from fieldsim.dynamics.radau.radau import Radau, RadauRun
from fieldsim.dynamics.radau.shared import Course, Crowd, Task, close, end_of, look_of, start_of, sweep_of
from fieldsim.dynamics.radau.step import SWEEPS
from fieldsim.dynamics.radau.tables import PLACES
from fieldsim.dynamics.splitting.mutual_gravity import FEW_PAIRS, MutualGravity
from fieldsim.launch import launch
from fieldsim.sources.elements import Sources
from fieldsim.sources.windows import Window


@functools.cache
def few_kernels(kinds_used, kernel, lanes: int):
    """Kernels of one thread: steps (leg, pulling, window, flights, crowd), and dense output, as in `many_kernels`."""
    place, pull, weigh = sweep_of(kinds_used, kernel, lanes)
    (open, foresee), (judge, finish) = start_of(kinds_used, lanes), end_of(lanes)
    look, remember, show = look_of(kinds_used, lanes)

    @wp.func
    def settle(pulling: Pulling, crowd: Crowd):
        count = crowd.tasks.shape[0]
        for _ in range(SWEEPS + 0 * count):
            for i in range(count):
                place(i, crowd)
            for i in range(count):
                pull(i, pulling, crowd)
            weigh(crowd)
            if crowd.course[0].settled == 1:
                break

    @wp.kernel(module="unique", enable_backward=False)
    def steps(start: int, leg: Leg, pulling: Pulling, window: Window, flights: Flights, crowd: Crowd):
        count = crowd.tasks.shape[0]
        for _ in range(leg.steps):
            if crowd.course[0].t >= leg.until or crowd.course[0].ended != FLYING:
                break
            open(leg, pulling, window, flights, crowd)
            for i in range(count):
                foresee(i, flights, crowd)
            settle(pulling, crowd)
            for i in range(count):
                judge(i, leg, flights, crowd)
            close(leg, crowd)
            for i in range(count):
                finish(i, flights, crowd)

    @wp.kernel(module="unique", enable_backward=False)
    def dense(
        start: int,
        time: wp.float64,
        pulling: Pulling,
        window: Window,
        flights: Flights,
        crowd: Crowd,
        positions: wp.array(dtype=wp.vec3d),
        velocities: wp.array(dtype=wp.vec3d),
    ):
        look(time, pulling, window, flights, crowd)
        for i in range(crowd.tasks.shape[0]):
            remember(i, flights, crowd)
        settle(pulling, crowd)
        for i in range(crowd.tasks.shape[0]):
            show(i, crowd, positions, velocities)

    return steps, dense


@functools.cache
def many_kernels(kinds_used, kernel, lanes: int):
    """Kernels of the parts of steps and of dense output by name, those of each particle with a thread for each."""
    place, pull, weigh = sweep_of(kinds_used, kernel, lanes)
    (open, foresee), (judge, finish) = start_of(kinds_used, lanes), end_of(lanes)
    look, remember, show = look_of(kinds_used, lanes)

    def opening(start: int, leg: Leg, pulling: Pulling, window: Window, flights: Flights, crowd: Crowd):
        open(leg, pulling, window, flights, crowd)

    def foreseeing(start: int, flights: Flights, crowd: Crowd):
        foresee(start + wp.tid(), flights, crowd)

    def placing(start: int, crowd: Crowd):
        place(start + wp.tid(), crowd)

    def pulling_each(start: int, pulling: Pulling, crowd: Crowd):
        pull(start + wp.tid(), pulling, crowd)

    def weighing(start: int, crowd: Crowd):
        weigh(crowd)

    def judging(start: int, leg: Leg, flights: Flights, crowd: Crowd):
        judge(start + wp.tid(), leg, flights, crowd)

    def closing(start: int, leg: Leg, flights: Flights, crowd: Crowd):
        # All in one: broken off between two of them, the particles would stand at two times.
        close(leg, crowd)
        for i in range(crowd.tasks.shape[0]):
            finish(i, flights, crowd)

    def looking(start: int, time: wp.float64, pulling: Pulling, window: Window, flights: Flights, crowd: Crowd):
        look(time, pulling, window, flights, crowd)

    def remembering(start: int, flights: Flights, crowd: Crowd):
        remember(start + wp.tid(), flights, crowd)

    def showing(start: int, crowd: Crowd, positions: wp.array(dtype=wp.vec3d), velocities: wp.array(dtype=wp.vec3d)):
        show(start + wp.tid(), crowd, positions, velocities)

    parts = opening, foreseeing, placing, pulling_each, weighing, judging, closing, looking, remembering, showing
    return {part.__name__: wp.kernel(part, module="unique", enable_backward=False) for part in parts}


class SharedRun(RadauRun):
    """The particles of a simulation that pull each other, or are pulled by such, under `Radau`: all have one step."""

    def __init__(
        self,
        radau: Radau,
        world,
        sources: Sources,
        positions,
        velocities,
        time: float,
        mutual: MutualGravity,
        *,
        threads=None,
    ):
        self._mutual = mutual
        super().__init__(radau, world, sources, positions, velocities, time, threads=threads)
        self._few = not self._device.is_cuda and self._count * len(mutual) <= FEW_PAIRS
        self._crowd = self._gathered(time)

    def _plan(self, radau, world, time):
        leg = super()._plan(radau, world, time)
        places = self._flights.x.numpy()
        leg.extent += float(np.abs(places).max(initial=0.0))
        kernel = self._mutual.kernel
        assert kernel is not None
        # Two that pull each other may both move.
        leg.stride = 0.5 * min(leg.stride, 0.5 * kernel.short_reach)
        return leg

    def _gathered(self, time, steps=0, evaluations=0):
        """The crowd at its start, or where it starts anew."""
        course = wp.zeros(1, dtype=Course, device="cpu").numpy()
        course["t"], course["steps"], course["evaluations"] = time, steps, evaluations
        crowd, device = Crowd(), self._device
        crowd.course = wp.array(course, dtype=Course, device=device)
        crowd.tasks = wp.zeros(self._count, dtype=Task, device=device)
        crowd.rows = self._room(self._mutual.rows_at(self._flights.x))
        crowd.index = self._mutual.index
        return crowd

    def restart(self, which, positions, velocities, time: float) -> None:
        """Let all start anew at `time`, as each feels the others. What was counted, and closest passages, are kept."""
        counted = self._course
        super().restart(np.ones(self._count, dtype=bool), positions, velocities, time)
        self._crowd = self._gathered(time, counted["steps"], counted["evaluations"])

    @property
    def _course(self):
        return self._crowd.course.numpy()[0]

    @property
    def steps(self) -> int:
        """Steps taken so far by all particles."""
        return int(self._course["steps"])

    @property
    def evaluations(self) -> int:
        """Evaluations of the field so far by all particles."""
        return int(self._course["evaluations"])

    @property
    def _batch(self):
        """All share the rows of moving elements."""
        return 1

    @property
    def _work(self):
        return (len(self._sources) + len(self._mutual)) * 3 * PLACES * self._count

    @property
    def _kernels(self):
        make = few_kernels if self._few else many_kernels
        return make(self._sources.kinds_used, type(self._mutual.kernel), self._lanes)

    def _fly(self):
        pulling, window, flights, crowd = self._pulled_by(), self._windows.window, self._flights, self._crowd
        if self._few:
            steps, _dense = self._kernels
            launch(steps, 1, [self._leg, pulling, window], [flights, crowd], device=self._device)
            return self._under_way
        taken = 0
        while self._under_way and taken < self._leg.steps:
            self._part("opening", 1, self._leg, pulling, window, flights, crowd)
            self._part("foreseeing", self._count, flights, crowd)
            self._settle(pulling)
            self._part("judging", self._count, self._leg, flights, crowd)
            self._part("closing", 1, self._leg, flights, crowd)
            taken += 1
        return self._under_way

    @property
    def _under_way(self):
        course = self._course
        return bool(course["t"] < self._leg.until and course["ended"] == FLYING)

    def _part(self, name, count, *arguments):
        launch(self._kernels[name], count, arguments, device=self._device, grain=8, threads=self._threads)

    def _settle(self, pulling):
        """Sweeps of a step, until it has converged."""
        while not self._course["settled"]:
            self._part("placing", self._count, self._crowd)
            self._part("pulling_each", self._count, pulling, self._crowd)
            self._part("weighing", 1, self._crowd)

    def read(self, times) -> tuple[wp.array, wp.array]:
        """Positions and velocities, Warp arrays (N,) of vec3d, at the time `times` (N,), the same for all."""
        flights, crowd, pulling, window = self._flights, self._crowd, self._pulled_by(), self._windows.window
        x, v = wp.clone(flights.x), wp.clone(flights.v)
        time, course = float(times[0]), self._course
        if course["ended"] == LOST:
            x.fill_(np.nan)
            v.fill_(np.nan)
        elif course["last"] > 0.0 and time != course["t"]:
            if self._few:
                _steps, dense = self._kernels
                launch(dense, 1, [time, pulling, window, flights, crowd], [x, v], device=self._device)
            else:
                self._part("looking", 1, time, pulling, window, flights, crowd)
                self._part("remembering", self._count, flights, crowd)
                self._settle(pulling)
                self._part("showing", self._count, crowd, x, v)
        return x, v


def run_of(
    radau: Radau, world, sources: Sources, positions, velocities, time: float, mutual: MutualGravity, *, threads=None
) -> RadauRun:
    """The particles of a simulation under `Radau`: each with its own steps, or where some pull others all with one."""
    start = radau, world, sources, positions, velocities, time
    return SharedRun(*start, mutual, threads=threads) if mutual else RadauRun(*start, threads=threads)
