"""Level surfaces of fields as closed triangle meshes.

Marching tetrahedra, which leave neither holes nor edges of more than two faces, on cells that are as fine as each part
of the surface takes: where a skeleton lies within the surface its distance from it tells how fine (`seeds_of`); around
it the kernels' widths do (`widths_of`), so that hollows and what several elements build up together are seen, too; and
from there on cells follow the surface to the size or the tolerance asked for. Vertices end on the true surface.
"""

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.meshes.mesh import TriangleMesh
from fieldsim.potentials.meshes.seeds import no_surface, seeds_of, surface_box, widths_of
from fieldsim.potentials.meshes.tetrahedra import HALVINGS, MOST, Tetrahedra

# Cells along the longest side: default, and at most.
RESOLUTION = 64
FINEST = 512
# A surface cuts about so many tetrahedra for each square of the cells' size that it is large.
CUT = 12.0
# Cells near an element are no larger than so many times the length over which its field changes.
WIDTHS = 2.5
# Longest edges at a resolution, in its cells, and bisections ahead of a new look at the distances.
CELL = 3.0
MORE = 4
# Heights are clipped here: a bare skeleton's field is infinite.
HIGHEST = 10.0
# Rounds in which vertices are spread evenly over the surface, and steps onto it.
ROUNDS = 3
STEPS = 40
# When a vertex is on the surface, in sizes of its cell.
CLOSE = 1e-13


def level_mesh(field, level, *, resolution=None, tolerance=None) -> TriangleMesh:
    """The surface field = level as a closed mesh, its normals towards smaller values.

    resolution: grid cells along the longest side of the surface; tolerance: greatest distance of the mesh from the
    surface, for which cells are refined until it holds at the middle of every face and edge. Smaller parts are found by
    the skeleton within them and get finer cells. Raises InputError where there is no surface, where it has no end, and
    for what takes more than two million cells.
    """
    level = validate.number("mesh", "level", level, above=0.0)
    tolerance = validate.optional(validate.number, "mesh", "tolerance", tolerance, above=0.0)
    cells = RESOLUTION if resolution is None else resolution
    cells = validate.whole("mesh", "resolution", cells, at_least=4, at_most=FINEST)
    if resolution is not None and tolerance is not None:
        raise InputError("mesh: resolution and tolerance are both given; give one of them")
    surface = _Surface(field, level)
    if tolerance is None:
        return surface.with_cells(cells)
    return surface.within(tolerance)


