"""Tetrahedra that fill a cube, finer where needed: bisection that keeps their faces whole (Maubach 1995)."""

import itertools

import numpy as np

from fieldsim.errors import InputError

# The cube's side in lattice units: it can be halved so many times.
HALVINGS = 20
SIDE = 1 << HALVINGS
# Tetrahedra at most: about half a gigabyte.
MOST = 2_000_000

_PAIRS = np.array(list(itertools.combinations(range(4), 2)))
# The longest edge, in sides of the cube that a tetrahedron halves, by its level modulo 3.
_LONGEST = np.sqrt([3.0, 2.0, 1.0])


class Tetrahedra:
    """A cube of tetrahedra and the heights of a function at their corners; refined, two that touch share whole faces.

    corners (T, 4): indices of points (V, 3), whole numbers; heights (V,); levels (T,): how often each was bisected,
    which three times halves its size; goals, widths (T,): what the user of this notes of each, and halves inherit.
    seeds: each lies in the tetrahedron seed_cells (S,) at the barycentric coordinates seed_shares (S, 4).
    """

    def __init__(self, low, side: float, height, seeds):
        """Low (3,), side: of the cube; height: a function of points (N, 3); seeds (S, 3): points to keep track of."""
        self._low, self._unit, self._height = np.asarray(low), side / SIDE, height
        corners = np.array(list(itertools.product((0, 1), repeat=3)))
        self.points = corners * SIDE
        self._keys = _keys(self.points)
        self._order = np.argsort(self._keys)
        self.heights = height(self.places(self.points))
        orders = list(itertools.permutations(range(3)))
        steps = np.cumsum(np.eye(3, dtype=np.int64)[orders], axis=1)
        number = np.zeros(6, dtype=np.int64), *(steps[:, k] @ (4, 2, 1) for k in range(3))
        self.corners = np.stack(number, axis=1)
        self.levels, self.goals = np.zeros((2, 6), dtype=np.int64)
        self.widths = np.zeros(6)
        self._middles = self._middle_keys(self.corners)
        # In the cube a point's tetrahedron and place there follow from the order of its coordinates.
        x = (np.asarray(seeds).reshape(-1, 3) - self._low) / side
        falling = np.argsort(-x, axis=1, kind="stable")
        x = np.take_along_axis(x, falling, axis=1)
        self.seed_cells = np.array([orders.index(tuple(row)) for row in falling.tolist()], dtype=np.int64)
        self.seed_shares = np.column_stack([1.0 - x[:, 0], x[:, 0] - x[:, 1], x[:, 1] - x[:, 2], x[:, 2]])

    def places(self, points):
        """Lattice points (..., 3) in space."""
        return self._low + self._unit * points

    @property
    def sizes(self):
        """Longest edges (T,)."""
        return self.unit_sizes(self.levels)

    def unit_sizes(self, levels):
        """Longest edges of tetrahedra of these levels."""
        return self._unit * SIDE * 0.5 ** (levels // 3) * _LONGEST[levels % 3]

    @property
    def cut(self):
        """Whether the surface parts the corners of each, (T,)."""
        inside = (self.heights >= 0.0)[self.corners]
        return inside.any(axis=1) & ~inside.all(axis=1)

    def refine(self, wanted) -> None:
        """Bisect the tetrahedra `wanted` (T,), and neighbours as it takes to keep faces whole."""
        while wanted.any():
            if len(self.corners) + np.count_nonzero(wanted) > MOST:
                raise InputError(
                    f"mesh: this takes more than {MOST:,} cells; give a lower resolution or a larger tolerance, or "
                    "mesh what is much thinner than the rest by itself"
                )
            if (self.levels[wanted] >= 3 * HALVINGS).any():
                raise InputError(
                    f"mesh: this takes cells of less than {self._unit:.3g}, a millionth of the whole; give a lower "
                    "resolution or a larger tolerance, or mesh what is much smaller than the rest by itself"
                )
            made = self._bisect(wanted)
            fresh = len(self.corners) - made
            wanted = np.zeros(len(self.corners), dtype=bool)
            # An edge with a point in its middle: among old ones only the latest points can be such.
            wanted[:fresh] = _among(self._latest, self._middles[:fresh]).any(axis=1)
            wanted[fresh:] = _among(self._keys[self._order], self._middles[fresh:]).any(axis=1)

    def _bisect(self, wanted):
        """Bisect; the halves come last, and their number is returned."""
        parents, each = self.corners[wanted], np.arange(np.count_nonzero(wanted))
        levels = self.levels[wanted]
        last = 3 - levels % 3
        middles = self._indices((self.points[parents[:, 0]] + self.points[parents[each, last]]) // 2)
        first, second = parents.copy(), parents.copy()
        for k in range(3):
            second[:, k] = np.where(k < last, parents[:, k + 1], parents[:, k])
        first[each, last] = second[each, last] = middles
        kept = ~wanted
        numbers = np.cumsum(kept) - 1
        numbers[wanted] = np.count_nonzero(kept) + each
        self._move_seeds(wanted, numbers, len(each))
        self.corners = np.concatenate([self.corners[kept], first, second])
        self._middles = np.concatenate([self._middles[kept], self._middle_keys(first), self._middle_keys(second)])
        self.levels = np.concatenate([self.levels[kept], levels + 1, levels + 1])
        for name in ("goals", "widths"):
            array = getattr(self, name)
            setattr(self, name, np.concatenate([array[kept], array[wanted], array[wanted]]))
        return 2 * len(each)

    def _move_seeds(self, wanted, numbers, count):
        """Seeds go to the half on their side."""
        moved = np.flatnonzero(wanted[self.seed_cells])
        levels = self.levels[self.seed_cells[moved]]
        self.seed_cells = numbers[self.seed_cells]
        shares, each, last = self.seed_shares[moved], np.arange(len(moved)), 3 - levels % 3
        start, end = shares[:, 0], shares[each, last]
        ahead = end > start
        halves = shares.copy()
        for k in range(3):
            halves[:, k] = np.where(ahead & (k < last), shares[:, k + 1], shares[:, k])
        near = np.where(ahead, last - 1, 0)
        halves[each, near] = np.abs(end - start)
        halves[each, last] = 2.0 * np.minimum(start, end)
        self.seed_shares[moved] = halves
        self.seed_cells[moved] += np.where(ahead, count, 0)

    def _indices(self, points):
        """Indices of lattice points, new ones entered."""
        keys, first, inverse = np.unique(_keys(points), return_index=True, return_inverse=True)
        known = self._keys[self._order]
        where = np.minimum(np.searchsorted(known, keys), len(known) - 1)
        new = known[where] != keys
        result = self._order[where]
        result[new] = len(self.points) + np.arange(np.count_nonzero(new))
        added = points[first[new]]
        self._latest = keys[new]
        self.points = np.concatenate([self.points, added])
        self.heights = np.concatenate([self.heights, self._height(self.places(added))])
        self._keys = np.concatenate([self._keys, self._latest])
        self._order = np.insert(self._order, np.searchsorted(known, self._latest), result[new])
        return result[inverse.reshape(-1)]

    def _middle_keys(self, corners):
        """Keys (T, 6) of the middles of edges; of those that cannot be halved, of nothing."""
        both = self.points[corners[:, _PAIRS[:, 0]]] + self.points[corners[:, _PAIRS[:, 1]]]
        return np.where((both % 2).any(axis=2), -1, _keys(both // 2))

    def surface(self):
        """The surface height = 0 as triangles, closed within the cube and right-handed about lower heights.

        Returns the edges (E, 2) of corners that it cuts, inside ones first, faces (F, 3) whose corners lie on these,
        and the tetrahedron of each face, (F,).
        """
        cells = np.flatnonzero(self.cut)
        corners = self.corners[cells]
        # Inside corners come first.
        inside = (self.heights >= 0.0)[corners]
        corners = np.take_along_axis(corners, np.argsort(~inside, axis=1, kind="stable"), axis=1)
        count = inside.sum(axis=1)
        parts = []
        for number, shapes in _SHAPES.items():
            which = np.flatnonzero(count == number)
            parts += [(cells[which], corners[which][:, np.array(shape)]) for shape in shapes]
        owner = np.concatenate([cell for cell, _ in parts])
        ends = np.concatenate([pairs for _, pairs in parts])
        edges, faces = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
        faces = faces.reshape(-1, 3)
        # The plane of the cuts' middles parts inside from outside corners.
        middles = self.points[ends].astype(float)
        a, b, c = np.moveaxis(middles.mean(axis=2), 1, 0)
        outward = (middles[:, :, 1] - middles[:, :, 0]).sum(axis=1)
        turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), outward) < 0.0
        faces[turned] = faces[turned][:, ::-1]
        return edges, faces, owner


# By the number of inside corners, which come first: triangles whose corners lie on the edges between these.
_SHAPES = {
    1: [((0, 1), (0, 2), (0, 3))],
    2: [((0, 2), (0, 3), (1, 3)), ((0, 2), (1, 3), (1, 2))],
    3: [((0, 3), (1, 3), (2, 3))],
}


def _among(ascending, keys):
    """Which of the keys are among the ascending ones."""
    if not len(ascending):
        return np.zeros(keys.shape, dtype=bool)
    return ascending[np.minimum(np.searchsorted(ascending, keys), len(ascending) - 1)] == keys


def _keys(points):
    """One number for each lattice point (..., 3)."""
    return (points[..., 0] << 42) | (points[..., 1] << 21) | points[..., 2]
