"""Restitution and friction of free bodies: closed forms, rest to rounding, and what is kept all the same."""

import math

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics import simulation as module
from fieldsim.dynamics.rigid.diagnostics import body_angular_momentum, body_energy, body_momentum

# The pull's far source has a large potential energy, which no fall from here can use.
pytestmark = pytest.mark.filterwarnings("ignore:free bodies. the hardest contact:fieldsim.FieldsimWarning")
ORIGIN = fs.Point((0, 0, 0))
FAR, R = 1e6, 0.3
RING = fs.Circle((0, 0, 0), (0, 0, 1), 0.3)
STILL = fs.Pose()


def ball(place, *, velocity=(0, 0, 0), mass=1.0, stiffness=1e5, spin=(0, 0, 0), **law):
    motion = fs.Rigid(place, velocity=velocity, angular_velocity=spin, inertia="solid", stiffness=stiffness, **law)
    return fs.Body(ORIGIN, mass=mass, surface=fs.Material(radius=R), motion=motion)


def ring(height=0.101, *, velocity=(0, 0, 0), **law):
    """A flat body, which does not roll."""
    motion = fs.Rigid((0, 0, height), velocity=velocity, inertia="solid", stiffness=1e6, **law)
    return fs.Body(RING, mass=1.0, surface=fs.Material(radius=0.1), motion=motion)


def world_on_ground(*bodies, slope=0.0, motion=STILL, ground=None):
    """Bodies on a flat ground under a pull of 1, which leans by the angle `slope` towards x."""
    sky = fs.Point((FAR * math.sin(slope), 0, -FAR * math.cos(slope)))
    ground = ground or fs.Plane((0, 0, -0.3), (0, 0, 1))
    radius = 3.0 if isinstance(ground, fs.Point) else 0.3
    world = fs.World()
    world.add_body(fs.Body(sky, gravity=fs.Newtonian(), mass=FAR**2))
    world.add_body(fs.Body(ground, surface=fs.Material(radius=radius), motion=motion))
    for body in bodies:
        world.add_body(body)
    return world


def run(world, *times, dt=1e-3):
    simulation = fs.Simulation(world, fs.Leapfrog(dt))
    found = []
    for time in times:
        simulation.advance(time)
        found.append((simulation.bodies.centers, simulation.bodies.momenta, simulation.bodies.angular_velocities))
    return simulation, found


def sums(bodies):
    return np.concatenate([body_momentum(bodies).sum(axis=0), body_angular_momentum(bodies).sum(axis=0)])


# Restitution


@pytest.mark.parametrize("speed", [0.02, 0.2, 1.0])
@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9])
def test_a_central_hit_leaves_at_the_restitution(restitution, speed):
    world = fs.World()
    one = {"restitution": restitution, "stiffness": 1e7}
    world.add_body(ball((-0.31, 0, 0), velocity=(speed, 0, 0), **one))
    world.add_body(ball((0.31, 0, 0), velocity=(-speed, 0, 0), mass=2.0, **one))
    simulation = fs.Simulation(world, fs.Leapfrog(2e-4 / max(speed, 0.1)))
    bodies = simulation.bodies
    energy, start = body_energy(bodies).total, sums(bodies)
    simulation.advance(0.15 / speed + 0.02 / (restitution * speed))
    v = bodies.momenta[:, 0] / bodies.masses
    assert (v[1] - v[0]) / (2 * speed) == pytest.approx(restitution, rel=0.01)
    np.testing.assert_allclose(sums(bodies), start, atol=1e-14)
    end = body_energy(bodies)
    assert end.potential == 0.0
    # Of the relative motion's energy, m v^2 / 2 with the reduced mass 2/3, the share 1 - e^2 is lost.
    assert end.lost == pytest.approx(0.5 * 2 / 3 * (2 * speed) ** 2 * (1 - restitution**2), rel=0.02)
    assert end.total + end.lost == pytest.approx(energy, rel=1e-3)


def test_the_softer_of_two_decides():
    world = fs.World()
    world.add_body(ball((-0.31, 0, 0), velocity=(1, 0, 0), stiffness=1e7, restitution=0.4))
    world.add_body(ball((0.31, 0, 0), velocity=(-1, 0, 0), stiffness=1e7))
    bodies = run(world, 0.3, dt=2e-4)[0].bodies
    assert bodies.momenta[1, 0] - bodies.momenta[0, 0] == pytest.approx(2 * 0.4, rel=0.01)


