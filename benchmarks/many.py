"""What fields of many elements at many points cost: fast sums beside exact ones, one core, compiled beforehand.

Segments of about 0.02, and as many points, lie anywhere in a cube of width 1. The exact sum is timed at some of the
points, which also tell the error: the largest over the largest value. Seconds are of processor time, with everything
that depends on elements and points; what is kept for later calls (the tree of elements, the translations of a kernel)
is given apart.
"""

import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import fieldsim as fs
from fieldsim.potentials.elements import Elements
from fieldsim.potentials.fast_summation import summation
from fieldsim.potentials.registry import formula_of
from fieldsim.potentials.row import AXIS, END, KERNEL_WIDTH, LENGTH, ROW_WIDTH, START, STRENGTH

COUNT, MANY = 30_000, 100_000
SEEN = 400
KERNELS = (fs.Newtonian(), fs.Cauchy(20.0))
TOLERANCE = 1e-9


def rows(full: bool = False):
    """Fast and exact seconds, and errors."""
    for kernel in KERNELS:
        elements, points = cloud(kernel, MANY if full else COUNT)
        warm(kernel)
        yield from measured(kernel, elements, points)


def cloud(kernel, count: int, seed: int = 0) -> tuple[Elements, np.ndarray]:
    """Segments of positive strengths, and points (count, 3)."""
    rng = np.random.default_rng(seed)
    starts, ways = rng.random((count, 3)), rng.normal(size=(count, 3))
    ways *= (0.02 * rng.uniform(0.5, 1.5, count) / np.linalg.norm(ways, axis=1))[:, None]
    table = np.zeros((count, ROW_WIDTH))
    table[:, START], table[:, END] = starts, starts + ways
    table[:, LENGTH] = np.linalg.norm(ways, axis=1)
    table[:, AXIS] = ways / table[:, LENGTH, None]
    table[:, STRENGTH], table[:, KERNEL_WIDTH] = rng.uniform(0.5, 1.5, count), kernel.width
    kind = formula_of(kernel, fs.Segment((0, 0, 0), (1, 0, 0))).kind
    return Elements(table, np.full(count, kind, dtype=np.int32), np.arange(count)), rng.random((count, 3))


def warm(kernel):
    """Compile all that is timed."""
    elements, points = cloud(kernel, 9000)
    fs.Field.of_elements(elements).value_and_gradient(points[:2])
    group = summation.Group(elements, kernel)
    summation.fast_sum(group, points, 1e-3, 1, threads=1)
    summation._made.cache_clear()


def measured(kernel, elements, points):
    """The rows of one kernel."""
    name = f"{kernel!r}, {len(elements)} segments at {len(points)} points"
    field = fs.Field.of_elements(elements)
    begin = time.process_time()
    value, gradient = field.value_and_gradient(points[:SEEN])
    exact = (time.process_time() - begin) * len(points) / SEEN
    begin = time.process_time()
    group = summation.Group(elements, kernel)
    built = time.process_time() - begin
    first, found = timed(group, points)
    again, found = timed(group, points)
    yield {"name": f"{name}: tree of the elements", "value": built, "unit": "s"}
    for words, seconds in (("first call, with the tree", built + first), ("second call", again)):
        row = {"name": f"{name}: {words}", "value": seconds, "unit": "s"}
        yield row | {"peer": "exact sum", "peer_value": exact, "ratio": seconds / exact}
    for words, one, other in zip(("value", "gradient"), found.results, (value, gradient), strict=True):
        error = np.abs(one[:SEEN] - other).max() / np.abs(other).max()
        yield {"name": f"{name}: error of the {words}", "value": error, "unit": "of the largest"}


def timed(group, points):
    """Seconds of a fast sum of value and gradient, and what it found."""
    begin = time.process_time()
    found = summation.fast_sum(group, points, TOLERANCE, 1, threads=1)
    return time.process_time() - begin, found
