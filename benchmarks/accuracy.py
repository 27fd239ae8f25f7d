"""How far from the truth every formula is, at 10,000 points each: largest and median relative errors.

Half the points lie about a primitive in standard position, half about others in general position with kernels of other
widths: most at log-uniform distances 1e-9 to 1e6 from a random point of it, some on hard places (see `clouds`).

- *largest*, *median*, *raw*: against quadrature of the definition in 34 to 50 digits (tests/jet_oracle.py and
  tests/triangle_oracle.py) at the exact binary values of point and primitive, so that their rounding is no error. At
  RANDOM points and at the WORST by the other measures. *raw* is the error as it is; of what exceeds the goal, *largest*
  leaves out what moving the point by ROUNDINGS half units in the last place of its largest coordinate, or of the
  primitive's, does to the truth: next to a support's edge and to equilibria no formula can know more.
- *twin*: numba against Warp, all points.
- *identities*, all points: halves add up; exact similarities (axes permuted, lengths doubled); the bare Newtonian
  Hessian has no trace; a Gaussian's slope across a flat primitive is -2 a^2 z F. Both sides take the same numbers:
  halves meet at representable points, motions do not round.
- *float32*: Warp in single against double precision at the same single-precision numbers, all points about the
  primitive in standard position, with the same allowance in single precision.

Errors are relative to the norm of what is measured; for kernels whose tails vanish, to that plus 2e-3 S / w^n (S and w
as in tests/reference_cases.py, n the derivative's order), so that 1e-12 is the accepted error; in float32 to the
field's scale, which is that plus S / w^n.
"""

import dataclasses
import functools
import math
import pathlib
import sys

import numpy as np

import fieldsim as fs
from benchmarks.clouds import COUNT, Cloud, make_cloud
from benchmarks.fields import KERNELS, PRIMITIVES
from fieldsim.potentials import registry
from fieldsim.potentials.elements import Elements, pack, place
from fieldsim.potentials.row import ANGLE, KERNEL_WIDTH, POSITIONS, ROW_WIDTH, SIZE

sys.path.append(str(pathlib.Path(__file__).parent.parent / "tests"))

RANDOM = 40
WORST = 10
QUANTITIES = ("value", "gradient", "Hessian")
GOAL = 1e-12
# Offsets are formed with about this many roundings, half a unit in the last place each.
ROUNDINGS = 4.0
GOAL_MEDIAN = 1e-15
GOAL_SINGLE = 5e-6
ALGEBRAIC = (fs.Cauchy, fs.InverseSquare, fs.Newtonian)


def rows():
    """The errors of all formulas, then the places that are hard for peers."""
    from benchmarks import accuracy_peers

    for kernel in KERNELS:
        for primitive in PRIMITIVES:
            yield from _rows_of(measure(kernel, primitive))
    yield from accuracy_peers.rows()


def _rows_of(report):
    for n, quantity in enumerate(QUANTITIES):
        for name, errors, goal in (
            ("largest", report.largest, GOAL),
            ("raw", report.raw.max(axis=0), GOAL),
            ("median", report.median, GOAL_MEDIAN),
            ("twin", report.twin.max(axis=0), GOAL),
            ("identities", report.identities.max(axis=0), None),
            ("float32", report.single.max(axis=0), GOAL_SINGLE),
        ):
            yield {
                "name": f"{report.name}, {quantity}, {name}",
                "value": float(errors[n]),
                "unit": "of scale" if name == "float32" else "relative error",
                "peer": goal and "goal",
                "peer_value": goal,
            }


@dataclasses.dataclass(frozen=True)
class Report:
    """Errors (N, 3) of value, gradient and Hessian of a formula: at the oracle's `places` of the cloud, or all over."""

    name: str
    cloud: Cloud
    places: np.ndarray
    oracle: np.ndarray
    raw: np.ndarray
    twin: np.ndarray
    identities: np.ndarray
    single: np.ndarray

    @property
    def largest(self) -> np.ndarray:
        """Of value, gradient and Hessian."""
        return self.oracle.max(axis=0)

    @property
    def median(self) -> np.ndarray:
        """Of value, gradient and Hessian at random points."""
        return np.median(self.oracle[:RANDOM], axis=0)


