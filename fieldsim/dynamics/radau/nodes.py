"""What a step computes at all its nodes at once: on CPUs in lanes, a node each; on GPUs one after the other.

A series is a matrix (3, PLACES), a column for each node, or for each power; see `tables`.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics.radau import tables
from fieldsim.dynamics.splitting.groups import ALONE
from fieldsim.portable import Indices, Table, hole, portable, real
from fieldsim.portable.lanes.functions import TABLES, group_function
from fieldsim.potentials import registry
from fieldsim.sources.windows import Window, interpolated, part_from

PLACES = wp.constant(tables.PLACES)
Series = wp.types.matrix((3, tables.PLACES), wp.float64)
Row = wp.types.matrix((1, tables.PLACES), wp.float64)
Weights = wp.types.matrix((tables.PLACES, tables.PLACES), wp.float64)
NODES = wp.constant(Row(*map(float, tables.NODES)))


def lanes_on(device) -> int:
    """How many nodes are computed at a time on a device."""
    return ALONE if device.is_cuda else tables.PLACES


def weights(table: np.ndarray):
    """A table of weights as a constant of kernels."""
    return wp.constant(Weights(*table.ravel()))


@wp.struct
class Pulling:
    """What pulls at the nodes of the steps of some particles.

    rows (N, ROW_WIDTH), kinds (N,): the elements that stay. moving_rows (PLACES, particles * moving, ROW_WIDTH): of
    each node those of the others, `moving` of each particle, as kernels put them in place; moving_kinds (particles *
    moving,).
    """

    rows: wp.array2d(dtype=wp.float64)
    kinds: wp.array(dtype=wp.int32)
    moving_rows: wp.array3d(dtype=wp.float64)
    moving_kinds: wp.array(dtype=wp.int32)
    moving: int


@portable
def _sum(
    w0: real, w1: real, w2: real, w3: real, w4: real, w5: real, w6: real, w7: real,
    p0: real, p1: real, p2: real, p3: real, p4: real, p5: real, p6: real, p7: real,
):  # fmt: skip
    return ((w7 * p7 + w6 * p6) + (w5 * p5 + w4 * p4)) + ((w3 * p3 + w2 * p2) + (w1 * p1 + w0 * p0))


@functools.cache
def mixed_of(lanes: int):
    """Warp function (weights, series) -> the series of weighted sums."""
    one = group_function(_sum, wp.float64, (f"rows {tables.PLACES}", *("real",) * tables.PLACES), (0,), PLACES, lanes)

    @wp.func
    def mixed(weights: Weights, p: Series):
        found = Series()
        for c in range(3):
            sums = one(weights, p[c, 0], p[c, 1], p[c, 2], p[c, 3], p[c, 4], p[c, 5], p[c, 6], p[c, 7])
            found[c] = sums[0]
        return found

    return mixed


fixed = hole("x, y, z, rows, kinds, first, count")
moving = hole("x, y, z, rows, kinds, first, count")


@portable
def _path(
    wx: real, wy: real, wz: real, s: real, x: real, y: real, z: real, rx: real, ry: real, rz: real,
    ux: real, uy: real, uz: real, h2: real,
):  # fmt: skip
    return x + (rx + s * ux + h2 * wx), y + (ry + s * uy + h2 * wy), z + (rz + s * uz + h2 * wz)


@functools.cache
def path_of(lanes: int):
    """Warp function (ways, x, rest, v, h) -> positions at the nodes of a step of length h from x on, and its rest.

    ways: their offsets less those by the velocity v, in units of h^2.
    """
    inputs = ("rows 3", "rows 1", *("real",) * 10)
    at_nodes = group_function(_path, wp.float64, inputs, (0, 1, 2), PLACES, lanes)

    @wp.func
    def path(ways: Series, x: wp.vec3d, rest: wp.vec3d, v: wp.vec3d, h: wp.float64):
        u = h * v
        return at_nodes(ways, NODES, x[0], x[1], x[2], rest[0], rest[1], rest[2], u[0], u[1], u[2], h * h)

    return path


@portable
def _pull(
    x: real, y: real, z: real, rows: Table, kinds: Indices, still: int,
    moving_rows: Table, moving_kinds: Indices, first: int, count: int,
):  # fmt: skip
    _f, ax, ay, az = fixed(x, y, z, rows, kinds, 0, still)
    _g, bx, by, bz = moving(x, y, z, moving_rows, moving_kinds, first, count)
    return ax + bx, ay + by, az + bz


@functools.cache
def pulls_of(kinds_used, lanes: int):
    """Warp function (points, pulling, which) -> accelerations at the nodes of the particle `which` of `pulling`."""
    bound = dict(zip(("fixed", "moving"), map(registry.field_sum, kinds_used), strict=True))
    inputs = ("rows 3", "table", "indices", "int", TABLES, "indices", "int", "int")
    pull = group_function(_pull.bind(**bound), wp.float64, inputs, (0, 1, 2), PLACES, lanes)

    @wp.func
    def pulls(points: Series, pulling: Pulling, which: int):
        return pull(
            points, pulling.rows, pulling.kinds, pulling.kinds.shape[0],
            pulling.moving_rows, pulling.moving_kinds, which * pulling.moving, pulling.moving,
        )  # fmt: skip

    return pulls


@functools.cache
def place_of(kinds_used, lanes: int):
    """Warp function (pulling, which, window, t, rest, h): rows of what moves at the nodes of a step from t on."""
    value = group_function(interpolated, wp.float64, ("rows 1", "table", "int"), (0,), PLACES, lanes)

    @wp.func
    def still(pulling: Pulling, which: int, window: Window, t: wp.float64, rest: wp.float64, h: wp.float64):
        pass

    @wp.func
    def changing(pulling: Pulling, which: int, window: Window, t: wp.float64, rest: wp.float64, h: wp.float64):
        part = part_from(window, t)
        middle = wp.float64(0.5) * (window.bounds[part] + window.bounds[part + 1])
        half = wp.float64(0.5) * (window.bounds[part + 1] - window.bounds[part])
        u = Row()
        for n in range(PLACES):
            u[0, n] = ((t - middle) + (rest + NODES[0, n] * h)) / half
        values = Row()
        last = wp.int32(-1)
        for k in range(window.rows.shape[0]):
            number = window.which[k]
            if number != last:
                values = value(u, window.coefficients, part * window.numbers + number)
                last = number
            row = which * pulling.moving + window.rows[k]
            for n in range(PLACES):
                pulling.moving_rows[n, row, window.columns[k]] = values[0, n]

    return changing if kinds_used[1] else still
