"""Margins: a safe distance to the surface, and how fast it shrinks.

A surface element's row gets two more columns, ALONE (see `rows`) and REACH: where a point is farther from every
primitive than its reach, the sum of all elements cannot come to 1. The least of distance minus reach over the elements,
the *margin*, is therefore a safe distance to the surface F = 1.
"""

import functools
import math

import numpy as np
import warp as wp

from fieldsim.errors import InputError
from fieldsim.launch import launch
from fieldsim.portable import Indices, Portable, Table, hole, portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.bounds.reach import alone, reach
from fieldsim.potentials.row import ANGLE, DIRECTIONS, POSITIONS, SIZE
from fieldsim.sources.rows import DEFORMS, REACH, shift_of, turn_of
from fieldsim.sources.stages import Stages
from fieldsim.sources.surface_velocity import screw


def with_reach(rows, kinds, total: int):
    """Rows (..., elements, ROW_WIDTH) with REACH and ALONE added, for a world of `total` surface elements.

    The reach is where an element's field cannot be more than 1 / total.
    """
    return np.concatenate(
        [rows, reach(rows, kinds, 1.0 / max(total, 1))[..., None], alone(rows, kinds)[..., None]], axis=-1
    )


def _that_are(kinds, trait):
    """Which elements' primitives have the trait, (elements,)."""
    wanted = [formula.kind for formula in registry.FORMULAS.values() if getattr(formula.primitive, trait)]
    return np.isin(kinds, wanted)


def sweeps(rows, kinds):
    """Bound of any surface's approach between one stage and the next, (stages,); 0 for the last.

    rows: (stages, elements, columns to ALONE). A bound for every point of the primitive, plus the growth of its reach.
    """
    step = np.diff(rows, axis=0)
    points = np.linalg.norm(step[..., POSITIONS].reshape(*step.shape[:2], 3, 3), axis=-1).max(axis=-1)
    turns = np.linalg.norm(step[..., DIRECTIONS].reshape(*step.shape[:2], 2, 3), axis=-1)
    if (turns[:, _that_are(kinds, "endless"), 1] > 1e-12).any():
        raise InputError("contact with a Plane that turns is not known; move it without turning, or use a rectangle")
    # A point of an arc is centre + size (cos u + sin (n x u)): |change of n x u| <= |change of n| + |change of u|.
    bend = rows[1:, :, SIZE] * (2.0 * turns[..., 0] + turns[..., 1] + np.abs(step[..., ANGLE]))
    bend += np.abs(step[..., SIZE])
    bend = np.where(_that_are(kinds, "round"), bend, 0.0)
    moved = points + bend + np.maximum(step[..., REACH], 0.0)
    return np.append(moved.max(axis=1, initial=0.0), 0.0)


distance = hole("x, y, z, rows, kinds, i")


@portable
def _least(x: real, y: real, z: real, rows: Table, kinds: Indices, first: int, count: int):
    least = real(math.inf)
    for i in range(first, first + count):
        least = min(least, distance(x, y, z, rows, kinds, i) - rows[i, REACH])
    return least


def margin_of(kinds) -> Portable:
    """Portable (x, y, z, rows, kinds, first, count) -> least of distance - reach over the rows."""
    primitives = {formula.kind: formula.primitive for formula in registry.FORMULAS.values()}
    # Without elements the loop is empty, but needs some function to compile.
    distances = {kind: primitives[kind].distance for kind in kinds or (min(primitives),)}
    return _least.bind(distance=registry.by_kind(distances))


@functools.cache
def _margin_kernel(kinds):
    margin = margin_of(kinds).warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(start: int, points: wp.array(dtype=wp.vec3d), stages: Stages, margins: wp.array(dtype=wp.float64)):
        i = start + wp.tid()
        p = points[i]
        margins[i] = margin(p[0], p[1], p[2], stages.rows, stages.kinds, 0, stages.kinds.shape[0])

    return evaluate


def margins(elements, points) -> np.ndarray:
    """Margins (N,) of the surface of packed elements at `points` (N, 3), in the elements' frame, on the host."""
    stages = Stages()
    rows = with_reach(elements.rows, elements.kinds, len(elements))
    stages.rows = wp.array(rows, dtype=wp.float64, device="cpu")
    stages.kinds = wp.array(elements.kinds, dtype=wp.int32, device="cpu")
    points = wp.array(points, dtype=wp.vec3d, device="cpu")
    found = wp.empty(len(points), dtype=wp.float64, device="cpu")
    launch(_margin_kernel(elements.kinds_used), len(points), [points, stages], [found], device="cpu")
    return found.numpy()


@functools.cache
def margin_at(kinds_used):
    """Warp function (point, surfaces, stage, s) -> a safe distance to the surface at the fraction s of a step."""
    fixed_kinds, moving_kinds = kinds_used
    fixed = margin_of(fixed_kinds).warp(wp.float64)
    moving = margin_of(moving_kinds).warp(wp.float64)

    @wp.func
    def still(p: wp.vec3d, surfaces: Stages, stage: int, s: wp.float64):
        return fixed(p[0], p[1], p[2], surfaces.rows, surfaces.kinds, 0, surfaces.kinds.shape[0])

    @wp.func
    def from_stage(p: wp.vec3d, surfaces: Stages, i: int, share: wp.float64, turn: wp.vec3d, shift: wp.vec3d):
        """Of one row, a share of a twist after its stage."""
        q = screw(p, -share * turn, -share * shift)
        return moving(q[0], q[1], q[2], surfaces.moving_rows, surfaces.moving_kinds, i, 1)

    @wp.func
    def both(p: wp.vec3d, surfaces: Stages, stage: int, s: wp.float64):
        least = still(p, surfaces, stage, s)
        for i in range(stage * surfaces.moving, (stage + 1) * surfaces.moving):
            turn = turn_of(surfaces.moving_rows, i)
            shift = shift_of(surfaces.moving_rows, i)
            least = wp.min(least, from_stage(p, surfaces, i, s, turn, shift))
            if surfaces.moving_rows[i, DEFORMS] != wp.float64(0.0):
                later = from_stage(p, surfaces, i + surfaces.moving, s - wp.float64(1.0), turn, shift)
                least = wp.min(least, later)
        return least

    return both if moving_kinds else still


@functools.cache
def sweep_at(kinds_used):
    """Warp function (surfaces, stage) -> bound of any surface's approach from `stage` to the next."""

    @wp.func
    def still(surfaces: Stages, stage: int):
        return wp.float64(0.0)

    @wp.func
    def changing(surfaces: Stages, stage: int):
        return surfaces.sweep[stage]

    return changing if kinds_used[1] else still
