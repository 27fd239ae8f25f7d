"""Profiles along segments and arcs, and segments of linear density."""

import functools
import math

import mpmath as mp
import numpy as np
import pytest
import targets
import warp as wp

from fieldsim import launch
from fieldsim.dynamics.rigid.body import free_body
from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.field import Field
from fieldsim.potentials.gravity import gravity
from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Metaball, Newtonian, Quartic, SoftObject
from fieldsim.potentials.primitives import profile
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.profile import Profile, ProfiledArc, ProfiledSegment, profiled
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.tapered import TaperedSegment
from fieldsim.potentials.row import KERNEL_WIDTH, ROW_WIDTH, STRENGTH
from fieldsim.world.body import Body
from fieldsim.world.material import Material
from fieldsim.world.rigid import Rigid

SEGMENT = Segment((0.2, -0.1, 0.3), (1.4, 0.5, -0.2))
ARC = Arc((0.1, 0.2, -0.3), (0.2, 0.3, 0.9), (1.0, 0.4, 0.0), 0.8, 2.2)
TWELFTH = (2.0, -1.5, 0.5, 1.25, -0.75, 0.25, -0.5, 0.75, 1.0, -0.25, 0.125, -0.625, 0.875)
PROFILES = {
    "constant": (profile.constant(0.7), lambda u: 0.7),
    "linear": (profile.linear(0.4, 1.5), lambda u: 0.4 + 1.1 * u),
    "hat": (profile.hat(0.2, 1.3), lambda u: 0.2 + 1.1 * (1 - abs(2 * u - 1))),
    "sine": (profile.sine(0.1, 0.9), lambda u: 0.1 + 0.8 * math.sin(math.pi * u) ** 2),
    "polynomial": (profile.polynomial(1, -2, 0.5, 3, -1, 0.25), lambda u: np.polyval([0.25, -1, 3, 0.5, -2, 1], u)),
    "degree 12": (profile.polynomial(*TWELFTH), lambda u: np.polyval(TWELFTH[::-1], u)),
    "hat squared": (Profile((0.5, 0.2, 0.3), "hat"), lambda u: np.polyval([0.3, 0.2, 0.5], 1 - abs(2 * u - 1))),
}
KERNELS = [Cauchy(1.3), Gaussian(0.9), Newtonian(0.1), InverseSquare(0.2), Metaball(2.5), SoftObject(3.0), Quartic(2.7)]
CASES = [(k, p) for k in KERNELS for p in (SEGMENT, ARC)]
CASES = [(k, p) for k, p in CASES if (type(k), type(profiled(p, profile.constant()))) in registry.FORMULAS]


def evaluate(target, kernel, primitive, points):
    """Jets (N, 10) of one primitive at points (N, 3); outputs start as NaN."""
    row = np.zeros((1, ROW_WIDTH))
    primitive.pack(row[0])
    row[0, [STRENGTH, KERNEL_WIDTH]] = 1.0, kernel.width
    points = np.ascontiguousarray(points, dtype=float)
    out = np.full((len(points), 10), np.nan)
    pair = type(kernel), type(primitive)
    if target == "numba":
        return targets.jets_by_numba(registry.FORMULAS[pair].jet, points, row)
    scalar = wp.float64 if target == "warp64" else wp.float32
    arrays = [wp.array(a, dtype=scalar, device="cpu") for a in (points, row, out)]
    launch.launch(_warp(pair, scalar), len(points), arrays[:2], arrays[2:], device="cpu")
    return arrays[2].numpy().astype(float)


@functools.cache
def _warp(pair, scalar):
    element = registry.FORMULAS[pair].jet.warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def each(
        start: int,
        points: wp.array(dtype=scalar, ndim=2),
        rows: wp.array(dtype=scalar, ndim=2),
        out: wp.array(dtype=scalar, ndim=2),
    ):
        i = start + wp.tid()
        f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz = element(points[i, 0], points[i, 1], points[i, 2], rows, 0)
        out[i, 0] = f
        out[i, 1] = fx
        out[i, 2] = fy
        out[i, 3] = fz
        out[i, 4] = fxx
        out[i, 5] = fyy
        out[i, 6] = fzz
        out[i, 7] = fxy
        out[i, 8] = fxz
        out[i, 9] = fyz

    return each