@functools.cache
def measure(kernel, primitive) -> Report:
    """The errors of one formula."""
    cloud = make_cloud(kernel, primitive)
    jets = cloud.jets("warp64")
    twin = relative(cloud, cloud.jets("numba") - jets, jets)
    same = identities(cloud, jets)
    suspects = np.argsort(-np.nan_to_num(np.maximum(twin, same), nan=np.inf).max(axis=1))[:WORST]
    places = np.concatenate([np.random.default_rng(0).choice(COUNT, RANDOM, replace=False), suspects])
    name = f"{type(kernel).__name__} on {type(primitive).__name__}"
    return Report(name, cloud, places, *against_oracle(cloud, jets, places), twin, same, single(cloud))


def over_reference(kernel, primitive):
    """Largest errors over a formula's reference cases (types given): value and gradient, in double and in single."""
    import reference_cases
    import targets

    cases = reference_cases.reference()[registry.FORMULAS[kernel, primitive]]
    packed = pack([c.primitive for c in cases], [c.kernel for c in cases], 1.0)
    points = np.array([c.point for c in cases])
    exact = np.zeros((len(cases), 10))
    exact[:, :4] = [[c.value, *c.gradient] for c in cases]
    scale = np.array([[c.scale, c.scale / c.width, 0.0] for c in cases])
    double = norms(targets.jets("warp64", packed.kinds, packed.rows, points) - exact)
    floor = 0.0 if issubclass(kernel, ALGEBRAIC) else 2e-3 * scale
    rounded = [a.astype(np.float32).astype(float) for a in (packed.rows, points)]
    exact_single = targets.jets("warp64", packed.kinds, *rounded)
    single = norms(targets.jets("warp32", packed.kinds, *rounded) - exact_single)
    # Below 1e-18 everything is accepted, as the reference's floor has it.
    double = double / np.maximum(norms(exact) + floor, 1e-6)
    return double.max(axis=0)[:2], (single / np.maximum(norms(exact_single) + scale, 1e-300)).max(axis=0)[:2]


def norms(jets):
    """Norms (N, 3) of value, gradient and Hessian."""
    hessian = np.sqrt((jets[:, 4:7] ** 2).sum(axis=1) + 2.0 * (jets[:, 7:] ** 2).sum(axis=1))
    return np.stack([np.abs(jets[:, 0]), np.linalg.norm(jets[:, 1:4], axis=1), hessian], axis=1)


def relative(cloud, difference, jets, places=slice(None), floor=2e-3):
    """Errors (N, 3) in the measure of this module's head."""
    size = norms(jets)
    if not isinstance(cloud.kernels[0], ALGEBRAIC):
        size = size + floor * _scale(cloud, size[:, 0], places)
    error = norms(difference)
    return np.divide(error, size, out=np.where(error > 0, np.inf, error), where=size > 0)


def _scale(cloud, value, places=slice(None)):
    """S / w^n (N, 3) of the formulas' scales."""
    import reference_cases

    result = np.empty((len(value), 3))
    for i, (owner, size) in enumerate(zip(cloud.owner[places], value, strict=True)):
        s, w = reference_cases.scale_and_width(cloud.kernels[owner], cloud.shapes[owner], max(size, 1e-300))
        result[i] = s, s / w, s / (w * w)
    return result


def single(cloud):
    """Errors (N, 3) of single precision about the shape in standard position, in units of the field's scale."""
    import targets

    count = np.count_nonzero(cloud.owner == 0)
    kinds, rows = (a[:count] for a in cloud.packed)
    rows, points = (a.astype(np.float32).astype(float) for a in (rows, cloud.points[:count]))
    exact = targets.jets("warp64", kinds, rows, points)
    result = targets.jets("warp32", kinds, rows, points)
    # Rounding took some points onto the source itself, where infinity is right.
    on_it = np.isposinf(exact[:, 0]) & np.isposinf(result[:, 0])
    exact[on_it, 0] = result[on_it, 0] = 0.0
    error = norms(result - exact)
    blur = np.zeros_like(error)
    for step in _steps(points, cloud.shapes[0], ROUNDINGS * 2.0**-24):
        blur = np.fmax(blur, norms(targets.jets("warp64", kinds, rows, points + step) - exact))
    size = norms(exact)
    scale = np.maximum(size + _scale(cloud, size[:, 0], slice(count)), 1e-300)
    return np.where(error > GOAL_SINGLE * scale, np.maximum(error - blur, 0.0), error) / scale


