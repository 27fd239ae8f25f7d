"""Fields as users call them: shapes, devices, sums, gravity, animation, bad input."""

import math

import numpy as np
import pytest
import warp as wp
from reference_cases import Gaussian, Newtonian, Point, Segment
from test_formulas import BALL, BONE, POINTS, assert_same

from fieldsim import launch
from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.elements import concatenate
from fieldsim.potentials.field import Field
from fieldsim.potentials.field_kernels import in_threads, kernel_and_items, results_of
from fieldsim.potentials.gravity import gravity
from fieldsim.potentials.row import ROW_WIDTH
from fieldsim.world.body import Body
from fieldsim.world.material import Material

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


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("scalar", [wp.float32, wp.float64], ids=["float32", "float64"])
def test_threads_of_a_gpu_are_one_lane_of_the_same(order, scalar):
    """On a CPU, one after another."""
    elements, device = (Field(BONE, Newtonian(0.2)) + Field(BALL, Gaussian(0.9))).elements, wp.get_device("cpu")
    rows, kinds = (
        wp.array(a, dtype=t, device=device) for a, t in ((elements.rows, scalar), (elements.kinds, wp.int32))
    )
    given = [wp.array(POINTS, dtype=wp.types.vector(3, scalar), device=device), rows, kinds, 0, len(elements)]
    found = []
    for kernel, items in (
        (in_threads(order, elements.kinds_used, scalar), len(POINTS)),
        kernel_and_items(order, elements.kinds_used, scalar, len(POINTS), device),
    ):
        found.append(results_of(order, len(POINTS), scalar, device))
        launch.launch(kernel, items, given, found[-1], device=device)
    for alone, in_lanes in zip(*found, strict=True):
        close = 1e-5 if scalar is wp.float32 else 1e-13
        np.testing.assert_allclose(alone.numpy(), in_lanes.numpy(), rtol=close, atol=close)


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

    def spy(kernel, count, inputs, outputs, **options):
        seen.append([table.ptr for table in inputs[1:3]])
        return launched(kernel, count, inputs, outputs, **options)

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


def test_no_elements_no_field():
    function = registry.field_sum(())
    assert function(0.0, 0.0, 0.0, np.zeros((0, ROW_WIDTH)), np.zeros(0, np.int32), 0, 0) == (0, 0, 0, 0)
    assert len(concatenate([])) == 0


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
