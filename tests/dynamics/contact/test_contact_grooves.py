"""Balls that touch a surface at several places: between rails, on three balls, in the hole of a donut."""

import math

import numpy as np
import pytest

import fieldsim as fs

# The pull is 1 and comes from so far away that it is uniform to 1e-9.
FAR = 1e9
RAIL, APART, BALL = 0.1, 0.3, 0.3
FRICTION = 0.5
COSINE = math.sqrt(1.0 - (APART / (RAIL + BALL)) ** 2)
DOWN = np.array([0.0, 0.0, -1.0])


def tilted(angle=0.0):
    """A world with a pull of 1, tilted by an angle from -z towards +x."""
    world = fs.World()
    toward = FAR * np.array([math.sin(angle), 0.0, -math.cos(angle)])
    world.add_body(fs.Body(fs.Point(toward), gravity=fs.Newtonian(), mass=FAR**2))
    return world


def on_rails(angle=0.0):
    """A world of two rails along x, far enough apart not to melt, and the centre of a ball that lies on both."""
    world = tilted(angle)
    rails = [fs.Segment((-40, y, 0), (40, y, 0)) for y in (-APART, APART)]
    world.add_body(fs.Body(rails, surface=fs.Material(radius=RAIL)))
    return world, np.array([0.0, 0.0, (RAIL + BALL) * COSINE])


def on_three():
    """A world of three fixed balls, and the centre of a ball that lies on all."""
    world = tilted()
    corners = [(0.6 * math.cos(a), 0.6 * math.sin(a), 0.0) for a in np.arange(3) * math.tau / 3]
    world.add_body(fs.Body([fs.Point(corner) for corner in corners], surface=fs.Material(radius=0.35)))
    return world, np.array([0.0, 0.0, math.sqrt((0.35 + BALL) ** 2 - 0.6**2)])


def in_a_hole():
    """A world of a donut whose hole is too narrow for a ball, and the centre of the ball that lies on its rim."""
    world, radius, tube = tilted(), 0.35, 0.15
    body = fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), radius), surface=fs.Material(radius=tube))
    world.add_body(body)
    # The profile of the tube, and where the ball leans on it: by symmetry a matter of the plane y = 0.
    angles = np.linspace(0.5 * np.pi, np.pi, 200_001)
    out = np.column_stack([np.cos(angles), 0 * angles, np.sin(angles)])
    field, size = body.surface_field(), np.full(len(angles), tube)
    for _ in range(30):
        value, gradient = field.value_and_gradient((radius, 0, 0) + size[:, None] * out)
        size -= np.log(value) * value / np.einsum("ij,ij->i", gradient, out)
    rim = (radius, 0, 0) + size[:, None] * out
    near = np.abs(rim[:, 0]) < BALL
    return world, np.array([0.0, 0.0, (rim[near, 2] + np.sqrt(BALL**2 - rim[near, 0] ** 2)).max()])


def thrown(placed, velocity, law, until, dt=1e-3):
    """The simulation of one ball at that time."""
    world, center = placed
    world.add_particles([center], [velocity], radius=BALL, contact=law)
    simulation = fs.Simulation(world, fs.Leapfrog(dt), threads=1)
    simulation.advance(until)
    return simulation


@pytest.mark.parametrize("place", [on_rails, on_three, in_a_hole])
@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_a_ball_that_comes_to_rest_on_several_places_stays_for_an_hour(place, friction):
    world, center = place()
    simulation = thrown((world, center - 0.05 * DOWN), (0, 0, 0), fs.Bounce(0.3, friction=friction), 20.0, 0.1)
    settled = simulation.positions[0].copy()
    assert simulation.census()["resting"] == 1
    np.testing.assert_allclose(settled, [center], atol=1e-8)
    simulation.advance(20.0 + 3600.0)
    np.testing.assert_array_equal(simulation.positions[0], settled)
    np.testing.assert_array_equal(simulation.velocities[0], 0.0)


def test_along_two_rails_a_ball_ends_up_rolling_about_their_chord():
    # It rolls on a circle of radius r cos: of its speed r^2 cos^2 / (2/5 r^2 + r^2 cos^2) are left.
    simulation = thrown(on_rails(), (1.0, 0, 0), fs.Bounce(0.0, friction=0.3, rolling=True), 4.0)
    np.testing.assert_allclose(simulation.velocities[0], [[COSINE**2 / (0.4 + COSINE**2), 0, 0]], atol=1e-7)


def test_a_bounce_off_two_rails_at_once_is_that_off_their_wedge():
    # Both contacts take their normal velocity times the restitution back: so does the fall.
    world, center = on_rails()
    simulation = thrown((world, np.add(center, (0, 0, 0.1))), (0, 0, -1.0), fs.Bounce(0.5), 0.12, 1e-3)
    assert simulation.bounces >= 1
    fall = math.sqrt(1.0 + 2 * 0.1)
    flight = 0.12 - (fall - 1.0)
    np.testing.assert_allclose(simulation.velocities[0], [[0, 0, 0.5 * fall - flight]], atol=1e-6)


