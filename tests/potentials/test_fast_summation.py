"""Fast sums against exact ones: bounds that hold wherever elements and points are, and what a user sees."""

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.potentials.elements import Elements, concatenate
from fieldsim.potentials.fast_summation import fast_field, summation
from fieldsim.potentials.registry import formula_of
from fieldsim.potentials.row import AXIS, END, KERNEL_WIDTH, LENGTH, POINT, ROW_WIDTH, START, STRENGTH

COUNT = 400


@pytest.fixture(autouse=True)
def _small_sums_are_fast_ones(monkeypatch):
    monkeypatch.setattr(fast_field, "EXACT", 0)
    monkeypatch.setattr(fast_field, "LEAST", 8)
    monkeypatch.setattr(summation, "FEW_AT_ALL", 0)
    monkeypatch.setattr(summation, "FEW_IN_A_LEVEL", 0)
    monkeypatch.setattr(summation, "PIECES", 16)
    monkeypatch.setattr(summation, "PIECES_OF_A_SIZE", 16)


def _elements(primitive, kernel, strengths):
    rows = np.zeros((len(strengths), ROW_WIDTH))
    rows[:, STRENGTH], rows[:, KERNEL_WIDTH] = strengths, kernel.width
    kind = formula_of(kernel, primitive).kind
    return Elements(rows, np.full(len(rows), kind, dtype=np.int32), np.arange(len(rows)))


def points_at(places, kernel, strengths=None):
    elements = _elements(fs.Point((0, 0, 0)), kernel, np.ones(len(places)) if strengths is None else strengths)
    elements.rows[:, POINT] = places
    return elements


def segments(starts, ends, kernel, strengths=None):
    some = fs.Segment((0, 0, 0), (1, 0, 0))
    elements = _elements(some, kernel, np.ones(len(starts)) if strengths is None else strengths)
    length = np.linalg.norm(ends - starts, axis=1)
    elements.rows[:, START], elements.rows[:, END], elements.rows[:, LENGTH] = starts, ends, length
    elements.rows[:, AXIS] = (ends - starts) / length[:, None]
    return elements


def directions(rng, count):
    found = rng.normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1)[:, None]


def uniform(rng, kernel):
    starts = rng.random((COUNT, 3))
    return segments(starts, starts + 0.03 * directions(rng, COUNT), kernel), rng.random((COUNT, 3))


def cancelling(rng, kernel):
    starts = rng.random((COUNT, 3))
    strengths = rng.normal(size=COUNT)
    return segments(starts, starts + 0.03 * directions(rng, COUNT), kernel, strengths), rng.random((COUNT, 3))


