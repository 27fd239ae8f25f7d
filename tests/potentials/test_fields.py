"""Fields as users call them: shapes, devices, sums, gravity, animation, bad input; and identities of every formula."""

import math

import numpy as np
import pytest
import reference_cases
import targets
import warp as wp
from reference_cases import Arc, Cauchy, Circle, Gaussian, Newtonian, Point, Segment

from fieldsim import launch
from fieldsim.errors import InputError
from fieldsim.potentials import field_kernels, registry
from fieldsim.potentials.elements import Elements, concatenate, pack, place
from fieldsim.potentials.field import Field
from fieldsim.potentials.gravity import gravity
from fieldsim.potentials.row import ROW_WIDTH
from fieldsim.world.body import Body
from fieldsim.world.material import Material

RNG = np.random.default_rng(17)
POINTS = RNG.normal(size=(50, 3))
BONE = Segment((-1, 0, 0), (1, 0.5, 0.25))
BALL = Point((0.3, -0.2, 0.1))


def one_of(formula):
    """The reference's first cases of a formula: their packed elements, points around them, and what rounding leaves."""
    cases = reference_cases.reference()[formula][:15]
    elements = pack([c.primitive for c in cases], [c.kernel for c in cases], 1.0)
    return elements, np.array([c.point for c in cases]), np.array([c.value_accepted for c in cases])


def name(formula):
    return f"{formula.kernel.__name__}-{formula.primitive.__name__}"


every_formula = pytest.mark.parametrize("formula", reference_cases.reference(), ids=name)


# Identities of every formula


@every_formula
def test_fields_move_rigidly_with_their_bodies(formula):
    elements, points, rounding = one_of(formula)
    w, x, y, z = quaternion = np.array([0.2, -0.5, 0.7, 0.4]) / math.sqrt(0.94)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0)
    rotation = np.eye(3) + 2 * (w * _cross((x, y, z)) + _cross((x, y, z)) @ _cross((x, y, z)))
    shift = np.array([0.4, -1.3, 0.8])
    placed = Elements(place(elements.rows, rotation, shift), elements.kinds, elements.order)
    value, gradient = targets.evaluate("warp64", elements, points)
    moved_value, moved_gradient = targets.evaluate("warp64", placed, points @ rotation.T + shift)
    # Moving rounds coordinates of size 30 to 1e-15, next to a wire at 0.02: 1e-13 of the field.
    assert (np.abs(moved_value - value) <= 2e-12 * np.abs(value) + rounding).all()
    error = np.linalg.norm(moved_gradient - gradient @ rotation.T, axis=1)
    assert (error <= 2e-12 * np.linalg.norm(gradient, axis=1) + 1e-15).all()


def _cross(v):
    return np.cross(np.eye(3), v) * -1.0


@every_formula
def test_gradient_is_the_derivative_of_the_value(formula):
    elements, points, _ = one_of(formula)
    value, gradient = targets.evaluate("warp64", elements, points)
    step = 1e-4
    for axis in range(3):
        shifted = [targets.evaluate("warp64", elements, points + k * step * np.eye(3)[axis])[0] for k in (-2, -1, 1, 2)]
        slope = (shifted[0] - 8 * shifted[1] + 8 * shifted[2] - shifted[3]) / (12 * step)
        # Fourth order: step^4 f''''' / 30, with f''''' up to 120 f / 0.02^5 next to a wire at 0.02.
        scale = np.linalg.norm(gradient, axis=1)
        # Next to a bare sheet's edge the field changes too much within the steps.
        wide = scale * step < 5e-3 * np.abs(value) + 1e-3
        assert (np.abs(slope - gradient[:, axis]) <= 2e-7 * scale + 1e-10)[wide].all()


def test_hessian_is_the_derivative_of_the_gradient():
    field = Field([BONE, BALL], Newtonian(0.2)) + 0.5 * Field(BONE, Gaussian(1.1))
    points = np.array([(0.4, 0.9, -0.3), (2.0, 0.1, 0.4), (-3.0, 4.0, 5.0)])
    hessian = field.hessian(points)
    assert hessian.shape == (3, 3, 3)
    np.testing.assert_array_equal(hessian, hessian.transpose(0, 2, 1))
    step = 1e-4
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        slope = (field.gradient(points + shift) - field.gradient(points - shift)) / (2 * step)
        # Second order: step^2 / 6 of the fourth derivative of F, some 10 here.
        np.testing.assert_allclose(hessian[:, axis], slope, atol=1e-7)
    np.testing.assert_array_equal(field.hessian(points[0]), hessian[0])