def parameter(primitive, point):
    """u of a point, by the definition."""
    if isinstance(primitive, Segment):
        start, end = np.array(primitive.start), np.array(primitive.end)
        return float(np.clip((point - start) @ (end - start) / np.sum((end - start) ** 2), 0, 1))
    normal, start = np.array(primitive.normal), np.array(primitive.start)
    offset = point - np.array(primitive.center)
    turn = math.atan2(offset @ np.cross(normal, start), offset @ start)
    # Beyond the ends the nearer one counts.
    half = primitive.angle / 2
    return float(np.clip(0.5 + (math.remainder(turn - half, 2 * math.pi)) / primitive.angle, 0, 1))


def points_around(primitive, count=12):
    """Points alongside the primitive and some beyond its ends, off the planes where derivatives jump."""
    rng = np.random.default_rng(5)
    points = rng.uniform(-1.0, 1.6, (200, 3))
    u = np.array([parameter(primitive, p) for p in points])
    inside = (abs(u - 0.5) > 0.01) & (u > 0.01) & (u < 0.99)
    return np.concatenate([points[inside][:count], points[(u == 0) | (u == 1)][: count // 3]])


@pytest.mark.parametrize(("kernel", "primitive"), CASES, ids=lambda c: type(c).__name__)
def test_value_is_the_product(kernel, primitive):
    points = points_around(primitive)
    plain = evaluate("numba", kernel, primitive, points)[:, 0]
    assert np.count_nonzero(plain) > 8
    for given, expected in PROFILES.values():
        value = evaluate("numba", kernel, profiled(primitive, given), points)[:, 0]
        factor = [expected(parameter(primitive, p)) for p in points]
        np.testing.assert_allclose(value, factor * plain, rtol=2e-14, atol=1e-15)


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize(("kernel", "primitive"), [(Newtonian(0.1), SEGMENT), (InverseSquare(0.2), ARC)])
def test_derivatives_by_differences(kernel, primitive, name):
    bent = profiled(primitive, PROFILES[name][0])
    step = 1e-5
    points = points_around(primitive)
    jets = evaluate("numba", kernel, bent, points)
    ways = step * np.eye(3)
    slopes = np.array(
        [(evaluate("numba", kernel, bent, points + w) - evaluate("numba", kernel, bent, points - w)) for w in ways]
    )
    slopes /= 2 * step
    scale = np.abs(jets).max()
    np.testing.assert_allclose(slopes[:, :, 0].T, jets[:, 1:4], atol=1e-8 * scale)
    xx, yy, zz, xy, xz, yz = jets[:, 4:].T
    hessian = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    np.testing.assert_allclose(np.moveaxis(slopes[:, :, 1:4], 1, 2), hessian, atol=1e-7 * scale)


@pytest.mark.parametrize("degree", range(profile.DEGREE + 1))
@pytest.mark.parametrize("target", ["numba", "warp64"])
def test_polynomials_of_any_degree_by_the_product_rule(target, degree):
    kernel, given = Newtonian(0.1), TWELFTH[: degree + 1]
    points = points_around(SEGMENT)
    f, slope, hessian = parts(evaluate(target, kernel, SEGMENT, points))
    bent = parts(evaluate(target, kernel, profiled(SEGMENT, profile.polynomial(*given)), points))
    u = np.array([parameter(SEGMENT, p) for p in points])
    curve = np.polynomial.Polynomial(given)
    inside = (u > 0) & (u < 1)
    p, p1, p2 = curve(u), np.where(inside, curve.deriv(1)(u), 0.0), np.where(inside, curve.deriv(2)(u), 0.0)
    along = np.subtract(SEGMENT.end, SEGMENT.start) / SEGMENT.measure**2
    mixed = np.einsum("n,i,nj->nij", p1, along, slope)
    expected = (
        p * f,
        p[:, None] * slope + (p1 * f)[:, None] * along,
        p[:, None, None] * hessian + mixed + mixed.swapaxes(1, 2) + np.einsum("n,i,j->nij", p2 * f, along, along),
    )
    for got, true in zip(bent, expected, strict=True):
        np.testing.assert_allclose(got, true, rtol=0, atol=1e-12 * np.abs(true).max())


def parts(jets):
    """Values (N,), gradients (N, 3) and Hessians (N, 3, 3) of jets (N, 10)."""
    return jets[:, 0], jets[:, 1:4], targets.hessians(jets)


@pytest.mark.parametrize(("kernel", "primitive"), [(Newtonian(0.1), SEGMENT), (InverseSquare(0.2), ARC)])
def test_targets_agree(kernel, primitive):
    points = points_around(primitive)
    for given in (profile.sine(), profile.polynomial(1, -2, 0.5, 3, -1, 0.25), profile.polynomial(*TWELFTH)):
        exact = evaluate("numba", kernel, profiled(primitive, given), points)
        scale = np.abs(exact).max(axis=0)
        for target, accepted in (("warp64", 1e-13), ("warp32", 2e-5)):
            error = np.abs(evaluate(target, kernel, profiled(primitive, given), points) - exact) / scale
            assert error.max() < accepted


def test_bare_wires():
    """Inf on the wire, 0 where the factor is 0, and never NaN, on the arc's axis neither."""
    ends = np.array([SEGMENT.start, SEGMENT.end])
    for kernel, primitive in ((Newtonian(), SEGMENT), (InverseSquare(), SEGMENT), (InverseSquare(), ARC)):
        if isinstance(primitive, Arc):
            start, normal = np.array(ARC.start), np.array(ARC.normal)
            places = [0.0 * start, normal, ARC.radius * start, -2 * start]
            places = np.array(places) + ARC.center
        else:
            places = np.array([ends[0], ends.mean(axis=0), ends[1], 2 * ends[1] - ends[0]])
        for given in (profile.linear(0.0, 1.0), profile.sine()):
            for target in ("numba", "warp64"):
                jets = evaluate(target, kernel, profiled(primitive, given), places)
                assert not np.isnan(jets).any()
                assert np.isfinite(jets[:, 1:]).all()
    assert evaluate("numba", Newtonian(), profiled(SEGMENT, profile.linear()), ends)[0, 0] == 0.0


def test_in_fields():
    kernel = Cauchy(1.3)
    thin = Field([profiled(SEGMENT, profile.hat())], kernel, 2.0)
    points = points_around(SEGMENT)
    expected = 2 * evaluate("numba", kernel, profiled(SEGMENT, profile.hat()), points)
    value, gradient = thin.value_and_gradient(points)
    np.testing.assert_allclose(value, expected[:, 0], rtol=1e-13)
    np.testing.assert_allclose(gradient, expected[:, 1:4], rtol=1e-12, atol=1e-14)


def test_profiled():
    assert isinstance(profiled(SEGMENT, profile.hat()), ProfiledSegment)
    arc = profiled(ARC, profile.hat())
    assert isinstance(arc, ProfiledArc)
    assert arc.start == pytest.approx(ARC.start, abs=1e-15)
    assert arc.angle == ARC.angle
    moving = profiled(Segment(lambda t: (t, 0, 0), (9, 0, 0)), profile.hat())
    assert moving.at(2.0) == ProfiledSegment((2, 0, 0), (9, 0, 0), profile.hat())


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Profile((1,), "wave"), "Profile: shape is 'wave'; give 'along', 'hat' or 'sine'"),
        (lambda: Profile(()), "Profile: coefficients has 0 numbers; give a list of 1 to 13"),
        (lambda: profile.polynomial(*range(14)), "Profile: coefficients has 14 numbers; give a list of 1 to 13"),
        (lambda: Profile(3.0), "Profile: coefficients is 3.0; give a list"),
        (lambda: Profile((1, np.nan)), "Profile: coefficients is .*nan"),
        (lambda: profile.linear("thick"), "linear: start is 'thick'"),
        (
            lambda: profiled(Circle((0, 0, 0), (0, 0, 1), 1), profile.hat()),
            "has no profiles; give a fs.Segment or a fs.Arc",
        ),
        (lambda: ProfiledSegment((0, 0, 0), (1, 0, 0), 2.0), "ProfiledSegment: profile is 2.0"),
        (lambda: profiled(SEGMENT, "hat"), "profiled: profile is 'hat'"),
        (lambda: TaperedSegment((0, 0, 0), (1, 0, 0), -1, 2), "TaperedSegment: start_density is -1"),
        (lambda: TaperedSegment((0, 0, 0), (1, 0, 0), 0, 0), "start_density and end_density are both 0"),
        (lambda: TaperedSegment((0, 0, 0), (0, 0, 0)), "start and end are both"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(InputError, match=message):
        call()


@pytest.mark.parametrize("primitive", [SEGMENT, ARC])
@pytest.mark.parametrize(
    "spread",
    [
        lambda p: gravity(p, 1.0),
        lambda p: gravity([SEGMENT, p], lambda t: 1.0, kernel=Newtonian(0.1)),
        lambda p: Body(p, gravity=Newtonian()),
        lambda p: Body([ARC, p], gravity=Newtonian(), surface=Material(level=1.0), motion=Rigid()),
    ],
)
def test_a_profile_is_no_density(spread, primitive):
    with pytest.raises(InputError, match=r"(gravity|Body): skeleton\[[01]\] is a Profiled.* give the plain primitive"):
        spread(profiled(primitive, profile.linear(0, 2)))


def test_a_free_body_with_a_profile_has_even_mass():
    # The profile shapes its surface alone.
    rod = Segment((-1, 0, 0), (1, 0, 0))
    plain, shaped = (
        free_body(0, Body(p, surface=Material(), mass=3.0, motion=Rigid())) for p in (rod, profiled(rod, profile.hat()))
    )
    np.testing.assert_allclose(shaped.moments, plain.moments)
    assert max(plain.moments) == pytest.approx(3.0 * 2.0**2 / 12)


def tapered_oracle(segment, softening, point):
    """The jet in 120 digits: derivatives by differences of the antiderivative."""
    with mp.workdps(120):
        a, b, p = (mp.matrix([mp.mpf(float(v)) for v in q]) for q in (segment.start, segment.end, point))
        length = mp.norm(b - a)
        axis = (b - a) / length
        w0, w1 = mp.mpf(segment.start_density), mp.mpf(segment.end_density)

        def value(x):
            lo = -(axis.T * (x - a))[0]
            aside = x - a + lo * axis
            d = mp.sqrt((aside.T * aside)[0] + mp.mpf(softening) ** 2)
            steep = (w1 - w0) / length
            hi = lo + length
            line = mp.asinh(hi / d) - mp.asinh(lo / d)
            return (w0 - steep * lo) * line + steep * (mp.hypot(hi, d) - mp.hypot(lo, d))

        h = mp.mpf(10) ** -35 * min(mp.norm(p - a), mp.norm(p - b), mp.norm(p - (a + b) / 2))
        way = [mp.matrix([h if i == k else 0 for i in range(3)]) for k in range(3)]
        f = value(p)
        jet = [f]
        jet += [(value(p + w) - value(p - w)) / (2 * h) for w in way]
        jet += [(value(p + w) - 2 * f + value(p - w)) / h**2 for w in way]
        for v, w in ((way[0], way[1]), (way[0], way[2]), (way[1], way[2])):
            jet.append((value(p + v + w) - value(p + v - w) - value(p - v + w) + value(p - v - w)) / (4 * h * h))
        return np.array([float(v) for v in jet])


@pytest.mark.parametrize("target", ["warp64", "numba"])
def test_tapered_segment_everywhere(target):
    rng = np.random.default_rng(2)
    worst = np.zeros(3)
    for distance in 10.0 ** np.array([-9, -6, -3, -1, 0, 0.5, 0.9, 2, 4, 6]):
        start, end = rng.normal(size=(2, 3))
        for place in (start, end, 0.3 * start + 0.7 * end, 2.5 * end - 1.5 * start):
            segment = TaperedSegment(start, end, rng.choice([0.0, 1.0, 0.3]), rng.choice([0.5, 2.0]))
            softening = rng.choice([0.0, 0.1])
            way = rng.normal(size=3)
            point = place + distance * segment.measure * way / np.linalg.norm(way)
            exact = tapered_oracle(segment, softening, point)
            error = evaluate(target, Newtonian(softening), segment, [point])[0] - exact
            parts = (slice(0, 1), slice(1, 4), slice(4, 10))
            worst = np.maximum(worst, [np.linalg.norm(error[p]) / np.linalg.norm(exact[p]) for p in parts])
    assert worst.max() < 1e-13


def test_tapered_segment_in_single_precision():
    segment = TaperedSegment((0, 0, 0), (1, 0.5, -0.25), 0.25, 2.0)
    points = np.float32(np.random.default_rng(4).normal(size=(40, 3)) * 10.0 ** np.linspace(-1, 4, 40)[:, None])
    single = evaluate("warp32", Newtonian(), segment, points)
    double = evaluate("numba", Newtonian(), segment, points)
    for part in (slice(0, 1), slice(1, 4), slice(4, 10)):
        scale = np.linalg.norm(double[:, part], axis=1)
        assert (np.linalg.norm((single - double)[:, part], axis=1) / scale).max() < 5e-6


def test_tapered_segment_is_two_even_ones_at_least():
    """Mirror images make an even segment, halves add up, and mass follows the density."""
    a, b = np.array(SEGMENT.start), np.array(SEGMENT.end)
    point = [[0.3, 0.8, 0.1]]
    rising, falling = TaperedSegment(a, b, 0.0, 1.0), TaperedSegment(a, b, 1.0, 0.0)
    both = evaluate("numba", Newtonian(), rising, point) + evaluate("numba", Newtonian(), falling, point)
    np.testing.assert_allclose(both, evaluate("numba", Newtonian(), SEGMENT, point), rtol=1e-13)
    middle = (a + b) / 2
    halves = TaperedSegment(a, middle, 0.0, 0.5), TaperedSegment(middle, b, 0.5, 1.0)
    parts = sum(evaluate("numba", Newtonian(), half, point) for half in halves)
    np.testing.assert_allclose(parts, evaluate("numba", Newtonian(), rising, point), rtol=1e-12)
    pull = gravity(rising, mass=3.0)
    assert pull.value((0, 0, 1e6)) * 1e6 == pytest.approx(3.0, rel=1e-5)
    # Two thirds of the way lies its centre of mass.
    center = a + 2 / 3 * (b - a)
    np.testing.assert_allclose(pull.gradient(center + np.array([0, 0, 1e3])), [0, 0, -3e-6], atol=2e-12)


def test_tapered_segment_on_its_wire():
    a, b = np.array(SEGMENT.start), np.array(SEGMENT.end)
    for target in ("numba", "warp64", "warp32"):
        jets = evaluate(
            target, Newtonian(), TaperedSegment((0, 0, 0), (1, 0, 0), 0, 1), [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]]
        )
        assert jets[0, 0] == 1.0
        assert (jets[1:, 0] == np.inf).all()
        assert np.isfinite(jets[:, 1:]).all()
    near = evaluate("numba", Newtonian(), TaperedSegment(a, b, 0, 1), [a + 1e-12])
    assert near[0, 0] == pytest.approx(1.0, abs=1e-9)


def test_compiles_for_cuda(compiles_for_cuda):
    for pair in ((Newtonian, TaperedSegment), (InverseSquare, ProfiledArc)):
        for scalar in (wp.float32, wp.float64):
            compiles_for_cuda(_warp(pair, scalar).module)
