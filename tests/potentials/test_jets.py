"""Formulas with Hessians: against quadrature, each other and identities, on every target."""

import itertools
import math
import zlib

import jet_oracle
import numpy as np
import pytest
import targets

from fieldsim.potentials.kernels import (
    Cauchy,
    Gaussian,
    InverseSquare,
    Metaball,
    Newtonian,
    Quartic,
    SoftObject,
)
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.registry import FORMULAS

COMPACT = (Metaball, SoftObject, Quartic)
ALGEBRAIC = (Cauchy, Newtonian, InverseSquare)
TARGETS = ["warp64", "numba"]
JETS = [key for key in FORMULAS if key[1] in (Arc, Circle, Point, Segment)]


def norms(jets):
    """Norms (N, 3) of value, gradient and Hessian."""
    value, gradient, hessian = jets[:, 0], jets[:, 1:4], jets[:, 4:]
    hessian = np.sqrt((hessian[:, :3] ** 2).sum(axis=1) + 2.0 * (hessian[:, 3:] ** 2).sum(axis=1))
    return np.stack([np.abs(value), np.linalg.norm(gradient, axis=1), hessian], axis=1)


def widths(kernel, primitive):
    """(S, w): what a field of vanishing tails is measured by; S is 0 for those without."""
    if isinstance(kernel, ALGEBRAIC):
        return 0.0, 1.0
    w = 2.0 / kernel.width if isinstance(kernel, Gaussian) else kernel.width
    return (1.0 if primitive.dimension == 0 else min(primitive.measure, 2.0 * w)), w


def scales(primitives, kernels):
    """S / w^k (N, 3) for value, gradient and Hessian."""
    pairs = [widths(k, p) for k, p in zip(kernels, primitives, strict=True)]
    return np.array([[s, s / w, s / w**2] for s, w in pairs])


def name(key):
    return f"{key[0].__name__}-{key[1].__name__}"


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def random_case(kernel_type, primitive_type, rng):
    """A primitive of size 1 anywhere, a kernel of some width, a query at a log-uniform distance from its body."""
    center, axis = rng.normal(size=3), unit(rng)
    size = 1.0
    if primitive_type is Point:
        primitive, foot = Point(center), center
    elif primitive_type is Segment:
        primitive = Segment(center, center + axis)
        foot = center + rng.choice([0.0, 1.0, rng.random(), 1.0 + rng.random()]) * axis
    else:
        angle = rng.choice(
            [0.05 + 6.2 * rng.random(), 10 ** rng.uniform(-3, 0), 2 * math.pi - 10 ** rng.uniform(-3, 0)]
        )
        circle = primitive_type is Circle
        primitive = Circle(center, axis, size) if circle else Arc(center, axis, unit(rng), size, angle)
        row = np.zeros(20)
        primitive.pack(row)
        t = rng.uniform(0.0, row[3])
        foot = center + math.cos(t) * row[14:17] + math.sin(t) * np.cross(row[17:20], row[14:17])
        if rng.random() < 0.2:
            foot = center
    distance = 10 ** rng.uniform(-8, 6)
    if kernel_type in (Newtonian, InverseSquare):
        kernel = kernel_type(0.0 if rng.random() < 0.7 else 10 ** rng.uniform(-3, 1))
    elif kernel_type in COMPACT:
        kernel = kernel_type(10 ** rng.uniform(-1, 2))
        distance = kernel.width * rng.choice([1.1 * rng.random(), 10 ** rng.uniform(-8, 0), 0.3334, 0.99])
    else:
        kernel = kernel_type(10 ** rng.uniform(-1, 1))
    return primitive, kernel, foot + distance * unit(rng)


def random_cases(key, count):
    rng = np.random.default_rng(zlib.crc32(name(key).encode()))
    primitives, kernels, points = zip(*(random_case(*key, rng) for _ in range(count)), strict=True)
    return primitives, kernels, np.array(points)