def clustered(rng, kernel):
    places = np.concatenate([1e-4 * rng.normal(size=(COUNT // 2, 3)), 1 + 1e-2 * rng.normal(size=(COUNT // 2, 3))])
    return points_at(places, kernel), places + 1e-5 * directions(rng, len(places))


def collinear(rng, kernel):
    starts = np.linspace(0, 1, COUNT)[:, None] * [1.0, 0.0, 0.0]
    return segments(starts, starts + np.array([0.002, 0, 0]), kernel), starts + 0.01 * rng.normal(size=(COUNT, 3))


def coplanar(rng, kernel):
    places = rng.random((COUNT, 3)) * (1, 1, 0) + (0, 0, 0.3)
    return points_at(places, kernel), places + np.array([0, 0, 1e-3])


def one_far(rng, kernel):
    places = np.concatenate([rng.random((COUNT, 3)), [[1e5, 0.0, 0.0]]])
    return points_at(places, kernel), np.concatenate([rng.random((COUNT, 3)), [[1e5, 0.0, 0.1]]])


def long_ones(rng, kernel):
    starts = rng.random((COUNT // 4, 3))
    return segments(starts, starts + 2.0 * directions(rng, len(starts)), kernel), rng.random((COUNT, 3))


def far_points(rng, kernel):
    return points_at(rng.random((COUNT, 3)), kernel), 1e3 * directions(rng, COUNT)


def identical(rng, kernel):
    return points_at(np.tile([0.1, 0.2, 0.3], (COUNT, 1)), kernel), rng.random((COUNT, 3))


def at_faces(rng, kernel):
    """Where cells meet, with signs."""
    places = np.round(8 * rng.random((COUNT, 3))) / 8 + 1e-9 * directions(rng, COUNT)
    signs = np.sign(rng.normal(size=COUNT))
    return points_at(places, kernel, signs), np.round(8 * rng.random((COUNT, 3))) / 8 + 1e-3


CASES = [
    *(uniform, cancelling, clustered, collinear, coplanar, one_far),
    *(long_ones, far_points, identical, at_faces),
]


def unsigned(elements):
    rows = elements.rows.copy()
    rows[:, STRENGTH] = np.abs(rows[:, STRENGTH])
    return fs.Field.of_elements(Elements(rows, elements.kinds, elements.order))


def resized(elements, points, size):
    """All lengths times a size."""
    rows = elements.rows.copy()
    rows[:, POINT] *= size
    if elements.kinds[0] == formula_of(fs.Newtonian(), fs.Segment((0, 0, 0), (1, 0, 0))).kind:
        rows[:, END] *= size
        rows[:, LENGTH] *= size
    return Elements(rows, elements.kinds, elements.order), size * points


def held(elements, points, tolerance, **options):
    """Errors of value, gradient and Hessian, each within its bound; the value's within the tolerance."""
    field = fs.Field.of_elements(elements)
    fast = field.fast(tolerance, **options)
    scale = unsigned(elements).value(points).max()
    exact = field._evaluate(points, 2)
    errors = []
    for one, other, bound in zip(fast._evaluate(points, 2), exact, fast.error_bounds(points), strict=True):
        error = np.sqrt(((one - other) ** 2).reshape(len(points), -1).sum(axis=1))
        size = np.sqrt((other**2).reshape(len(points), -1).sum(axis=1)).max()
        assert (error <= bound + 1e-11 * size).all(), (error / bound).max()
        errors.append(error.max())
    assert errors[0] <= tolerance * scale
    return errors, scale, fast


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("kernel", [fs.Newtonian(), fs.Gaussian(6.0)], ids=["newtonian", "gaussian"])
def test_errors_stay_within_the_tolerance_and_the_bounds(case, kernel):
    elements, points = case(np.random.default_rng(0), kernel)
    if kernel.folds and case in (far_points, one_far):
        points = points[:COUNT] * (1e-3 if case is far_points else 1.0)
    errors, scale, _fast = held(elements, points, 1e-4)
    if not kernel.folds and case is not identical:
        assert errors[0] > 1e-12 * scale, "nothing was summed fast"


@pytest.mark.parametrize(
    "kernel",
    [fs.Cauchy(8.0), fs.Newtonian(0.05), fs.InverseSquare(), fs.Metaball(0.2), fs.SoftObject(0.3)],
    ids=["cauchy", "softened", "inverse square", "metaball", "soft object"],
)
def test_every_kind_of_kernel_is_summed(kernel):
    elements, points = uniform(np.random.default_rng(1), kernel)
    held(elements, points, 1e-3)


@pytest.mark.full
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("kernel", [fs.Cauchy(8.0), fs.Newtonian(0.05), fs.InverseSquare()], ids=repr)
def test_errors_of_all_kernels_stay_within_a_fine_tolerance(case, kernel):
    held(*case(np.random.default_rng(2), kernel), 1e-8)


@pytest.mark.parametrize("size", [1e-8, 1e8])
@pytest.mark.parametrize("case", [uniform, clustered])
def test_units_do_not_matter(case, size):
    elements, points = case(np.random.default_rng(3), fs.Newtonian())
    held(*resized(elements, points, size), 1e-4)


def test_a_proved_tolerance_is_one_of_the_bounds():
    elements, points = uniform(np.random.default_rng(4), fs.Newtonian())
    _errors, scale, fast = held(elements, points, 1e-3, proved=True)
    assert fast.error_bounds(points)[0].max() <= 1e-3 * scale


def test_errors_fall_with_the_tolerance():
    elements, points = uniform(np.random.default_rng(5), fs.Newtonian())
    coarse, fine = (held(elements, points, tolerance)[0] for tolerance in (1e-2, 1e-5))
    assert all(3.0 * few < many for few, many in zip(fine, coarse, strict=True))


def test_errors_that_are_seen_are_mended(monkeypatch):
    """Where the first try is too coarse for what is seen at a few points, a finer one follows."""
    monkeypatch.setattr(summation, "translations_of", worse(summation.translations_of))
    held(*uniform(np.random.default_rng(6), fs.Newtonian()), 1e-4)


def worse(translations):
    calls = []

    def first_ones_are_coarse(group, planned, error):
        calls.append(error)
        return translations(group, planned, 1e3 * error if len(calls) % 3 == 1 else error)

    return first_ones_are_coarse


def test_the_same_bytes_for_any_number_of_threads_and_any_call():
    elements, points = uniform(np.random.default_rng(7), fs.Newtonian())
    field = fs.Field.of_elements(elements)
    fast = field.fast(1e-5, threads=1)
    first = fast.value_and_gradient(points)
    for other in (fast, field.fast(1e-5, threads=3)):
        for one, again in zip(first, other.value_and_gradient(points), strict=True):
            np.testing.assert_array_equal(one, again)


def test_arcs_circles_and_tapered_segments_are_cut_and_summed():
    rng = np.random.default_rng(8)
    middles, normals = rng.random((60, 3)), directions(rng, 60)
    skeleton = [
        *(fs.Circle(m, n, 0.2) for m, n in zip(middles[:20], normals, strict=False)),
        *(fs.Arc(m, n, (0.3, 0.2, 1.0), 0.3, 2.5) for m, n in zip(middles[20:40], normals[20:], strict=False)),
        *(fs.TaperedSegment(m, m + 0.5 * n, 2.0, 0.5) for m, n in zip(middles[40:], normals[40:], strict=True)),
    ]
    field = fs.Field(skeleton, fs.Newtonian(), strength=rng.uniform(0.5, 1.0, 60))
    assert field.fast().summed_exactly == 0
    held(field.elements, rng.random((400, 3)), 1e-4)


def test_what_has_no_moments_is_summed_exactly():
    rng = np.random.default_rng(9)
    many, points = uniform(rng, fs.Cauchy(8.0))
    others = [fs.Plane((0, 0, -1), (0, 0, 1)), fs.Triangle((0, 0, 0), (1, 0, 0), (0, 1, 0))]
    swelling = fs.profiled(fs.Segment((0, 0, 0), (1, 1, 1)), fs.profile.linear(1, 0))
    rest = fs.Field([*others, swelling], fs.Cauchy(5.0)) + fs.Field(fs.Point((0.5, 0.5, 0.5)), fs.Gaussian(3.0))
    field = fs.Field.of_elements(concatenate([many, rest.elements]).grouped()[0])
    fast = field.fast(1e-3)
    assert fast.summed_exactly == 4
    scale = field.value(points).max()
    assert np.abs(fast.value(points) - field.value(points)).max() <= 1e-3 * scale


def test_a_warning_says_when_most_is_summed_exactly():
    kernels = [fs.Cauchy(1.0 + 0.1 * k) for k in range(20)]
    field = sum(fs.Field(fs.Point((k, 0, 0)), kernel) for k, kernel in enumerate(kernels))
    with pytest.warns(fs.FieldsimWarning, match="20 of 20 elements are summed exactly"):
        assert field.fast().summed_exactly == 20


def test_small_sums_are_exact_to_the_bit(monkeypatch):
    monkeypatch.setattr(fast_field, "EXACT", 1)
    elements, points = uniform(np.random.default_rng(10), fs.Newtonian())
    field = fs.Field.of_elements(elements)
    np.testing.assert_array_equal(field.fast().gradient(points), field.gradient(points))
    assert isinstance(field.fast().value(points[0]), float)
    assert field.fast().hessian(points[0]).shape == (3, 3)
    assert not np.any(field.fast().error_bounds(points))


def test_points_on_bare_sources_are_infinite_and_without_nan():
    elements, _points = clustered(np.random.default_rng(11), fs.Newtonian())
    points = elements.rows[:, POINT]
    value, gradient = fs.Field.of_elements(elements).fast(1e-4).value_and_gradient(points)
    assert np.isinf(value).all()
    assert np.isfinite(gradient).all()


def test_points_that_are_out_of_reach_of_any_tree_are_summed_exactly():
    elements, points = uniform(np.random.default_rng(12), fs.Newtonian())
    points[0] = 1e30, 0.0, 0.0
    field = fs.Field.of_elements(elements)
    value = field.fast(1e-4).value(points)
    assert value[0] == pytest.approx(field.value(points[0]), rel=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tolerance": 0.0}, "tolerance is 0"),
        ({"tolerance": 0.5}, "tolerance is 0.5"),
        ({"proved": 1}, "proved is 1"),
        ({"threads": 0}, "threads is 0"),
    ],
)
def test_bad_options_are_refused(options, words):
    with pytest.raises(fs.InputError, match=words):
        fs.Field(fs.Point((0, 0, 0)), fs.Newtonian()).fast(**options)


def test_functions_of_time_are_refused():
    with pytest.raises(fs.InputError, match="function of time"):
        fs.Field(fs.Point(lambda t: (t, 0, 0)), fs.Newtonian()).fast()
