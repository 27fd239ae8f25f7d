"""What a formula costs: nanoseconds per value and gradient of one element at one point, one core, compiled beforehand.

`ratio` compares with a Point under the same kernel and target; for lanes, in which fields on CPUs are evaluated, it is
how many times as fast as Warp's scalar code they are, both measured in turns, in the processor's time of this process.
Points lie at log-uniform distances around a primitive, in no order, so that each vector takes most branches; on a grid,
neighbours mostly take the same.
"""

import functools
import subprocess
import sys
import tempfile
import time

import numpy as np
import warp as wp

import fieldsim as fs
from fieldsim.launch import launch
from fieldsim.portable.lanes.kernels import items_of
from fieldsim.potentials import field_kernels, registry

KERNELS = (
    fs.Cauchy(2.0),
    fs.Gaussian(2.0),
    fs.InverseSquare(),
    fs.Metaball(0.9),
    fs.Newtonian(),
    fs.Quartic(0.9),
    fs.SoftObject(0.9),
)
PRIMITIVES = (
    fs.Point((0, 0, 0)),
    fs.Segment((-0.5, 0, 0), (0.5, 0, 0)),
    fs.Circle((0, 0, 0), (0, 0, 1), 0.5),
    fs.Arc((0, 0, 0), (0, 0, 1), (1, 0, 0), 0.5, 2.5),
    fs.Triangle((-0.5, -0.3, 0), (0.5, -0.3, 0), (0, 0.6, 0)),
    fs.Plane((0, 0, 0), (0, 0, 1)),
)
CLOUD, GRID = "in no order", "on a grid"
PRECISIONS = {"float64": wp.float64, "float32": wp.float32}
TARGETS = {"Warp float64": wp.float64, "Warp float32": wp.float32, "numba": float}
COUNT = 20_000


def rows(repeats: int = 5):
    """The cost of every formula on every target, and what a first compile takes."""
    for kernel in KERNELS:
        points = {}
        for primitive in PRIMITIVES:
            for target, scalar in TARGETS.items():
                cost = nanoseconds(kernel, primitive, scalar, repeats)
                base = points.setdefault(target, cost)
                yield {
                    "name": f"{type(kernel).__name__} on {type(primitive).__name__}, {target}",
                    "value": cost,
                    "unit": "ns",
                    "peer": "Point",
                    "peer_value": base,
                }
            yield from lanes_rows(kernel, primitive)
    yield from single_point_rows()
    for name, code in FIRST.items():
        yield {"name": f"first compile of a world with {name}", "value": cold(code), "unit": "s"}


def lanes_rows(kernel, primitive):
    """The cost of a formula in lanes beside that of scalar code."""
    elements = fs.Field(primitive, kernel).elements
    for precision, scalar in PRECISIONS.items():
        for order, points in ((CLOUD, cloud(COUNT)), (GRID, grid())):
            wide, single = in_turns(elements, points, scalar)
            yield {
                "name": f"{type(kernel).__name__} on {type(primitive).__name__}, lanes {precision}, points {order}",
                "value": wide,
                "unit": "ns",
                "peer": f"Warp {precision}",
                "peer_value": single,
                "ratio": single / wide,
            }


def single_point_rows():
    """What one point costs a user, checks of it included."""
    field = fs.Field(PRIMITIVES[1], fs.Newtonian())
    calls = {"value": field.value, "value and gradient": field.value_and_gradient, "Hessian": field.hessian}
    for name, call in calls.items():
        call((0.3, 0.4, 0.5))
        times = []
        for _ in range(50):
            start = time.perf_counter()
            for _ in range(100):
                call((0.3, 0.4, 0.5))
            times.append((time.perf_counter() - start) / 100)
        yield {"name": f"{name} of a segment at one point", "value": min(times) * 1e6, "unit": "us"}


def grid() -> np.ndarray:
    """Points (N, 3) of a cubic grid about the origin, some 20,000, one coordinate after another."""
    along = np.linspace(-2.0, 2.0, 27)
    return np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1).reshape(-1, 3) + 0.0123


def evaluation(elements, points, order: int):
    """A function that evaluates a field in lanes at points (N, 3), on one core: derivatives up to that order."""
    given = [wp.array(points, dtype=wp.vec3d, device="cpu"), wp.array(elements.rows, dtype=wp.float64, device="cpu")]
    given.append(wp.array(elements.kinds, dtype=wp.int32, device="cpu"))
    kinds = (wp.float64, wp.vec3d, wp.mat33d)[: order + 1]
    results = [wp.empty(len(points), dtype=kind, device="cpu") for kind in kinds]
    kernel = field_kernels.in_lanes(order, elements.kinds_used, wp.float64)
    items = items_of(len(points), wp.float64)
    return lambda: launch(kernel, items, [*given, 0, len(elements)], results, device="cpu", threads=1)


