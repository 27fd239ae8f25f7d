"""Shadows of Gaussian elements: which elements lie between a point and a light.

For a directional light the elements are sorted into a 2-D grid perpendicular to the light (an orthographic projection),
so that a shadow ray stays within one cell. Point lights use the bounding-volume tree.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools
import math

import numpy as np
import warp as wp

from fieldsim.launch import launch
from fieldsim.render.scene.candidates import sorted_lists
from fieldsim.render.scene.compaction import picked
from fieldsim.render.scene.hits import Balls, Hits, Lights, above, behind_shape, towards
from fieldsim.render.scene.tables import NO_HIT
from fieldsim.render.shading.lights import ball_shadow, lit, unlit
from fieldsim.render.shading.sky import Sky
from fieldsim.render.solvers.packet import packet_tracer
from fieldsim.render.solvers.packet.gaussian_elements import GaussianElements
from fieldsim.render.solvers.packet.simd import OPTIONS, group_of

_MOST = 256  # cells along a side of a grid


@wp.struct
class Blockers:
    """Occluders: a tree of all elements, and a grid for each directional light.

    Cell c of grid k lists ids[first[k side^2 + c] : first[k side^2 + c + 1]], largest radius first. grid: a light's
    grid, or -1; light: a grid's light; right, up: axes across its light, per cell, and the grid's corner, in cells;
    side: cells along a side.
    """

    tree: wp.uint64
    grid: wp.array(dtype=int)
    light: wp.array(dtype=int)
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
    """Occluders for the lights; the tree is the stage's, and only built for point lights."""
    blockers = Blockers()
    where, casting = lights.where.numpy(), lights.shadows.numpy() == 1
    parallel = np.flatnonzero(casting & (where[:, 3] == 0.0))
    blockers.tree = stage.tree if len(parallel) < casting.sum() else wp.uint64(0)
    grid = np.full(len(where), -1, dtype=np.int32)
    grid[parallel] = np.arange(len(parallel))
    number = len(bounded.radius)
    side = int(np.clip(1.5 * math.sqrt(number), 8, _MOST))
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
    blockers.light = wp.array(parallel.astype(np.int32), dtype=int, device=device)
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
    # Widen by more than the rounding of float32 positions.
    radius = bounded.radius[order, None] * (1 + 1e-5)
    low, high = ends.min(axis=0) - radius, ends.max(axis=0) + radius
    corner = low.min(axis=0)
    cell = (high.max(axis=0) - corner).max() / side * (1 + 1e-5)
    axes = np.concatenate([across.T / cell, -corner[:, None] / cell], axis=1)
    slack = 1e-6 * np.abs(corner / cell).max()
    first = np.floor((low - corner) / cell - slack)
    last = np.floor((high - corner) / cell + slack) + 1
    return axes, np.clip(np.concatenate([first, last], axis=1), 0, side)


@wp.func
def _cell_of(p: wp.vec3, grid: int, blockers: Blockers):
    """The cell of a grid in which p lies; -1 for none."""
    right = blockers.right[grid]
    up = blockers.up[grid]
    x = int(wp.floor(right[0] * p[0] + right[1] * p[1] + right[2] * p[2] + right[3]))
    y = int(wp.floor(up[0] * p[0] + up[1] * p[1] + up[2] * p[2] + up[3]))
    if wp.min(x, y) < 0 or wp.max(x, y) >= blockers.side:
        return -1
    return (grid * blockers.side + y) * blockers.side + x


