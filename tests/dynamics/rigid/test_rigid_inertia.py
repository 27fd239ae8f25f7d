"""Mass properties of bodies against closed forms; what cannot be a body."""

import math

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics.rigid.body import free_body
from fieldsim.dynamics.rigid.inertia import mass_properties
from fieldsim.dynamics.rigid.mass_points import enough, mass_points

ORIGIN = (0.0, 0.0, 0.0)
HALF_RING = fs.Arc(ORIGIN, (0, 0, 1), (1, 0, 0), 1.0, math.pi)


def properties(skeleton, mass=2.0, surface=None, **motion):
    return mass_properties(fs.Body(skeleton, mass=mass, surface=surface, motion=fs.Rigid(**motion)))


def rod(length, mass):
    return mass * length**2 / 12


@pytest.mark.parametrize(
    ("skeleton", "center", "moments"),
    [
        (fs.Segment((0, 0, 0), (3, 0, 0)), (1.5, 0, 0), (0, rod(3, 2), rod(3, 2))),
        ([fs.Point((-1, 0, 0)), fs.Point((1, 0, 0))], ORIGIN, (0, 2, 2)),
        (fs.Circle(ORIGIN, (0, 0, 1), 1.5), ORIGIN, (2.25, 2.25, 4.5)),
        (HALF_RING, (0, 2 / math.pi, 0), (1 - 8 / math.pi**2, 1, 2 - 8 / math.pi**2)),
        (fs.Triangle((0, 0, 0), (3, 0, 0), (0, 3, 0)), (1, 1, 0), (1, 1, 2)),
        ([fs.Segment((-1, 0, 0), (1, 0, 0)), fs.Segment((0, -2, 0), (0, 2, 0))], ORIGIN, None),
        # Density 1 - u on 0..1: centre 1/3, second moment 1/6 - 1/9.
        (fs.TaperedSegment((0, 0, 0), (1, 0, 0)), (1 / 3, 0, 0), (0, 1 / 9, 1 / 9)),
        (fs.solid_faces(fs.mesh(fs.box(ORIGIN, (2, 3, 4)))), ORIGIN, (25 / 6, 20 / 6, 13 / 6)),
    ],
    ids=["segment", "points", "circle", "arc", "triangle", "cross", "tapered", "box"],
)  # fmt: skip
def test_skeletons(skeleton, center, moments):
    found = properties(skeleton)
    if moments is None:
        thin, long = rod(2, 2 / 3), rod(4, 4 / 3)
        moments = (long, thin, long + thin)
    np.testing.assert_allclose(found.center, center, atol=1e-14)
    inertia = found.inertia
    if isinstance(skeleton, fs.Triangle):
        assert inertia[0, 1] == pytest.approx(0.5)
    else:
        np.testing.assert_allclose(inertia - np.diag(np.diag(inertia)), 0.0, atol=1e-13)
    np.testing.assert_allclose(np.diag(inertia), moments, rtol=1e-13, atol=1e-13)


def test_a_solid_sphere():
    found = properties(fs.Point((0.3, 0, 0)), surface=fs.Material(radius=0.5), inertia="solid")
    np.testing.assert_allclose(found.center, (0.3, 0, 0), atol=1e-6)
    # Stated: a share of 1e-4 of the extent (1) squared, per unit of mass.
    np.testing.assert_allclose(found.inertia, 0.4 * 2.0 * 0.25 * np.eye(3), atol=2e-4)


def test_another_center_and_a_matrix():
    bar = fs.Segment((-1, 0, 0), (1, 0, 0))
    found = properties(bar, center=(0, 0.5, 0))
    np.testing.assert_allclose(np.diag(found.inertia), (0.5, 2 / 3, 2 / 3 + 0.5), atol=1e-14)  # Steiner
    matrix = np.diag([1.0, 1.5, 2.0])
    np.testing.assert_array_equal(properties(bar, inertia=matrix).inertia, matrix)


def test_principal_frames_are_right_handed_and_ascend():
    body = fs.Body(fs.Triangle((0, 0, 0), (3, 0.2, 0), (0, 1, 1)), motion=fs.Rigid())
    start = free_body(0, body)
    assert np.all(np.diff(start.moments) >= 0)
    turn = start.frame.matrix
    assert np.linalg.det(turn) == pytest.approx(1.0)
    inertia = mass_properties(body).inertia
    np.testing.assert_allclose(turn @ np.diag(start.moments) @ turn.T, inertia, atol=1e-14)


def test_enough_mass_points_give_the_pull_at_the_surface():
    for primitive in (
        fs.Segment((-1, 0, 0), (1, 0, 0)),
        fs.Circle(ORIGIN, (0, 0, 1), 1.0),
        fs.Arc(ORIGIN, (0, 0, 1), (1, 0, 0), 1.0, 4.0),
    ):
        points, weights = mass_points([primitive], [enough(primitive, 0.5, 1e-8)])
        assert weights.sum() == pytest.approx(1.0, abs=1e-14)
        field = fs.gravity(primitive, 1.0)
        for away in ((0.3, 1.45, 0.2), (1.5, 0, 0), (-0.9, -0.2, 0.5)):
            near = np.linalg.norm(points - away, axis=1)
            exact = field.value(away)
            # The bound holds for the integrand's largest value, not for its mean.
            assert np.sum(weights / near) == pytest.approx(exact, rel=1e-6)


def test_impossible_bodies_are_refused():
    bar, at = fs.Segment((-1, 0, 0), (1, 0, 0)), fs.Point(ORIGIN)
    with pytest.raises(fs.InputError, match="Rigid: mass is 0"):
        fs.Rigid(mass=0.0)
    with pytest.raises(fs.InputError, match=r"Body \(hill\): its mass is -1"):
        mass_properties(fs.Body(bar, mass=-1.0, motion=fs.Rigid(), name="hill"))
    for inertia, reason in (
        (np.diag([1.0, 1.0, 0.0]), "not all above 0"),
        (np.diag([1.0, 1.0, 3.0]), "no body has one above the sum"),
        ([[1, 2, 0], [0, 1, 0], [0, 0, 1]], "not symmetric"),
        ("shell", "give 'skeleton', 'solid'"),
        (np.eye(2), "give 'skeleton', 'solid'"),
    ):
        with pytest.raises(fs.InputError, match=reason):
            fs.Rigid(inertia=inertia)
    with pytest.raises(fs.InputError, match="no surface that bounds one"):
        properties(bar, inertia="solid")
    with pytest.raises(fs.InputError, match="lies on a straight line"):
        free_body(0, fs.Body(bar, motion=fs.Rigid(angular_velocity=(1, 0, 0))))
    with pytest.raises(fs.InputError, match="lies on a point"):
        free_body(0, fs.Body(at, motion=fs.Rigid(angular_velocity=(0, 0, 1))))
    with pytest.raises(fs.InputError, match="infinite area"):
        free_body(0, fs.Body(fs.Plane(ORIGIN, (0, 0, 1)), motion=fs.Rigid()))
    with pytest.raises(fs.InputError, match="are constant"):
        fs.Body(bar, mass=lambda t: t, motion=fs.Rigid())


def test_odd_quaternions_are_normalised_with_a_warning():
    with pytest.warns(fs.FieldsimWarning, match="has length 2 and was normalised"):
        assert fs.Rigid(rotation=(2, 0, 0, 0)).rotation == (1, 0, 0, 0)
    fs.Rigid(rotation=(1 + 1e-7, 0, 0, 0))