def _steps(points, shape, unit):
    """Six steps (N, 3) along the axes, `unit` of the largest coordinate of the point and of the shape."""
    size = np.maximum(np.abs(points).max(axis=1), _extent(shape))
    return [sign * unit * size[:, None] * axis for axis in np.eye(3) for sign in (-1.0, 1.0)]


def _extent(shape):
    row = np.zeros(ROW_WIDTH)
    shape.pack(row)
    return np.abs(row[POSITIONS]).max() + (shape.radius if hasattr(shape, "radius") else 0.0)


def against_oracle(cloud, jets, places):
    """Errors (M, 3) at some places of the cloud, beyond the input's last digits and as they are."""
    import mpmath as mp

    result, raw = np.empty((2, len(places), 3))
    with mp.workdps(50):
        for row, at in enumerate(places):
            owner, point = cloud.owner[at], cloud.points[at]
            kernel, shape = cloud.kernels[owner], cloud.shapes[owner]
            truth = oracle(kernel, shape, point)
            here = [at]
            exact = np.array([truth], dtype=float)
            error = raw[row] = relative(cloud, _difference(jets[at], truth), exact, here)[0]
            if error.max() > GOAL:
                steps = _steps(point[None], shape, ROUNDINGS * 2.0**-53)
                moved = [oracle(kernel, shape, _moved(point, step[0])) for step in steps]
                blur = np.max([relative(cloud, _difference(m, truth), exact, here) for m in moved], axis=0)
                error = np.where(error > GOAL, np.maximum(error - blur[0], 0.0), error)
            result[row] = error
    return result, raw


def _moved(point, step):
    """The point (mpf) a step away, which float64 could not hold."""
    import mpmath as mp

    return [mp.mpf(float(p)) + mp.mpf(float(s)) for p, s in zip(point, step, strict=True)]


def _difference(jet, truth):
    import mpmath as mp

    return np.array([[float(mp.mpf(j) - t) for j, t in zip(jet, truth, strict=True)]])


def oracle(kernel, shape, point):
    """The ten numbers (mpf) of a jet, by quadrature of the definition."""
    import jet_oracle
    import triangle_oracle

    if isinstance(shape, fs.Triangle):
        f, g, hessian = triangle_oracle.exact(kernel, (shape.a, shape.b, shape.c), point)
        pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        return [f, *g, *(hessian[i, j] for i, j in pairs)]
    return jet_oracle.jet(kernel, shape, point)


def identities(cloud, jets):
    """The largest error (N, 3) of the identities that hold for a formula, at all points."""
    errors = [similarity(cloud, jets)]
    if isinstance(cloud.shapes[0], fs.Segment | fs.Circle | fs.Arc | fs.Triangle):
        errors.append(halves(cloud, jets))
    if isinstance(cloud.kernels[0], fs.Newtonian):
        size, bare = norms(jets)[:, 2], np.array([k.softening == 0 for k in cloud.kernels])[cloud.owner]
        trace = np.abs(jets[:, 4:7].sum(axis=1)) / np.where(size > 0, size, 1.0)
        errors.append(np.where(bare, trace, 0.0)[:, None] * [0, 0, 1])
    if isinstance(cloud.kernels[0], fs.Gaussian) and not isinstance(cloud.shapes[0], fs.Point | fs.Segment):
        errors.append(slope_across(cloud, jets))
    return np.max(errors, axis=0)


# Of a jet whose axes x, y, z became y, z, x: where each number is found.
TURNED = [0, 2, 3, 1, 5, 6, 4, 9, 7, 8]


