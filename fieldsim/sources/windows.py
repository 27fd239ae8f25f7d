"""Moving sources at any time: Chebyshev interpolants of their rows over a window of time.

An adaptive step evaluates forces at times that are not known in advance. So the rows of moving elements are sampled on
the host over a window and interpolated; the window is halved until the interpolants agree with further samples to
rounding. The kernels evaluate the interpolants; no step passes the end of a window, or of one of its parts. Windows
depend on the motions alone, not on the times of output.
"""

import dataclasses
import math

import numpy as np
import warp as wp

from fieldsim.errors import InputError
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.row import DIRECTIONS, POSITIONS, ROW_WIDTH
from fieldsim.sources.elements import Sources
from fieldsim.world.motion import Keyframes

DEGREE = 20
# A first try; later windows are at most GROWTH times as long as the one before, and so long that this degree of their
# interpolants is about the last that counts.
FIRST_LENGTH = 2.0
GROWTH = 2.0
AIM = DEGREE - 2
# A window has parts of one length, twice as many as the one before: at most so many, for which at most so many rows are
# sampled at once.
PARTS = 32
SAMPLES = 30_000
# Windows shorter than this share of the longest are not halved further: they contain a jump. The first window may be
# short because of the unit of time, so it is halved much farther, as if the longest were no longer than NO_LENGTH.
SHORTEST = 2.0**-30
NO_LENGTH = 2.0**-170
# Greatest error of an interpolant, relative to the coordinates.
AGREEMENT = 4e-15


@wp.struct
class Window:
    """Interpolants over the time from bounds[0] on: part p of `parts` lasts until bounds[p + 1].

    The last bound is inf where nothing moves. coefficients (parts * numbers, DEGREE + 1): of each number that changes,
    part after part. What changes, in row rows[c], column columns[c], is the number which[c]; these ascend.
    """

    bounds: wp.array(dtype=wp.float64)
    parts: int
    numbers: int
    coefficients: wp.array2d(dtype=wp.float64)
    rows: wp.array(dtype=wp.int32)
    columns: wp.array(dtype=wp.int32)
    which: wp.array(dtype=wp.int32)


@wp.func
def part_from(window: Window, t: wp.float64):
    """The part of a window in which a step from the time t on lies."""
    part = wp.int32(0)
    for p in range(1, window.parts):
        if t >= window.bounds[p]:
            part = p
    return part


@portable
def interpolated(u: real, coefficients: Table, k: int):
    """The k-th interpolant of a window at u = -1..1 from its part's start to its end: Clenshaw's recurrence."""
    twice = u + u
    b1 = real(0.0)
    b2 = real(0.0)
    for j in range(DEGREE):
        b0 = twice * b1 + (coefficients[k, DEGREE - j] - b2)
        b2 = b1
        b1 = b0
    return u * b1 + (coefficients[k, 0] - b2)


def _cosines(numerators, denominator):
    """cos(pi numerators / denominator), reduced while exact."""
    return np.cos(np.pi / denominator * (numerators % (2 * denominator)))


_DEGREES = np.arange(DEGREE + 1)
_ODD = 2 * _DEGREES + 1
# Where rows are sampled, the points between, and the polynomials' values at these.
_POINTS = _cosines(_ODD, 2 * len(_ODD))
_BETWEEN = _cosines(np.arange(DEGREE + 2), DEGREE + 1)
_AT_BETWEEN = _cosines(np.outer(np.arange(DEGREE + 2), _DEGREES), DEGREE + 1)
SAMPLED = len(_POINTS) + len(_BETWEEN)
# From samples to coefficients.
_TRANSFORM = _cosines(np.outer(_DEGREES, _ODD), 2 * len(_ODD)) * (2.0 / len(_ODD))
_TRANSFORM[0] *= 0.5


