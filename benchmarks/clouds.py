"""Where accuracy is measured: clouds of points about primitives, near and far and on hard places."""

import dataclasses
import functools
import math

import numpy as np

import fieldsim as fs
from fieldsim.potentials.elements import pack
from fieldsim.potentials.row import ROW_WIDTH

COUNT = 10_000
OTHERS = 7  # shapes in general position
NEAREST, FARTHEST = -9.0, 6.0
# Coordinates are multiples of this, so that the middle of two corners is exact.
GRID = 2.0**-20


@dataclasses.dataclass(frozen=True)
class Cloud:
    """Points (N, 3) about shapes; owner (N,): which shape each belongs to, and which kernel.

    shapes[0] is in standard position, kernels[0] of the common width.
    """

    kernels: tuple
    shapes: tuple
    owner: np.ndarray
    points: np.ndarray

    def jets(self, target):
        """Jets (N, 10) of every point's shape."""
        import targets

        return targets.jets(target, *self.packed, self.points)

    @functools.cached_property
    def packed(self):
        """Kinds (N,) and rows (N, ROW_WIDTH) of every point's element."""
        elements = [pack([s], [k], 1.0) for s, k in zip(self.shapes, self.kernels, strict=True)]
        kinds = np.concatenate([e.kinds for e in elements])
        return kinds[self.owner], np.concatenate([e.rows for e in elements])[self.owner]


def make_cloud(kernel, primitive) -> Cloud:
    """The cloud of a formula: half its points about `primitive`, half about others of its kind in general position."""
    rng = np.random.default_rng([*map(ord, type(kernel).__name__ + type(primitive).__name__)])
    shapes = (primitive, *(_another(primitive, rng) for _ in range(OTHERS)))
    kernels = (kernel, *(_another_width(kernel, rng) for _ in range(OTHERS)))
    owner = np.sort(np.where(rng.random(COUNT) < 0.5, 0, rng.integers(1, OTHERS + 1, COUNT)))
    counts = np.bincount(owner, minlength=len(shapes))
    points = [_about(k, s, n, rng) for k, s, n in zip(kernels, shapes, counts, strict=True)]
    return Cloud(kernels, shapes, owner, np.concatenate(points))


def _another_width(kernel, rng):
    """The kernel with another width; a bare one stays bare every other time."""
    width = 10 ** rng.uniform(-1, 1)
    return type(kernel)(width if kernel.width or rng.random() < 0.5 else 0.0)


def _another(primitive, rng):
    """A primitive of the same kind in general position, of size about 1; now and then thin or nearly closed."""

    def corner():
        return tuple(np.round(rng.uniform(-1, 1, 3) / GRID) * GRID)

    if isinstance(primitive, fs.Point):
        return fs.Point(corner())
    if isinstance(primitive, fs.Plane):
        return fs.Plane(corner(), corner())
    if isinstance(primitive, fs.Segment):
        return fs.Segment(corner(), corner())
    if isinstance(primitive, fs.Circle):
        return fs.Circle(corner(), corner(), rng.uniform(0.3, 1.0))
    if isinstance(primitive, fs.Arc):
        angle = rng.choice([rng.uniform(0.3, 6.2), 10 ** rng.uniform(-4, 0), math.tau - 10 ** rng.uniform(-4, 0)])
        return fs.Arc(corner(), corner(), corner(), rng.uniform(0.3, 1.0), angle)
    return fs.Triangle(corner(), corner(), corner())


def _about(kernel, shape, count, rng):
    """Points (count, 3) about a shape: two in three anywhere, the rest on hard places."""
    feet = _feet(shape, count, rng)
    points = feet + _away(count, rng) * (_across if isinstance(shape, fs.Plane) else _any)(shape, count, rng)
    chosen = [*hard_places(kernel, shape, feet, rng), points]
    which = np.where(rng.random(count) < 1 / 3, rng.integers(0, len(chosen), count), len(chosen) - 1)
    return np.stack(chosen)[which, np.arange(count)]


def bare(kernel):
    """Whether a kernel is infinite at its source."""
    return isinstance(kernel, fs.Newtonian | fs.InverseSquare) and kernel.softening == 0.0


