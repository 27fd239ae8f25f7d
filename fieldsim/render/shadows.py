"""Shadows of bells: which of them stand between a point and a light.

Parallel light looks at the scene as a camera without a vanishing point does: a grid across its direction lists the
bells above and below each cell, and a shadow ray never leaves its cell. Other lights ask a tree.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools
import math

import numpy as np
import warp as wp

from fieldsim.launch import launch
from fieldsim.render import bells, hermite
from fieldsim.render.candidates import sorted_lists
from fieldsim.render.hits import Balls, Hits, Lights, above, behind_shape
from fieldsim.render.shading import ball_shadow, lit, towards, unlit
from fieldsim.render.sky import Sky

_MOST = 256  # cells along a side of a grid


@wp.struct
class Blockers:
    """What may block light: a tree of all elements, and a grid for each parallel light.

    Cell c of grid k lists ids[first[k side^2 + c] : first[k side^2 + c + 1]], large ones first. grid: a light's grid,
    or -1; right, up: axes across its light, per cell, and the grid's corner, in cells; side: cells along a side.
    """

    tree: wp.uint64
    grid: wp.array(dtype=int)
    right: wp.array(dtype=wp.vec4)
    up: wp.array(dtype=wp.vec4)
    side: int
    first: wp.array(dtype=int)
    ids: wp.array(dtype=int)


@wp.kernel(enable_backward=False)
def _fill(
    begin: int,
    number: int,
    side: int,
    order: wp.array(dtype=int),
    rectangle: wp.array(dtype=wp.vec4i),
    slot: wp.array(dtype=int),
    cell: wp.array(dtype=int),
    ids: wp.array(dtype=int),
):
    item = begin + wp.tid()
    k = item // number
    r = rectangle[item]
    entry = slot[item]
    for y in range(r[1], r[3]):
        for x in range(r[0], r[2]):
            cell[entry] = (k * side + y) * side + x
            ids[entry] = order[item - k * number]
            entry += 1


def blockers_of(lights, bounded, stage, device) -> Blockers:
    """Blockers of the lights; the tree is the stage's, where one is needed."""
    blockers = Blockers()
    where, casting = lights.where.numpy(), lights.shadows.numpy() == 1
    parallel = np.flatnonzero(casting & (where[:, 3] == 0.0))
    blockers.tree = stage.tree if len(parallel) < casting.sum() else wp.uint64(0)
    grid = np.full(len(where), -1, dtype=np.int32)
    grid[parallel] = np.arange(len(parallel))
    number = len(bounded.radius)
    side = int(np.clip(4 * math.sqrt(number), 8, _MOST))
    order = np.argsort(-bounded.radius, kind="stable")
    axes, rectangles = [], []
    for k in parallel:
        right_up, rectangle = _rectangles(where[k, :3], bounded, order, side)
        axes.append(right_up)
        rectangles.append(rectangle)
    right_up = np.array(axes).reshape(-1, 2, 4)
    rectangle = np.concatenate([np.zeros((0, 4)), *rectangles]).astype(np.int32)
    count = np.prod(rectangle[:, 2:] - rectangle[:, :2], axis=1)
    total = int(count.sum())
    cell = wp.empty(max(2 * total, 1), dtype=int, device=device)
    blockers.ids = wp.empty(max(2 * total, 1), dtype=int, device=device)
    inputs = [wp.array(x.astype(np.int32), dtype=int, device=device) for x in (order, np.cumsum(count) - count)]
    inputs.insert(1, wp.array(rectangle, dtype=wp.vec4i, device=device))
    launch(_fill, len(count), [number, side, *inputs], [cell, blockers.ids], device=device, grain=4096)
    blockers.first = sorted_lists(cell, blockers.ids, total, len(parallel) * side**2, device)
    blockers.grid = wp.array(grid, dtype=int, device=device)
    blockers.right = wp.array(right_up[:, 0], dtype=wp.vec4, device=device)
    blockers.up = wp.array(right_up[:, 1], dtype=wp.vec4, device=device)
    blockers.side = side
    return blockers


