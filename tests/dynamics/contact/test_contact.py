"""Bounces, rest and sliding on surfaces, still and moving."""

import warnings

import numpy as np
import pytest

from fieldsim.dynamics.diagnostics.invariants import energy
from fieldsim.dynamics.integrators.splittings import Leapfrog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import FieldsimWarning
from fieldsim.potentials.field import Field
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce
from fieldsim.world.material import Material
from fieldsim.world.motion import Keyframes, Pose, Spin
from fieldsim.world.world import World

RADIUS = 0.5
BALL = 0.02
CENTER = Point((0.0, 0.0, 0.0))


def planet(gravity=True, **options):
    """A world with one Gaussian ball of RADIUS at the origin."""
    world = World()
    kernel = Newtonian() if gravity else None
    world.add_body(Body(CENTER, gravity=kernel, mass=1.0, surface=Material(radius=RADIUS), **options))
    return world


def depth(simulation, k=0):
    """How deep the lowest points of the balls of set k are below a spherical planet at the origin."""
    return RADIUS + BALL - np.linalg.norm(simulation.positions[k], axis=1)


def directions(count, seed=0):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
def test_a_dropped_ball_rises_to_the_height_of_its_restitution(restitution):
    world = planet()
    world.add_particles([(2.0, 0, 0)], [(0, 0, 0)], radius=BALL, contact=Bounce(restitution))
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    heights = [s.positions[0][0, 0] for s in simulation.snapshots(np.arange(0.0, 6.0, 0.01)) if simulation.bounces == 1]
    ground = RADIUS + BALL
    impact = 1 / ground - 1 / 2.0  # kinetic energy per mass
    expected = 1 / (1 / ground - restitution**2 * impact)
    # Leapfrog's error is of order dt^2; 0.01 between looks at an apex of curvature g costs g dt^2 / 8.
    assert max(heights) == pytest.approx(expected, abs=1e-4)


def test_elastic_bounces_keep_the_energy_to_second_order():
    drifts = []
    for dt in (4e-3, 2e-3, 1e-3):
        world = planet()
        start = 1.2 * directions(50)
        across = np.cross(start, directions(50, seed=1))
        world.add_particles(start, 0.5 * across, radius=BALL, contact=Bounce(1.0))
        simulation = Simulation(world, Leapfrog(dt), threads=1)
        before = energy(simulation.snapshot()).total
        worst = 0.0
        for snapshot in simulation.snapshots(np.linspace(0.1, 6.0, 60)):
            worst = max(worst, np.abs(energy(snapshot).total - before).max())
        assert simulation.bounces >= 100
        drifts.append(worst)
    slopes = np.log2(np.divide(drifts[:-1], drifts[1:]))
    assert (slopes > 1.7).all(), (drifts, slopes)


def test_nothing_tunnels_however_fast():
    # 1000 a time unit at dt = 1e-2: ten units a step, ten times the planet's diameter.
    count = 2000
    rng = np.random.default_rng(3)
    heading = directions(count, seed=4)
    aside = np.cross(heading, directions(count, seed=5))
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    impact = rng.uniform(0.0, 2.0, count) * (RADIUS + BALL)
    start = -heading * rng.uniform(2.0, 12.0, count)[:, None] + aside * impact[:, None]
    world = planet(gravity=False)
    world.add_particles(start, 1000.0 * heading, radius=BALL, contact=Bounce(1.0))
    simulation = Simulation(world, Leapfrog(1e-2), threads=1)
    simulation.advance(0.05)
    hit = impact < RADIUS + BALL
    np.testing.assert_array_equal(simulation.bounce_counts[0], hit.astype(int))
    # Mirrored at the sphere's normal where the straight path meets it.
    along = -np.sqrt(np.maximum((RADIUS + BALL) ** 2 - impact**2, 0.0))
    normal = (along[:, None] * heading + impact[:, None] * aside) / (RADIUS + BALL)
    mirrored = heading - 2 * np.einsum("ij,ij->i", heading, normal)[:, None] * normal
    expected = 1000.0 * np.where(hit[:, None], mirrored, heading)
    # The contact is found to 1e-10 / |grad log F|; grazing multiplies that by the inverse of the sine of the angle.
    np.testing.assert_allclose(simulation.velocities[0], expected, atol=1e-3)