class _Surface:
    """The surface field = level, and the lattice in which all its parts were found."""

    def __init__(self, field, level):
        self._field, self._level = field, level
        elements = field.elements.scaled(1.0 / level)
        low, high = surface_box(elements, level)
        side = 1.01 * float(np.max(high - low))
        if not side > 0.0:
            raise InputError(
                f"mesh: the field stays below {level:g}, or its surface is a point to rounding; lower the level"
            )
        seeds, self._depths = seeds_of(elements, self._height, side)
        self._lattice = Tetrahedra(0.5 * (low + high - side), side, self._height, seeds)
        self._find(widths_of(elements))

    def _height(self, points):
        return np.clip(self._field.value(points) / self._level - 1.0, -1.0, HIGHEST)

    def _find(self, widths):
        lattice = self._lattice
        wanted = np.ones(1, dtype=bool)
        while wanted.any():
            # Halves have the bound of their whole until it is computed.
            asked = np.flatnonzero(lattice.sizes > WIDTHS * lattice.widths)
            if len(asked):
                corners = lattice.places(lattice.points[lattice.corners[asked]])
                centers = corners.mean(axis=1)
                radii = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
                lattice.widths[asked] = widths(centers, radii)
            wanted = lattice.sizes > WIDTHS * lattice.widths
            # A seed lies within the surface, so that a corner of its cell does, too.
            unseen = (lattice.heights < 0.0)[lattice.corners].all(axis=1)[lattice.seed_cells]
            unseen |= lattice.sizes[lattice.seed_cells] > 0.9 * self._depths
            wanted[lattice.seed_cells[unseen]] = True
            lattice.refine(wanted)
        if not lattice.cut.any():
            raise no_surface(self._level)

    def with_cells(self, resolution) -> TriangleMesh:
        """The mesh on cells of a share of its longest side, or smaller ones."""
        lattice = self._lattice
        edges, faces, _ = lattice.surface()
        points = self._crossings(edges)
        cell = np.max(np.ptp(points, axis=0)) / resolution
        a, b, c = np.moveaxis(points[faces], 1, 0)
        count = CUT * 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / cell**2
        if count > MOST:
            raise InputError(
                f"mesh: resolution is {resolution}, for which this surface takes about {count:,.0f} cells, more than "
                f"{MOST:,}; give at most {int(resolution * np.sqrt(MOST / count))}"
            )
        while (wanted := lattice.cut & (lattice.sizes > CELL * cell)).any():
            lattice.refine(wanted)
        edges, faces, _ = lattice.surface()
        return closed(self._spread(edges, faces, self._crossings(edges)), faces)

    def within(self, tolerance) -> TriangleMesh:
        """The mesh on cells that are refined until it is within the tolerance."""
        lattice = self._lattice
        while True:
            edges, faces, owner = lattice.surface()
            points = self._crossings(edges)
            error = self._distances(points[faces])
            bad = error > tolerance
            if not bad.any():
                points = self._spread(edges, faces, points)
                error = self._distances(points[faces])
                bad = error > tolerance
            if not bad.any():
                return closed(points, faces)
            # The error of a chord falls with its square, and three bisections halve a cell.
            more = np.clip(np.ceil(1.5 * np.log2(error[bad] / tolerance)), 1, 3 * HALVINGS).astype(int)
            np.maximum.at(lattice.goals, owner[bad], lattice.levels[owner[bad]] + more)
            # Each bisection parts a surface's cells by 2^(2/3).
            count = np.sum(2.0 ** (np.maximum(lattice.goals - lattice.levels, 0)[lattice.cut] / 1.5))
            if count > MOST:
                raise InputError(
                    f"mesh: tolerance is {tolerance:g}, for which this surface takes about {count:,.0f} cells, more "
                    f"than {MOST:,}; give a larger one"
                )
            lattice.goals = np.minimum(lattice.goals, lattice.levels + MORE)
            while (wanted := lattice.cut & (lattice.levels < lattice.goals)).any():
                lattice.refine(wanted)

    def _crossings(self, edges):
        """Where the surface cuts edges (E, 2) of the lattice, (E, 3): the Illinois method."""
        lattice = self._lattice
        start, end = np.moveaxis(lattice.places(lattice.points[edges]), 1, 0)
        f_low, f_high = lattice.heights[edges].T.copy()
        low, high = np.zeros(len(edges)), np.ones(len(edges))
        found, side = np.full(len(edges), 0.5), np.zeros(len(edges))
        active = np.arange(len(edges))
        for _ in range(STEPS):
            i = active
            found[i] = low[i] + (high[i] - low[i]) * f_low[i] / (f_low[i] - f_high[i])
            value = self._height(start[i] + found[i, None] * (end[i] - start[i]))
            inside = value >= 0.0
            f_high[i] *= np.where(inside & (side[i] > 0), 0.5, 1.0)
            f_low[i] *= np.where(~inside & (side[i] < 0), 0.5, 1.0)
            side[i] = np.where(inside, 1.0, -1.0)
            low[i], f_low[i] = np.where(inside, found[i], low[i]), np.where(inside, value, f_low[i])
            high[i], f_high[i] = np.where(inside, high[i], found[i]), np.where(inside, f_high[i], value)
            active = i[(np.abs(value) > CLOSE) & (high[i] - low[i] > CLOSE)]
            if not len(active):
                break
        return start + found[:, None] * (end - start)

    def _spread(self, edges, faces, points):
        """Vertices (E, 3), where the surface cuts edges, spread evenly over it."""
        ends = self._lattice.places(self._lattice.points[edges])
        sizes = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        points = self._onto(points, points, sizes)
        around = np.bincount(faces.ravel(), minlength=len(points))[:, None]
        for _ in range(ROUNDS):
            corners = points[faces]
            others = (corners.sum(axis=1, keepdims=True) - corners).reshape(-1, 3)
            sums = [np.bincount(faces.ravel(), weights=others[:, k], minlength=len(points)) for k in range(3)]
            middles = np.stack(sums, axis=1) / (2 * around)
            points = self._onto(0.5 * (points + middles), points, sizes)
        return points

    def _onto(self, points, instead, sizes):
        """Points moved along the gradient onto the surface; where they do not arrive within their size, `instead`."""
        origin, points = points, points.copy()
        arrived = np.zeros(len(points), dtype=bool)
        active = np.arange(len(points))
        for _ in range(STEPS):
            step = self._step(points[active])
            length = np.linalg.norm(step, axis=1)
            near = np.isfinite(length)
            step[~near] = 0.0
            most = 0.5 * sizes[active]
            step *= np.divide(most, length, out=np.ones(len(length)), where=length > most)[:, None]
            points[active] += step
            near &= np.linalg.norm(points[active] - origin[active], axis=1) <= sizes[active]
            done = length <= CLOSE * sizes[active]
            arrived[active[near & done]] = True
            active = active[near & ~done]
            if not len(active):
                break
        return np.where(arrived[:, None], points, instead)

    def _step(self, points):
        """Newton's step towards the surface, (N, 3), for log F where that is one; infinite where there is no slope."""
        value, gradient = self._field.value_and_gradient(points)
        ratio = value / self._level
        with np.errstate(all="ignore"):
            miss = np.where(ratio > 0.0, -np.log(ratio) * ratio, 1.0 - ratio) * self._level
            step = (miss / np.einsum("ij,ij->i", gradient, gradient))[:, None] * gradient
        return np.where(np.isfinite(step).all(axis=1, keepdims=True), step, np.inf)

    def _distances(self, corners):
        """How far the middles of faces and of their edges (F, 3, 3) are from the surface, to first order, (F,)."""
        middles = [corners.mean(axis=1), *(0.5 * (corners[:, k] + corners[:, k - 1]) for k in range(3))]
        farthest = np.max([np.linalg.norm(self._step(points), axis=1) for points in middles], axis=0)
        # No farther than a corner, which is on it.
        return np.minimum(farthest, np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1))


def closed(points, faces):
    """The mesh, whose every edge has two faces that run along it in opposite directions."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    there, back = (np.sort(pair @ (len(points), 1)) for pair in (sides, sides[:, ::-1]))
    if (there != back).any() or (there[1:] == there[:-1]).any():
        raise InputError("mesh: the surface could not be closed; give another resolution or tolerance")
    return TriangleMesh(points, faces)
