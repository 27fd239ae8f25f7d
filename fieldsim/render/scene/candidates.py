"""Which capsules each screen tile sees, sorted by depth: the candidates of its primary rays.

Built per frame: count the tiles that each capsule overlaps, scan the counts for offsets, write (tile, capsule) pairs,
and sort them by tile; the sort is stable, so that each tile's capsules stay sorted from near to far. Their number has
no limit.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import dataclasses

import numpy as np
import warp as wp

from fieldsim.launch import launch

TILE = 8  # pixels


@wp.struct
class View:
    """A camera at the origin. Directions: pixel (x, y) is seen along corner + x across + y down."""

    corner: wp.vec3d
    across: wp.vec3d
    down: wp.vec3d
    right: wp.vec3
    up: wp.vec3
    forward: wp.vec3
    center: wp.vec2  # the pixel on the optical axis
    width: int
    height: int
    tiles: int  # across
    pixel: float  # size of a pixel in the plane at distance 1


@wp.struct
class Candidates:
    """Tile i's candidates are ids[first[i]:first[i + 1]], from near to far; near: least distance of each capsule."""

    first: wp.array(dtype=int)
    ids: wp.array(dtype=int)
    near: wp.array(dtype=float)


@wp.func
def exact_direction(view: View, x: float, y: float):
    """Unit direction through the point (x, y) of the picture, in pixels, in float64."""
    return wp.normalize(view.corner + wp.float64(x) * view.across + wp.float64(y) * view.down)


@wp.func
def ray_direction(view: View, x: float, y: float):
    """Unit direction through the point (x, y) of the picture, in pixels."""
    return wp.vec3(exact_direction(view, x, y))


@wp.func
def _tangents(x: float, z: float, radius: float):
    """Least and greatest x/z over a disc at (x, z), z > radius: the slopes m with (x - m z)^2 = r^2 (1 + m^2)."""
    below = (z - radius) * (z + radius)
    root = radius * wp.sqrt(x * x + below)
    return (x * z - root) / below, (x * z + root) / below


@wp.func
def _extent(view: View, center: wp.vec3, radius: float):
    """Pixel rectangle (x0, x1, y0, y1) of a sphere; all of the picture where it reaches behind the eye."""
    w = float(view.width)
    h = float(view.height)
    z = wp.dot(center, view.forward)
    if z <= radius * 1.0001:
        return wp.vec4(0.0, w, 0.0, h)
    x0, x1 = _tangents(wp.dot(center, view.right), z, radius)
    y0, y1 = _tangents(wp.dot(center, view.up), z, radius)
    x = view.center[0]
    y = view.center[1]
    return wp.vec4(x + x0 / view.pixel, x + x1 / view.pixel, y - y1 / view.pixel, y - y0 / view.pixel)


