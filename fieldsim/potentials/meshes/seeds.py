"""Where level surfaces are looked for: boxes around them, points of the skeleton within them, and how fine they are."""

import functools

import numpy as np
import warp as wp

from fieldsim.errors import InputError
from fieldsim.launch import launch
from fieldsim.potentials import registry
from fieldsim.potentials.bounds.reach import reach, scale
from fieldsim.potentials.meshes.tetrahedra import MOST
from fieldsim.potentials.row import STRENGTH

# About so many cells lie around a seed of a surface and of a curve.
AROUND = (10, 60)
# Where a skeleton leaves the surface, parts less deep than this share of the deepest are left to the cells around.
EDGE = 1 / 16
# How much thinner than its element's own width a part may be.
THINNEST = 1e-6
# Among so many elements that overlap without any reaching the level is the level shared.
SHARED = 8
# Three directions that are no axes.
_WAYS = np.array([(2, 2, 1), (-2, 1, 2), (1, -2, 2)]) / 3.0


def no_surface(level) -> InputError:
    """What to raise for a field that nowhere reaches the level."""
    return InputError(f"mesh: the field stays below {level:g} at and around its skeleton; give a lower level")


def surface_box(elements, level):
    """Corners of a box around the surface F = 1: outside it every element stays below its share."""
    low, high = np.full((2, len(elements), 3), np.nan)
    positive = elements.rows[:, STRENGTH] > 0.0
    far = np.zeros(len(elements))
    for formula, which in registry.parts_of(elements.kinds):
        rows, primitive = elements.rows[which], formula.primitive
        if primitive.endless:
            raise InputError("mesh: a plane has no end; clip it with a triangle, or leave it out")
        low[which], high[which] = primitive.row_box(rows)
        if primitive.distance is None:
            # A solid's pull is that of its mass, at no less than the distance from it.
            mass = float(np.sum(rows[:, STRENGTH] * primitive.row_measure(rows)))
            far[which] = len(elements) * max(0.0, mass)
        else:
            far[which] = reach(rows, elements.kinds[which], 1.0 / len(elements))
    if not positive.any():
        raise no_surface(level)
    return (low - far[:, None])[positive].min(axis=0), (high + far[:, None])[positive].max(axis=0)


def _flat(kinds):
    """Which of the elements of kinds (N,) are triangles, (N,)."""
    flat = [kind for kind, formula in registry.formulas_of(np.unique(kinds)).items() if formula.primitive.corners == 3]
    return np.isin(kinds, flat)


def _lengths(elements, side):
    """Lengths (N,) over which elements' fields vary, and within which each alone has its surface F = 1."""
    width, own = np.full(len(elements), side), np.full(len(elements), side)
    for formula, which in registry.parts_of(elements.kinds):
        if formula.primitive.distance is not None:
            width[which] = np.minimum(scale(elements.rows[which], elements.kinds[which]), side)
            own[which] = reach(elements.rows[which], elements.kinds[which], 1.0)
    return width, own


def seeds_of(elements, height, side):
    """Points (S, 3) of the skeleton within the surface, about as close as they are deep, and their depths (S,).

    Pieces of the skeleton are halved until their middles lie outside, or deeper than the piece is long.
    """
    width, own = _lengths(elements, side)
    pieces = _pieces(elements)
    deepest = np.zeros(len(elements))
    found, depths, count = [np.zeros((0, 3))], [np.zeros(0)], 0
    while len(pieces[0]):
        which, corners = pieces
        places = _places(elements, which, corners.mean(axis=1))
        inside = height(places) >= 0.0
        most = 2.0 * np.maximum(width, own)[which[inside]]
        enough = width[which].copy()
        enough[inside] = _depths(height, places[inside], most)
        ends = [_places(elements, which, corners[:, k]) for k in range(3)]
        np.maximum.at(deepest, which[inside], enough[inside])
        # Where the skeleton leaves the surface it is as thin as one looks, and belongs to what is deeper.
        leaving = inside & (height(np.concatenate(ends)) < 0.0).reshape(3, -1).any(axis=0)
        leaving &= enough < EDGE * deepest[which]
        enough[leaving] = EDGE * deepest[which[leaving]]
        found.append(places[inside & ~leaving])
        depths.append(enough[inside & ~leaving])
        flat = _flat(elements.kinds[which[inside]])
        count += np.sum(np.where(flat, *AROUND))
        if count > MOST or len(which) > MOST:
            thin = f" of about {min(map(np.min, filter(len, depths))):.3g}" if any(map(len, depths)) else ""
            raise InputError(
                f"mesh: the surface is too thin{thin} for the length of its skeleton; give a lower level, or mesh less"
            )
        size = np.max([np.linalg.norm(ends[k] - ends[k - 1], axis=1) for k in range(3)], axis=0)
        pieces = _halves(elements, which[size > enough], corners[size > enough])
    return np.concatenate(found), np.concatenate(depths)