def hard_places(kernel, shape, feet, rng):
    """Points (N, 3) on hard places of a shape, one array a place; feet: points (N, 3) of the shape."""
    count = len(feet)

    def away():
        return _away(count, rng)

    places = []
    if isinstance(shape, fs.Segment):
        along = np.subtract(shape.end, shape.start) / shape.measure
        beyond = np.array(shape.end) + away() * along
        places = [
            beyond,
            beyond + away() * _units(count, rng),
            np.array(shape.start) + 1e-3 * away() * _units(count, rng),
        ]
    if isinstance(shape, fs.Arc | fs.Circle):
        normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
        axis = np.array(shape.center) + away() * normal
        out = (feet - shape.center) / shape.radius
        places = [
            axis,
            axis + away() * _units(count, rng),
            np.array(shape.center) + away() * out,
            feet + away() * normal,
        ]
    if isinstance(shape, fs.Triangle):
        a, b, c = np.array([shape.a, shape.b, shape.c])
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        u = (b - a) / np.linalg.norm(b - a)
        edge = a + rng.random((count, 1)) * (b - a)
        side = np.cross(normal, u)
        places = [
            feet + away() * normal,
            b + away() * u,
            b + away() * u + away() * _units(count, rng),
            edge - away() * side if bare(kernel) else edge + away() * side * rng.choice([-1, 1], (count, 1)),
            edge + away() * _units(count, rng),
            c + away() * _units(count, rng),
            edge + away() * side * rng.choice([-1, 1], (count, 1)) + away() * normal,
        ]
    if isinstance(kernel, fs.Metaball | fs.Quartic | fs.SoftObject):
        # On the edge itself the second derivative jumps, and rounding would say on which side a point lies.
        off = 10 ** rng.uniform(NEAREST, 0, (count, 1))
        edge = kernel.radius * (1 - rng.choice([-1, 1, 1], (count, 1)) * off)
        places += [feet + edge * _across(shape, count, rng)] * 2
        if isinstance(kernel, fs.Metaball):
            places += [feet + edge / 3 * _across(shape, count, rng)]
    return places


def _feet(shape, count, rng):
    """Random points (count, 3) of a shape."""
    t, s = rng.random((2, count, 1))
    if isinstance(shape, fs.Point):
        return np.tile(shape.position, (count, 1))
    if isinstance(shape, fs.Segment):
        return np.array(shape.start) + t * np.subtract(shape.end, shape.start)
    if isinstance(shape, fs.Triangle):
        a, b, c = np.array([shape.a, shape.b, shape.c])
        low, high = np.minimum(s, t), np.maximum(s, t)
        return a + low * (b - a) + (1 - high) * (c - a)
    if isinstance(shape, fs.Plane):
        sideways = rng.uniform(-1, 1, (count, 3))
        normal = np.array(shape.normal) / np.linalg.norm(shape.normal)
        return np.array(shape.point) + sideways - (sideways @ normal)[:, None] * normal
    row = np.zeros(ROW_WIDTH)
    shape.pack(row)
    start, normal = row[14:17], row[17:20]
    turn = t * row[3]
    return np.array(shape.center) + row[2] * (np.cos(turn) * start + np.sin(turn) * np.cross(normal, start))


def _across(shape, count, rng):
    """Unit vectors (count, 3) across a segment, an arc's plane or a flat shape, which end on a support's edge."""
    units = _units(count, rng)
    if isinstance(shape, fs.Segment):
        along = np.subtract(shape.end, shape.start) / shape.measure
        units -= (units @ along)[:, None] * along
    elif isinstance(shape, fs.Triangle):
        units = np.cross(np.subtract(shape.b, shape.a), np.subtract(shape.c, shape.a)) + np.zeros((count, 1))
    elif not isinstance(shape, fs.Point):
        units = np.array(shape.normal) * np.sign(units[:, :1])
    return units / np.linalg.norm(units, axis=1)[:, None]


def _away(count, rng):
    return 10 ** rng.uniform(NEAREST, FARTHEST, (count, 1))


def _any(shape, count, rng):
    return _units(count, rng)


def _units(count, rng):
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]
