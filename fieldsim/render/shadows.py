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
from fieldsim.render import lockstep
from fieldsim.render.bells import Bells
from fieldsim.render.candidates import sorted_lists
from fieldsim.render.hits import Balls, Hits, Lights, above, behind_shape
from fieldsim.render.lanes import OPTIONS
from fieldsim.render.shading import ball_shadow, lit, towards, unlit
from fieldsim.render.sky import Sky

_MOST = 256  # cells along a side of a grid
_DARK, _LIT = (wp.constant(k) for k in (-2, -1))  # instead of a list of what may block a ray


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
def shade_kernel(segments, width):
    """The kernel that shades hits on surfaces made of bells, `width` at a time."""
    first_hits = lockstep.first_hits_function(segments, width, shadow=True)
    rows = int(lockstep.RAY_ROWS)
    room = lockstep.ROOM

    @wp.func
    def cell_of(p: wp.vec3, grid: int, blockers: Blockers):
        """The cell of a grid in which p lies; _LIT for none."""
        right = blockers.right[grid]
        up = blockers.up[grid]
        x = int(wp.floor(right[0] * p[0] + right[1] * p[1] + right[2] * p[2] + right[3]))
        y = int(wp.floor(up[0] * p[0] + up[1] * p[1] + up[2] * p[2] + up[3]))
        if wp.min(x, y) < 0 or wp.max(x, y) >= blockers.side:
            return _LIT
        return (grid * blockers.side + y) * blockers.side + x

    @wp.func
    def aim(
        lane: int,
        i: int,
        light: int,
        lights: Lights,
        blockers: Blockers,
        balls: Balls,
        hits: Hits,
        cast: wp.array(dtype=int),
        rays: wp.array(dtype=float),
    ):
        """A ray to a light. Returns its list: a cell, or its lane where there is no grid; _DARK or _LIT without."""
        if hits.thing[i] == -1:
            return _DARK
        p = above(i, hits)
        toward, far = towards(p, lights.where[light])
        if wp.dot(hits.normal[i], toward) <= 0.0:
            return _DARK
        for k in range(3):
            rays[(lockstep.START + k) * width + lane] = p[k]
            rays[(lockstep.DIRECTION + k) * width + lane] = toward[k]
        rays[rows * width + lane] = far
        if lights.shadows[light] == 0:
            return _LIT
        cast[i] += 1
        if behind_shape(i, light, hits) or ball_shadow(p, toward, far, balls):
            return _DARK
        if blockers.grid[light] < 0:
            return lane
        return cell_of(p, blockers.grid[light], blockers)

    @wp.func
    def meet(
        key: int,
        grid: int,
        table: Bells,
        blockers: Blockers,
        rays: wp.array(dtype=float),
        found: wp.array(dtype=int),
    ):
        """Look for hits of the rays with that key."""
        # Distances matter where the first hit does.
        near = rays
        if grid >= 0:
            first_hits(table, blockers.ids, blockers.first[key], blockers.first[key + 1], near, rays, found)
            return
        p = wp.vec3(rays[key], rays[width + key], rays[2 * width + key])
        d = wp.vec3(rays[3 * width + key], rays[4 * width + key], rays[5 * width + key])
        far = rays[lockstep.FAR * width + key]
        query = wp.bvh_query_ray(blockers.tree, p, d)
        i = int(0)
        count = int(0)
        while wp.bvh_query_next(query, i, far):
            if count < room:
                found[count] = i
            count += 1
        if count > room:
            rays[lockstep.HIT * width + key] = lockstep.GIVEN_UP
        else:
            first_hits(table, found, 0, count, near, rays, found)

    @wp.func
    def shade(
        first: int,
        number: int,
        light: int,
        table: Bells,
        blockers: Blockers,
        lights: Lights,
        hits: Hits,
        color: wp.array(dtype=wp.vec3),
        cast: wp.array(dtype=int),
        rays: wp.array(dtype=float),
        keys: wp.array(dtype=int),
        found: wp.array(dtype=int),
    ):
        """Add what a light gives."""
        for leader in range(number):
            key = keys[leader]
            if key >= 0:
                for lane in range(width):
                    rays[lockstep.FAR * width + lane] = 0.0
                    if lane < number and keys[lane] == key:
                        rays[lockstep.FAR * width + lane] = rays[rows * width + lane]
                meet(key, blockers.grid[light], table, blockers, rays, found)
                for lane in range(leader, number):
                    if keys[lane] == key:
                        hit = rays[lockstep.HIT * width + lane]
                        keys[lane] = wp.where(hit < 0.0, _LIT, _DARK)
                        if hit == lockstep.GIVEN_UP:
                            cast[first + lane] = -(1 << 20)
            if keys[leader] == _LIT:
                toward = wp.vec3(rays[3 * width + leader], rays[4 * width + leader], rays[5 * width + leader])
                i = first + leader
                color[i] = color[i] + lit(i, toward, lights.color[light], hits)

    @wp.kernel(module="unique", enable_backward=False, module_options=OPTIONS)
    def shade_bells(
        start: int,
        group: int,
        table: Bells,
        blockers: Blockers,
        balls: Balls,
        lights: Lights,
        sky: Sky,
        hits: Hits,
        color: wp.array(dtype=wp.vec3),
        cast: wp.array(dtype=int),
    ):
        rays = wp.zeros(shape=wp.static((rows + 1) * width), dtype=float)
        keys = wp.zeros(shape=width, dtype=int)
        found = wp.zeros(shape=room, dtype=int)
        begin = (start + wp.tid()) * group
        end = wp.min(begin + group, color.shape[0])
        for first in range(begin, end, width):
            number = wp.min(end - first, width)
            seen = int(0)
            for lane in range(number):
                color[first + lane] = unlit(first + lane, hits, sky)
                cast[first + lane] = 0
                seen += wp.where(hits.thing[first + lane] == -1, 0, 1)
            if seen == 0:
                continue
            for light in range(lights.where.shape[0]):
                for lane in range(number):
                    keys[lane] = aim(lane, first + lane, light, lights, blockers, balls, hits, cast, rays)
                shade(first, number, light, table, blockers, lights, hits, color, cast, rays, keys, found)

    return shade_bells