def test_an_oblique_hit_with_friction_keeps_what_both_share():
    world = fs.World()
    law = {"restitution": 0.6, "friction": 0.4}
    world.add_body(ball((-0.31, 0, 0), velocity=(1, 0.3, -0.2), spin=(1, 5, -2), **law))
    world.add_body(ball((0.31, 0.1, 0.05), velocity=(-1, 0, 0.4), mass=2.0, **law))
    simulation = fs.Simulation(world, fs.Leapfrog(5e-4))
    start, spins = sums(simulation.bodies), simulation.bodies.spins
    simulation.advance(0.3)
    np.testing.assert_allclose(sums(simulation.bodies), start, atol=1e-14)
    assert np.abs(simulation.bodies.spins - spins).min(axis=1).max() > 1e-3


def test_energy_and_what_was_lost_keep_the_order_of_the_method():
    world = world_on_ground(ball((0, 0, 0.301), velocity=(1, 0, -1), stiffness=1e4, restitution=0.5, friction=0.3))
    swings = []
    for dt in (2e-3, 1e-3, 5e-4):
        simulation = fs.Simulation(world, fs.Leapfrog(dt))
        start, most = body_energy(simulation.bodies).total, 0.0
        for time in np.linspace(0.02, 0.6, 30):
            simulation.advance(time)
            now = body_energy(simulation.bodies)
            most = max(most, abs(now.total + now.lost - start))
        swings.append(most)
    np.testing.assert_allclose(np.log2(np.divide(swings[:-1], swings[1:])), 2.0, atol=0.2)
    assert now.lost > 0.3


def test_a_log_counts_what_was_lost_as_kept():
    simulation = fs.Simulation(world_on_ground(ball((0, 0, 0.35), restitution=0.3, friction=0.3)), fs.Leapfrog(1e-3))
    log = fs.EnergyLog(simulation)
    for time in (0.2, 0.4, 0.6):
        simulation.advance(time)
        log.record()
    assert simulation.bodies.lost > 0.04
    assert log.report().totals[0].quantity == "energy"
    assert max(log.totals[0].drifts) < 1e-9  # of a potential energy of 1e6


# Friction


def test_what_lies_on_a_slope_below_the_angle_of_friction_stays():
    """Not a creep: to rounding, it does not move at all."""
    law = {"restitution": 0.3, "friction": 0.5}
    below = world_on_ground(ring(**law), slope=math.atan(0.5 * 0.99))
    _, ((settled, *_), (later, momenta, turning)) = run(below, 3.0, 6.0)
    np.testing.assert_allclose(later[0, :2], settled[0, :2], atol=1e-9)
    np.testing.assert_allclose(momenta, 0.0, atol=1e-8)
    np.testing.assert_allclose(turning, 0.0, atol=1e-6)


def test_above_that_angle_it_slides_as_coulomb_says():
    law = {"restitution": 0.3, "friction": 0.5}
    slope = math.atan(0.5 * 1.01) + 0.02
    _, ((_, before, _), (_, after, _)) = run(world_on_ground(ring(**law), slope=slope), 1.0, 2.0)
    wanted = math.sin(slope) - 0.5 * math.cos(slope)
    assert after[0, 0] - before[0, 0] == pytest.approx(wanted, rel=0.01)


def test_a_sliding_body_slows_by_mu_g_and_stops():
    world = world_on_ground(ring(velocity=(1, 0.5, 0), restitution=0.3, friction=0.4))
    _, ((_, one, _), (_, two, _), (x, three, _), (y, _, _)) = run(world, 1.0, 2.0, 4.0, 5.0)
    assert np.linalg.norm(one[0]) - np.linalg.norm(two[0]) == pytest.approx(0.4, rel=0.01)
    np.testing.assert_allclose(three, 0.0, atol=1e-7)
    np.testing.assert_allclose(y, x, atol=1e-7)


def test_a_sliding_ball_ends_rolling_with_five_sevenths_of_its_speed():
    world = world_on_ground(ball((0, 0, 0.301), velocity=(1, 0, 0), restitution=0.5, friction=0.3))
    _, ((_, p, turning),) = run(world, 1.3)
    assert p[0, 0] == pytest.approx(5 / 7, rel=0.01)
    assert turning[0, 1] * R == pytest.approx(p[0, 0], rel=5e-3)


