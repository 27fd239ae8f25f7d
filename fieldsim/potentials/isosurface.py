"""Level surfaces of fields as closed triangle meshes: marching cubes, then every vertex moved onto the true surface."""

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.mesh import TriangleMesh

# Cells along the longest side: unless told, and at most.
RESOLUTION = 64
FINEST = 512
# Points across a side where a box is tried for size.
PROBES = 64
# The box grows by this factor, so many times at most, until the surface lies inside; then its sides are halved in.
GROWTH = 1.6
GROWTHS = 60
HALVINGS = 12
# Newton steps to the surface at most, and when a vertex is on it, in cells.
STEPS = 30
CLOSE = 1e-12


def level_mesh(field, level: float, low, high, *, resolution=None, tolerance=None) -> TriangleMesh:
    """The surface field = level as a closed mesh, its normals towards smaller values.

    field: a `Field` whose skeleton lies between the corners low and high (3,). resolution: grid cells along the longest
    side of the surface; tolerance: greatest distance of the mesh from the surface, for which the grid is refined until
    it holds at the middle of every face and edge. Raises InputError where there is no surface, where it has no end, and
    for a tolerance that takes more than 512 cells.
    """
    level = validate.number("mesh", "level", level, above=0.0)
    if resolution is not None and tolerance is not None:
        raise InputError("mesh: resolution and tolerance are both given; give one of them")
    cells = RESOLUTION if resolution is None else resolution
    cells = validate.whole("mesh", "resolution", cells, at_least=4, at_most=FINEST)
    tolerance = validate.optional(validate.number, "mesh", "tolerance", tolerance, above=0.0)
    low, high = _box(field, level, np.array(low, dtype=float), np.array(high, dtype=float))
    if tolerance is None:
        return _marched(field, level, low, high, cells)
    cells = 16
    while True:
        found = _marched(field, level, low, high, cells)
        error = _distance(field, level, found)
        if error <= tolerance:
            return found
        if cells == FINEST:
            break
        # The error of a chord falls with its square.
        cells = min(FINEST, max(cells + 1, round(1.1 * cells * np.sqrt(error / tolerance))))
    raise InputError(
        f"mesh: a tolerance of {tolerance:g} takes more than {FINEST} cells across a surface of size "
        f"{np.max(high - low):.3g}; give a larger one"
    )


def _box(field, level, low, high):
    """Corners of a box around the surface, a little larger than it.

    All strengths being positive, a point outside a box that holds the skeleton has a smaller field than the nearest one
    on the box; so the surface is inside as soon as the field on the six sides stays below the level.
    """
    size = max(np.max(high - low), 1e-9 * (1.0 + np.abs(low).max()))
    for _ in range(GROWTHS):
        sides = [(axis, end) for axis in range(3) for end in (0, 1)]
        if all(_peak(field, low - size, high + size, axis, end, 1.0) < level for axis, end in sides):
            break
        size *= GROWTH
    else:
        raise InputError(
            f"mesh: the surface at {level:g} has no end; give a higher level, or a skeleton of finite size"
        )
    corners = [low.copy(), high.copy()]
    for axis, end in sides:
        inner, outer = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = 0.5 * (inner + outer)
            reaches = _peak(field, low - size, high + size, axis, end, middle, low, high) >= level
            inner, outer = (middle, outer) if reaches else (inner, middle)
        corners[end][axis] += (-1, 1)[end] * outer * size
    return corners


def _peak(field, low, high, axis, end, share, inner_low=None, inner_high=None):
    """Greatest field on one side of the box low..high, moved towards the inner box by 1 - share."""
    others = [k for k in range(3) if k != axis]
    grid = np.meshgrid(*(np.linspace(low[k], high[k], PROBES) for k in others), indexing="ij")
    points = np.empty((PROBES * PROBES, 3))
    outer = (low, high)[end][axis]
    points[:, axis] = outer if share == 1.0 else outer + (1.0 - share) * ((inner_low, inner_high)[end][axis] - outer)
    for k, values in zip(others, grid, strict=True):
        points[:, k] = values.ravel()
    return field.value(points).max()


def _marched(field, level, low, high, resolution):
    """The mesh on a grid of so many cells along the longest side."""
    try:
        from skimage.measure import marching_cubes
    except ImportError:
        raise InputError("mesh: this takes scikit-image; install it with: pip install 'fieldsim[mesh]'") from None
    cell = np.max(high - low) / resolution
    counts = np.ceil((high - low) / cell).astype(int) + 3
    start = 0.5 * (low + high) - 0.5 * cell * (counts - 1)
    axes = [start[k] + cell * np.arange(counts[k]) for k in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    # Marching cubes only asks which side a corner is on, and roughly how far; a bare skeleton's field is infinite.
    heights = np.clip(field.value(points) / level - 1.0, -1.0, 10.0).reshape(counts)
    if heights.max() <= 0.0:
        raise InputError(
            f"mesh: the field stays below {level:g} on a grid of {resolution} cells; "
            "give a lower level, or a higher resolution for a thin surface"
        )
    vertices, faces, _, _ = marching_cubes(heights, 0.0, gradient_direction="ascent", allow_degenerate=False)
    vertices = _projected(field, level, start + cell * vertices.astype(float), cell)
    return TriangleMesh(vertices, faces)


def _projected(field, level, points, cell):
    """Points moved along the gradient onto the surface, by at most a cell: Newton's method."""
    origin, points = points, points.copy()
    active = np.arange(len(points))
    for _ in range(STEPS):
        step = _step(field, level, points[active])
        size = np.linalg.norm(step, axis=1)
        step *= np.minimum(1.0, 0.5 * cell / np.maximum(size, 1e-300))[:, None]
        moved = points[active] + step
        offset = moved - origin[active]
        far = np.linalg.norm(offset, axis=1) > cell
        moved[far] = points[active][far]
        points[active] = moved
        active = active[(size > CLOSE * cell) & ~far]
        if not len(active):
            break
    return points


def _step(field, level, points):
    """Newton's step to the surface, (N, 3); nothing where the field has no slope."""
    value, gradient = field.value_and_gradient(points)
    steep = np.einsum("ij,ij->i", gradient, gradient)
    return np.where(steep > 0.0, (level - value) / np.where(steep > 0.0, steep, 1.0), 0.0)[:, None] * gradient


def _distance(field, level, mesh):
    """Greatest distance of the middles of faces and edges from the surface, to first order."""
    corners = mesh.corners
    middles = [corners.mean(axis=1), *(corners[:, k] + corners[:, k - 1] for k in range(3))]
    middles[1:] = [0.5 * edge for edge in middles[1:]]
    return max(np.linalg.norm(_step(field, level, points), axis=1).max() for points in middles)
