"""Segments (and points) in hard places, against closed forms in 150 digits."""

import math

import mpmath as mp
import numpy as np
import pytest
import targets

from fieldsim.errors import InputError
from fieldsim.potentials.elements import Elements, pack
from fieldsim.potentials.formulas.segment.inverse_powers import inverse_powers
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.kernels.gaussian import EXPONENT_LIMIT
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment

ALGEBRAIC = [Cauchy(1.7), Cauchy(60.0), Cauchy(0.01), Newtonian(), Newtonian(1e-7), Newtonian(0.5)]
GAUSSIANS = [Gaussian(0.05), Gaussian(1.3), Gaussian(40.0)]


@pytest.fixture(autouse=True)
def many_digits():
    # Far away on the axis the antiderivatives below cancel to 1e-60 and less of themselves.
    with mp.workdps(150):
        yield


def integrals(kernel, lo, hi, rho2):
    """F, h(lo) - h(hi) and dF/d(rho2) with antiderivatives as printed: right, given digits enough."""
    if isinstance(kernel, Newtonian):
        d2 = rho2 + mp.mpf(kernel.softening) ** 2
        f = mp.asinh(hi / mp.sqrt(d2)) - mp.asinh(lo / mp.sqrt(d2))
        r_lo, r_hi = mp.sqrt(lo**2 + d2), mp.sqrt(hi**2 + d2)
        return f, 1 / r_lo - 1 / r_hi, -(hi / r_hi - lo / r_lo) / (2 * d2)
    if isinstance(kernel, Gaussian):
        a = mp.mpf(kernel.a)
        low, high = (-hi, -lo) if hi < 0 else (lo, hi)
        across = mp.erfc(a * low) - mp.erfc(a * high)
        f = mp.sqrt(mp.pi) / (2 * a) * mp.exp(-a * a * rho2) * across
        slope = mp.exp(-a * a * (rho2 + lo**2)) - mp.exp(-a * a * (rho2 + hi**2))
        return f, slope, -a * a * f
    s = mp.mpf(kernel.s)
    c2 = 1 + s * s * rho2

    def h(q):
        return 1 / (c2 + s * s * q * q) ** 2

    def antiderivative(q):
        return q * mp.sqrt(h(q)) / (2 * c2) + mp.atan(s * q / mp.sqrt(c2)) / (2 * c2 * mp.sqrt(c2) * s)

    f = antiderivative(hi) - antiderivative(lo)
    return f, h(lo) - h(hi), -2 * s * s * (hi * h(hi) - lo * h(lo) + 3 * f) / (4 * c2)


def exact(kernel, segment, point):
    a, b, p = (mp.matrix([mp.mpf(x) for x in v]) for v in (segment.start, segment.end, point.tolist()))
    length = mp.norm(b - a)
    axis = (b - a) / length
    x = mp.fdot(p - a, axis)
    across = p - a - x * axis
    f, along, per_rho2 = integrals(kernel, -x, length - x, mp.fdot(across, across) + mp.mpf(10) ** -70)
    return f, along * axis + 2 * per_rho2 * across


def worst_errors(kernel, segments, points, target="warp64"):
    """Largest errors of values and gradients, in units of what the reference's README accepts."""
    value, gradient = targets.evaluate(target, pack(segments, [kernel] * len(segments), 1.0), points)
    worst_value = worst_gradient = 0.0
    for segment, point, v, g in zip(segments, points, value, gradient, strict=True):
        f, slope = exact(kernel, segment, point)
        width = 2 / kernel.a if isinstance(kernel, Gaussian) else 1.0
        floor = 2e-15 * min(segment.measure, 2 * width) if isinstance(kernel, Gaussian) else 0.0
        error = mp.norm(mp.matrix(g.tolist()) - slope)
        worst_value = max(worst_value, float(abs(v - f) / (1e-12 * abs(f) + floor + mp.mpf(10) ** -290)))
        worst_gradient = max(
            worst_gradient, float(error / (1e-12 * mp.norm(slope) + floor / width + mp.mpf(10) ** -290))
        )
    return worst_value, worst_gradient