@pytest.mark.parametrize("key", JETS, ids=name)
def test_jet_meets_quadrature(key):
    primitives, kernels, points = random_cases(key, 12)
    jets = targets.jets("warp64", *targets.rows_of(primitives, kernels), points)
    exact = [jet_oracle.jet(k, p, x) for p, k, x in zip(primitives, kernels, points, strict=True)]
    error = np.array([[float(g - e) for g, e in zip(*pair, strict=True)] for pair in zip(jets, exact, strict=True)])
    scale = scales(primitives, kernels)
    accepted = 1e-12 * norms(np.array(exact, dtype=float)) + 2e-15 * scale
    # A second derivative of a compact kernel jumps at the support's edge, whose place on a primitive of length L is
    # known to the rounding of coordinates, a part of 1e-16 (|x| + w) / L.
    if key[0] in COMPACT:
        reach = np.linalg.norm(points, axis=1) + [k.width for k in kernels]
        accepted[:, 2] += 1e-14 * scale[:, 2] * reach / [min(p.measure, 1.0) for p in primitives]
    assert (norms(error) <= accepted).all()


def hard_places(primitive, support):
    """Queries on, next to and far from a primitive about the origin, also where a compact kernel ends."""
    distances = [0.0, 1e-300, 1e-30, 1e-15, 1e-12, 1e-9, 1e-7, 1e-3, 0.3, 1.0, 3.0, 1e6, 1e12]
    for edge in (support / 3, support):
        distances += [edge, edge * (1 - 1e-12), edge * (1 + 1e-12), np.nextafter(edge, 0.0)]
    directions = [np.array(v) / math.hypot(*v) for v in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(v)]
    feet = [np.zeros(3)]
    if isinstance(primitive, Segment):
        feet = [np.array([t, 0.0, 0.0]) for t in (0.0, 0.25, 0.5, 1.0)]
    if primitive.dimension == 1 and not isinstance(primitive, Segment):
        feet += [np.array([math.cos(t), math.sin(t), 0.0]) for t in (0.0, 1e-6, 0.5, 1.0, 2.0, math.pi, -1.0, -1e-9)]
    return np.array([foot + d * u for foot in feet for d in distances for u in directions])


def hard_elements(key):
    """Elements of the formula in standard position, with narrow, fitting and wide kernels."""
    kernel_type, primitive_type = key
    x, z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    primitives = {
        Point: [Point((0.0, 0.0, 0.0))],
        Segment: [Segment((0.0, 0.0, 0.0), x)],
        Circle: [Circle((0.0, 0.0, 0.0), z, 1.0)],
        Arc: [
            Arc((0.0, 0.0, 0.0), z, x, 1.0, a)
            for a in (1e-12, 1e-6, 1.0, math.pi, 5.0, 2 * math.pi - 1e-6, 2 * math.pi - 1e-12, 2 * math.pi)
        ],
    }[primitive_type]
    values = (0.0, 0.1) if kernel_type in (Newtonian, InverseSquare) else (1e-3, 0.5, 1.0, 2.0, 3.0, 1e3)
    return [(p, kernel_type(v)) for p in primitives for v in values]


@pytest.mark.parametrize("target", ["warp64", "warp32", "numba"])
@pytest.mark.parametrize("key", JETS, ids=name)
def test_hard_places_have_no_nan(key, target):
    for primitive, kernel in hard_elements(key):
        points = hard_places(primitive, kernel.width if key[0] in COMPACT else 1.0)
        kinds, rows = targets.rows_of([primitive], [kernel])
        shape = (len(points), 1)
        jets = targets.jets(target, np.tile(kinds, len(points)), np.tile(rows, shape), points)
        assert not np.isnan(jets).any()
        # Only what is on a bare source is infinite, and only the value.
        if target == "warp64" and not (key[0] in (Newtonian, InverseSquare) and kernel.width == 0.0):
            assert np.isfinite(jets).all()


@pytest.mark.parametrize("key", JETS, ids=name)
def test_targets_agree(key):
    primitives, kernels, points = random_cases(key, 2000)
    kinds, rows = targets.rows_of(primitives, kernels)
    a, b = (targets.jets(target, kinds, rows, points) for target in TARGETS)
    # Both compilers' libraries and fused operations round differently; the formulas' own conditioning is below 100.
    assert (norms(a - b)[:, :2] <= (1e-13 * norms(a) + 1e-14 * scales(primitives, kernels))[:, :2]).all()


