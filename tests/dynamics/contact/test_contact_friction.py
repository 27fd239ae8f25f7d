"""Coulomb friction in bounces and at rest: sticking, sliding, rolling, on still and on moving ground."""

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics import simulation as simulations

BALL = 0.02
GROUND = 0.25
# The pull comes from so far away that it is uniform to 1e-9.
FAR = 1e9


def incline(angle, motion=None):
    """The plane z = 0 (its surface at z = GROUND) under a pull of 1, tilted by `angle` towards +x."""
    toward = FAR * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    motion = fs.Pose() if motion is None else motion
    world = fs.World()
    world.add_body(fs.Body(fs.Point(toward), gravity=fs.Newtonian(), mass=FAR**2))
    world.add_body(fs.Body(fs.Plane((0, 0, 0), (0, 0, 1)), surface=fs.Material(radius=GROUND), motion=motion))
    return world


def run(world, velocity, law, until, dt=1e-3, height=0.0):
    world.add_particles([(0, 0, GROUND + BALL + height)], [velocity], radius=BALL, contact=law)
    simulation = fs.Simulation(world, fs.Leapfrog(dt), threads=1)
    simulation.advance(until)
    return simulation


@pytest.mark.parametrize("slope", [0.2, 0.4999999])
def test_a_pebble_within_the_cone_stays_exactly_where_it_is(slope):
    simulation = run(incline(np.arctan(slope)), (0, 0, 0), fs.Bounce(0.3, friction=0.5), 1.0)
    landed = simulation.positions[0].copy()
    simulation.advance(3600.0)
    np.testing.assert_array_equal(simulation.positions[0], landed)
    np.testing.assert_array_equal(simulation.velocities[0], 0.0)
    np.testing.assert_allclose(landed, [[0, 0, GROUND + BALL]], atol=1e-10)
    assert simulation.census() == {"moving": 0, "resting": 1, "absorbed": 0, "escaped": 0}


@pytest.mark.parametrize("slope", [0.5000001, 0.8])
def test_a_pebble_outside_the_cone_slides_with_kinetic_friction(slope):
    angle = np.arctan(slope)
    simulation = run(incline(angle), (0, 0, 0), fs.Bounce(0.3, friction=0.5), 2.0)
    acceleration = np.sin(angle) - 0.5 * np.cos(angle)
    # Constant forces: leapfrog is exact, but for the pull's unevenness of 1e-9.
    np.testing.assert_allclose(simulation.velocities[0], [[2.0 * acceleration, 0, 0]], atol=1e-8)
    np.testing.assert_allclose(simulation.positions[0], [[2.0 * acceleration, 0, GROUND + BALL]], atol=1e-8)


def test_friction_brings_a_slider_to_rest_after_its_stopping_distance():
    simulation = run(incline(0.0), (0.8, 0.6, 0), fs.Bounce(0.3, friction=0.4), 1.0)
    heading = np.array([0.8, 0.6, 0.0])
    np.testing.assert_allclose(simulation.velocities[0], [0.6 * heading], atol=1e-8)
    np.testing.assert_allclose(simulation.positions[0][0, :2], 0.8 * heading[:2], atol=1e-8)
    simulation.advance(4.0)
    # v^2 / (2 mu); the last step ends early: at most mu dt^2 / 2 is lost.
    np.testing.assert_allclose(simulation.positions[0][0, :2], 1.25 * heading[:2], atol=3e-7)
    np.testing.assert_array_equal(simulation.velocities[0], 0.0)