def _rectangles(toward, bounded, order, side):
    """Axes (2, 4) of a grid across a direction, and the cells (N, 4) that capsules cover: x0, y0 to below x1, y1."""
    right = np.cross(toward, np.eye(3)[np.argmin(np.abs(toward))])
    right /= np.linalg.norm(right)
    across = np.stack([right, np.cross(toward, right)], axis=1)
    ends = np.stack([bounded.start[order] @ across, bounded.end[order] @ across])
    # Cells a little larger than the float32 positions on them are uncertain.
    radius = bounded.radius[order, None] * (1 + 1e-5)
    low, high = ends.min(axis=0) - radius, ends.max(axis=0) + radius
    corner = low.min(axis=0)
    cell = (high.max(axis=0) - corner).max() / side * (1 + 1e-5)
    axes = np.concatenate([across.T / cell, -corner[:, None] / cell], axis=1)
    slack = 1e-6 * np.abs(corner / cell).max()
    first = np.floor((low - corner) / cell - slack)
    last = np.floor((high - corner) / cell + slack) + 1
    return axes, np.clip(np.concatenate([first, last], axis=1), 0, side)


@functools.cache
def shade_kernel(segments):
    """The kernel that shades hits on surfaces made of bells."""
    gather, search = bells.functions(segments)
    room = int(bells.ROOM)

    @wp.func
    def surface_shadow(
        p: wp.vec3,
        toward: wp.vec3,
        far: float,
        light: int,
        table: bells.Bells,
        blockers: Blockers,
        ids: wp.array(dtype=int),
        bell: wp.array(dtype=wp.vec4),
        ends: wp.array(dtype=wp.vec4),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
    ):
        """Where something blocks the light, NO_HIT or GIVEN_UP."""
        count = int(0)
        opaque = float(far)
        grid = blockers.grid[light]
        if grid >= 0:
            right = blockers.right[grid]
            up = blockers.up[grid]
            x = int(wp.floor(right[0] * p[0] + right[1] * p[1] + right[2] * p[2] + right[3]))
            y = int(wp.floor(up[0] * p[0] + up[1] * p[1] + up[2] * p[2] + up[3]))
            if wp.min(x, y) < 0 or wp.max(x, y) >= blockers.side:
                return hermite.NO_HIT
            cell = (grid * blockers.side + y) * blockers.side + x
            for k in range(blockers.first[cell], blockers.first[cell + 1]):
                count, opaque = gather(blockers.ids[k], p, toward, far, table, ids, bell, ends, t0s, t1s, count)
                if opaque < far:
                    return opaque
        else:
            query = wp.bvh_query_ray(blockers.tree, p, toward)
            i = int(0)
            while wp.bvh_query_next(query, i, far):
                count, opaque = gather(i, p, toward, far, table, ids, bell, ends, t0s, t1s, count)
                if opaque < far:
                    return opaque
        hit, _count = search(far, far, True, ids, bell, ends, t0s, t1s, count)
        return hit

    @wp.kernel(module="unique", enable_backward=False)
    def shade_bells(
        start: int,
        group: int,
        table: bells.Bells,
        blockers: Blockers,
        balls: Balls,
        lights: Lights,
        sky: Sky,
        hits: Hits,
        color: wp.array(dtype=wp.vec3),
        rays: wp.array(dtype=int),
    ):
        ids = wp.zeros(shape=room, dtype=int)
        bell = wp.zeros(shape=room, dtype=wp.vec4)
        ends = wp.zeros(shape=wp.static(room if segments else 1), dtype=wp.vec4)
        t0s = wp.zeros(shape=room, dtype=float)
        t1s = wp.zeros(shape=room, dtype=float)
        first = (start + wp.tid()) * group
        for i in range(first, wp.min(first + group, color.shape[0])):
            result = unlit(i, hits, sky)
            cast = int(0)
            if hits.thing[i] != -1:
                p = above(i, hits)
                for k in range(lights.where.shape[0]):
                    toward, far = towards(p, lights.where[k])
                    dark = float(hermite.NO_HIT)
                    if wp.dot(hits.normal[i], toward) <= 0.0:
                        continue
                    if lights.shadows[k] == 1:
                        cast += 1
                        if behind_shape(i, k, hits) or ball_shadow(p, toward, far, balls):
                            continue
                        dark = surface_shadow(p, toward, far, k, table, blockers, ids, bell, ends, t0s, t1s)
                        if dark == bells.GIVEN_UP:
                            cast = -1
                            break
                    if dark < 0.0:
                        result += lit(i, toward, lights.color[k], hits)
            color[i] = result
            rays[i] = cast

    return shade_bells