def in_turns(elements, points, scalar, turns: int = 20):
    """Nanoseconds per point, value and gradient, in lanes and by scalar code: the least of each in its turns."""
    count, vector = len(points), wp.types.vector(3, scalar)
    given = [wp.array(points, dtype=vector, device="cpu"), wp.array(elements.rows, dtype=scalar, device="cpu")]
    given.append(wp.array(elements.kinds, dtype=wp.int32, device="cpu"))
    results = [wp.empty(count, dtype=scalar, device="cpu"), wp.empty(count, dtype=vector, device="cpu")]
    wide, single = (
        field_kernels.in_lanes(1, elements.kinds_used, scalar),
        field_kernels.in_threads(1, elements.kinds_used, scalar),
    )
    runs = (
        lambda: launch(wide, items_of(count, scalar), [*given, 0, 1], results, device="cpu", threads=1),
        lambda: launch(single, count, [*given, 0, 1], results, device="cpu", threads=1),
    )
    least = [np.inf, np.inf]
    for turn in range(turns + 1):
        for place, run in enumerate(runs):
            start = time.process_time()
            run()
            # The first turn compiles.
            least[place] = min(least[place], time.process_time() - start) if turn else np.inf
    return [seconds / count * 1e9 for seconds in least]


def cloud(count: int, seed: int = 0) -> np.ndarray:
    """Points (count, 3) at log-uniform distances 0.01 to 10 from the origin's neighbourhood."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return rng.uniform(-0.5, 0.5, (count, 3)) + directions * 10 ** rng.uniform(-2, 1, (count, 1))


def nanoseconds(kernel, primitive, scalar, repeats):
    """The least time of `repeats` runs, per point."""
    elements = fs.Field(primitive, kernel).elements
    points = cloud(COUNT)
    run = _numba_run(elements, points) if scalar is float else _warp_run(elements, points, scalar)
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times) / COUNT * 1e9


def _warp_run(elements, points, scalar):
    vector = wp.types.vector(3, scalar)
    kernel = _gradient_kernel(elements.kinds_used, scalar)
    points = wp.array(points, dtype=vector, device="cpu")
    rows = wp.array(elements.rows, dtype=scalar, device="cpu")
    kinds = wp.array(elements.kinds, dtype=wp.int32, device="cpu")
    gradient = wp.empty(COUNT, dtype=vector, device="cpu")
    return lambda: launch(kernel, COUNT, [points, rows, kinds], [gradient], device="cpu", threads=1)


@functools.cache
def _gradient_kernel(kinds_used, scalar):
    vector = wp.types.vector(3, scalar)
    total = registry.field_sum(kinds_used).warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(
        start: int,
        points: wp.array(dtype=vector),
        rows: wp.array(dtype=scalar, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        gradient: wp.array(dtype=vector),
    ):
        i = start + wp.tid()
        p = points[i]
        f, gx, gy, gz = total(p[0], p[1], p[2], rows, kinds, 0, kinds.shape[0])
        # The value takes part, so that it is not left out as dead code.
        gradient[i] = vector(gx + f, gy, gz)

    return evaluate


def _numba_run(elements, points):
    import numba

    total = registry.field_sum(elements.kinds_used).numba

    @numba.njit(error_model="numpy")
    def loop(points, rows, kinds):
        s = 0.0
        for i in range(len(points)):
            f, gx, gy, gz = total(points[i, 0], points[i, 1], points[i, 2], rows, kinds, 0, len(kinds))
            s += f + gx + gy + gz
        return s

    return lambda: loop(points, elements.rows, elements.kinds)


_ONE = "fs.Field(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), fs.Newtonian()).value((0, 0, 1))"
_ALL = """
from benchmarks.fields import KERNELS, PRIMITIVES
sum((fs.Field(PRIMITIVES, kernel) for kernel in KERNELS[1:]), fs.Field(PRIMITIVES, KERNELS[0])).value((2.0, 3.0, 1.0))
"""
FIRST = {"one formula": _ONE, "all formulas": _ALL}


def cold(code):
    """Seconds that `code` takes in a process of its own with an empty kernel cache."""
    with tempfile.TemporaryDirectory() as cache:
        script = f"import warp as wp; wp.config.kernel_cache_dir = {cache!r}\nimport time, fieldsim as fs\n"
        script += f"start = time.perf_counter()\n{code}\nprint(time.perf_counter() - start)"
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])