# Two contacts at an angle press more than the weight: friction along rails is that of a plane with mu / cos.
@pytest.mark.parametrize("share", [0.999999, 1.000001])
def test_along_two_rails_a_ball_slides_beyond_the_cone_of_both(share):
    angle = math.atan(share * FRICTION / COSINE)
    simulation = thrown(on_rails(angle), (0, 0, 0), fs.Bounce(0.0, friction=FRICTION), 1.0)
    assert (np.linalg.norm(simulation.velocities[0]) > 0.0) == (share > 1.0)


def test_along_two_rails_kinetic_friction_is_that_of_both_contacts():
    simulation = thrown(on_rails(0.9), (0, 0, 0), fs.Bounce(0.0, friction=FRICTION), 1.0)
    speed = math.sin(0.9) - FRICTION / COSINE * math.cos(0.9)
    np.testing.assert_allclose(simulation.velocities[0], [[speed, 0, 0]], atol=1e-7)
    np.testing.assert_allclose(simulation.positions[0], [[0.5 * speed, 0, (RAIL + BALL) * COSINE]], atol=1e-7)


def on_posts(posts):
    """A world of fixed balls in a ring about z, and the centre of a ball of radius 1.2 that lies on all."""
    world = tilted()
    places = [(math.cos(a), math.sin(a), 0.0) for a in np.arange(posts) * math.tau / posts]
    world.add_body(fs.Body([fs.Point(place) for place in places], surface=fs.Material(radius=0.2)))
    return world, np.array([0.0, 0.0, math.sqrt(1.4**2 - 1.0)])


@pytest.mark.parametrize("posts", [8, 12])
def test_a_ball_on_more_posts_than_contacts_are_kept_goes_straight_up_again_and_comes_to_rest(posts):
    world, place = on_posts(posts)
    start = place - 0.3 * DOWN
    world.add_particles([start], [(0, 0, 0)], radius=1.2, contact=fs.Bounce(1.0))
    world.add_particles([start], [(0, 0, 0)], radius=1.2, contact=fs.Bounce(0.3))
    simulation = fs.Simulation(world, fs.Leapfrog(1e-2), threads=1)
    # The fall takes sqrt(0.6); as long after it the elastic ball is back where it was, at rest.
    simulation.advance(2.0 * math.sqrt(0.6))
    np.testing.assert_allclose(simulation.positions[0], [start], atol=1e-3)
    np.testing.assert_allclose(simulation.velocities[0][:, :2], 0.0, atol=1e-8)
    simulation.advance(5.0)
    # Twelve posts melt together a little, which lifts the ball.
    np.testing.assert_allclose(simulation.positions[1], [place], atol=1e-4)
    np.testing.assert_array_equal(simulation.velocities[1], 0.0)


@pytest.mark.parametrize("clearance", [1e-3, 1e-5])
def test_between_two_bodies_an_elastic_ball_keeps_its_speed_however_often_it_hits_in_a_step(clearance):
    world = fs.World()
    world.add_body(fs.Body([fs.Point((0, 0, 1)), fs.Point((0, 0, -1))], surface=fs.Material(radius=0.5)))
    velocity = (0.1, 0.0, 1.0)
    world.add_particles([(0, 0, 0)], [velocity], radius=0.5 * (1.0 - clearance), contact=fs.Bounce(1.0))
    simulation = fs.Simulation(world, fs.Leapfrog(1e-2), threads=1)
    simulation.advance(1.0)
    assert simulation.census()["moving"] == 1
    assert np.linalg.norm(simulation.velocities[0]) == pytest.approx(np.linalg.norm(velocity), rel=1e-12)


@pytest.mark.parametrize("sideways", [0.2, 0.0, -0.05])
def test_in_a_nook_no_energy_is_made(sideways):
    """A ball touches two still balls, one of which it approaches and one it leaves."""
    height = 0.58
    world = fs.World()
    for z in (height, -height):
        world.add_body(fs.Body(fs.Point((0, 0, z)), surface=fs.Material(radius=0.3)))
    x = math.sqrt(0.36 - height**2) + 1e-12
    world.add_particles([(x, 0, 0)], [(sideways, 0, 1.0)], radius=0.3, contact=fs.Bounce(1.0))
    simulation = fs.Simulation(world, fs.Leapfrog(0.01), threads=1)
    simulation.advance(0.3)
    assert simulation.bounces > 0
    assert np.linalg.norm(simulation.velocities[0]) == pytest.approx(math.hypot(sideways, 1.0), rel=1e-12)
