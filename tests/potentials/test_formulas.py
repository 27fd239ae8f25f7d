"""Every formula of the registry: identities that hold for all of them, and the registry itself."""

import math

import numpy as np
import pytest
import reference_cases
import targets
import warp as wp
from reference_cases import Arc, Cauchy, Circle, Gaussian, Newtonian, Point, Segment

from fieldsim.errors import InputError
from fieldsim.potentials import field_kernels, registry
from fieldsim.potentials.elements import Elements, pack, place
from fieldsim.potentials.field import Field
from fieldsim.potentials.gravity import gravity

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


def test_unknown_formulas_name_the_known_ones():
    class Plank(Point):
        pass

    with pytest.raises(InputError, match=r"no field is known for Newtonian.* on .*Plank.*known: .*Newtonian on Point"):
        Field(Plank((0, 0, 0)), Newtonian()).value(POINTS)


def test_formulas_are_registered_once():
    with pytest.raises(InputError, match="Newtonian on Point is registered already"):
        registry.register(Newtonian, Point, registry.FORMULAS[Newtonian, Point].jet)


@pytest.mark.parametrize("scalar", [wp.float32, wp.float64], ids=["float32", "float64"])
def test_all_formulas_compile_for_cuda_without_a_device(scalar, compiles_for_cuda):
    kinds = tuple(sorted(formula.kind for formula in registry.FORMULAS.values()))
    compiles_for_cuda(field_kernels.in_threads(2, kinds, scalar).module)