@pytest.mark.parametrize(("rolling", "share"), [(False, 1.0), (True, 2.0 / 7.0)])
@pytest.mark.parametrize("friction", [0.1, 5.0])
def test_a_bounce_with_friction_has_the_impulse_of_coulomb(rolling, share, friction):
    law = fs.Bounce(0.5, friction=friction, rolling=rolling)
    simulation = run(incline(0.0), (2.0, -1.0, -3.0), law, 0.05, height=0.1)
    fall = np.sqrt(3.0**2 + 2 * 0.1)
    slip = np.array([2.0, -1.0, 0.0])
    # At most mu times the normal impulse; at most what ends the slip, of which a sphere turns away 5/7.
    loss = min(friction * 1.5 * fall, share * np.sqrt(5.0)) / np.sqrt(5.0)
    (impulse,) = simulation.events.impulses
    np.testing.assert_allclose(impulse, [*-loss * slip[:2], 1.5 * fall], atol=1e-8)
    np.testing.assert_allclose(simulation.velocities[0][0, :2], (1 - loss) * slip[:2], atol=1e-8)
    # The impulse acts at the lowest point: (-r z) x J / (2/5 r^2).
    spin = np.cross([0, 0, -BALL], -loss * slip) / (0.4 * BALL**2) if rolling else np.zeros(3)
    np.testing.assert_allclose(simulation.spins[0], [spin], atol=1e-6)
    assert simulation.events.kinds.tolist() == ["bounce"]


def test_a_sphere_rolls_down_a_slope_and_slips_where_it_is_too_steep():
    for slope, slipping in ((0.5, False), (2.5, True)):
        angle = np.arctan(slope)
        simulation = run(incline(angle), (0, 0, 0), fs.Bounce(0.3, friction=0.5, rolling=True), 1.0)
        acceleration = np.sin(angle) - 0.5 * np.cos(angle) if slipping else 5.0 / 7.0 * np.sin(angle)
        turning = 2.5 * 0.5 * np.cos(angle) / BALL if slipping else acceleration / BALL
        np.testing.assert_allclose(simulation.velocities[0], [[acceleration, 0, 0]], atol=1e-8)
        np.testing.assert_allclose(simulation.spins[0], [[0, turning, 0]], atol=1e-6)


def test_a_sliding_ball_ends_up_rolling_with_five_sevenths_of_its_speed():
    simulation = run(incline(0.0), (1.0, 0, 0), fs.Bounce(0.3, friction=0.3, rolling=True), 3.0)
    np.testing.assert_allclose(simulation.velocities[0], [[5 / 7, 0, 0]], atol=1e-7)
    np.testing.assert_allclose(simulation.spins[0], [[0, 5 / 7 / BALL, 0]], atol=1e-5)


def test_a_moving_floor_drags_a_pebble_along():
    floor = incline(0.0, motion=lambda time: (0.5 * time, 0.0, 0.0))
    simulation = run(floor, (0, 0, 0), fs.Bounce(0.3, friction=0.2), 1.0)
    # Friction speeds it up by 0.2 a unit of time, until it moves as the floor does, from time 2.5 on.
    np.testing.assert_allclose(simulation.velocities[0], [[0.2, 0, 0]], atol=1e-7)
    np.testing.assert_allclose(simulation.positions[0][0, 0], 0.1, atol=1e-7)
    simulation.advance(5.0)
    np.testing.assert_allclose(simulation.velocities[0], [[0.5, 0, 0]], atol=1e-9)
    np.testing.assert_allclose(simulation.positions[0][0, 0], 0.5 * 0.2 * 2.5**2 + 0.5 * 2.5, atol=1e-6)


def test_a_spinning_planet_gives_a_bouncing_ball_the_speed_of_its_ground():
    world = fs.World()
    planet = fs.Point((0, 0, 0))
    world.add_body(fs.Body(planet, surface=fs.Material(radius=0.5), motion=fs.Spin(rate=2.0)))
    start, velocity = [(1.52, 0, 0), (0, 1.52, 0)], [(-4.0, 0, 0), (0, -4.0, 0)]
    world.add_particles(start, velocity, radius=BALL, contact=fs.Bounce(0.5, friction=0.1))
    world.add_particles(start, velocity, radius=BALL, contact=fs.Bounce(0.5, friction=0.9))
    simulation = fs.Simulation(world, fs.Leapfrog(1e-3), threads=1)
    simulation.advance(0.5)
    # The ground carried on to the ball's centre moves with 2 * 0.52 across; the normal impulse is 1.5 * 4.
    expected = np.array([[2.0, 0.6, 0], [-0.6, 2.0, 0]]), np.array([[2.0, 1.04, 0], [-1.04, 2.0, 0]])
    for velocities, wanted in zip(simulation.velocities, expected, strict=True):
        # A turn of 1e-3 a step within which the ground's motion is a screw motion, exactly.
        np.testing.assert_allclose(velocities, wanted, atol=1e-8)