@pytest.mark.parametrize("key", [k for k in JETS if k[0] not in COMPACT], ids=name)
def test_single_precision(key):
    primitives, kernels, points = random_cases(key, 2000)
    kinds, rows = targets.rows_of(primitives, kernels)
    # Both answer the question as rounded. Below 1e-4 a rounded offset says little of the distance from a source, where
    # a Newtonian F, a logarithm, is a tenth of its slope times that distance.
    steepest = 1e3 if key[0] is Newtonian else 1e4
    rows, points = rows.astype(np.float32).astype(float), points.astype(np.float32).astype(float)
    single, double = (targets.jets(target, kinds, rows, points) for target in ("warp32", "warp64"))
    size = norms(double)
    far = np.isfinite(size[:, 0]) & (size[:, 1] < steepest * size[:, 0])
    size, error = size[far], norms(single[far] - double[far])
    # The field's own scale: F over powers of a length, so that what cancels on a ring's axis is not asked for. For
    # kernels without width that length is the mean distance.
    measure = np.array([p.measure for p in primitives])[far]
    if key[0] is Gaussian:
        scale = scales(primitives, kernels)[far]
    else:
        power = {Newtonian: 1.0, InverseSquare: 0.5}.get(key[0])
        width = (measure / size[:, 0]) ** power if power else np.array([1.0 / k.width for k in kernels])[far]
        scale = size[:, :1] / width[:, None] ** np.arange(3)
    relative = (error / (size + scale)).max(axis=1)
    assert relative.max() <= 1e-5
    # The ends of an arc are known to the rounding of its angle, which counts close to them.
    assert (relative <= 5e-6).mean() >= (0.98 if key[1] is Arc else 1.0)


@pytest.mark.parametrize("key", [k for k in JETS if k[0] in COMPACT], ids=name)
def test_single_precision_inside_a_wide_support(key):
    rng = np.random.default_rng(1)
    cases = [random_case(*key, rng) for _ in range(500)]
    primitives = [p for p, _, _ in cases]
    kernels = [key[0](10 ** rng.uniform(-0.5, 1.0)) for _ in cases]
    points = np.array([x for _, _, x in cases])
    kinds, rows = targets.rows_of(primitives, kernels)
    rows, points = rows.astype(np.float32).astype(float), points.astype(np.float32).astype(float)
    single, double = (targets.jets(target, kinds, rows, points) for target in ("warp32", "warp64"))
    # (Points as far from a support's edge as these are on the same side of it in both precisions.)
    relative = norms(single - double) / (norms(double) + scales(primitives, kernels))
    assert relative.max() <= 5e-6


@pytest.mark.parametrize("primitive_type", [Point, Segment])
def test_newtonian_hessian_has_no_trace(primitive_type):
    rng = np.random.default_rng(5)
    cases = [random_case(Newtonian, primitive_type, rng) for _ in range(500)]
    primitives, points = [p for p, _, _ in cases], np.array([x for _, _, x in cases])
    jets = targets.jets("warp64", *targets.rows_of(primitives, [Newtonian()] * 500), points)
    assert (np.abs(jets[:, 4:7].sum(axis=1)) <= 1e-14 * norms(jets)[:, 2]).all()


@pytest.mark.parametrize("kernel", [InverseSquare(), InverseSquare(0.1), Metaball(1.2), SoftObject(0.7), Quartic(2.5)])
def test_pieces_of_an_arc_add_up(kernel):
    rng = np.random.default_rng(6)
    for _ in range(50):
        center, normal, start = rng.normal(size=3), unit(rng), unit(rng)
        angle, share = rng.uniform(0.1, 6.28), rng.random()
        whole = Arc(center, normal, start, 1.0, angle)
        first = Arc(center, normal, start, 1.0, share * angle)
        u, n = np.array(whole.start), np.array(whole.normal)
        turned = math.cos(share * angle) * u + math.sin(share * angle) * np.cross(n, u)
        second = Arc(center, normal, turned, 1.0, (1 - share) * angle)
        point = center + 2.0 * rng.random() * unit(rng)
        jets = targets.jets("warp64", *targets.rows_of([whole, first, second], [kernel] * 3), np.tile(point, (3, 1)))
        parts = np.abs(jets).max(axis=0)
        np.testing.assert_allclose(jets[1] + jets[2], jets[0], rtol=0, atol=1e-11 * max(1.0, parts.max()))
