"""Surfaces as contact needs them: how far each element's surface can reach, and how fast it moves.

A surface element's row gets one more column, REACH: where a point is farther from every primitive than its reach, the
sum of all elements cannot come to 1. The least of distance minus reach over the elements, the *margin*, is therefore a
safe distance to the surface F = 1.
"""

import functools
import math
import warnings

import numpy as np
import warp as wp

from fieldsim.dynamics.sources import Sources, Stages, tables
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.portable import Indices, Portable, Table, portable, real
from fieldsim.potentials import cells
from fieldsim.potentials.arc import Arc
from fieldsim.potentials.circle import Circle
from fieldsim.potentials.kernels import Cauchy, Gaussian
from fieldsim.potentials.point import Point
from fieldsim.potentials.segment import Segment

REACH = cells.WIDTH


def gaussian_reach(width, fold, strength):
    """Distance where strength * exp(fold - width^2 r^2) falls to 1."""
    return np.sqrt(np.maximum(0.0, fold + np.log(strength))) / width


def cauchy_reach(width, fold, strength):
    """Distance where strength / (1 + width^2 r^2)^2 falls to 1."""
    return np.sqrt(np.maximum(0.0, np.sqrt(strength) - 1.0)) / width


_REACHES = {Gaussian: gaussian_reach, Cauchy: cauchy_reach}
_MEASURES = {
    Point: lambda rows: 1.0,
    Segment: lambda rows: rows[..., cells.SIZE],
    Arc: lambda rows: rows[..., cells.SIZE] * rows[..., cells.ANGLE],
    Circle: lambda rows: rows[..., cells.SIZE] * rows[..., cells.ANGLE],
}


def with_reach(rows, kinds, total: int):
    """Rows (..., elements, WIDTH) with the column REACH added, for a world of `total` surface elements.

    No element gives more than strength * measure * h(distance to it); the reach is where that is 1 / total.
    """
    reach = np.zeros(rows.shape[:-1])
    for kind, cell in _chart(kinds).items():
        own = rows[..., kinds == kind, :]
        ceiling = own[..., cells.STRENGTH] * _MEASURES[cell.primitive](own) * (total * (1.0 + 1e-9))
        with np.errstate(divide="ignore"):  # an element of no strength reaches nowhere
            far = _REACHES[cell.kernel](own[..., cells.KERNEL], own[..., cells.FOLD], np.maximum(ceiling, 0.0))
        reach[..., kinds == kind] = far
    return np.concatenate([rows, reach[..., None]], axis=-1)


def _chart(kinds):
    """The cells that occur, by kind; raises InputError for one that contact cannot bound."""
    by_kind = {cell.kind: cell for cell in cells.CELLS.values()}
    chart = {kind: by_kind[kind] for kind in np.unique(kinds).tolist()}
    for cell in chart.values():
        if cell.kernel not in _REACHES or cell.primitive not in _MEASURES:
            raise InputError(
                f"no contact is known for a surface of {cell.kernel.__name__} on {cell.primitive.__name__}; "
                "give the particles contact=None, or the body another surface"
            )
    return chart


def sweeps(rows):
    """How far any element's surface may come nearer between one stage and the next, (stages,); 0 for the last.

    rows: (stages, elements, WIDTH + 1). A bound for every point of the primitive, plus the growth of its reach.
    """
    step = np.diff(rows, axis=0)
    points = np.linalg.norm(step[..., cells.POSITIONS].reshape(*step.shape[:2], 3, 3), axis=-1).max(axis=-1)
    turns = np.linalg.norm(step[..., cells.DIRECTIONS].reshape(*step.shape[:2], 2, 3), axis=-1)
    # A point of an arc is centre + size (cos u + sin (n x u)): |change of n x u| <= |change of n| + |change of u|.
    bend = rows[1:, :, cells.SIZE] * (2.0 * turns[..., 0] + turns[..., 1] + np.abs(step[..., cells.ANGLE]))
    bend = np.where(rows[1:, :, cells.ANGLE] > 0.0, bend + np.abs(step[..., cells.SIZE]), 0.0)
    moved = points + bend + np.maximum(step[..., REACH], 0.0)
    return np.append(moved.max(axis=1, initial=0.0), 0.0)