@wp.func
def _rectangle(view: View, start: wp.vec3, end: wp.vec3, radius: float):
    """Tiles (x0, x1, y0, y1), inclusive, that may see a capsule; x0 > x1 for one behind the eye."""
    if wp.max(wp.dot(start, view.forward), wp.dot(end, view.forward)) + radius <= 0.0:
        return wp.vec4i(0, -1, 0, -1)
    a = _extent(view, start, radius)
    b = a
    if wp.length_sq(end - start) > 0.0:
        b = _extent(view, end, radius)
    size = float(TILE)
    last_x = float(view.tiles - 1)
    last_y = float((view.height + TILE - 1) // TILE - 1)
    if wp.max(a[1], b[1]) < 0.0 or wp.min(a[0], b[0]) > float(view.width):
        return wp.vec4i(0, -1, 0, -1)
    if wp.max(a[3], b[3]) < 0.0 or wp.min(a[2], b[2]) > float(view.height):
        return wp.vec4i(0, -1, 0, -1)
    return wp.vec4i(
        int(wp.clamp(wp.floor(wp.min(a[0], b[0]) / size), 0.0, last_x)),
        int(wp.clamp(wp.floor(wp.max(a[1], b[1]) / size), 0.0, last_x)),
        int(wp.clamp(wp.floor(wp.min(a[2], b[2]) / size), 0.0, last_y)),
        int(wp.clamp(wp.floor(wp.max(a[3], b[3]) / size), 0.0, last_y)),
    )


@wp.func
def _touches(view: View, tx: int, ty: int, start: wp.vec3, end: wp.vec3, radius: float):
    """Whether the cone around tile (tx, ty) meets a capsule."""
    x = float(tx * TILE)
    y = float(ty * TILE)
    size = float(TILE)
    axis = ray_direction(view, x + 0.5 * size, y + 0.5 * size)
    nearest = wp.min(
        wp.min(wp.dot(axis, ray_direction(view, x, y)), wp.dot(axis, ray_direction(view, x + size, y))),
        wp.min(wp.dot(axis, ray_direction(view, x, y + size)), wp.dot(axis, ray_direction(view, x + size, y + size))),
    )
    cosine = nearest - 1.0e-6
    sine = wp.sqrt(wp.max(1.0 - cosine * cosine, 0.0))
    # Along the capsule's line, position z along the axis and vector q across it are linear in u.
    z = wp.dot(start, axis)
    q = start - z * axis
    along = end - start
    dz = wp.dot(along, axis)
    dq = along - dz * axis
    # cosine |q| - sine z is convex in u; where its slope vanishes, (u - u0)^2 (A^2 - k^2 A) = k^2 B.
    u = float(0.0)
    A = wp.dot(dq, dq)
    if A > 0.0:
        u0 = -wp.dot(q, dq) / A
        closest = q + u0 * dq
        k = dz * sine / cosine
        if A > k * k:
            u = u0 + k * wp.sqrt(wp.dot(closest, closest) / (A * (A - k * k)))
        elif k > 0.0:
            u = 1.0
    elif dz > 0.0:
        u = 1.0
    u = wp.clamp(u, 0.0, 1.0)
    distance = cosine * wp.length(q + u * dq) - sine * (z + u * dz)
    return distance <= radius * 1.0001


@wp.func
def _sees(view: View, r: wp.vec4i, tx: int, ty: int, start: wp.vec3, end: wp.vec3, radius: float):
    """Whether tile (tx, ty) of the rectangle r may see a capsule; a rectangle of one tile is not tested again."""
    if r[0] == r[1] and r[2] == r[3]:
        return True
    return _touches(view, tx, ty, start, end, radius)


@wp.kernel(enable_backward=False)
def _count(
    begin: int,
    view: View,
    order: wp.array(dtype=int),
    start: wp.array(dtype=wp.vec3),
    end: wp.array(dtype=wp.vec3),
    radius: wp.array(dtype=float),
    count: wp.array(dtype=int),
):
    rank = begin + wp.tid()
    i = order[rank]
    r = _rectangle(view, start[i], end[i], radius[i])
    n = int(0)
    for ty in range(r[2], r[3] + 1):
        for tx in range(r[0], r[1] + 1):
            if _sees(view, r, tx, ty, start[i], end[i], radius[i]):
                n += 1
    count[rank] = n


@wp.kernel(enable_backward=False)
def _fill(
    begin: int,
    view: View,
    order: wp.array(dtype=int),
    start: wp.array(dtype=wp.vec3),
    end: wp.array(dtype=wp.vec3),
    radius: wp.array(dtype=float),
    last: wp.array(dtype=int),
    tile: wp.array(dtype=int),
    ids: wp.array(dtype=int),
):
    rank = begin + wp.tid()
    i = order[rank]
    r = _rectangle(view, start[i], end[i], radius[i])
    slot = int(0)
    if rank > 0:
        slot = last[rank - 1]
    for ty in range(r[2], r[3] + 1):
        for tx in range(r[0], r[1] + 1):
            if _sees(view, r, tx, ty, start[i], end[i], radius[i]):
                tile[slot] = ty * view.tiles + tx
                ids[slot] = i
                slot += 1


@wp.kernel(enable_backward=False)
def _starts(begin: int, key: wp.array(dtype=int), total: int, keys: int, first: wp.array(dtype=int)):
    # An entry is the first of its key, and of the keys without entries before it.
    k = begin + wp.tid()
    before = int(-1)
    if k > 0:
        before = key[k - 1]
    here = int(keys)
    if k < total:
        here = key[k]
    for j in range(before + 1, here + 1):
        first[j] = k


def sorted_lists(key, ids, total, keys, device):
    """Sort pairs (key, id), with room for twice as many; first (keys + 1,): where each key's ids begin, and the end."""
    if total:
        wp.utils.radix_sort_pairs(key, ids, total, end_bit=max(int(keys).bit_length(), 1))
    first = wp.empty(keys + 1, dtype=int, device=device)
    launch(_starts, total + 1, [key, total, keys], [first], device=device, grain=1 << 14)
    return first


@dataclasses.dataclass
class Capsules:
    """Capsules on a device: start, end (vec3) and radius, relative to the eye; near: least distance from the eye."""

    start: wp.array
    end: wp.array
    radius: wp.array
    near: np.ndarray


def capsules(start, end, radius, device) -> Capsules:
    """Capsules (N, 3), (N, 3), (N,) uploaded."""
    along = end - start
    length2 = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    u = np.clip(-np.einsum("ij,ij->i", start, along) / length2, 0.0, 1.0)
    closest = start + u[:, None] * along
    # Rounded down a little: `near` must be a lower bound.
    near = np.maximum(np.sqrt(np.einsum("ij,ij->i", closest, closest)) * (1 - 1e-6) - radius * (1 + 1e-6), 0.0)
    return Capsules(
        wp.array(start, dtype=wp.vec3, device=device),
        wp.array(end, dtype=wp.vec3, device=device),
        wp.array(radius, dtype=float, device=device),
        near.astype(np.float32),
    )


def candidates(view, shapes: Capsules, device) -> Candidates:
    """The tile lists of a view."""
    number = len(shapes.near)
    tiles = view.tiles * -(-view.height // TILE)
    if not number:
        return _nothing(tiles, device)
    order = wp.array(np.argsort(shapes.near, kind="stable").astype(np.int32), dtype=int, device=device)
    last = wp.zeros(number, dtype=int, device=device)
    geometry = [view, order, shapes.start, shapes.end, shapes.radius]
    launch(_count, number, geometry, [last], device=device, grain=512)
    wp.utils.array_scan(last, last, inclusive=True)
    total = int(last[number - 1 :].numpy()[0])
    tile = wp.empty(max(2 * total, 1), dtype=int, device=device)
    ids = wp.empty(max(2 * total, 1), dtype=int, device=device)
    launch(_fill, number, [*geometry, last], [tile, ids], device=device, grain=512)
    lists = Candidates()
    lists.first = sorted_lists(tile, ids, total, tiles, device)
    lists.ids = ids
    lists.near = wp.array(shapes.near, dtype=float, device=device)
    return lists


def _nothing(tiles, device):
    lists = Candidates()
    lists.first = wp.zeros(tiles + 1, dtype=int, device=device)
    lists.ids = wp.empty(0, dtype=int, device=device)
    lists.near = wp.empty(0, dtype=float, device=device)
    return lists