def test_newtonian_hessian_has_no_trace_away_from_the_source():
    field = Field([BONE, BALL], Newtonian())
    hessian = field.hessian(np.array([(0.4, 0.9, -0.3), (2.0, 0.1, 0.4), (-30.0, 40.0, 50.0)]))
    size = np.linalg.norm(hessian, axis=(1, 2))
    assert (np.abs(np.trace(hessian, axis1=1, axis2=2)) < 1e-13 * size).all()


def test_hessian_of_warp_points_stays_on_their_device():
    field = Field(BALL, Gaussian(1.1))
    points = wp.array([(0.4, 0.9, -0.3)], dtype=wp.vec3d, device="cpu")
    result = field.hessian(points)
    assert isinstance(result, wp.array)
    np.testing.assert_array_equal(result.numpy()[0], field.hessian((0.4, 0.9, -0.3)))


@pytest.mark.parametrize("kernel", [Cauchy(1.3), Gaussian(1.1), Newtonian(0.2)], ids=repr)
def test_curves_are_the_sums_of_their_parts(kernel):
    middle = tuple(0.3 * np.array(BONE.start) + 0.7 * np.array(BONE.end))
    assert_same(Field(BONE, kernel), Field([Segment(BONE.start, middle), Segment(middle, BONE.end)], kernel))
    x, y = (1, 0, 0), (0, 1, 0)
    arc = Arc((0, 0, 0), (0, 0, 1), x, 1.0, 2.0)
    rest = Arc((0, 0, 0), (0, 0, 1), (math.cos(2.0), math.sin(2.0), 0), 1.0, 2 * math.pi - 2.0)
    assert_same(Field(Circle((0, 0, 0), (0, 0, 1), 1.0), kernel), Field([arc, rest], kernel))
    assert_same(Field(Arc((0, 0, 0), (0, 0, 1), y, 1.0, 2 * math.pi), kernel), Field([arc, rest], kernel))


@pytest.mark.parametrize("kernel", [Cauchy(1.3), Gaussian(1.1), Newtonian(0.2)], ids=repr)
def test_segments_have_no_direction(kernel):
    assert_same(Field(BONE, kernel), Field(Segment(BONE.end, BONE.start), kernel))


def assert_same(one, other, rtol=1e-13):
    value, gradient = one.value_and_gradient(POINTS)
    other_value, other_gradient = other.value_and_gradient(POINTS)
    np.testing.assert_allclose(other_value, value, rtol=rtol)
    np.testing.assert_allclose(other_gradient, gradient, rtol=rtol, atol=rtol * np.abs(gradient).max())


@pytest.mark.parametrize("distance", [1e7, 1e12])
@pytest.mark.parametrize(
    "primitive",
    [BONE, Circle((0, 0, 0), (1, 1, 1), 2.0), Arc((0.1, 0, 0), (0, 1, 1), (1, 0, 0), 1.0, 1.5)],
    ids=lambda p: type(p).__name__,
)
def test_everything_is_a_point_from_far_away(primitive, distance):
    directions = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
    value, gradient = gravity(primitive, 3.0, G=0.5).value_and_gradient(distance * directions)
    # Seen from the origin the centre of mass is off by at most 1 in `distance`.
    np.testing.assert_allclose(value, 1.5 / distance, rtol=2 / distance + 1e-12)
    np.testing.assert_allclose(
        gradient, -1.5 / distance**2 * directions, atol=1.5 / distance**2 * (4 / distance + 1e-12)
    )


# Fields as values


def test_fields_add_and_scale():
    f, g = Field(BONE, Newtonian(0.2), 2.0), Field(BALL, Newtonian(0.2))
    for field, f_factor, g_factor in [
        (f + g, 1, 1),
        (2.5 * f, 2.5, 0),
        (f * 2, 2, 0),
        (np.float64(2.5) * f, 2.5, 0),
        (-f, -1, 0),
        (f - 3 * g, 1, -3),
        (sum([f, g, g]), 1, 2),
    ]:
        assert isinstance(field, Field)
        expected = f_factor * f.value(POINTS) + g_factor * g.value(POINTS)
        np.testing.assert_allclose(field.value(POINTS), expected, rtol=1e-13, atol=1e-14)
        expected = f_factor * f.gradient(POINTS) + g_factor * g.gradient(POINTS)
        np.testing.assert_allclose(field.gradient(POINTS), expected, rtol=1e-13, atol=1e-13)


