"""The oracle of contact against closed forms: nothing here is simulated."""

import contact_oracle
import numpy as np
import pytest
from contact_scenes import Scene
from contact_surface import Surface
from scipy import optimize

import fieldsim as fs

R = 0.2
SOFT = fs.Material(radius=R, blobbiness=-4.0)


def touches(bodies, starts, velocities, radii):
    """First touches of balls thrown at bodies."""
    scene = Scene("", tuple(bodies), *map(np.array, (starts, velocities, radii)), np.full(len(radii), R), 10.0)
    found = contact_oracle.first_touches(scene)
    assert not found.doubtful.any()
    return found


def test_of_a_sphere():
    rng = np.random.default_rng(1)
    count = 40
    radii = R * 10.0 ** rng.uniform(-2, 1, count)
    headings = rng.normal(size=(count, 3))
    headings /= np.linalg.norm(headings, axis=1)[:, None]
    aside = np.cross(headings, rng.normal(size=(count, 3)))
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    impact = np.linspace(0.0, 1.29, count) * (R + radii)
    starts = -4.0 * headings + impact[:, None] * aside
    found = touches([fs.Body(fs.Point((0, 0, 0)), surface=SOFT)], starts, headings, radii)
    hit = impact < R + radii
    times = 4.0 - np.sqrt(np.maximum((R + radii) ** 2 - impact**2, 0.0))
    np.testing.assert_allclose(found.times, np.where(hit, times, np.inf), rtol=1e-12)
    places = (starts + times[:, None] * headings) * (R / (R + radii))[:, None]
    error = np.linalg.norm(found.places - places, axis=1) / radii
    assert (error[hit] < 1e-9).all()
    # Only near misses are measured.
    known = ~hit & np.isfinite(found.clearances)
    assert known.sum() > 3
    np.testing.assert_allclose(found.clearances[known], (impact - R - radii)[known], atol=1e-4)


def test_of_the_middle_of_a_straight_tube():
    body = fs.Body(fs.Segment((0, 0, -3), (0, 0, 3)), surface=SOFT, motion=fs.Pose.turned((1, 2, 3), 0.7))
    turn, aside, r = body.motion.matrix, np.array([0.0, 0.1, 0.3]), np.array([0.004, 0.05, 0.3])
    starts = np.column_stack([[-3.0, -3.0, -3.0], aside, [0.2, 0.0, -0.1]]) @ turn.T
    velocities = np.array([(2.0, 0.0, 0.1)] * 3) @ turn.T
    found = touches([body], starts, velocities, r)
    np.testing.assert_allclose(found.times, (3.0 - np.sqrt((R + r) ** 2 - aside**2)) / 2.0, rtol=1e-12)


def test_of_two_rails_between_which_a_ball_falls():
    # Far enough apart not to melt; the ball meets both at once, and each on its own side.
    rails = [fs.Segment((-5, y, 0), (5, y, 0)) for y in (-0.9, 0.9)]
    r = np.array([0.8, 1.7])
    found = touches([fs.Body(rails, surface=SOFT)], [(0.1, 0, 4.0)] * 2, [(0.0, 0, -1.0)] * 2, r)
    height = np.sqrt((R + r) ** 2 - 0.9**2)
    np.testing.assert_allclose(found.times, 4.0 - height, rtol=1e-10)
    np.testing.assert_allclose(found.places[:, 2], height * R / (R + r), rtol=1e-8)
    np.testing.assert_allclose(np.abs(found.places[:, 1]), 0.9 * r / (R + r), rtol=1e-8)


def test_of_the_hole_of_a_donut():
    # A ball too thick for it: by symmetry a matter of the plane (rho, z), where the profile is F = 1.
    body = fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), 0.7), surface=SOFT)
    field, r = body.surface_field(), 0.65

    def rim(angle):
        """The profile's point in a direction from the wire."""
        out = np.array([np.cos(angle), 0.0, np.sin(angle)])
        size = optimize.brentq(lambda s: field.value((0.7, 0, 0) + s * out) - 1.0, 0.05, 0.4, xtol=1e-15)
        return (0.7, 0, 0) + size * out

    def height(angle):
        p = rim(angle)
        return p[2] + np.sqrt(r**2 - p[0] ** 2)

    best = optimize.minimize_scalar(lambda a: -height(a), bounds=(1.7, 3.1), method="bounded", options={"xatol": 1e-9})
    found = touches([body], [(0, 0, 3.0)], [(0, 0, -2.0)], [r])
    np.testing.assert_allclose(found.times, (3.0 + best.fun) / 2.0, rtol=1e-12)
    np.testing.assert_allclose(np.hypot(*found.places[0, :2]), rim(best.x)[0], rtol=1e-7)


@pytest.mark.parametrize("motion", ["line", "spin"])
def test_of_a_moving_sphere(motion):
    place, rate = np.array([0.5, 0.0, 0.0]), 1.3
    if motion == "line":
        moving = fs.Keyframes([0.0, 4.0], [fs.Pose(), fs.Pose((0.0, 0.8, 1.2))], interpolation="linear")
    else:
        moving = fs.Spin((0, 0, 1), rate)
    start, velocity, r = np.array([-2.0, 1.0, 0.1]), np.array([2.0, -0.7, 0.0]), 0.4
    found = touches([fs.Body(fs.Point(place), surface=SOFT, motion=moving)], [start], [velocity], [r])
    times = np.linspace(0.0, 3.0, 3001)

    def center(t):
        return moving(t).apply(place)

    def gap(t):
        return np.linalg.norm(start + t * velocity - center(t)) - R - r

    first = next(k for k, t in enumerate(times) if gap(t) < 0)
    time = optimize.brentq(gap, times[first - 1], times[first], xtol=1e-15)
    np.testing.assert_allclose(found.times, time, rtol=1e-12)
    toward = start + time * velocity - center(time)
    np.testing.assert_allclose(found.places[0], center(time) + R * toward / np.linalg.norm(toward), atol=1e-10)


def test_samples_and_newton_agree_where_bodies_melt():
    # Two spheres that have melted to one: what a dense net of samples meets first, a little later than the truth.
    melted = [fs.Point((-0.2, 0, 0)), fs.Point((0.2, 0.05, 0))]
    body = fs.Body(melted, surface=SOFT)
    start, velocity, r = np.array([0.02, 0.3, -2.0]), np.array([0.0, -0.1, 1.0]), 0.15
    found = touches([body], [start], [velocity], [r])
    angles, heights = np.meshgrid(np.linspace(0, 2 * np.pi, 500), np.linspace(-1, 1, 500))
    round_ = np.sqrt(1 - heights**2)
    out = np.stack([round_ * np.cos(angles), round_ * np.sin(angles), heights], axis=-1).reshape(-1, 3)
    on, net = Surface([body]).projected(0.3 * out, 0.0, steps=40)
    meeting = contact_oracle.Paths(start[None], velocity[None], np.array([r])).meeting(0, net[on])[0].min()
    assert -1e-12 < meeting - found.times[0] < 1e-4