def _pieces(elements):
    """Pieces of all elements of positive strength: which element (P,), and parameters of three corners (P, 3, 2)."""
    which, corners = [], []
    formulas = registry.formulas_of(elements.kinds_used)
    for index, (row, kind) in enumerate(zip(elements.rows, elements.kinds, strict=True)):
        if row[STRENGTH] > 0.0:
            primitive = formulas[kind].primitive
            # A whole turn would begin and end at the same place.
            parts = 8 if primitive.round else 1
            for k in range(parts):
                which.append(index)
                u, v = k / parts, (k + 1) / parts
                flat = primitive.corners == 3
                corners.append(((0, 0), (1, 0), (0, 1)) if flat else ((u, 0), (v, 0), (0.5 * (u + v), 0)))
    return np.array(which, dtype=np.int64), np.array(corners, dtype=float).reshape(-1, 3, 2)


def _halves(elements, which, corners):
    """Curves in halves, triangles in quarters."""
    flat = _flat(elements.kinds[which])
    a, b, c = np.moveaxis(corners, 1, 0)
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    halves = [(a, c, 0.5 * (a + c)), (c, b, 0.5 * (c + b))]
    parts = [np.stack(q, axis=1)[flat] for q in quarters] + [np.stack(h, axis=1)[~flat] for h in halves]
    return np.concatenate([which[flat]] * 4 + [which[~flat]] * 2), np.concatenate(parts)


def _places(elements, which, parameters):
    """Points (P, 3) of the elements `which` at parameters (P, 2) from 0 to 1."""
    rows, result = elements.rows[which], np.empty((len(which), 3))
    for formula, where in registry.parts_of(elements.kinds[which]):
        part, (u, v) = rows[where], parameters[where].T[:, :, None]
        result[where] = formula.primitive.row_places(part, u, v)
    return result


def _depths(height, points, most):
    """About how far the surface is from points within it, (S,), at most `most` (S,), from six directions."""
    ways = np.concatenate([_WAYS, -_WAYS])
    low, high = np.broadcast_to(most[:, None] * (THINNEST, 1.0), (len(most), 2)).T[..., None] * np.ones(6)
    for _ in range(8):
        middle = np.sqrt(low * high)
        places = points[:, None] + middle[..., None] * ways
        inside = height(places.reshape(-1, 3)).reshape(middle.shape) >= 0.0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return low.min(axis=1, initial=np.inf)


def widths_of(elements):
    """A function: the smallest length over which a field near to any of the balls (n, 3), (n,) varies, (n,)."""
    width, _ = _lengths(elements, np.inf)
    far = np.zeros(len(elements))
    for formula, which in registry.parts_of(elements.kinds):
        if formula.primitive.distance is not None:
            far[which] = reach(elements.rows[which], elements.kinds[which], 1.0 / min(len(elements), SHARED))
    near = (far > 0.0) & np.isfinite(width)
    if not near.any():
        return lambda centers, radii: np.full(len(centers), np.inf)
    kinds = elements.kinds[near]
    kernel = _width_kernel(tuple(np.unique(kinds).tolist()))
    tables = [wp.array(a, dtype=wp.float64, device="cpu") for a in (elements.rows[near], far[near], width[near])]
    numbers = wp.array(kinds, dtype=wp.int32, device="cpu")

    def around(centers, radii):
        found = wp.empty(len(centers), dtype=wp.float64, device="cpu")
        balls = wp.array(centers, dtype=wp.vec3d, device="cpu"), wp.array(radii, dtype=wp.float64, device="cpu")
        launch(kernel, len(centers), [*balls, *tables, numbers], [found], device="cpu")
        return found.numpy()

    return around


@functools.cache
def _width_kernel(kinds_used):
    """The Warp kernel of `widths_of`."""
    distances = {kind: formula.primitive.distance for kind, formula in registry.formulas_of(kinds_used).items()}
    distance = registry.by_kind(distances).warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def smallest_width(
        start: int,
        centers: wp.array(dtype=wp.vec3d),
        radii: wp.array(dtype=wp.float64),
        rows: wp.array(dtype=wp.float64, ndim=2),
        far: wp.array(dtype=wp.float64),
        width: wp.array(dtype=wp.float64),
        kinds: wp.array(dtype=wp.int32),
        found: wp.array(dtype=wp.float64),
    ):
        i = start + wp.tid()
        p = centers[i]
        least = wp.float64(wp.inf)
        for k in range(kinds.shape[0]):
            if width[k] < least:
                if distance(p[0], p[1], p[2], rows, kinds, k) - radii[i] < far[k]:
                    least = width[k]
        found[i] = least

    return smallest_width