def test_factors_by_which_strengths_overflow_are_refused():
    field = Field(BONE, Gaussian(2.0), 1e10)
    for one in (field, Field.of_elements(field.elements)):
        with pytest.raises(InputError, match="overflows"):
            1e300 * one


def test_one_strength_per_primitive():
    assert_same(
        Field([BONE, BALL], Newtonian(0.2), [2.0, -3.0]),
        Field(BONE, Newtonian(0.2), 2.0) + Field(BALL, Newtonian(0.2), -3.0),
    )
    assert_same(Field([BONE, BALL], Newtonian(0.2), np.array([2, 2])), Field([BONE, BALL], Newtonian(0.2), np.array(2)))


def test_kernels_mix_in_one_field():
    mixed = Field(BONE, Newtonian(0.2)) + Field(BALL, Gaussian(1.0)) + Field(BONE, Newtonian(0.7))
    parts = [Field(BONE, Newtonian(0.2)), Field(BALL, Gaussian(1.0)), Field(BONE, Newtonian(0.7))]
    np.testing.assert_allclose(mixed.value(POINTS), sum(p.value(POINTS) for p in parts), rtol=1e-14)


@pytest.mark.parametrize("bad", ["x", None, [1, 2], 1j, (Field(BALL, Newtonian()), 1)])
def test_only_numbers_scale_and_only_fields_add(bad):
    f = Field(BALL, Newtonian())
    for operation in (lambda: f + bad, lambda: f * bad, lambda: bad * f, lambda: f - bad):
        with pytest.raises(TypeError):
            operation()
    with pytest.raises(InputError, match="factor is nan"):
        f * math.nan


# Points in, numbers out


def test_shapes():
    f = Field(BONE, Newtonian(0.2))
    value, gradient = f.value_and_gradient(POINTS)
    assert (value.shape, gradient.shape, value.dtype, gradient.dtype) == ((50,), (50, 3), np.float64, np.float64)
    for single in (POINTS[3], tuple(POINTS[3]), POINTS[3].tolist(), wp.vec3d(*POINTS[3])):
        assert isinstance(f.value(single), float)
        assert f.value(single) == value[3]
        assert (f.gradient(single) == gradient[3]).all()
        assert f.gradient(single).shape == (3,)
    nothing = f.value_and_gradient(np.zeros((0, 3)))
    assert (nothing[0].shape, nothing[1].shape) == ((0,), (0, 3))
    assert f.value(POINTS.tolist()).shape == (50,)
    np.testing.assert_array_equal(f.value(np.asfortranarray(POINTS)[::-1]), value[::-1])


def test_many_points_are_the_same_points():
    # Enough for launches in slices on several threads.
    f = Field(BONE, Newtonian(0.2))
    np.testing.assert_array_equal(f.value(np.tile(POINTS, (100, 1))), np.tile(f.value(POINTS), 100))


@pytest.mark.parametrize("device", ["cpu", "cuda"])
@pytest.mark.parametrize(("vector", "scalar", "rtol"), [(wp.vec3d, wp.float64, 1e-13), (wp.vec3f, wp.float32, 2e-6)])
def test_warp_arrays_stay_on_their_device(device, vector, scalar, rtol):
    if device == "cuda" and not wp.is_cuda_available():
        pytest.skip("no CUDA device")
    f = Field(BONE, Newtonian(0.2))
    points = wp.array(POINTS, dtype=vector, device=device)
    value, gradient = f.value_and_gradient(points)
    assert (value.dtype, gradient.dtype) == (scalar, vector)
    assert value.device == gradient.device == points.device
    expected = f.value_and_gradient(POINTS)
    np.testing.assert_allclose(value.numpy(), expected[0], rtol=rtol)
    np.testing.assert_allclose(gradient.numpy(), expected[1], rtol=rtol, atol=rtol)
    np.testing.assert_array_equal(f.value(points[10:20]).numpy(), value.numpy()[10:20])
    assert len(f.value(wp.empty(0, dtype=vector, device=device))) == 0