def test_a_moving_belt_takes_bodies_along():
    """A flat one at its speed, a ball that begins to roll at 2/7 of it."""
    belt = fs.Keyframes([0, 100], [(0, 0, 0), (50, 0, 0)], interpolation="linear")
    law = {"restitution": 0.3, "friction": 0.3}
    _, ((_, p, _),) = run(world_on_ground(ring(**law), motion=belt), 3.0)
    np.testing.assert_allclose(p[0], (0.5, 0, 0), atol=1e-7)
    _, ((_, p, _),) = run(world_on_ground(ball((0, 0, 0.301), **law), motion=belt), 1.5)
    assert p[0, 0] == pytest.approx(0.5 * 2 / 7, rel=0.02)


def test_what_lies_on_the_pole_of_a_spinning_planet_turns_with_it():
    law = {"restitution": 0.3, "friction": 0.5}
    world = world_on_ground(ring(0.12, **law), motion=fs.Spin((0, 0, 1), 0.3), ground=fs.Point((0, 0, -3)))
    _, ((x, p, turning),) = run(world, 2.0)
    np.testing.assert_allclose(turning, [(0, 0, 0.3)], atol=1e-6)
    np.testing.assert_allclose(p, 0.0, atol=1e-6)
    assert abs(x[0, 0]) < 1e-6


# Rest


def test_a_ball_on_three_balls_stays():
    r = 0.602 / math.sqrt(3.0)
    law = {"restitution": 0.5, "friction": 0.5}
    angles = 2 * math.pi / 3 * np.arange(3)
    below = [ball((r * math.cos(a), r * math.sin(a), 0.301), **law) for a in angles]
    top = ball((0, 0, 0.303 + math.sqrt(0.602**2 - r * r)), **law)
    _, ((settled, *_), (later, momenta, _)) = run(world_on_ground(*below, top), 8.0, 10.0)
    assert later[3, 2] > 0.65
    np.testing.assert_allclose(later, settled, atol=1e-5)
    assert np.abs(momenta).max() < 1e-5


def test_a_stack_stays():
    law = {"restitution": 0.3, "friction": 0.5}
    _, ((settled, *_), (later, momenta, _)) = run(
        world_on_ground(*(ring(0.101 + 0.202 * k, **law) for k in range(3))), 2.0, 3.0
    )
    np.testing.assert_allclose(later, settled, atol=1e-8)
    assert np.abs(momenta).max() < 1e-7
    assert np.diff(later[:, 2]).min() > 0.17


# The run


def test_the_same_bytes_however_a_run_is_cut(monkeypatch):
    ends = []
    for steps in (256, 7):
        monkeypatch.setattr(module, "LAUNCH_STEPS", steps)
        world = world_on_ground(ball((0, 0, 0.301), velocity=(1, 0, -1), restitution=0.5, friction=0.3))
        simulation, _ = run(world, 0.5)
        bodies = simulation.bodies
        ends.append((bodies.centers.tobytes(), bodies.spins.tobytes(), bodies.lost))
    assert ends[0] == ends[1]


def test_a_body_without_a_moment_of_inertia_does_not_roll():
    """Its mass lies on a point: friction brings it to rest as it does a point mass."""
    motion = fs.Rigid((0, 0, 0.301), velocity=(1, 0, 0), stiffness=1e5, restitution=0.3, friction=0.5)
    point = fs.Body(ORIGIN, mass=1.0, surface=fs.Material(radius=R), motion=motion)
    _, ((_, p, _),) = run(world_on_ground(point), 4.0)
    assert abs(p[0, 0]) < 1e-3


def test_bad_laws_and_methods_are_refused():
    with pytest.raises(fs.InputError, match=r"Rigid: restitution is 1\.5; give a number in 0\.\.1"):
        fs.Rigid(restitution=1.5)
    with pytest.raises(fs.InputError, match="Rigid: friction"):
        fs.Rigid(friction=-0.1)
    world = world_on_ground(ball((0, 0, 0.4), friction=0.2))
    with pytest.raises(fs.InputError, match=r"Body 2 loses energy where it touches .*fs\.Leapfrog"):
        fs.Simulation(world, fs.BlanesMoan6(0.01))


def test_by_default_nothing_is_lost():
    simulation = fs.Simulation(world_on_ground(ball((0, 0, 0.4))), fs.BlanesMoan6(0.01))
    assert not simulation.bodies.lossy
    assert body_energy(simulation.bodies).lost == 0.0