def test_thin_walls_of_cauchy_segments_hold():
    world = World()
    thin = Material(radius=0.02, kernel=Cauchy, blobbiness=-2.0)
    bars = [Segment((-1.0, y, 0.0), (1.0, y, 0.0)) for y in np.arange(-1.0, 1.01, 0.05)]
    world.add_body(Body(bars, surface=thin))
    rng = np.random.default_rng(0)
    count = 500
    start = np.column_stack([rng.uniform(-0.8, 0.8, count), rng.uniform(-0.8, 0.8, count), np.full(count, 1.0)])
    velocity = np.column_stack([rng.normal(size=(count, 2)), np.full(count, -300.0)])
    world.add_particles(start, velocity, radius=0.02, contact=Bounce(0.7))
    simulation = Simulation(world, Leapfrog(1e-2), threads=1)
    simulation.advance(0.1)
    # Gaps between the bars are narrower than the balls.
    assert (simulation.positions[0][:, 2] > 0.0).all()
    assert (simulation.bounce_counts[0] > 0).all()


def test_a_pebble_at_rest_neither_sinks_nor_jitters():
    world = planet()
    world.add_particles(0.7 * directions(5), np.zeros((5, 3)), radius=BALL, contact=Bounce(0.5))
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    simulation.advance(10.0)
    settled, bounces = simulation.positions[0], simulation.bounces
    simulation.advance(200.0)
    assert simulation.bounces == bounces
    # Contact is held within 1e-10 of log F, whose slope here is 2 * 4 / RADIUS = 16.
    assert (np.abs(depth(simulation)) < 1e-11).all()
    np.testing.assert_allclose(simulation.positions[0], settled, atol=1e-11)
    np.testing.assert_allclose(simulation.velocities[0], 0.0, atol=1e-12)


def test_sliding_without_friction_keeps_the_energy_and_the_ground():
    world = planet()
    world.add_particles([(RADIUS + BALL, 0, 0)], [(0, 0.8, 0.3)], radius=BALL, contact=Bounce(0.5))
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    simulation.advance(0.01)
    before = energy(simulation.snapshot()).total
    simulation.advance(50.0)
    assert abs(depth(simulation)[0]) < 1e-11
    np.testing.assert_allclose(energy(simulation.snapshot()).total, before, atol=1e-10)


def test_a_fast_slider_takes_off():
    world = planet()
    # Faster than the circular speed sqrt(1 / r): the ground falls away, and the orbit is the one without a planet.
    world.add_particles([(RADIUS + BALL, 0, 0)], [(0, 1.6, 0)], radius=BALL, contact=Bounce(0.5))
    world.add_particles([(RADIUS + BALL, 0, 0)], [(0, 1.6, 0)], radius=BALL, contact=None)
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    simulation.advance(2.0)
    np.testing.assert_allclose(simulation.positions[0], simulation.positions[1], atol=1e-5)


