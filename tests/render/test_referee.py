"""The referee: its bounds hold, what it sees is exact, and the default tracer sees the same."""

import math

import numpy as np
import pytest
import referee_scenes

import fieldsim as fs
from fieldsim.filming.comparing import compare_depths
from fieldsim.potentials import registry
from fieldsim.potentials.bounds import safe_step
from fieldsim.potentials.elements import pack
from fieldsim.render.solvers.referee import Referee

PRIMITIVES = {
    fs.Point: fs.Point((0.1, 0.2, -0.1)),
    fs.Segment: fs.Segment((-0.6, 0.1, 0.0), (0.7, 0.2, 0.3)),
    fs.Arc: fs.Arc((0.0, 0.1, 0.0), (0.2, 0.1, 1.0), (1.0, 0.0, 0.0), 0.7, 3.8),
    fs.Circle: fs.Circle((0.0, 0.1, 0.0), (0.2, 0.1, 1.0), 0.7),
    fs.Triangle: fs.Triangle((-0.6, -0.4, 0.0), (0.7, -0.3, 0.2), (0.1, 0.8, -0.1)),
    fs.Plane: fs.Plane((0.1, 0.0, 0.0), (0.3, 1.0, 0.2)),
}
WIDTHS = {fs.Gaussian: 3.0, fs.Cauchy: 3.0, fs.Newtonian: 0.2, fs.InverseSquare: 0.2}


def element(kernel, primitive, width=None):
    """An element's bounded row and its formula."""
    kernel = kernel(width or WIDTHS.get(kernel, 0.6))
    packed = pack([primitive], [kernel], [2.0], [1.5 if isinstance(kernel, fs.Gaussian) else 0.0])
    rows, bend = safe_step.with_bounds(packed)
    return rows, bend, registry.formula_of(kernel, primitive)


@pytest.mark.parametrize("primitive", PRIMITIVES)
@pytest.mark.parametrize("kernel", referee_scenes.KERNELS)
def test_no_field_changes_more_than_its_bounds_allow(kernel, primitive):
    rows, bend, formula = element(kernel, PRIMITIVES[primitive])
    rng = np.random.default_rng(3)
    tight = 0
    for _ in range(60):
        x, d = rng.normal(size=3) * rng.choice([0.3, 1.0]), rng.normal(size=3)
        d /= np.linalg.norm(d)
        away = primitive.distance(*x, rows, 0)
        delta = min(10 ** rng.uniform(-3, 0), 0.95 * away) if rng.random() < 0.5 else 10 ** rng.uniform(-4, 0)
        here, there = (np.array(formula.jet(*p, rows, 0)[:4]) for p in (x, x + delta * d))
        slope = here[1:] @ d
        # Rounding of the field and of the points.
        slack = 1e-10 * (1.0 + abs(here[0]) + bend * delta * 1e-3)
        high = safe_step.rise(here[0], slope, away, delta, rows, 0)
        low = safe_step.fall(here[0], slope, away, delta, rows, 0)
        assert low - slack <= there[0] <= high + slack
        assert here[0] <= safe_step.ceiling(away, rows, 0) * (1 + 1e-9)
        assert abs(there[0] - here[0] - slope * delta) <= 0.5 * bend * delta**2 + slack
        tight += high - low <= 0.5 * abs(here[0])
    # Bounds that hold but leave all room would be of no use.
    assert tight >= 5


@pytest.mark.parametrize("kernel", [fs.Metaball, fs.SoftObject, fs.Quartic])
def test_slopes_and_curvatures_of_compact_kernels(kernel):
    rows, bend, formula = element(kernel, fs.Point((0, 0, 0)), width=1.0)
    r = np.linspace(1e-4, 1 - 1e-4, 4001)
    h = np.array([formula.jet(float(x), 0.0, 0.0, rows, 0)[:5] for x in r])
    steepest = np.abs(h[:, 1] / (2 * np.sqrt(h[:, 0]))).max()
    # The greatest itself, to the digits of the constant.
    assert steepest <= rows[0, safe_step.SLOPE] * (1 + 1e-12) <= 1.001 * steepest
    sharpest = max(np.abs(h[:, 4]).max(), np.abs(h[:, 1] / r).max())
    assert sharpest <= bend * (1 + 1e-9) <= 1.01 * sharpest


