"""Leapfrog through still, moving and deforming sources: orbits, order, reversibility, reproducibility, bad input."""

import itertools
import math

import numpy as np
import pytest

from fieldsim.dynamics import simulation as module
from fieldsim.dynamics.integrators.splittings import Leapfrog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import FieldsimError, InputError
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce
from fieldsim.world.material import Material
from fieldsim.world.motion import Keyframes, Pose, Spin
from fieldsim.world.world import World

SUN = Point((0.0, 0.0, 0.0))


def world_of(*bodies, positions=((1.0, 0, 0),), velocities=((0, 1.0, 0),), **options):
    world = World()
    for body in bodies:
        world.add_body(body)
    world.add_particles(positions, velocities, **options)
    return world


def end_of(world, dt, until, **options):
    simulation = Simulation(world, Leapfrog(dt), **options)
    simulation.advance(until)
    return simulation.positions[0], simulation.velocities[0]


@pytest.mark.parametrize("eccentricity", [0.0, 0.5])
def test_kepler_orbits_close(eccentricity):
    # Semi-major axis 1, GM 1, from apocentre.
    far = 1.0 + eccentricity
    speed = math.sqrt((1.0 - eccentricity) / far)
    world = world_of(Body(SUN, gravity=Newtonian()), positions=[(far, 0, 0)], velocities=[(0, speed, 0)])
    x, _ = end_of(world, 2 * math.pi / 20_000, 2 * math.pi)
    # The phase error of an orbit is about (2 pi)^3 / 24 (dt / period)^2 for the circle, more for the ellipse.
    np.testing.assert_allclose(x, [(far, 0, 0)], atol=1e-6)


def test_leapfrog_is_of_second_order_and_exact_for_a_constant_pull():
    assert Leapfrog.order == 2
    world = world_of(Body(Segment((-1, 0, 0), (1, 0, 0)), gravity=Newtonian()), positions=[(0.5, 0.8, 0.3)])
    reference, _ = end_of(world, 1 / 8192, 2.0)
    errors = [np.abs(end_of(world, dt, 2.0)[0] - reference).max() for dt in (1 / 64, 1 / 128, 1 / 256)]
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(slopes, 2.0, atol=0.2)


def test_motion_is_reversible():
    rng = np.random.default_rng(0)
    start, velocity = 2.0 * rng.normal(size=(20, 3)), 0.5 * rng.normal(size=(20, 3))
    bar = Body(Segment((-1, 0, 0), (1, 0, 0)), gravity=Newtonian(0.1))
    x, v = end_of(world_of(bar, positions=start, velocities=velocity), 1e-3, 3.0)
    back, _ = end_of(world_of(bar, positions=x, velocities=-v), 1e-3, 3.0)
    # 6000 steps of rounding, amplified by the flow.
    np.testing.assert_allclose(back, start, atol=1e-10)


def spinning_world():
    rng = np.random.default_rng(1)
    bar = Body(
        Segment((-1, 0, 0), (1, 0, 0)),
        gravity=Newtonian(),
        surface=Material(radius=0.2),
        motion=Spin(axis=(0, 1, 3), rate=0.8),
    )
    start = rng.normal(size=(200, 3))
    start *= (rng.uniform(1.4, 2.5, 200) / np.linalg.norm(start, axis=1))[:, None]
    return world_of(bar, positions=start, velocities=0.4 * rng.normal(size=(200, 3)), contact=Bounce(0.5))


def test_threads_and_the_length_of_launches_do_not_change_a_byte(monkeypatch):
    ends = []
    for threads, steps in ((1, 256), (2, 256), (2, 17)):
        monkeypatch.setattr(module, "LAUNCH_STEPS", steps)
        simulation = Simulation(spinning_world(), Leapfrog(2e-3), threads=threads)
        simulation.advance(2.0)
        assert simulation.bounces > 20
        ends.append((simulation.positions[0].tobytes(), simulation.velocities[0].tobytes(), simulation.bounces))
    assert ends[0] == ends[1] == ends[2]


def test_sets_that_do_not_collide_move_as_in_a_world_without_surfaces():
    bar = dict(skeleton=Segment((-1, 0, 0), (1, 0, 0)), gravity=Newtonian())
    plain, _ = end_of(world_of(Body(**bar), positions=[(0, 1.0, 0.2)]), 1e-3, 3.0)
    both = world_of(Body(**bar, surface=Material(radius=0.2)), positions=[(0, 1.0, 0.2)])
    both.add_particles([(0.1, 1.0, 0.2)], [(0, 0, 0)], contact=Bounce(0.5))
    through, _ = end_of(both, 1e-3, 3.0)
    np.testing.assert_array_equal(plain, through)