def test_a_moving_planet_pushes_what_it_meets():
    world = planet(gravity=False, motion=lambda time: (2.0 * time, 0.0, 0.0))
    world.add_particles([(1.5, 0, 0)], [(0, 0, 0)], radius=BALL, contact=Bounce(0.5))
    world.add_particles([(1.5, 0, 0)], [(0, 0, 0)], radius=BALL, contact=None)
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    simulation.advance(1.0)
    # From a heavy wall at speed 2 a ball at rest leaves with (1 + e) 2.
    np.testing.assert_allclose(simulation.velocities[0], [[3.0, 0, 0]], rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(simulation.velocities[1], 0.0)
    assert [counts.sum() for counts in simulation.bounce_counts] == [1, 0]


def test_a_growing_planet_carries_what_rests_on_it():
    growing = Material(radius=Keyframes([0.0, 2.0], [0.4, 0.6], interpolation="linear"))
    world = World()
    world.add_body(Body(CENTER, gravity=Newtonian(), mass=1.0, surface=growing))
    world.add_particles([(0.43, 0, 0)], [(0, 0, 0)], radius=BALL, contact=Bounce(0.3))
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    for time in (0.5, 1.0, 1.5):
        simulation.advance(time)
        # Between stages the field is interpolated, so the radius is right to second order in dt.
        assert simulation.positions[0][0, 0] == pytest.approx(0.4 + 0.1 * time + BALL, abs=1e-7)
        # The surface's speed is a mean over one step: right to first order.
        np.testing.assert_allclose(simulation.velocities[0], [[0.1, 0, 0]], atol=3e-5)


def test_a_spinning_cross_hits_with_the_speed_of_its_arm():
    arms = [Segment((-1.0, 0, 0), (1.0, 0, 0)), Segment((0, -1.0, 0), (0, 1.0, 0))]
    world = World()
    rate = 0.5
    world.add_body(Body(arms, surface=Material(radius=0.1, blobbiness=-6.0), motion=Spin(rate=rate)))
    world.add_particles([(0.7, 0.3, 0)], [(0, -1.0, 0)], radius=BALL, contact=Bounce(1.0))
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    simulation.advance(0.3)

    def above_the_arm(time):
        angle = rate * time
        normal, arm = np.array([-np.sin(angle), np.cos(angle), 0]), np.array([np.cos(angle), np.sin(angle), 0])
        return np.array([0.7, 0.3 - time, 0]) @ normal, normal, np.array([0.7, 0.3 - time, 0]) @ arm

    low, high = 0.0, 0.3
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if above_the_arm(middle)[0] > 0.1 + BALL else (low, middle)
    _, normal, lever = above_the_arm(low)
    start = np.array([0, -1.0, 0])
    assert simulation.bounces == 1
    expected = start - 2 * (start @ normal - rate * lever) * normal
    # The surface's speed comes from a difference over one step.
    np.testing.assert_allclose(simulation.velocities[0], [expected], atol=1e-3)


def test_particles_inside_at_the_start_are_moved_out_with_a_warning():
    world = planet()
    world.add_particles([(0.3, 0, 0), (0, 0, 0), (2, 0, 0)], np.zeros((3, 3)), radius=BALL, contact=Bounce(0.5))
    with pytest.warns(FieldsimWarning, match="2 of 3 particles start inside"):
        simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    assert np.abs(depth(simulation)[:2]).max() < 1e-10
    simulation.advance(1.0)
    assert depth(simulation).max() < 1e-10


def test_a_surface_that_leaps_hits_what_is_in_its_way():
    """In a step it moves by more than what lies between its places before and after."""
    world = planet(gravity=False, motion=lambda time: (5000.0 * time, 0.0, 0.0))
    world.add_particles([(8.0, 0, 0)], [(0, 0, 0)], radius=BALL, contact=Bounce(0.5))
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    simulation.advance(0.002)
    assert simulation.events.times[0] == pytest.approx((8.0 - 0.5 - BALL) / 5000.0, rel=1e-9)
    np.testing.assert_allclose(simulation.velocities[0], [[7500.0, 0, 0]], rtol=1e-8)


def test_a_surface_that_deforms_by_a_leap_is_warned_of():
    world = World()
    wire = Segment(lambda time: (500.0 * time, -1.0, 0.0), lambda time: (500.0 * time, 1.0, 0.0))
    world.add_body(Body(wire, surface=Material(radius=0.1)))
    world.add_particles([(5.0, 0, 0)], [(0, 0, 0)], radius=BALL, contact=Bounce(0.5))
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    with pytest.warns(FieldsimWarning, match="shorter dt"):
        simulation.advance(0.01)


def test_a_pile_on_a_cross_stays_outside_and_complete():
    arms = [Segment((-1.0, 0, 0), (1.0, 0, 0)), Segment((0, -1.0, 0), (0, 1.0, 0))]
    world = World()
    world.add_body(Body(arms, gravity=Newtonian(), mass=1.0, surface=Material(radius=0.2), motion=Spin(rate=0.7)))
    rng = np.random.default_rng(7)
    start = directions(300, seed=8) * rng.uniform(1.4, 2.0, 300)[:, None]
    world.add_particles(start, 0.3 * rng.normal(size=(300, 3)), radius=BALL, contact=Bounce(0.4))
    simulation = Simulation(world, Leapfrog(2e-3), threads=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.advance(8.0)
    assert simulation.positions[0].shape == (300, 3)
    assert simulation.bounces > 300
    snapshot = simulation.snapshot()
    moved = World()
    moved.add_body(Body(arms, surface=Material(radius=0.2), motion=Pose.turned((0, 0, 1), 0.7 * 8.0)))
    moved.add_particles(snapshot.positions[0], snapshot.velocities[0], radius=BALL, contact=Bounce(0.4))
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing starts inside
        Simulation(moved, Leapfrog(2e-3), threads=1)


def donut(**options):
    world = World()
    ring = Circle((0, 0, 0), (0, 0, 1), 1.0)
    world.add_body(Body(ring, gravity=Newtonian(), mass=1.0, surface=Material(radius=0.25), **options))
    return world


def test_a_pebble_rests_on_the_outer_equator_of_the_donut():
    # Elsewhere the pull is not along the normal, and without friction a pebble slides to the inside.
    world = donut()
    angle = np.linspace(0.0, 2 * np.pi, 7)[:-1]
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(6)])
    world.add_particles(1.5 * rim[:1], np.zeros((1, 3)), radius=BALL, contact=Bounce(0.5))
    world.add_particles(1.4 * rim, np.zeros((6, 3)), radius=BALL, contact=Bounce(0.0))
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    simulation.advance(5.0)
    settled, bounces = simulation.positions, simulation.bounces
    simulation.advance(300.0)
    assert simulation.bounces == bounces
    np.testing.assert_allclose(simulation.positions[0], settled[0], atol=1e-11)
    np.testing.assert_array_equal(simulation.positions[0][0, 1:], 0.0)
    # A neutral equilibrium along the rim, an unstable one across it: rounding grows, but not the distance.
    np.testing.assert_allclose(np.linalg.norm(simulation.positions[1][:, :2], axis=1), settled[0][0, 0], atol=1e-9)