def test_a_sphere_from_outside_and_from_within():
    point = pack([fs.Point((1.0, 2.0, 3.0))], [fs.Gaussian(4.0)], [1.0], [4.0])
    referee = Referee(point)
    # exp(4 - 16 r^2) = 1 at r = 1/2.
    depth, normal = referee.first_hits((-4.0, 2.0, 3.0), [(2.0, 0, 0), (0, 1.0, 0), (5.0, 0.4999, 0), (5.0, 0.51, 0)])
    assert depth[0] == pytest.approx(4.5, abs=1e-12)
    assert normal[0] == pytest.approx((-1, 0, 0), abs=1e-12)
    assert np.isinf(depth[[1, 3]]).all()
    hit = np.array((-4.0, 2.0, 3.0)) + depth[2] * np.array((5.0, 0.4999, 0)) / math.hypot(5.0, 0.4999)
    assert np.linalg.norm(hit - (1.0, 2.0, 3.0)) == pytest.approx(0.5, abs=1e-11)
    depth, normal = referee.first_hits((1.2, 2.0, 3.0), [(1, 0, 0), (-1, 0, 0)])
    assert depth == pytest.approx([0.3, 0.7], abs=1e-12)
    assert normal == pytest.approx(np.array([(-1, 0, 0), (1, 0, 0)]), abs=1e-12)


def test_roche_lobes_and_charges_of_both_signs():
    # 1/r on the axis of two masses, and a difference of charges, against the roots of the quadratics.
    two = pack([fs.Point((-1, 0, 0)), fs.Point((1, 0, 0))], [fs.Newtonian()] * 2, [0.5, 0.5])
    depth, _ = Referee(two).first_hits((5.0, 0, 0), [(-1, 0, 0)])
    x = 5.0 - depth[0]
    assert x == pytest.approx(0.5 + math.sqrt(1.25), abs=1e-11)
    charges = pack([fs.Point((-1, 0, 0)), fs.Point((1, 0, 0))], [fs.InverseSquare(0.1)] * 2, [1.0, -0.5])
    depth, _ = Referee(charges).first_hits((-9.0, 0, 0), [(1, 0, 0)])
    x = -9.0 + depth[0]
    assert 1 / ((x + 1) ** 2 + 0.01) - 0.5 / ((x - 1) ** 2 + 0.01) == pytest.approx(1, abs=1e-9)


def test_a_slab_of_a_plane():
    slab = pack([fs.Plane((0, 0, 1), (0, 0, 1))], [fs.Quartic(1.0)], [1.0])
    depth, normal = Referee(slab).first_hits((0, 0, 5), [(0.0, 0.0, -1), (3.0, 0, -1), (1, 0, 0.1)])
    # 2 pi int_z^1 r (1 - r^2)^2 dr = pi / 3 (1 - z^2)^3 = 1.
    z = math.sqrt(1 - (3 / math.pi) ** (1 / 3))
    assert depth[:2] == pytest.approx([4 - z, (4 - z) * math.sqrt(10)], abs=1e-10)
    assert np.isinf(depth[2])
    assert normal[0] == pytest.approx((0, 0, 1), abs=1e-12)


def test_formulas_without_a_safe_step_are_refused():
    plane = pack([fs.Plane((0, 0, 0), (0, 0, 1))], [fs.InverseSquare()], [1.0])
    with pytest.raises(fs.InputError, match="unsoftened InverseSquare on Plane; give a softening"):
        Referee(plane)


SCENES = referee_scenes.scenes()
# One a compiled set of formulas, or a view of its own; `python -m benchmarks referee` looks at all of them, and closer.
VIEWED = (
    "cross, side, Gaussian",
    "cross, along an arm, Gaussian",
    "long cigar, grazed",
    "cross, side, Cauchy",
    "circle edge-on, Gaussian",
    "blobs, Gaussian",
    "hard blobs",
    "camera within",
    "from afar",
)


@pytest.mark.parametrize("name", VIEWED)
def test_the_default_tracer_sees_what_the_referee_sees(name):
    scene = SCENES[name]()
    seen = compare_depths(scene.snapshot(), scene.camera, size=(64, 64))
    assert np.isfinite(seen.depths[1]).sum() > 200
    assert seen.mismatched.sum() <= 2
    assert seen.dropouts == 0
    # float32 resolves 60 / 0.2 radii to 1e-5 of one.
    assert seen.inner_error < (1e-5 if name != "from afar" else 1e-4)


@pytest.mark.parametrize("name", ["cross, side, Gaussian", "blobs, Gaussian", "hard blobs"])
def test_no_dropouts_from_anywhere(name):
    scene = SCENES[name]()
    snapshot, rng = scene.snapshot(), np.random.default_rng(11)
    for _ in range(6):
        seen = compare_depths(snapshot, scene.from_anywhere(rng), size=(48, 48))
        assert seen.mismatched.sum() <= 2
        assert seen.dropouts == 0
        assert seen.leaps == 0