@pytest.mark.parametrize(
    "body",
    [
        Body(Segment((-1, 0, 0), (1, 0, 0)), gravity=Newtonian(), motion=lambda t: Pose.turned((0, 0, 1), 0.6 * t)),
        Body(
            Segment(
                lambda t: (-math.cos(0.6 * t), -math.sin(0.6 * t), 0),
                lambda t: (math.cos(0.6 * t), math.sin(0.6 * t), 0),
            ),
            gravity=Newtonian(),
        ),
    ],
    ids=["pose", "skeleton"],
)
def test_a_spin_a_function_of_time_and_a_moving_skeleton_are_the_same_motion(body):
    spun = Body(Segment((-1, 0, 0), (1, 0, 0)), gravity=Newtonian(), motion=Spin(rate=0.6))
    # Beside the rod's end: on it, where the potential is infinite, no motion is defined.
    expected, _ = end_of(world_of(spun, positions=[(1.1, 0, 0)]), 1e-2, 3.0)
    x, _ = end_of(world_of(body, positions=[(1.1, 0, 0)]), 1e-2, 3.0)
    np.testing.assert_allclose(x, expected, atol=1e-12)


def test_moving_sources_are_seen_at_the_right_times():
    # A particle that starts as a source does, both in free fall with it, stays with it to second order.
    fall = Keyframes([0.0, 100.0], [(0, 0, 0), (300.0, 0, 0)], interpolation="linear")
    moving = world_of(Body(SUN, gravity=Newtonian(), motion=fall), velocities=[(3.0, 1.0, 0)])
    resting = world_of(Body(SUN, gravity=Newtonian()))
    (moved, _), (stayed, _) = end_of(moving, 1e-3, 5.0), end_of(resting, 1e-3, 5.0)
    np.testing.assert_allclose(moved - (15.0, 0, 0), stayed, atol=1e-11)  # Galileo, to rounding


def test_still_and_moving_bodies_pull_together():
    still = Body(Point((3.0, 0, 0)), gravity=Newtonian(), mass=2.0)
    waiting = Body(SUN, gravity=Newtonian(), motion=lambda time: (0.0, 0.0, 0.0))
    both, _ = end_of(world_of(still, waiting), 1e-2, 2.0)
    fixed, _ = end_of(world_of(still, Body(SUN, gravity=Newtonian())), 1e-2, 2.0)
    np.testing.assert_allclose(both, fixed, atol=1e-13)


def test_whole_steps_land_on_the_time_asked_for():
    world = world_of(Body(SUN, gravity=Newtonian()))
    simulation = Simulation(world, Leapfrog(0.1), time=1.0)
    simulation.advance(1.0)
    assert simulation.steps_done == 0
    simulation.advance(1.3)  # 0.3 / 0.1 is not quite 3 in binary
    assert (simulation.time, simulation.steps_done) == (1.3, 3)
    simulation.advance(1.55)
    assert (simulation.time, simulation.steps_done) == (1.55, 6)
    snapshots = list(itertools.islice(simulation.snapshots([2.0, 3.0]), 2))
    assert [s.time for s in snapshots] == [2.0, 3.0]
    assert snapshots[0].positions[0].shape == (1, 3)
    assert not np.array_equal(snapshots[0].positions[0], snapshots[1].positions[0])


def test_worlds_without_bodies_or_without_particles():
    x, _ = end_of(world_of(velocities=[(1.0, 2.0, 3.0)]), 0.1, 2.0)
    np.testing.assert_allclose(x, [(3.0, 4.0, 6.0)], atol=1e-14)
    empty = Simulation(World())
    empty.advance(5.0)
    assert (empty.time, empty.positions, empty.snapshot().positions, empty.bounces) == (5.0, (), (), 0)


@pytest.mark.parametrize("dt", [0.0, -1.0, math.nan, math.inf, "soon"])
def test_a_bad_step_is_refused(dt):
    with pytest.raises(InputError, match="Leapfrog: dt"):
        Leapfrog(dt)


def test_bad_times_and_integrators_are_refused():
    world = world_of(Body(SUN, gravity=Newtonian()))
    simulation = Simulation(world, Leapfrog(0.1), time=1.0)
    with pytest.raises(InputError, match="before the present time"):
        simulation.advance(0.5)
    with pytest.raises(InputError, match="until is nan"):
        simulation.advance(math.nan)
    with pytest.raises(InputError, match="integrator"):
        Simulation(world, 0.1)
    with pytest.raises(InputError, match="too short"):
        Simulation(world, Leapfrog(1e-300)).advance(1.0)


def test_bad_particles_are_refused():
    for positions in ([(math.nan, 0, 0)], [(0, 0)], "here"):
        with pytest.raises(InputError, match="Particles: positions"):
            world_of(positions=positions)


def test_a_motion_that_gives_nonsense_is_named():
    world = world_of(Body(SUN, gravity=Newtonian(), motion=lambda t: (math.nan if t > 0.5 else t, 0, 0), name="moon"))
    simulation = Simulation(world, Leapfrog(0.01))
    with pytest.raises(InputError, match=r"Body 0 \(moon\).*finite"):
        simulation.advance(1.0)


def test_particles_that_leave_the_numbers_are_reported():
    world = world_of(Body(SUN, gravity=Newtonian()), velocities=[(1e60, 0, 0)], positions=[(1, 0, 0)])
    simulation = Simulation(world, Leapfrog(1e250))
    with pytest.raises(FieldsimError, match="particle 0 of set 0"):
        simulation.advance(2e250)
