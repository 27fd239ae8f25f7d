"""Fields of many elements at many points, in a time that grows slower than their product (see `Field.fast`)."""

import contextlib
import functools
import sys
import time
import warnings
from typing import Any, Protocol

import numpy as np

from fieldsim import validate
from fieldsim.errors import FieldsimWarning
from fieldsim.launch import checked_threads, is_watched
from fieldsim.potentials.elements import Elements
from fieldsim.potentials.fast_summation.octree import FARTHEST_DOUBLING
from fieldsim.potentials.fast_summation.summation import Group, Sum, fast_sum, groups_of
from fieldsim.potentials.field_kernels import SHAPES
from fieldsim.potentials.host_points import host_points
from fieldsim.types import ArrayLike, RealLike, WholeLike

# Fewer elements of one kernel are summed exactly.
LEAST = 2000
# Up to so many times what was measured, sums are exact.
EXACT = 1
# Tolerances: less is not reached in float64; more is no sum.
FINEST, COARSEST = 1e-12, 1e-2
# Seconds after which one who waits is told what is being done.
PATIENCE = 2.0


class Exact(Protocol):
    """A field that is summed exactly: a `Field`, not a function of time."""

    @property
    def elements(self) -> Elements:
        """Its elements."""
        ...

    def of_elements(self, elements: Elements, /) -> "Exact":
        """A field of other elements."""
        ...

    def _evaluate(self, points: Any, order: int, /) -> tuple:
        """Value and derivatives up to `order`, checked."""
        ...

    def _sums_on_host(self, points: np.ndarray, order: int, /) -> list[np.ndarray]:
        """The same at checked points (N, 3), whatever they are."""
        ...

    def _answer(self, results: list[np.ndarray], array: np.ndarray, single: bool, /) -> tuple:
        """Results as a user gets them."""
        ...


class FastField:
    """A field whose sums over many elements at many points are taken by a fast multipole method.

    Made by `Field.fast`. `tolerance`, `proved`: as given there. `summed_exactly`: how many elements always are.
    """

    def __init__(self, field: Exact, tolerance: RealLike, *, proved: bool = False, threads: WholeLike | None = None):
        self.field = field
        self.tolerance = validate.number("Field.fast", "tolerance", tolerance, at_least=FINEST, at_most=COARSEST)
        self.proved = validate.flag("Field.fast", "proved", proved)
        self.threads = checked_threads("Field.fast", threads)

    @functools.cached_property
    def _parts(self) -> tuple[list[Group], Elements]:
        """The groups that are summed fast, and the elements that are summed exactly."""
        elements = self.field.elements
        groups, alone = groups_of(elements, LEAST)
        rest, self._grouped = (  # what is in no group, and what is
            Elements(elements.rows[some], elements.kinds[some], elements.order[some]) for some in (alone, ~alone)
        )
        if len(elements) >= LEAST and 2 * len(rest) > len(elements):
            warnings.warn(
                f"Field.fast: {len(rest)} of {len(elements)} elements are summed exactly; what is summed fast are "
                f"points, segments and arcs, at least {LEAST} of one kernel of one width",
                FieldsimWarning,
                stacklevel=4,
            )
        return groups, rest

    @property
    def summed_exactly(self) -> int:
        """How many elements are summed exactly: those that no group of one kernel holds."""
        return len(self._parts[1])

    def value(self, points: ArrayLike) -> Any:
        """F at points: (N, 3) -> (N,); (3,) -> float."""
        return self._evaluate(points, 0)[0]

    def gradient(self, points: ArrayLike) -> np.ndarray:
        """The gradient of F: (N, 3) -> (N, 3); (3,) -> (3,)."""
        return self._evaluate(points, 1)[1]

    def hessian(self, points: ArrayLike) -> np.ndarray:
        """The matrix of second derivatives of F: (N, 3) -> (N, 3, 3), symmetric; (3,) -> (3, 3)."""
        return self._evaluate(points, 2)[2]

    def value_and_gradient(self, points: ArrayLike) -> tuple[Any, np.ndarray]:
        """F and its gradient in one evaluation."""
        return self._evaluate(points, 1)

    def error_bounds(self, points: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How wrong value, gradient and Hessian can be at points (N, 3), whatever the elements: (N,) each.

        Gradients and Hessians by their norms. 0 where sums are exact. Errors are a small part of these bounds.
        """
        array, _single = host_points(points)
        sums, which = self._sums(array, 0)
        found = np.zeros((3, len(array)))
        for one in sums:
            found[:, which] += one.bounds
        return found[0], found[1], found[2]

    def _evaluate(self, points, order):
        """As `Field._evaluate`, for points on the host."""
        array, single = host_points(points)
        sums, which = self._sums(array, order)
        if not sums:
            return self.field._evaluate(points, order)
        results = [np.zeros((len(array), *shape)) for shape in SHAPES[: order + 1]]
        for one in sums:
            for result, part in zip(results, one.results, strict=True):
                result[which] += part
        self._add_exact(results, array, slice(None), self._parts[1], order)
        if not which.all():
            self._add_exact(results, array, ~which, self._grouped, order)
        return self.field._answer(results, array, single)

    def _add_exact(self, results, points, which, elements, order):
        """Add the exact sums of some elements at some points."""
        if len(elements):
            exact = self.field.of_elements(elements)._sums_on_host(points[which], order)
            for result, part in zip(results, exact, strict=True):
                result[which] += part

    def _sums(self, points, order) -> tuple[list[Sum], np.ndarray]:
        """The fast sums of all groups, none where exact ones take no longer; and at which of the points, a mask."""
        nowhere = np.zeros(len(points), dtype=bool)
        if len(points) * len(self.field.elements) <= EXACT * LEAST:
            return [], nowhere
        with _told(len(self.field.elements), len(points)) as tell:
            tell("dividing elements")
            groups, _rest = self._parts
            if all(len(points) * group.count <= EXACT * group.measured for group in groups):
                return [], nowhere
            which = ~nowhere
            for group in groups:
                root = group.pieces.tree.root
                middle, most = root.low + 0.5 * root.width, 0.5 * root.width * 2.0 ** (FARTHEST_DOUBLING - 1)
                which &= (np.abs(points - middle) < most).all(axis=1)
            if not which.any():
                return [], nowhere
            options = {"proved": self.proved, "threads": self.threads, "tell": tell}
            return [fast_sum(group, points[which], self.tolerance, order, **options) for group in groups], which

    def __repr__(self):
        return f"{self.field!r}.fast(tolerance={self.tolerance:g})"


@contextlib.contextmanager
def _told(elements, points):
    """A function that says what is being done, to one who watches and has waited."""
    began, said = time.perf_counter(), []

    def tell(words):
        if is_watched(sys.stderr) and time.perf_counter() - began > PATIENCE:
            said.append(words)
            text = f"fieldsim: {elements} elements at {points} points: {words}"
            print(f"\r{text:<78}", end="", file=sys.stderr, flush=True)

    try:
        yield tell
    finally:
        if said:
            print(f"\r{'':<78}\r", end="", file=sys.stderr, flush=True)