def slanted(count, seed, place):
    """Random segments, and points at 1e-9..1e-3 of the size off the lines: inside, at an end, or beyond."""
    rng = np.random.default_rng(seed)
    start, end = rng.normal(size=(2, count, 3))
    across = np.cross(end - start, rng.normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    off = 10 ** rng.uniform(-9, -3, size=(count, 1))
    share = {
        "inside": rng.uniform(0.02, 0.98, size=(count, 1)),
        "at the end": 1 + off * rng.normal(size=(count, 1)),
        "beyond": 1 + 10 ** rng.uniform(-1, 4, size=(count, 1)),
    }[place]
    points = start + share * (end - start) + off * across
    return [Segment(a, b) for a, b in zip(start, end, strict=True)], points


@pytest.mark.parametrize("place", ["inside", "at the end", "beyond"])
@pytest.mark.parametrize("kernel", ALGEBRAIC + GAUSSIANS, ids=repr)
def test_close_to_the_line(kernel, place):
    # Coordinates of slanted segments are rounded, so offsets formed without care are wrong by up to 1e-7 here.
    assert max(worst_errors(kernel, *slanted(40, 5, place))) <= 1.0


@pytest.mark.parametrize("target", ["warp64", "numba"])
@pytest.mark.parametrize("kernel", ALGEBRAIC, ids=repr)
def test_from_a_millionth_of_the_size_to_a_million_million_sizes(kernel, target):
    rng = np.random.default_rng(11)
    towards = rng.normal(size=(150, 3))
    towards[::3] = (1.0, 0.0, 0.0)  # exactly on the line beyond the end
    towards[1::3, 1:] *= 1e-7
    points = (1.0, 0.0, 0.0) + np.abs(towards) * 10 ** rng.uniform(-6, 12, size=(150, 1))
    assert max(worst_errors(kernel, [Segment((-1, 0, 0), (1, 0, 0))] * 150, points, target)) <= 1.0


@pytest.mark.parametrize("kernel", [Cauchy(0.8), Gaussian(0.4), Newtonian()], ids=repr)
@pytest.mark.parametrize("length", [1e-9, 1e-3, 0.3, 1e3, 1e6])
def test_needles_and_crumbs(kernel, length):
    rng = np.random.default_rng(3)
    points = rng.normal(size=(60, 3)) * np.where(rng.random((60, 1)) < 0.5, (1, 1, 1), (max(length, 1.0), 1, 1))
    assert max(worst_errors(kernel, [Segment((-length / 2, 0, 0), (length / 2, 0, 0))] * 60, points)) <= 1.0


@pytest.mark.parametrize("target", ["warp64", "numba", "warp32"])
def test_on_the_unsoftened_wire(target):
    segments = [Segment((0, 0, 0), (4, 0, 0))] * 4
    points = np.array([[1.0, 0, 0], [2.0, 0, 0], [0, 0, 0], [4.0, 0, 0]])
    value, gradient = targets.evaluate(target, pack(segments, [Newtonian()] * 4, 1.0), points)
    assert (value == math.inf).all()
    np.testing.assert_allclose(gradient, [[1 - 1 / 3, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]], atol=1e-7)
    value, gradient = targets.evaluate(target, pack([Point((1, 2, 3))], [Newtonian()], 1.0), np.array([[1.0, 2, 3]]))
    assert value[0] == math.inf
    assert (gradient == 0).all()


@pytest.mark.parametrize("target", ["warp64", "numba", "warp32"])
def test_softened_wire_is_finite_and_pulls_along_only(target):
    value, gradient = targets.evaluate(
        target, pack([Segment((0, 0, 0), (4, 0, 0))], [Newtonian(0.1)], 1.0), np.array([[1.0, 0, 0]])
    )
    np.testing.assert_allclose(value, math.asinh(30.0) + math.asinh(10.0), rtol=3e-7)
    np.testing.assert_allclose(
        gradient, [[1 / math.hypot(1, 0.1) - 1 / math.hypot(3, 0.1), 0, 0]], rtol=1e-6, atol=1e-12
    )


BLOBBINESS = 256.0


def folded(points, primitive, target):
    """A body of radius 1 and blobbiness -256: h = exp(256 (1 - r^2)), whose peak no float32 holds."""
    elements = pack([primitive], [Gaussian(16.0)], 1.0, BLOBBINESS)
    elements = Elements(np.repeat(elements.rows, len(points), 0), np.repeat(elements.kinds, len(points), 0), None)
    return targets.evaluate(target, elements, points)


@pytest.mark.parametrize(("target", "tolerance"), [("warp64", 1e-12), ("numba", 1e-12), ("warp32", 2e-4)])
def test_folded_exponents_keep_the_surface(target, tolerance):
    # float32 knows an exponent of 256 to 3e-5, so F to 3e-5 or a little worse.
    segment = Segment((0, 0, 0), (3, 0, 0))
    points = np.array(
        [[1.5, 1, 0], [0.1, 0.8, 0.6], [-1, 0, 0], [3.6, 0, 0.8], [4.02, 0, 0], [-0.3, 0.9, 0.3], [3, 1, 0]]
    )
    points = points.astype(np.float32).astype(float)
    value, gradient = folded(points, segment, target)
    for point, v, g in zip(points, value, gradient, strict=True):
        f, slope = exact(Gaussian(16.0), segment, point)
        grown = mp.exp(BLOBBINESS)
        assert abs(v - grown * f) <= tolerance * grown * f
        assert mp.norm(mp.matrix(g.tolist()) - grown * slope) <= tolerance * grown * mp.norm(slope)


@pytest.mark.parametrize(
    "primitive", [Segment((0, 0, 0), (3, 0, 0)), Segment((0, 0, 0), (0.01, 0, 0)), Point((0, 0, 0))]
)
def test_folded_exponents_are_large_and_finite_inside(primitive):
    rng = np.random.default_rng(2)
    points = np.concatenate([np.zeros((1, 3)), rng.uniform(-0.3, 0.3, size=(300, 3))])
    for target in ("warp32", "warp64"):
        value, gradient = folded(points, primitive, target)
        assert np.isfinite(value).all()
        assert np.isfinite(gradient).all()
        assert (value > 1e20).all()
        assert (value <= 3.1 * math.exp(EXPONENT_LIMIT)).all()


@pytest.mark.parametrize("kernel", [*ALGEBRAIC, *GAUSSIANS], ids=repr)
def test_single_precision_survives_any_distance(kernel):
    rng = np.random.default_rng(7)
    points = rng.normal(size=(200, 3)) * 10 ** rng.uniform(-12, 12, size=(200, 1))
    segments = [Segment((-1, 0, 0), (1, 0.5, 0))] * 200
    value, gradient = targets.evaluate("warp32", pack(segments, [kernel] * 200, 1.0), points)
    assert np.isfinite(value).all()
    assert np.isfinite(gradient).all()


def test_integrals_of_inverse_powers():
    rng = np.random.default_rng(8)
    for _ in range(400):
        length, d = 10 ** rng.uniform(-4, 4), 10 ** rng.uniform(-7, 7)
        lo = rng.choice([-0.5 * rng.random() * length, 10 ** rng.uniform(-6, 6), -(10 ** rng.uniform(-9, -1)) * length])
        # A right angle between the views of both ends is where one form takes over from the other.
        if rng.random() < 0.2 and lo < 0:
            d = math.sqrt(-lo * (lo + length)) * (1 + rng.choice([-1e-15, 1e-9, 0.0, 1e-3]))
        root, ends, far, *got = inverse_powers(lo, length, d * d)
        low, d2 = mp.mpf(lo), mp.mpf(d * d)
        high, depth = low + mp.mpf(length), mp.sqrt(d2)
        h_low, h_high = 1 / (low**2 + d2), 1 / (high**2 + d2)
        assert root == pytest.approx(float(mp.sqrt(h_low * h_high)), rel=2e-15)
        assert ends == pytest.approx(float(h_low + h_high), rel=3e-15)
        assert far == pytest.approx(float(h_high), rel=3e-15)
        true = (mp.atan(high / depth) - mp.atan(low / depth)) / depth
        for k, integral in enumerate(got, 1):
            assert abs(integral / true - 1) < 5e-15
            true = ((2 * k - 1) * true + high * h_high**k - low * h_low**k) / (2 * k * d2)


@pytest.mark.parametrize(
    ("start", "end", "message"),
    [
        ((0, 0, 0), (0, 0, 0), r"both \(0, 0, 0\); give two different points or use Point"),
        ((1, 2.5, 3), (1, 2.5, 3), r"both \(1, 2.5, 3\)"),
        ((0, 0), (1, 1, 1), "start has shape"),
        ((0, 0, 0), (1, math.nan, 1), "end is .*nan.*finite"),
        ("a", (0, 0, 0), "start is 'a'"),
    ],
)
def test_segments_that_are_none(start, end, message):
    with pytest.raises(InputError, match=message):
        Segment(start, end)


def test_measure_is_the_length_even_of_tiny_and_huge_ones():
    assert Segment((0, 0, 0), (3, 4, 0)).measure == 5.0
    assert Segment((0, 0, 0), (3e-59, 4e-59, 0)).measure == pytest.approx(5e-59, rel=1e-15)
    assert Segment((0, 0, 0), (3e59, 4e59, 0)).measure == pytest.approx(5e59, rel=1e-15)
    # The field's formulas take powers of lengths that would overflow, or vanish, beyond.
    for size in (1e-200, 1e200):
        with pytest.raises(InputError, match="in another unit"):
            Segment((0, 0, 0), (3 * size, 4 * size, 0))
