"""Triangles: hard places against quadrature in 50 digits, identities, singular places, bad input."""

import math

import jets
import mpmath as mp
import numpy as np
import pytest
import triangle_oracle

from fieldsim.errors import InputError
from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Metaball, Newtonian, Quartic, SoftObject
from fieldsim.potentials.primitives.triangle import Triangle

KERNELS = [
    *(Newtonian(), Newtonian(0.3), InverseSquare(), InverseSquare(0.3)),
    *(Cauchy(0.05), Cauchy(2.0), Cauchy(10.0), Gaussian(0.1), Gaussian(2.0), Gaussian(15.0)),
    *(Metaball(0.4), Metaball(2.5), SoftObject(0.4), SoftObject(2.5), Quartic(0.4), Quartic(2.5)),
]
NEEDLED = [*(Newtonian(), InverseSquare(), Cauchy(2.0), Gaussian(2.0)), *(Metaball(2.5), SoftObject(2.5), Quartic(2.5))]
CORNERS = np.array([(0.3, -0.2, 0.5), (1.4, 0.1, -0.3), (0.2, 1.1, 0.4)])


def places(corners, seed):
    """Points in hard places: (name, point)."""
    a, b, c = corners
    rng = np.random.default_rng(seed)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    along = (b - a) / np.linalg.norm(b - a)
    across = np.cross(normal, along)
    size = max(np.linalg.norm(v) for v in (b - a, c - b, a - c))

    def off(low, high):
        return size * 10 ** rng.uniform(low, high)

    return [
        ("above the inside", 0.3 * a + 0.3 * b + 0.4 * c + off(-2, 0) * normal),
        ("close to the sheet", 0.2 * a + 0.5 * b + 0.3 * c + off(-9, -6) * normal),
        ("in the plane outside", a - off(-1, 0.5) * across),
        ("nearly in the plane outside", c + off(-1, 0.5) * across + off(-9, -6) * normal),
        ("close to an edge", 0.4 * a + 0.6 * b + off(-9, -6) * across - off(-9, -6) * normal),
        ("just outside an edge", 0.4 * a + 0.6 * b - off(-9, -6) * across),
        ("on an edge's line", b + off(-1, 0.7) * along),
        ("close to an edge's line", b + off(-1, 0.7) * along + off(-9, -6) * (normal + across)),
        ("close to a corner", c + off(-9, -6) * rng.normal(size=3)),
        ("above a corner", a + off(-3, 0) * normal),
        ("above an edge", 0.5 * a + 0.5 * c + off(-3, 0) * normal),
        ("between near and far", 8 * size * rng.normal(size=3)),
        ("far", off(1, 6) * rng.normal(size=3)),
        ("far in the plane", off(1, 6) * (across - 0.3 * along)),
    ]


def norms(jet):
    """Norms of values, gradients and Hessians, (3, N)."""
    return np.array([np.linalg.norm(part.reshape(len(part), -1), axis=1) for part in jet])


def differences(jet, other):
    return norms([a - b for a, b in zip(jet, other, strict=True)])


@pytest.mark.parametrize("kernel", KERNELS, ids=str)
def test_hard_places(kernel):
    triangle = Triangle(*CORNERS)
    names, points = zip(*places(CORNERS, 5), strict=True)
    rows = [jets.row(kernel, triangle)] * len(points)
    jet = jets.evaluate("warp64", (type(kernel), Triangle), points, rows)
    floor, width = jets.scale(kernel, triangle.measure)
    for i, name in enumerate(names):
        with mp.workdps(50):
            expected = triangle_oracle.exact(kernel, CORNERS, points[i])
            for power, (got, want) in enumerate(zip(jet, expected, strict=True)):
                error = float(mp.norm(mp.matrix(got[i].tolist()) - want) if power else abs(got[i] - want))
                accepted = 1e-12 * float(mp.norm(want) if power else abs(want)) + 2e-15 * floor / width**power
                assert error <= accepted + 1e-300, (name, power)