class Surfaces:
    """The collidable surfaces of a world. grain: length over which the field of the thinnest varies little."""

    def __init__(self, world, time: float, free=None):
        self.sources = Sources(world, "surface", time, free)
        fixed = self.sources.fixed
        self._fixed_rows = with_reach(fixed.rows, fixed.kinds, len(self.sources))
        moving = self.sources.rows_at(np.array([time]))
        # Both kernels' parameters are inverse widths.
        parameters = np.concatenate([fixed.rows[:, cells.KERNEL], moving[0, :, cells.KERNEL]])
        self.grain = 0.5 / parameters.max() if len(parameters) else math.inf
        self._still = None
        self._warned = False

    def __len__(self) -> int:
        return len(self.sources)

    def upload(self, times, device) -> Stages:
        """The tables of a launch whose stages are at `times`."""
        if self._still is not None and not self.sources.moving:
            return self._still
        rows = with_reach(self.sources.rows_at(times), self.sources.moving_kinds, len(self))
        sweep = sweeps(rows)
        self._warn_of_leaps(sweep, times)
        stages = tables(self.sources, self._fixed_rows, rows, device, self._still, sweep)
        if self._still is None:
            self._still = stages
        return stages

    def _warn_of_leaps(self, sweep, times):
        fastest = int(np.argmax(sweep))
        if sweep[fastest] > 2.0 * self.grain and not self._warned:
            self._warned = True
            warnings.warn(
                f"at time {times[fastest]:g} a surface moves {sweep[fastest]:.3g} in one step, more than its softness "
                f"{2 * self.grain:.3g}: it may pass over particles; give a shorter dt",
                FieldsimWarning,
                stacklevel=4,
            )


@portable
def _point(x: real, y: real, z: real, rows: Table, i: int):
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@portable
def _segment(x: real, y: real, z: real, rows: Table, i: int):
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    along = dx * rows[i, 14] + dy * rows[i, 15] + dz * rows[i, 16]
    along = min(max(along, real(0.0)), rows[i, 2])
    dx -= along * rows[i, 14]
    dy -= along * rows[i, 15]
    dz -= along * rows[i, 16]
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@portable
def _circle(x: real, y: real, z: real, rows: Table, i: int):
    """Distance to the whole circle of an arc: not more than that to the arc."""
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    height = dx * rows[i, 17] + dy * rows[i, 18] + dz * rows[i, 19]
    dx -= height * rows[i, 17]
    dy -= height * rows[i, 18]
    dz -= height * rows[i, 19]
    off = math.sqrt(dx * dx + dy * dy + dz * dz) - rows[i, 2]
    return math.sqrt(off * off + height * height)


@portable
def _least(x: real, y: real, z: real, rows: Table, kinds: Indices, first: int, count: int):
    least = real(math.inf)
    for i in range(first, first + count):
        least = min(least, distance(x, y, z, rows, kinds, i) - rows[i, REACH])  # noqa: F821 - bound by `_margin`
    return least


_DISTANCES = {Point: _point, Segment: _segment, Arc: _circle, Circle: _circle}


def _margin(kinds) -> Portable:
    """Portable (x, y, z, rows, kinds, first, count) -> least of distance - reach over the rows."""
    primitives = {cell.kind: cell.primitive for cell in cells.CELLS.values()}
    # Without elements nothing is asked for, but the loop over them wants a function to compile.
    distances = {kind: _DISTANCES[primitives[kind]] for kind in kinds or (min(primitives),)}
    return _least.bind(distance=cells.by_kind(distances))


@functools.cache
def margin_at(kinds_used):
    """Warp function (point, surfaces, stage) -> a distance to the surface that is safe from `stage` to the next."""
    fixed_kinds, moving_kinds = kinds_used
    fixed = _margin(fixed_kinds).warp(wp.float64)
    moving = _margin(moving_kinds).warp(wp.float64)

    @wp.func
    def still(p: wp.vec3d, surfaces: Stages, stage: int):
        return fixed(p[0], p[1], p[2], surfaces.rows, surfaces.kinds, 0, surfaces.kinds.shape[0])

    @wp.func
    def both(p: wp.vec3d, surfaces: Stages, stage: int):
        first = stage * surfaces.moving
        two = 2 * surfaces.moving
        near = moving(p[0], p[1], p[2], surfaces.moving_rows, surfaces.moving_kinds, first, two)
        return wp.min(near, still(p, surfaces, stage))

    return both if moving_kinds else still


@functools.cache
def sweep_at(kinds_used):
    """Warp function (surfaces, stage) -> how far a surface may come nearer from `stage` to the next."""

    @wp.func
    def still(surfaces: Stages, stage: int):
        return wp.float64(0.0)

    @wp.func
    def changing(surfaces: Stages, stage: int):
        return surfaces.sweep[stage]

    return changing if kinds_used[1] else still