def _coefficients(samples):
    """Chebyshev coefficients (DEGREE + 1, ...) of samples; of their changes first, so that constants stay exact."""
    level = samples[DEGREE // 2]
    result = np.tensordot(_TRANSFORM, samples - level, axes=1)
    result[0] += level
    return result


class Windows:
    """The windows of one world's sources in turn, from `start` on.

    start, end: of the present one; rows (M, ROW_WIDTH): what stays over it, NaN where numbers change.
    """

    def __init__(self, sources: Sources, world, start: float, device):
        self._sources = sources
        self._device = device
        self._keys = keyframes(world)
        self._plan, self._parts, self._longest = FIRST_LENGTH, 1, NO_LENGTH
        self._most = max(1, min(PARTS, SAMPLES // (SAMPLED * max(1, len(sources.moving_kinds)))))
        self.rows = np.zeros((0, ROW_WIDTH))
        self.window = Window()
        nothing = np.zeros((DEGREE + 1, 1, 0))
        self._fill([start, start if sources.moving else math.inf], nothing, nothing, np.zeros((0, 2), dtype=int))

    def advance(self) -> bool:
        """Go on to the next window; whether the numbers that stay over it are those of the window before."""
        start, limit, length, parts = self.end, self._next_key(), self._plan, self._parts
        while True:
            bounds = _bounds(start, length, parts, limit)
            length = bounds[1] - start
            try:
                rows, changing, samples, known, agree = self._sampled(bounds)
            except InputError:
                if len(bounds) == 2:
                    raise
                # A motion that ends somewhere is sampled beyond its end as little as can be.
                self._most = parts = 1
                continue
            good = len(agree) if agree.all() else int(np.argmin(agree))
            if good or length <= max(SHORTEST * self._longest, 64 * np.spacing(abs(start))):
                break
            length, parts = 0.5 * length, 1
        self._parts = min(self._most, 2 * len(agree)) if agree.all() else 1
        good = max(1, good)
        self._longest = max(length, self._longest)
        samples, earlier = samples[:, :good], self.rows
        coefficients = _coefficients(samples)
        self.rows = np.where(changing, np.nan, rows)
        if bounds[good] < limit:
            self._plan = length * _growth(coefficients, known[:good])
        self._fill(bounds[: good + 1], samples, coefficients, np.argwhere(changing))
        return np.array_equal(self.rows, earlier, equal_nan=True)

    def _fill(self, bounds, samples, coefficients, places):
        """Make the window of samples and interpolants, (DEGREE + 1, parts, M) each, of numbers at places (M, 2)."""
        self.start, self.end = bounds[0], bounds[-1]
        # Many numbers are the same: a body's points, and columns of its elements that mean nothing, move alike.
        known: dict[bytes, int] = {}
        which = [known.setdefault(samples[..., k].tobytes(), len(known)) for k in range(len(places))]
        which = np.array(which, dtype=int)
        table = np.moveaxis(coefficients, 0, -1)
        different, order = np.unique(which, return_index=True)[1], np.argsort(which, kind="stable")
        window, device = self.window, self._device
        window.parts, window.numbers = len(table), len(different)
        window.bounds = wp.array(bounds, dtype=wp.float64, device=device)
        table = table[:, different].reshape(len(table) * len(different), DEGREE + 1)
        window.coefficients = wp.array(table, dtype=wp.float64, device=device)
        for name, values in (("rows", places[order, 0]), ("columns", places[order, 1]), ("which", which[order])):
            setattr(window, name, wp.array(values, dtype=wp.int32, device=device))

    def _next_key(self):
        """The first time after the present window when some keyframe's curve has a kink."""
        return min((_key_after(keys, self.end) for keys in self._keys), default=math.inf)

    def _sampled(self, bounds):
        """Rows at the start (M, ROW_WIDTH), which of their numbers change, and samples of these K numbers.

        Then how well these are known (parts, K), and in which parts interpolants agree with what is in between.
        """
        starts, ends = np.array(bounds[:-1]), np.array(bounds[1:])
        middles, halves = 0.5 * (starts + ends), 0.5 * (ends - starts)
        times = np.clip(middles + halves * np.concatenate([_POINTS, _BETWEEN])[:, None], starts, ends)
        rows = self._sources.rows_at(times.ravel())
        changing = (rows != rows[0]).any(axis=0)
        numbers = rows[:, changing].reshape(*times.shape, -1)
        samples, between = np.split(numbers, [len(_POINTS)])
        error = np.abs(np.tensordot(_AT_BETWEEN, _coefficients(samples), axes=1) - between).max(axis=0)
        # The rounding of times moves fast elements, too.
        closest = halves * np.abs(np.diff(_POINTS)).min()
        grain = 4.0 * np.spacing(np.maximum(np.abs(starts), np.abs(ends))) / closest
        rounding = np.abs(np.diff(samples, axis=0)).max(axis=0) * grain[:, None]
        known = AGREEMENT * _sizes(rows)[changing] + rounding
        return rows[0], changing, samples, known, (error <= known).all(axis=1)


def _bounds(start, length, parts, limit):
    """Where the parts of a window begin and end: so many of a length, or what there is up to a limit."""
    if start + length >= limit:
        return [start, limit]
    if start + parts * length > limit:
        parts = int((limit - start) / length)
    return [start, *(start + length * k for k in range(1, parts + 1))]


def _growth(coefficients, known):
    """How many times longer the next window's parts may be.

    coefficients (DEGREE + 1, parts, M) of M numbers, known so well (parts, M).
    """
    count = np.flatnonzero((np.abs(coefficients) > known).any(axis=(1, 2))).max(initial=1)
    return min(GROWTH, max(1.0, AIM / count))


def _sizes(rows):
    """What numbers in rows are to be compared with, (M, ROW_WIDTH): positions with the largest coordinate."""
    sizes = np.abs(rows).max(axis=0)
    for group in (POSITIONS, DIRECTIONS):
        sizes[:, group] = sizes[:, group].max(axis=1, keepdims=True)
    return sizes


def keyframes(world) -> list[Keyframes]:
    """All keyframes that move or deform what pulls."""
    values = []
    for body in world.bodies:
        if body.gravity is not None:
            parts = [getattr(p, field.name) for p in body.skeleton for field in dataclasses.fields(p)]
            values += [body.motion, body.mass, *parts]
    return [value for value in values if isinstance(value, Keyframes)]


def _key_after(keys, time):
    first, last = keys.times[0], keys.times[-1]
    if keys.loop and last > first:
        turn = math.floor((time - first) / (last - first))
        later = [(turn + k) * (last - first) + key for k in (0, 1) for key in keys.times]
    else:
        later = keys.times
    return min((key for key in later if key > time), default=math.inf)