@pytest.mark.parametrize("aspect", [1e3, 1e6])
@pytest.mark.parametrize("kernel", NEEDLED, ids=str)
def test_needles(kernel, aspect):
    along, across = np.array([0.5, 0.75, -0.25]), np.array([-0.5, 0.25, 0.625])
    above = np.cross(along, across)
    start = np.array([0.25, -0.375, 0.5])
    end = start + along
    corners = np.array([start, end, end + across / aspect])
    points = [
        *(start - 0.4 * along + 0.02 * above, end + 0.9 * along - 0.8 * across, start + 0.5 * along + 1.2 * across),
        *(end + 0.6 * along - 0.1 * across, start + 0.5 * along + 0.1 * above, start + 0.3 * along - 0.4 * across),
        *(end - 1e-3 * along + 0.3 * across / aspect + 1e-3 * above, start + 2.0 * above),
    ]
    triangle = Triangle(*corners)
    jet = jets.evaluate("warp64", (type(kernel), Triangle), points, [jets.row(kernel, triangle)] * len(points))
    floor, width = jets.scale(kernel, triangle.measure)
    for i, point in enumerate(points):
        with mp.workdps(40):
            expected = triangle_oracle.exact(kernel, corners, point)
            for power, (got, want) in enumerate(zip(jet, expected, strict=True)):
                error = float(mp.norm(mp.matrix(got[i].tolist()) - want) if power else abs(got[i] - want))
                # The long edges' terms differ by as little as they are apart: a rounding costs so many times itself.
                accepted = 1e-14 * aspect * (float(mp.norm(want) if power else abs(want)) + 2e-3 * floor / width**power)
                assert error <= accepted, (i, power)


@pytest.mark.parametrize("kernel", [Quartic(0.9), SoftObject(0.9), Metaball(0.9)], ids=str)
def test_single_precision_at_a_corner(kernel):
    """The feet lie outside by rounding, as far from one edge as from the other; and R is the height."""
    corners = np.array([(-0.5, -0.25, 0.0), (0.5, -0.25, 0.0), (0.0, 0.65, 0.0)])
    points = np.array([(1.555586e-08, 0.65, -1.2927e-08), (3.469352e-09, 0.65, 2.4275e-10), (0.0, 0.65, 0.0)])
    points, row = (a.astype(np.float32).astype(float) for a in (points, jets.row(kernel, Triangle(*corners))))
    expected, jet = (
        jets.evaluate(target, (type(kernel), Triangle), points, [row] * len(points)) for target in ("warp64", "warp32")
    )
    scale = norms(expected) + np.array([[1.0], [1.0], [1.0]])
    assert (differences(jet, expected) <= 5e-6 * scale).all()


@pytest.mark.parametrize("kernel", KERNELS, ids=str)
def test_single_precision(kernel):
    corners = np.array([(0.0, 0.0, 0.0), (1.5, 0.0, 0.0), (0.25, 1.25, 0.0)])
    triangle = Triangle(*corners)
    points = np.array([p for seed in range(20) for _, p in places(corners, seed)]).astype(np.float32).astype(float)
    rows = np.array([jets.row(kernel, triangle)] * len(points)).astype(np.float32).astype(float)
    expected = jets.evaluate("warp64", (type(kernel), Triangle), points, rows)
    jet = jets.evaluate("warp32", (type(kernel), Triangle), points, rows)
    floor, width = jets.scale(kernel, triangle.measure)
    if isinstance(kernel, Cauchy):
        floor, width = min(triangle.measure, math.pi / kernel.s**2), 1 / kernel.s
    scale = norms(expected) + floor / np.array([[1.0], [width], [width**2]])
    assert np.isfinite(np.concatenate([part.ravel() for part in jet])).all()
    assert (differences(jet, expected) <= 5e-6 * scale).all()