def donut(count=60, motion=None, **law):
    world = fs.World()
    ring = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
    motion = fs.Pose() if motion is None else motion
    world.add_body(fs.Body(ring, gravity=fs.Newtonian(), surface=fs.Material(radius=0.25), motion=motion))
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    where = 1.0 + 0.3 * np.cos(7 * angle)
    start = np.column_stack([where * np.cos(angle), where * np.sin(angle), 0.45 + 0.1 * np.sin(3 * angle)])
    world.add_particles(start, np.zeros((count, 3)), radius=BALL, contact=fs.Bounce(0.5, **law))
    return world


def test_an_hour_of_rest_on_the_donut_moves_nothing():
    simulation = fs.Simulation(donut(friction=1.0), fs.Leapfrog(2e-3), threads=1)
    simulation.advance(20.0)
    settled = simulation.positions[0].copy()
    resting = simulation.states[0] == fs.Status.RESTING
    # Where the pull leans by more than 45 degrees from the normal they slide on; most do not.
    held = resting & ~simulation.velocities[0].any(axis=1)
    assert held.sum() >= 50
    simulation.advance(3620.0)
    np.testing.assert_array_equal(simulation.positions[0][held], settled[held])
    surface = fs.Field(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), fs.Gaussian(8.0), 8.0 / np.sqrt(np.pi) * np.exp(4.0))
    inward = surface.gradient(settled[held])
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    np.testing.assert_allclose(surface.value(settled[held] + BALL * inward), 1.0, atol=2e-9)


def test_pebbles_ride_on_a_spinning_donut():
    rate = 0.1
    simulation = fs.Simulation(donut(12, motion=fs.Spin(rate=rate), friction=1.0), fs.Leapfrog(2e-3), threads=1)
    simulation.advance(12.0)

    def in_its_frame():
        angle = -rate * simulation.time
        cosine, sine = np.cos(angle), np.sin(angle)
        return simulation.positions[0] @ np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]).T

    settled = in_its_frame()
    simulation.advance(20.0)
    drift = np.linalg.norm(in_its_frame() - settled, axis=1)
    assert (drift < 1e-11).sum() >= 10
    held = drift < 1e-11
    expected = np.cross([0, 0, rate], simulation.positions[0])
    np.testing.assert_allclose(simulation.velocities[0][held], expected[held], atol=1e-11)


def test_a_stuck_pebble_slides_once_a_moving_pull_leans_too_far():
    def tilt(time):
        return FAR * np.array([np.sin(0.1 * time), 0.0, 1.0 - np.cos(0.1 * time)])

    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, -FAR)), gravity=fs.Newtonian(), mass=FAR**2, motion=tilt))
    world.add_body(fs.Body(fs.Plane((0, 0, 0), (0, 0, 1)), surface=fs.Material(radius=GROUND)))
    simulation = run(world, (0, 0, 0), fs.Bounce(0.3, friction=0.2), 0.5, dt=1e-2)
    slips = 10.0 * np.arctan(0.2)
    simulation.advance(slips - 0.011)
    np.testing.assert_array_equal(simulation.positions[0][0, :2], 0.0)
    simulation.advance(slips + 0.02)
    assert simulation.velocities[0][0, 0] > 0.0


def test_contact_does_not_depend_on_threads_or_launches(monkeypatch):
    ends = []
    for steps, threads in ((256, 1), (7, 2)):
        monkeypatch.setattr(simulations, "LAUNCH_STEPS", steps)
        simulation = fs.Simulation(donut(friction=0.4), fs.Leapfrog(2e-3), threads=threads)
        simulation.advance(4.0)
        events = simulation.events
        ends.append([*simulation.positions, *simulation.velocities, events.times, events.impulses, events.kinds])
    assert len(ends[0][2]) > 100
    for one, other in zip(*ends, strict=True):
        np.testing.assert_array_equal(one, other)