def test_rows_are_uploaded_once(monkeypatch):
    seen = []

    def spy(kernel, count, inputs, outputs, *, device):
        seen.append([table.ptr for table in inputs[1:]])
        return launched(kernel, count, inputs, outputs, device=device)

    launched = launch.launch
    monkeypatch.setattr(launch, "launch", spy)
    f = Field(BONE, Newtonian(0.2))
    first, again = f.value(POINTS), f.value(POINTS)
    np.testing.assert_array_equal(again, first)
    assert len(seen) == 2
    assert seen[0] == seen[1]


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((4, 2)), r"points has shape \(4, 2\)"),
        (np.zeros(4), r"points has shape \(4,\)"),
        (np.zeros((2, 2, 3)), r"points has shape \(2, 2, 3\)"),
        (1.0, r"points has shape \(\)"),
        ([[1, 2, 3], [1, 2]], "cannot be read as numbers"),
        ("abc", "cannot be read|shape"),
        ([[0, 0, 0], [0, math.nan, 0], [math.inf, 0, 0]], r"points\[1\] is \(0.0, nan, 0.0\).*2 of 3"),
        ((0, 0, math.inf), r"points\[0\] is"),
        (wp.zeros(3, dtype=wp.float32, device="cpu"), "float32 with shape"),
        (wp.zeros((3, 2), dtype=wp.vec3f, device="cpu"), r"vec3f with shape \(3, 2\)"),
        (wp.zeros(3, dtype=wp.vec2f, device="cpu"), "vec2f"),
    ],
    ids=str,
)
def test_points_that_are_none(points, message):
    with pytest.raises(InputError, match=message):
        Field(BONE, Newtonian(0.2)).value(points)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([], Newtonian()), "skeleton is empty"),
        (([BONE, "x"], Newtonian()), r"skeleton\[1\] is 'x'"),
        ((BONE, "newton"), "kernel is 'newton'; give one such as"),
        ((BONE, Newtonian), "kernel is"),
        ((BONE, Newtonian(), math.nan), "strength is nan; give a finite number"),
        ((BONE, Newtonian(), True), "strength is True; give a number"),
        ((BONE, Newtonian(), "2"), "strength is '2'; give a number"),
        ((BONE, Newtonian(), None), "strength is None; give a number"),
        (([BONE, BALL], Newtonian(), [1.0, math.inf]), r"strength\[1\] is inf; give a finite number"),
        (([BONE, BALL], Newtonian(), [1.0, [2.0, 3.0]]), r"strength\[1\] is \[2.0, 3.0\]; give a number"),
        (([BONE, BALL], Newtonian(), np.array([True, False])), r"strength\[0\]"),
        (([BONE, BALL], Newtonian(), [1.0]), "1 strengths for 2 primitives"),
    ],
    ids=str,
)
def test_fields_that_are_none(arguments, message):
    with pytest.raises(InputError, match=message):
        Field(*arguments)


# Gravity and animation


def test_gravity_spreads_the_mass_over_the_measure():
    bones = [BONE, Segment((0, 0, 0), (0, 0, 3))]
    total = BONE.measure + 3.0
    assert_same(gravity(bones, 4.0, G=2.0, kernel=Newtonian(0.2)), Field(bones, Newtonian(0.2), 8.0 / total))
    assert_same(gravity([BALL, Point((1, 1, 1))], 4.0), Field([BALL, Point((1, 1, 1))], Newtonian(), 2.0))
    assert (gravity(BONE, -1.0).value(POINTS) < 0).all()


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((BONE, math.nan), {}, "mass is nan"),
        ((BONE, 1.0), {"G": math.inf}, "G is inf"),
        (([BONE, BALL], 1.0), {}, "mixes points, curves and surfaces"),
        (([BONE, BALL], lambda t: t), {}, "mixes points, curves and surfaces"),
        (([], 1.0), {}, "empty"),
    ],
)
def test_gravity_refuses(arguments, options, message):
    with pytest.raises(InputError, match=message):
        gravity(*arguments, **options)