def test_pebbles_on_the_donut_are_all_there_and_all_outside():
    world = donut()
    rng = np.random.default_rng(2)
    start = directions(200, seed=9) * rng.uniform(1.6, 2.5, 200)[:, None]
    world.add_particles(start, 0.2 * rng.normal(size=(200, 3)), radius=BALL, contact=Bounce(0.5))
    simulation = Simulation(world, Leapfrog(2e-3), threads=1)
    surface = Field(Circle((0, 0, 0), (0, 0, 1), 1.0), Gaussian(8.0), 8.0 / np.sqrt(np.pi) * np.exp(4.0))
    for snapshot in simulation.snapshots(np.linspace(1.0, 20.0, 20)):
        value, gradient = surface.value_and_gradient(snapshot.positions[0])
        # Far away the gradient's squares underflow: it is scaled before its length is taken.
        gradient /= np.maximum(np.abs(gradient).max(axis=1), 1e-300)[:, None]
        inward = gradient / np.maximum(np.linalg.norm(gradient, axis=1), 1.0)[:, None]
        assert (surface.value(snapshot.positions[0] + BALL * inward) < 1.0 + 1e-8).all()
    assert len(value) == 200
    assert simulation.bounces > 200
    assert np.isfinite(simulation.positions[0]).all()


def test_balls_in_the_corners_of_a_cross_bounce_off_and_keep_their_energy():
    # In a corner the field's gradient turns within a ball's radius; bounces there must not trap or feed the ball.
    arms = [Segment((-1.5, 0, 0), (1.5, 0, 0)), Segment((0, -1.5, 0), (0, 1.5, 0))]
    world = World()
    world.add_body(Body(arms, gravity=Newtonian(), mass=2.0, surface=Material(radius=0.16)))
    rng = np.random.default_rng(11)
    start = np.column_stack([rng.uniform(0.4, 1.0, (100, 2)), rng.uniform(-0.1, 0.1, 100)])
    world.add_particles(start, np.zeros((100, 3)), radius=0.03, contact=Bounce(1.0))
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    before = energy(simulation.snapshot()).total
    simulation.advance(6.0)
    bounces = simulation.bounce_counts[0]
    assert bounces.sum() > 300
    assert bounces.max() < 200
    # Leapfrog's own error: 7e-6 here, 2.7e-5 at twice the step.
    np.testing.assert_allclose(energy(simulation.snapshot()).total, before, atol=2e-5)


def test_a_bounce_off_a_moving_surface_is_that_off_one_at_rest():
    def bounced(speed, dt):
        motion = Keyframes([0.0, 10.0], [(0, 0, 0), (10 * speed, 0, 0)], interpolation="linear") if speed else Pose()
        world = World()
        world.add_body(
            Body(Segment((0, -5, 0), (0, 5, 0)), surface=Material(radius=0.25, blobbiness=-4), motion=motion)
        )
        world.add_particles([(2.0, 0.3, 0.05)], [(speed - 1.0, 0.2, 0)], radius=0.02, contact=Bounce(1.0))
        simulation = Simulation(world, Leapfrog(dt))
        simulation.advance(3.0)
        return np.concatenate([simulation.positions[0][0], simulation.velocities[0][0]]) - [
            speed * 3,
            0,
            0,
            speed,
            0,
            0,
        ]

    # Between stages a body moves by a screw, so that what does not deform is exact at any time.
    for dt in (0.1, 1e-3):
        np.testing.assert_allclose(bounced(2.3, dt), bounced(0.0, dt), atol=1e-11)
