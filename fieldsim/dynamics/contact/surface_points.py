"""Points spread over the surface of a body, for contact."""

import dataclasses

import numpy as np

from fieldsim.errors import InputError
from fieldsim.sources.field import field_of_elements
from fieldsim.sources.margins import margins

# How far the surface may bulge between points, in radii of its material.
TOLERANCE = 0.02
# Greatest number of points in one bounding sphere.
BLOCK = 32
# Greatest number of cells of the grid that finds the surface.
MOST_CELLS = 4_000_000


@dataclasses.dataclass(frozen=True, eq=False)
class SurfacePoints:
    """points (n, 3) on a surface F = 1 with their shares of its area (n,), block by block.

    blocks (m, 4): centre and radius of a sphere around the points of each; ends (m,): where each block's points end.
    """

    points: np.ndarray
    areas: np.ndarray
    blocks: np.ndarray
    ends: np.ndarray

    @property
    def area(self) -> float:
        """Area of the surface."""
        return float(self.areas.sum())


def spacing(radius: float, tolerance: float = TOLERANCE) -> float:
    """Distance between points on a surface of least radius of curvature `radius`: it bulges distance^2 / (2 radius)."""
    return radius * np.sqrt(2.0 * tolerance)


def surface_points(elements, low, high, step: float) -> SurfacePoints:
    """Points about `step` apart on the surface F = 1 of packed elements within the box from `low` to `high`.

    One for each cell of a grid that the surface cuts, from its middle along the gradient. A plane with unit normal n
    cuts (|n1| + |n2| + |n3|) / step^2 cells per unit of area, so each point stands for the inverse of that.
    """
    points = _cut_cells(elements, low, high, step)
    for _ in range(12):
        points = points - _to_surface(elements, points, step)
    field, gradient = field_of_elements(elements, points)
    found = np.abs(np.log(field)) < 1e-6
    if not found.any():
        raise InputError("no surface F = 1 was found; give its material a larger radius")
    normals = gradient[found] / np.linalg.norm(gradient[found], axis=1)[:, None]
    areas = step**2 / np.abs(normals).sum(axis=1)
    points = points[found]
    order, ends = _blocks(points)
    points, areas = points[order], areas[order]
    parts = np.split(points, ends[:-1])
    centers = [0.5 * (part.min(axis=0) + part.max(axis=0)) for part in parts]
    radii = [np.linalg.norm(part - c, axis=1).max() for part, c in zip(parts, centers, strict=True)]
    return SurfacePoints(points, areas, np.column_stack([centers, radii]), ends)


def _cut_cells(elements, low, high, step):
    """Middles (n, 3) of the cells of a grid of the given step that the surface cuts."""
    counts = np.ceil((high - low) / step).astype(int) + 1
    if counts.astype(float).prod() > MOST_CELLS:
        return _cut_cells_of_octree(elements, low, high, step)
    middle = 0.5 * (low + high)
    axes = [middle[k] + (np.arange(counts[k]) - 0.5 * (counts[k] - 1)) * step for k in range(3)]
    corners = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    inside = (field_of_elements(elements, corners.reshape(-1, 3))[0] > 1.0).reshape(tuple(counts)).astype(int)
    inside = inside[1:] + inside[:-1]
    inside = inside[:, 1:] + inside[:, :-1]
    inside = inside[:, :, 1:] + inside[:, :, :-1]
    return np.stack([axes[k][i] for k, i in enumerate(np.nonzero((inside > 0) & (inside < 8)))], axis=1) + 0.5 * step


def _cut_cells_of_octree(elements, low, high, step):
    """The same of a long or wide surface: cells are halved, and only those within reach of the elements are kept."""
    halvings = 0
    while np.ceil((high - low) / (step * 2**halvings)).prod() > MOST_CELLS / 64:
        halvings += 1
    coarse = step * 2**halvings
    counts = np.ceil((high - low) / coarse).astype(int)
    axes = [0.5 * (low + high)[k] + (np.arange(counts[k]) - 0.5 * (counts[k] - 1)) * coarse for k in range(3)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    octants = np.stack(np.meshgrid(*3 * [(-0.5, 0.5)], indexing="ij"), axis=-1).reshape(8, 3)
    for size in coarse * 0.5 ** np.arange(halvings + 1):
        cells = cells[margins(elements, cells) < 0.5 * np.sqrt(3.0) * size]
        if size > step:
            cells = (cells[:, None] + 0.5 * size * octants).reshape(-1, 3)
        if len(cells) > MOST_CELLS:
            raise InputError(
                f"a surface of extent {float((high - low).max()):.3g} sampled every {step:.2g} takes too many cells; "
                "give its material a larger radius"
            )
    corners = (cells[:, None] + step * octants).reshape(-1, 3)
    inside = (field_of_elements(elements, corners)[0] > 1.0).reshape(-1, 8).sum(axis=1)
    return cells[(inside > 0) & (inside < 8)]


def _to_surface(elements, points, longest):
    """Newton's step for log F = 0 along the gradient, no longer than `longest`."""
    field, gradient = field_of_elements(elements, points)
    field = np.maximum(field, 1e-300)
    slope = gradient / field[:, None]
    steep = np.maximum(np.sum(slope**2, axis=1), 1e-300)
    step = (np.log(field) / steep)[:, None] * slope
    size = np.linalg.norm(step, axis=1)[:, None]
    return step * np.minimum(1.0, longest / np.maximum(size, 1e-300))


def _blocks(points):
    """(order of points, ends of blocks): blocks of points close together, by repeated bisection."""
    done, rest = [], [np.arange(len(points))]
    while rest:
        part = rest.pop()
        if len(part) <= BLOCK:
            done.append(part)
            continue
        longest = np.argmax(np.ptp(points[part], axis=0))
        part = part[np.argsort(points[part, longest], kind="stable")]
        rest += [part[len(part) // 2 :], part[: len(part) // 2]]
    return np.concatenate(done), np.cumsum([len(part) for part in done])