def test_animated_fields_are_evaluated_at_a_time():
    growing = Segment((0, 0, 0), lambda t: (1 + t, 0, 0))
    field = 2.0 * Field([growing, BONE], Newtonian(0.2), [1.0, lambda t: 3 * t]) + Field(BONE, Newtonian(0.2))
    assert field.animated
    still = field.at(2.0)
    assert not still.animated
    assert still.at(5.0) is still
    grown = Segment((0, 0, 0), (3, 0, 0))
    assert_same(still, Field([grown, BONE, BONE], Newtonian(0.2), [2.0, 12.0, 1.0]))
    for use in (lambda: field.value(POINTS), lambda: field.elements):
        with pytest.raises(InputError, match="evaluate field"):
            use()


def test_animated_gravity_keeps_the_mass():
    growing = [Segment((0, 0, 0), lambda t: (1 + t, 0, 0)), BONE]
    grown = [Segment((0, 0, 0), (3, 0, 0)), BONE]
    assert_same(gravity(growing, lambda t: 5 * t).at(2.0), gravity(grown, 10.0))


@pytest.mark.parametrize(
    ("field", "message"),
    [
        (Field([BALL, Segment((0, 0, 0), lambda t: (1 - t, 0, 0))], Newtonian()), "term 1 at time 1: Segment: .* both"),
        (Field(BALL, Newtonian(), lambda t: math.nan), "term 0 at time 1: Field: strength is nan"),
        (Field(Point(lambda t: (0, t)), Newtonian()), "term 0 at time 1: Point: position has shape"),
    ],
    ids=["zero length", "nan strength", "two coordinates"],
)
def test_animations_that_break_say_where_and_when(field, message):
    with pytest.raises(InputError, match=message):
        field.at(1.0)


# The registry


def test_unknown_formulas_name_the_known_ones():
    class Plank(Point):
        pass

    with pytest.raises(InputError, match=r"no field is known for Newtonian.* on .*Plank.*known: .*Newtonian on Point"):
        Field(Plank((0, 0, 0)), Newtonian()).value(POINTS)


def test_formulas_are_registered_once():
    with pytest.raises(InputError, match="Newtonian on Point is registered already"):
        registry.register(Newtonian, Point, registry.FORMULAS[Newtonian, Point].jet)


def test_no_elements_no_field():
    function = registry.field_sum(())
    assert function(0.0, 0.0, 0.0, np.zeros((0, ROW_WIDTH)), np.zeros(0, np.int32), 0, 0) == (0, 0, 0, 0)
    assert len(concatenate([])) == 0


@pytest.mark.parametrize("scalar", [wp.float32, wp.float64], ids=["float32", "float64"])
def test_all_formulas_compile_for_cuda_without_a_device(scalar, tmp_path):
    kinds = tuple(sorted(formula.kind for formula in registry.FORMULAS.values()))
    kernel = field_kernels.KERNELS[2](kinds, scalar)
    wp.compile_aot_module(kernel.module, arch=90, use_ptx=True, module_dir=tmp_path)
    (ptx,) = tmp_path.glob("*.ptx")
    assert ".entry" in ptx.read_text()


def test_surface_fields_are_fields_like_any_other():
    body = Body(BONE, gravity=Newtonian(0.3), surface=Material(radius=0.3))
    equipotential = Body(BONE, gravity=Newtonian(0.3), surface=Material(level=2.0)).surface_field()
    surface, pull = body.surface_field(), body.gravity_field()
    for field in (surface, equipotential, Field.of_elements(pull.elements)):
        value, gradient = field.value_and_gradient(POINTS)
        np.testing.assert_allclose((field + field).value(POINTS), 2 * value, rtol=1e-12)
        np.testing.assert_allclose((3 * field).gradient(POINTS), 3 * gradient, rtol=1e-12, atol=1e-300)
        np.testing.assert_allclose((-field).value(POINTS), -value, rtol=1e-12)
        mixed = sum([field, 0.5 * pull, field]) - field
        np.testing.assert_allclose(mixed.value(POINTS), value + 0.5 * pull.value(POINTS), rtol=1e-9)
        assert mixed.at(3.0) is mixed
        assert repr(field + pull) == f"<Field of {2 * len(pull.terms)} elements>"
    moving = Field(Point(lambda t: (t, 0.0, 0.0)), Newtonian()) + surface
    right = surface.value(POINTS) + Field(Point((2, 0, 0)), Newtonian()).value(POINTS)
    np.testing.assert_allclose((2 * moving).at(2.0).value(POINTS), 2 * right, rtol=1e-12)
    with pytest.raises(InputError, match="function of time"):
        moving.value(POINTS)
