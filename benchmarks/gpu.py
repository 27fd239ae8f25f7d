"""What a GPU makes of the heaviest work: particles on a donut, and fields at many points.

Beside the speed stands the share of the device's float64 peak, by operations counted in the portable functions
themselves: an addition, a multiplication, a division, a root are one each, a comparison is none. Without a GPU a few
particles on the CPU show that everything runs.
"""

import contextlib
import math
import time

import numpy as np
import warp as wp

from benchmarks.motion import DONUT, DT, falling
from fieldsim.dynamics.integrators.splittings import Leapfrog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.dynamics.splitting.method import method_of
from fieldsim.dynamics.splitting.substeps import substeps_of
from fieldsim.potentials.field import Field
from fieldsim.potentials.kernels import Newtonian
from fieldsim.world.body import Body
from fieldsim.world.world import World

# Particles, steps and points: on a GPU, and to see that all runs.
GPU, DRY = (1_000_000, 200, 4_000_000), (2_000, 20, 10_000)
# Peaks of float64 outside tensor cores, in operations a second, by a part of the device's name.
PEAKS = {"H200": 33.5e12, "H100": 33.5e12, "A100": 9.7e12, "V100": 7.8e12}


def rows(repeats: int = 3):
    """Speeds, and shares of the peak."""
    device = "cuda" if wp.is_cuda_available() else "cpu"
    count, steps, points = DRY if device == "cpu" else GPU
    name = wp.get_device(device).name
    yield from _leapfrog(device, name, count, steps, repeats)
    yield from _fields(device, name, points, repeats)


def _leapfrog(device, name, count, steps, repeats):
    positions, velocities = falling(count)
    world = World()
    world.add_body(Body(DONUT, gravity=Newtonian(), mass=1.0))
    world.add_particles(positions, velocities)
    simulation = Simulation(world, Leapfrog(DT), device=device)
    seconds = _least(lambda: simulation.advance(simulation.time + steps * DT), device, repeats)
    speed = count * steps / seconds
    title = f"{name}: donut, leapfrog, {count} particles x {steps} steps"
    yield {"name": title, "value": speed, "unit": "particle-steps/s"}
    yield from _share(title, name, speed, operations_of_a_step(positions[:64], velocities[:64]))


def _fields(device, name, count, repeats):
    points = wp.array(falling(count)[0], dtype=wp.vec3d, device=device)
    field = Field(DONUT, Newtonian())
    seconds = _least(lambda: field.value_and_gradient(points), device, repeats)
    title = f"{name}: Newtonian circle, value and gradient at {count} points"
    yield {"name": title, "value": seconds / count * 1e9, "unit": "ns"}


def _share(title, name, speed, operations):
    yield {"name": f"{title}: operations a step", "value": operations, "unit": "operations"}
    for part, peak in PEAKS.items():
        if part in name:
            yield {"name": f"{title}: of the float64 peak", "value": speed * operations / peak, "unit": "share"}


def _least(run, device, repeats):
    """The least wall time of a run, in seconds; the first compiles."""
    times = []
    for _ in range(repeats + 1):
        wp.synchronize_device(device)
        start = time.perf_counter()
        run()
        wp.synchronize_device(device)
        times.append(time.perf_counter() - start)
    return min(times[1:])


class Counted(float):
    """A number that knows of what it was made: an operation's, if it was made by one."""

    made_of: tuple = ()
    by_operation = False


def _noting(operation, counts=True):
    def noted(*args):
        result = operation(*map(float, args))
        if not isinstance(result, float):
            return result
        number = Counted(result)
        number.made_of = tuple(one for one in args if isinstance(one, Counted))
        number.by_operation = counts
        return number

    return noted


for _name in ("add", "sub", "mul", "truediv"):
    for _form in (f"__{_name}__", f"__r{_name}__"):
        setattr(Counted, _form, _noting(getattr(float, _form)))
for _form in ("__neg__", "__abs__"):
    setattr(Counted, _form, _noting(getattr(float, _form), counts=False))


def operations(results) -> int:
    """Operations that numbers are made by, each once: what leads to nothing else is left out, as compilers do."""
    seen, todo = {}, [one for one in results if isinstance(one, Counted)]
    while todo:
        one = todo.pop()
        if id(one) not in seen:
            seen[id(one)] = one
            todo.extend(one.made_of)
    return sum(one.by_operation for one in seen.values())


@contextlib.contextmanager
def counted_mathematics():
    """Within, functions of `math` are operations, too."""
    names = ("sqrt", "exp", "log", "log1p", "sin", "cos", "tan", "atan", "atan2", "asin", "acos", "erf", "pow")
    before = {name: getattr(math, name) for name in names}
    for name, function in before.items():
        setattr(math, name, _noting(function))
    try:
        yield
    finally:
        for name, function in before.items():
            setattr(math, name, function)


def counted(array) -> np.ndarray:
    """An array of numbers that know: NumPy's would not, and would take what does with them."""
    return np.vectorize(Counted, otypes=[object])(array)


def operations_of_a_step(positions, velocities) -> float:
    """Operations of one leapfrog step around the donut, the mean over particles (N, 3)."""
    elements = Field(DONUT, Newtonian()).elements
    table = counted(method_of(Leapfrog(DT), DT, wp.get_device("cpu")).table.numpy())
    none = np.zeros((0, elements.rows.shape[1]))
    step, total = substeps_of((elements.kinds_used, ()), False), 0
    with counted_mathematics():
        for x, v in zip(positions, velocities, strict=True):
            state = [Counted(c) for c in (*x, *v, *np.zeros(9))]
            tables = counted(elements.rows), elements.kinds, len(elements), none, np.zeros(0, dtype=np.int32), 0
            # All but the last, how far the particle came, which free motion does not ask for.
            total += operations(step(*state, DT, table, 0, len(table), 1, 0, *tables)[:-1])
    return total / len(positions)
