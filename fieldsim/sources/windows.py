"""Moving sources at any time: Chebyshev interpolants of their rows over a window of time.

An adaptive step evaluates forces at times that are not known in advance. So the rows of moving elements are sampled on
the host over a window and interpolated; the window is halved until the interpolants agree with further samples to
rounding. The kernels evaluate the interpolants; no step passes a window's end. Windows depend on the motions alone, not
on the times of output.
"""

import dataclasses
import math

import numpy as np
import warp as wp

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
# Windows shorter than this share of the longest are not halved further: they contain a jump. The first window may be
# short because of the unit of time, so it is halved much farther, as if the longest were no longer than NO_LENGTH.
SHORTEST = 2.0**-30
NO_LENGTH = 2.0**-170
# Greatest error of an interpolant, relative to the coordinates.
AGREEMENT = 4e-15


@wp.struct
class Window:
    """Interpolants over the time until `end`; middle, half: of the window; inf where nothing moves.

    coefficients (columns, DEGREE + 1): of each number that changes, found in row rows[c], column columns[c].
    """

    end: wp.float64
    middle: wp.float64
    half: wp.float64
    coefficients: wp.array2d(dtype=wp.float64)
    rows: wp.array(dtype=wp.int32)
    columns: wp.array(dtype=wp.int32)


@portable
def interpolated(u: real, coefficients: Table, k: int):
    """The k-th interpolant of a window at u = -1..1 from its start to its end: Clenshaw's recurrence."""
    twice = u + u
    b1 = real(0.0)
    b2 = real(0.0)
    for j in range(DEGREE):
        b0 = twice * b1 - b2 + coefficients[k, DEGREE - j]
        b2 = b1
        b1 = b0
    return u * b1 - b2 + coefficients[k, 0]


def _cosines(numerators, denominator):
    """cos(pi numerators / denominator), reduced while exact."""
    return np.cos(np.pi / denominator * (numerators % (2 * denominator)))


_DEGREES = np.arange(DEGREE + 1)
_ODD = 2 * _DEGREES + 1
# Where rows are sampled, the points between, and the polynomials' values at these.
_POINTS = _cosines(_ODD, 2 * len(_ODD))
_BETWEEN = _cosines(np.arange(DEGREE + 2), DEGREE + 1)
_AT_BETWEEN = _cosines(np.outer(np.arange(DEGREE + 2), _DEGREES), DEGREE + 1)
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
        self._plan, self._longest = FIRST_LENGTH, NO_LENGTH
        self.start, self.end = start, start if sources.moving else math.inf
        self.rows = np.zeros((0, ROW_WIDTH))
        self.window = Window()
        self.window.end = self.end
        self._fill(np.zeros((0, DEGREE + 1)), np.zeros((0, 2), dtype=int))

    def advance(self) -> bool:
        """Go on to the next window; whether the numbers that stay over it are those of the window before."""
        start, limit, length = self.end, self._next_key(), self._plan
        while True:
            end = min(start + length, limit)
            samples, known, agree = self._sampled(start, end)
            if agree or length <= max(SHORTEST * self._longest, 64 * np.spacing(abs(start))):
                break
            length = 0.5 * (end - start)
        self._longest = max(length, self._longest)
        self.start, self.end = start, end
        self.window.end, self.window.middle, self.window.half = end, 0.5 * (start + end), 0.5 * (end - start)
        changing = (samples != samples[0]).any(axis=0)
        rows, earlier = np.where(changing, np.nan, samples[0]), self.rows
        coefficients, self.rows = _coefficients(samples)[:, changing], rows
        self._plan = length if end == limit else length * _growth(coefficients, known[changing])
        self._fill(coefficients, np.argwhere(changing))
        return np.array_equal(rows, earlier, equal_nan=True)

    def _fill(self, coefficients, places):
        window, device = self.window, self._device
        window.coefficients = wp.array(np.ascontiguousarray(coefficients.T), dtype=wp.float64, device=device)
        window.rows = wp.array(np.ascontiguousarray(places[:, 0]), dtype=wp.int32, device=device)
        window.columns = wp.array(np.ascontiguousarray(places[:, 1]), dtype=wp.int32, device=device)

    def _next_key(self):
        """The first time after the present window when some keyframe's curve has a kink."""
        return min((_key_after(keys, self.end) for keys in self._keys), default=math.inf)

    def _sampled(self, start, end):
        """Rows at the sampling points, how well they are known, and whether interpolants agree with rows in between."""
        middle, half = 0.5 * (start + end), 0.5 * (end - start)
        rows = self._sources.rows_at(np.clip(middle + half * np.concatenate([_POINTS, _BETWEEN]), start, end))
        samples, between = np.split(rows, [len(_POINTS)])
        error = np.abs(np.tensordot(_AT_BETWEEN, _coefficients(samples), axes=1) - between).max(axis=0)
        # The rounding of times moves fast elements, too.
        speed = np.abs(np.diff(samples, axis=0)).max(axis=0) / (half * np.abs(np.diff(_POINTS)).min())
        rounding = 4.0 * np.spacing(max(abs(start), abs(end))) * speed
        known = AGREEMENT * _sizes(samples) + rounding
        return samples, known, bool((error <= known).all())


def _growth(coefficients, known):
    """How many times longer the next window may be; coefficients (DEGREE + 1, M) of M numbers, known so well (M,)."""
    count = np.flatnonzero((np.abs(coefficients) > known).any(axis=1)).max(initial=1)
    return min(GROWTH, max(1.0, AIM / count))


def _sizes(samples):
    """What numbers in rows are to be compared with, (elements, ROW_WIDTH): positions with the largest coordinate."""
    sizes = np.abs(samples).max(axis=0)
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