@pytest.mark.parametrize("kernel", [Newtonian(), Newtonian(0.3), Gaussian(2.0), Cauchy(2.0), Metaball(2.5)], ids=str)
def test_identities(kernel):
    pair = type(kernel), Triangle
    a, b, c = CORNERS
    middle = 0.5 * (b + c)
    points = np.array([p for seed in range(30) for _, p in places(CORNERS, seed)])

    def jet(*corners):
        return jets.evaluate("warp64", pair, points, [jets.row(kernel, Triangle(*corners))] * len(points))

    whole = jet(a, b, c)
    # Rounding of the corner in the middle moves the inner edges, which points close to them see.
    floor, width = jets.scale(kernel, Triangle(a, b, c).measure)
    accepted = 1e-11 * norms(whole) + 1e-14 * (floor / np.array([[1.0], [width], [width**2]]))
    for other in (jet(b, c, a), jet(c, b, a)):
        assert (differences(whole, other) <= accepted).all()
    halves = [one + two for one, two in zip(jet(a, b, middle), jet(a, middle, c), strict=True)]
    assert (differences(whole, halves) <= 1e3 * accepted).all()
    if kernel == Newtonian():
        trace = np.trace(whole[2], axis1=1, axis2=2)
        assert (abs(trace) <= 1e-13 * np.linalg.norm(whole[2], axis=(1, 2))).all()


@pytest.mark.parametrize("kernel", [Newtonian(0.3), Metaball(2.5)], ids=str)
def test_numba_agrees_with_warp(kernel):
    pair = type(kernel), Triangle
    points = np.array([p for seed in range(20) for _, p in places(CORNERS, seed)])
    rows = [jets.row(kernel, Triangle(*CORNERS))] * len(points)
    warp, numba = (jets.evaluate(target, pair, points, rows) for target in ("warp64", "numba"))
    assert (differences(warp, numba) <= 1e-12 * norms(warp) + 1e-14).all()


@pytest.mark.parametrize("kernel", KERNELS, ids=str)
def test_nothing_is_nan_where_the_mathematics_is_singular(kernel):
    corners = np.array([(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    inside, on_edge, at_corner, beyond = (0.5, 0.25, 0.0), (0.5, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0)
    points = [inside, on_edge, at_corner, beyond, (0.5, 0.25, 1e-300), (1e100, 0.0, 0.0)]
    rows = [jets.row(kernel, Triangle(*corners))] * len(points)
    f, g, hessian = jets.evaluate("warp64", (type(kernel), Triangle), points, rows)
    assert not np.isnan(f).any()
    assert np.isfinite(g).all()
    assert np.isfinite(hessian[:4]).all()
    assert not g[:4, 2].any()
    infinite = isinstance(kernel, InverseSquare) and kernel.softening == 0.0
    assert (np.isposinf(f[:3]) == infinite).all()
    assert np.isfinite(f[3])


def test_a_folded_gaussian_keeps_its_tail():
    a, fold = 8.0, 256.0
    points = np.array([(0.3, -distance, height) for distance in (1.0, 1.9, 2.0) for height in (0.0, 0.1)])
    corners = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    rows = [jets.row(Gaussian(a), Triangle(*corners), fold)] * len(points)
    f, g, _ = jets.evaluate("warp64", (Gaussian, Triangle), points, rows)
    for point, value, gradient in zip(points, f, g, strict=True):
        with mp.workdps(160):
            want, slope, _ = (mp.exp(fold) * x for x in triangle_oracle.exact(Gaussian(a), corners, point))
            if want < mp.exp(50):
                assert abs(value / want - 1) < 1e-11
                assert mp.norm(mp.matrix(gradient.tolist()) - slope) < 1e-11 * mp.norm(slope)


def test_bad_triangles():
    with pytest.raises(InputError, match="on one line"):
        Triangle((0, 0, 0), (1, 1, 1), (3, 3, 3))
    with pytest.raises(InputError, match="on one line"):
        Triangle((1, 2, 3), (1, 2, 3), (0, 0, 0))
    with pytest.raises(InputError, match="on one line"):
        Triangle((0, 0, 0), (0.1, 0.1, 0.3), (0.3, 0.3, 0.9))
    with pytest.raises(InputError, match="b has shape"):
        Triangle((0, 0, 0), (1, 0), (0, 1, 0))
    assert Triangle((0, 0, 0), (2, 0, 0), (0, 1e-9, 0)).measure == pytest.approx(1e-9)
