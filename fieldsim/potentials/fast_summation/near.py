"""Exact sums at many points, each of the elements of its own list: in lanes, points of one list side by side."""

import functools

import numpy as np
import warp as wp

from fieldsim.launch import launch
from fieldsim.portable import Indices, Table, hole, portable, real
from fieldsim.portable.lanes.kernels import items_of, lanes_kernel
from fieldsim.portable.lanes.source import width_of
from fieldsim.potentials import registry
from fieldsim.potentials.field_kernels import RESULTS, host_results_of

INPUTS = ("points", "by vector", "indices", "indices", "indices", "table", "indices")

total = hole("x, y, z, rows, kinds, first, count")


@portable
def listed_field(
    x: real, y: real, z: real, which: int, begin: Indices, first: Indices, count: Indices, rows: Table, kinds: Indices
):
    """Value and gradient of the ranges of rows, first[k] and count[k], of one list: k from begin[which] on."""
    f = real(0.0)
    fx = real(0.0)
    fy = real(0.0)
    fz = real(0.0)
    for k in range(begin[which], begin[which + 1]):
        f_k, fx_k, fy_k, fz_k = total(x, y, z, rows, kinds, first[k], count[k])
        f += f_k
        fx += fx_k
        fy += fy_k
        fz += fz_k
    return f, fx, fy, fz


@portable
def listed_jet(
    x: real, y: real, z: real, which: int, begin: Indices, first: Indices, count: Indices, rows: Table, kinds: Indices
):
    """As `listed_field`, with the Hessian, as a jet."""
    f = real(0.0)
    fx = real(0.0)
    fy = real(0.0)
    fz = real(0.0)
    xx = real(0.0)
    yy = real(0.0)
    zz = real(0.0)
    xy = real(0.0)
    xz = real(0.0)
    yz = real(0.0)
    for k in range(begin[which], begin[which + 1]):
        f_k, fx_k, fy_k, fz_k, xx_k, yy_k, zz_k, xy_k, xz_k, yz_k = total(x, y, z, rows, kinds, first[k], count[k])
        f += f_k
        fx += fx_k
        fy += fy_k
        fz += fz_k
        xx += xx_k
        yy += yy_k
        zz += zz_k
        xy += xy_k
        xz += xz_k
        yz += yz_k
    return f, fx, fy, fz, xx, yy, zz, xy, xz, yz


@functools.cache
def _kernel(kinds_used, order):
    if order < 2:
        bound = listed_field.bind(total=registry.field_sum(kinds_used))
    else:
        bound = listed_jet.bind(total=registry.jet_sum(kinds_used))
    return lanes_kernel(bound, wp.float64, INPUTS, RESULTS[: order + 1])


def near_sums(points, lists, begin, ranges, tables, kinds_used, order, threads=None) -> list[np.ndarray]:
    """Value and derivatives up to `order` at points (N, 3) of the rows in their lists; see `near_lists`.

    Points of one list stand together. tables: rows and kinds as Warp arrays on the CPU.
    """
    width = width_of(False)
    places, which = _in_vectors(lists, width)
    arrays, found = host_results_of(order, len(places))
    given = [wp.from_numpy(np.ascontiguousarray(points[places]), dtype=wp.vec3d, device="cpu")]
    integers = which, begin, ranges[:, 0], ranges[:, 1] - ranges[:, 0]
    given += [wp.from_numpy(np.ascontiguousarray(a, dtype=np.int32), dtype=wp.int32, device="cpu") for a in integers]
    items = items_of(len(places), wp.float64)
    launch(_kernel(kinds_used, order), items, [*given, *tables], found, device="cpu", threads=threads, grain=16)
    results = []
    for array in arrays:
        result = np.empty((len(points), *array.shape[1:]))
        result[places] = array
        results.append(result)
    return results


def _in_vectors(lists, width):
    """Places of points in vectors (V * width,), of one list each and filled up with its last; their lists (V,)."""
    starts = np.flatnonzero(np.concatenate([np.ones(min(1, len(lists)), dtype=bool), lists[1:] != lists[:-1]]))
    counts = np.diff(np.concatenate([starts, [len(lists)]]))
    vectors = -(-counts // width)
    own = np.repeat(np.arange(len(starts)), vectors)
    number = np.arange(len(own)) - np.repeat(np.cumsum(vectors) - vectors, vectors)
    within = number[:, None] * width + np.arange(width)
    places = starts[own, None] + np.minimum(within, counts[own, None] - 1)
    return places.ravel(), lists[starts[own]]
