"""What a formula costs: nanoseconds per value and gradient of one element at one point, one core, compiled beforehand.

`ratio` compares with a Point under the same kernel and target. Points lie at log-uniform distances around a primitive.
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
from fieldsim.potentials import registry

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
    for name, code in FIRST.items():
        yield {"name": f"first compile of a world with {name}", "value": cold(code), "unit": "s"}


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