def test_contact_goes_on_from_where_it_was_broken_off(monkeypatch):
    whole, broken = (fs.Simulation(donut(friction=0.4), fs.Leapfrog(2e-3), threads=1) for _ in range(2))
    launch = simulations.launch_groups

    def interrupted(*args, **options):
        launch(*args, **options)
        raise KeyboardInterrupt

    # While many slide: what is known of their contacts, too, is of the time before.
    for simulation in (whole, broken):
        simulation.advance(2.0)
    with monkeypatch.context() as patch:
        patch.setattr(simulations, "launch_groups", interrupted)
        with pytest.raises(KeyboardInterrupt):
            broken.advance(2.5)
    for simulation in (whole, broken):
        simulation.advance(3.0)
    for one, other in zip(whole.positions + whole.velocities, broken.positions + broken.velocities, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"restitution": 1.5}, "restitution is 1.5"),
        ({"friction": -0.1}, "friction is -0.1"),
        ({"friction": float("nan")}, "friction is nan"),
        ({"rolling": True}, "rolling without friction"),
    ],
)
def test_laws_without_meaning_are_refused(options, words):
    with pytest.raises(fs.InputError, match=words):
        fs.Bounce(**options)


def test_a_sphere_that_rolls_around_a_planet_keeps_its_energy_and_its_ground():
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), surface=fs.Material(radius=0.5)))
    law = fs.Bounce(0.3, friction=1.0, rolling=True)
    world.add_particles([(0.52, 0, 0)], [(0, 0.7, 0.2)], radius=BALL, contact=law)
    simulation = fs.Simulation(world, fs.Leapfrog(1e-3), threads=1)
    simulation.advance(0.2)

    def energy():
        x, v, spin = simulation.positions[0][0], simulation.velocities[0][0], simulation.spins[0][0]
        return 0.5 * v @ v + 0.2 * BALL**2 * spin @ spin - 1 / np.linalg.norm(x)

    # Slipping took what it takes of a ball without spin: 2/7 of the kinetic energy.
    before = energy()
    assert before == pytest.approx(0.5 * 5 / 7 * 0.53 - 1 / 0.52, abs=1e-4)
    simulation.advance(20.0)
    slip = simulation.velocities[0][0] - BALL * np.cross(simulation.spins[0][0], simulation.positions[0][0] / 0.52)
    np.testing.assert_allclose(slip, 0.0, atol=1e-9)
    assert np.linalg.norm(simulation.positions[0]) == pytest.approx(0.52, abs=1e-10)
    # At one speed around a sphere nothing is lost but by rounding.
    assert energy() == pytest.approx(before, abs=1e-12)


@pytest.mark.parametrize(("rate", "holds"), [(1.45, True), (1.63, False)])
def test_a_pebble_is_flung_off_its_latitude_where_the_planet_spins_too_fast(rate, holds):
    # At 45 degrees w^2 r / 2 is needed along the ground and taken off the weight: w = 1.54 for friction 0.2.
    world = fs.World()
    surface = fs.Material(radius=0.5)
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), surface=surface, motion=fs.Spin(rate=rate)))
    place = 0.52 * np.sqrt(0.5) * np.array([1.0, 0.0, 1.0])
    velocity = np.cross([0, 0, rate], place)
    world.add_particles([place], [velocity], radius=BALL, contact=fs.Bounce(0.3, friction=0.2))
    simulation = fs.Simulation(world, fs.Leapfrog(1e-3), threads=1)
    simulation.advance(1.0)
    latitude = np.degrees(np.arcsin(simulation.positions[0][0, 2] / 0.52))
    assert np.linalg.norm(simulation.positions[0]) == pytest.approx(0.52, abs=1e-9)
    assert latitude == pytest.approx(45.0, abs=1e-6) if holds else latitude < 44.0