@functools.cache
def shade_kernel(kind, width, trees):
    """The kernel that shades hits by point lights, and finds the grid cell of each hit for each directional light.

    trees: whether any point light casts shadows.
    """
    first_hits = packet_tracer.first_hits_function(kind, width, shadow=True)
    rows = int(packet_tracer.RAY_ROWS)
    room = packet_tracer.ROOM
    group = group_of(width)

    @wp.func
    def occlusion(
        p: wp.vec3,
        toward: wp.vec3,
        far: float,
        table: GaussianElements,
        blockers: Blockers,
        rays: wp.array(dtype=float),
        found: wp.array(dtype=int),
    ):
        """Where an element of the tree blocks a ray: a distance, NO_HIT or GIVEN_UP."""
        query = wp.bvh_query_ray(blockers.tree, p, toward)
        i = int(0)
        count = int(0)
        while wp.bvh_query_next(query, i, far):
            if count == room:
                return float(packet_tracer.GIVEN_UP)
            found[count] = i
            count += 1
        for k in range(3):
            rays[(packet_tracer.START + k) * width] = p[k]
            rays[(packet_tracer.DIRECTION + k) * width] = toward[k]
        rays[packet_tracer.FAR * width] = far
        # The elements' distances (the fifth argument) are read for first hits only: any array does here.
        first_hits(table, found, 0, count, rays, rays, found)
        return rays[packet_tracer.HIT * width]

    @wp.func
    def shade(
        i: int,
        table: GaussianElements,
        blockers: Blockers,
        balls: Balls,
        lights: Lights,
        sky: Sky,
        hits: Hits,
        color: wp.array(dtype=wp.vec3),
        cast: wp.array(dtype=int),
        cell: wp.array2d(dtype=int),
    ):
        result = unlit(i, hits, sky)
        rays_cast = int(0)
        for grid in range(cell.shape[0]):
            cell[grid, i] = -1
        if hits.thing[i] != -1:
            p = above(i, hits)
            for k in range(lights.where.shape[0]):
                toward, far = towards(p, lights.where[k])
                if wp.dot(hits.normal[i], toward) <= 0.0:
                    continue
                blocked = float(NO_HIT)
                if lights.shadows[k] == 1:
                    rays_cast += 1
                    if behind_shape(i, k, hits) or ball_shadow(p, toward, far, balls):
                        continue
                    grid = blockers.grid[k]
                    if grid >= 0:
                        cell[grid, i] = _cell_of(p, grid, blockers)
                        if cell[grid, i] >= 0:
                            continue
                    elif wp.static(trees):
                        rays = wp.zeros(shape=wp.static(rows * width), dtype=float)
                        found = wp.zeros(shape=room, dtype=int)
                        blocked = occlusion(p, toward, far, table, blockers, rays, found)
                        if blocked == packet_tracer.GIVEN_UP:
                            rays_cast = -1
                            break
                if blocked < 0.0:
                    result += lit(i, toward, lights.color[k], hits)
        color[i] = result
        cast[i] = rays_cast

    @wp.kernel(module="unique", enable_backward=False, module_options=OPTIONS)
    def shade_packets(
        start: int,
        table: GaussianElements,
        blockers: Blockers,
        balls: Balls,
        lights: Lights,
        sky: Sky,
        hits: Hits,
        color: wp.array(dtype=wp.vec3),
        cast: wp.array(dtype=int),
        cell: wp.array2d(dtype=int),
    ):
        first = (start + wp.tid()) * group
        for i in range(first, wp.min(first + group, color.shape[0])):
            shade(i, table, blockers, balls, lights, sky, hits, color, cast, cell)

    return shade_packets


def by_cell(cell: wp.array, cells: int) -> tuple[wp.array, wp.array]:
    """(keys, indices): the entries >= 0 of `cell` (all below `cells`), sorted, and their indices in `cell`."""
    key, ids, total = picked(cell)
    if total:
        wp.utils.radix_sort_pairs(key, ids, total, end_bit=max(int(cells).bit_length(), 1))
    return key[:total], ids[:total]


@functools.cache
def cells_kernel(kind, width):
    """The kernel that adds directional light to hits sorted by cell, `width` hits of one cell at a time."""
    first_hits = packet_tracer.first_hits_function(kind, width, shadow=True)
    rows = int(packet_tracer.RAY_ROWS)
    group = group_of(width)

    @wp.kernel(module="unique", enable_backward=False, module_options=OPTIONS)
    def shade_cells(
        start: int,
        table: GaussianElements,
        blockers: Blockers,
        lights: Lights,
        hits: Hits,
        key: wp.array(dtype=int),
        ids: wp.array(dtype=int),
        color: wp.array(dtype=wp.vec3),
        cast: wp.array(dtype=int),
    ):
        rays = wp.zeros(shape=wp.static(rows * width), dtype=float)
        none = wp.zeros(shape=1, dtype=int)
        at = int((start + wp.tid()) * group)
        last = wp.min(at + group, key.shape[0])
        while at < last:
            cell = key[at]
            light = blockers.light[cell // (blockers.side * blockers.side)]
            number = int(0)
            for lane in range(width):
                rays[packet_tracer.FAR * width + lane] = 0.0
                if number == lane and at + lane < last:
                    if key[at + lane] == cell:
                        p = above(ids[at + lane] % color.shape[0], hits)
                        toward, far = towards(p, lights.where[light])
                        for k in range(3):
                            rays[(packet_tracer.START + k) * width + lane] = p[k]
                            rays[(packet_tracer.DIRECTION + k) * width + lane] = toward[k]
                        rays[packet_tracer.FAR * width + lane] = far
                        number += 1
            # The elements' distances (the fifth argument) are read for first hits only: any array does here.
            first_hits(table, blockers.ids, blockers.first[cell], blockers.first[cell + 1], rays, rays, none)
            for lane in range(number):
                i = ids[at + lane] % color.shape[0]
                hit = rays[packet_tracer.HIT * width + lane]
                if hit == packet_tracer.GIVEN_UP:
                    cast[i] = -1
                elif hit < 0.0:
                    toward = wp.vec3(
                        rays[packet_tracer.DIRECTION * width + lane],
                        rays[(packet_tracer.DIRECTION + 1) * width + lane],
                        rays[(packet_tracer.DIRECTION + 2) * width + lane],
                    )
                    color[i] = color[i] + lit(i, toward, lights.color[light], hits)
            at += number

    return shade_cells