def similarity(cloud, jets):
    """The field of the turned and doubled shape at the turned and doubled points."""
    import targets

    primitive, kernel = cloud.shapes[0], cloud.kernels[0]
    kinds, rows = cloud.packed
    turn = np.roll(np.eye(3), 1, axis=0)
    turned = place(rows, turn, np.zeros(3))
    turned[:, POSITIONS] *= 2.0
    turned[:, SIZE] *= 2.0
    turned[:, KERNEL_WIDTH] *= 0.5 if isinstance(kernel, fs.Cauchy | fs.Gaussian) else 2.0
    if isinstance(primitive, fs.Triangle):
        turned[:, ANGLE] *= 4.0  # there its area
    other = targets.jets("warp64", kinds, turned, 2.0 * cloud.points @ turn.T)[:, TURNED]
    order = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
    degree = primitive.dimension + {fs.Newtonian: -1, fs.InverseSquare: -2}.get(type(kernel), 0) - order
    other /= 2.0**degree
    if isinstance(primitive, fs.Plane) and isinstance(kernel, fs.InverseSquare):
        other[:, 0] += 2 * math.pi * math.log(2.0)
    return relative(cloud, other - jets, jets)


def halves(cloud, jets):
    """The fields of two halves against that of the whole, relative to the sum of all their sizes."""
    pairs = [_halves(*pair) for pair in zip(cloud.kernels, cloud.shapes, strict=True)]
    first, second = (_packed_jets(cloud, [pair[n] for pair in pairs]) for n in (0, 1))
    size = norms(first) + norms(second) + norms(jets)
    if not isinstance(cloud.kernels[0], ALGEBRAIC):
        size = size + 2e-3 * _scale(cloud, norms(jets)[:, 0])
    error = norms(first + second - jets)
    return np.divide(error, size, out=np.where(error > 0, np.inf, error), where=size > 0)


def _packed_jets(cloud, elements):
    """Jets (N, 10) of every point, whose owner's element is given."""
    import targets

    kinds, rows = (np.concatenate([getattr(e, name) for e in elements])[cloud.owner] for name in ("kinds", "rows"))
    return targets.jets("warp64", kinds, rows, cloud.points)


def _halves(kernel, shape):
    """The elements of two primitives that make up the whole."""
    if isinstance(shape, fs.Segment):
        middle = tuple(np.add(shape.start, shape.end) / 2)
        halves = fs.Segment(shape.start, middle), fs.Segment(middle, shape.end)
    elif isinstance(shape, fs.Triangle):
        middle = tuple(np.add(shape.a, shape.b) / 2)
        halves = fs.Triangle(shape.a, middle, shape.c), fs.Triangle(middle, shape.b, shape.c)
    else:
        return _half_arcs(kernel, shape)
    return [pack([half], [kernel], 1.0) for half in halves]


def _half_arcs(kernel, shape):
    """The elements of two half arcs; made of the whole's row, so that all lie on the same wire to the last digit."""
    kind = registry.FORMULAS[type(kernel), fs.Arc].kind
    row = pack([shape], [kernel], 1.0).rows[0]
    row[ANGLE] /= 2
    start, normal = row[14:17], row[17:20]
    other = row.copy()
    other[14:17] = np.cos(row[ANGLE]) * start + np.sin(row[ANGLE]) * np.cross(normal, start)
    return [Elements(r[None], np.array([kind]), np.zeros(1, int)) for r in (row, other)]


def slope_across(cloud, jets):
    """dF/dz = -2 a^2 z F and d2F/dz2 = (4 a^4 z^2 - 2 a^2) F of Gaussians, about the shape in standard position."""
    a2, z = cloud.kernels[0].a ** 2, cloud.points[:, 2]
    other = jets.copy()
    other[:, 3] = -2 * a2 * z * jets[:, 0]
    other[:, 6] = (4 * a2 * z * a2 * z - 2 * a2) * jets[:, 0]
    return np.where((cloud.owner == 0)[:, None], relative(cloud, other - jets, jets), 0.0)
