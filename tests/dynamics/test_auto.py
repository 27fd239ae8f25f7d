"""`Auto` keeps its tolerance whatever moves, foresees passages within its flight ahead, or says what it does not."""

import math

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics import auto, trials


def binary(motion, **options):
    """Two masses about each other, and a particle that passes one of them at a distance of 0.04 at the time 33."""
    world = fs.World(**options)
    for sign in (-1, 1):
        place, how = motion(sign)
        world.add_body(fs.Body(fs.Point(place), gravity=fs.Newtonian(), motion=how))
    world.add_particles([(3, 0, 0)], [(0, 0.7, 0)])
    return world


def turning(sign):
    return (0.5 * sign, 0, 0), fs.Spin(rate=1.0)


def moved(sign):
    return (0, 0, 0), lambda time: (0.5 * sign * math.cos(time), 0.5 * sign * math.sin(time), 0.0)


def pair(e, free=False):
    """Two equal masses on an orbit of semi-major axis 1 and eccentricity e, from its far end; a period is 2 pi."""
    speed, world = 0.5 * math.sqrt((1 - e) / (1 + e)), fs.World()
    x, v = np.array([(0.5 + 0.5 * e, 0, 0)]), np.array([(0, speed, 0)])
    if not free:
        world.add_particles(np.concatenate([x, -x]), np.concatenate([v, -v]), gravity=fs.Newtonian(), mass=0.5)
    for sign in (-1, 1) if free else ():
        motion = fs.Rigid(sign * x[0], velocity=sign * v[0])
        world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), mass=0.5, motion=motion))
    return world


def drift(simulation, until, looks=12):
    """The largest drift of what an `EnergyLog` follows."""
    log = fs.EnergyLog(simulation)
    for time in np.linspace(simulation.time, until, looks + 1)[1:]:
        simulation.advance(time)
        log.record()
    report = log.report()
    return max([report.largest, *(total.largest for total in report.totals if total.quantity == "energy")])


@pytest.mark.parametrize("options", [{}, {"escape_radius": 500.0}], ids=["bounded", "escape"])
def test_a_passage_of_turning_bodies_is_foreseen(options):
    simulation = fs.Simulation(binary(turning, **options), fs.Auto(1e-10))
    assert drift(simulation, 36.0) < 1e-9
    assert simulation.choice.caveat == ""


@pytest.mark.full
def test_a_passage_of_bodies_that_move_in_a_way_of_their_own_is_foreseen():
    world = binary(moved)
    simulation, exact = fs.Simulation(world, fs.Auto(1e-8)), fs.Simulation(world, fs.Radau(1e-11))
    simulation.advance(36.0)
    exact.advance(36.0)
    one, other = (fs.energy(run.snapshot()) for run in (simulation, exact))
    assert abs(one.total - other.total)[0] < 1e-7 * (other.kinetic - other.potential)[0]


@pytest.mark.parametrize(("free", "tolerance"), [(False, 1e-5), (False, 1e-11), (True, 1e-5), (True, 1e-9)])
def test_what_pulls_each_other_keeps_the_tolerance(free, tolerance):
    simulation = fs.Simulation(pair(0.5, free), fs.Auto(tolerance))
    assert simulation.choice.error <= tolerance
    assert not (free and any(simulation.integrator.gradients))
    assert drift(simulation, 20.0) < 4.0 * tolerance
    if not free:
        simulation.advance(10 * 2 * math.pi)
        np.testing.assert_allclose(simulation.positions[0][0], (0.75, 0, 0), atol=2e3 * tolerance)


def test_a_planet_and_particles_that_pull():
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian()))
    world.add_particles([(2, 0, 0), (-3, 0, 0)], [(0, 0.7, 0), (0, -0.55, 0)], gravity=fs.Newtonian(), mass=1e-3)
    world.add_particles([(0, 4, 0)], [(0.5, 0, 0)])
    simulation = fs.Simulation(world, "auto")
    assert drift(simulation, 30.0) < 1e-7


def test_a_passage_after_the_trial_is_met_on_the_flight_ahead(monkeypatch):
    # The trial sees a tenth of the first orbit, away from the pericentre.
    short = fs.Auto(1e-7, span=0.6)
    simulation = fs.Simulation(pair(0.9), short)
    assert drift(simulation, 12.0, 60) < 1e-6
    assert simulation.choice.until == pytest.approx(18.0)
    # Without a flight, a warning says what is not known.
    monkeypatch.setattr(auto, "FLIGHT", 0)
    with pytest.warns(fs.FieldsimWarning, match=r"a flight ahead would take long, so that what comes after time 0 "):
        careless = fs.Simulation(pair(0.9), short)
    assert careless.choice.caveat in str(careless.choice)
    assert careless.choice.cost < 0.5 * simulation.choice.cost


def test_a_flight_that_nothing_mends_is_told_of():
    method = fs.Auto(1e-7, span=0.6, candidates=(fs.Leapfrog,))
    with pytest.warns(fs.FieldsimWarning, match=r"after time \d.* keeps the tolerance no more") as told:
        simulation = fs.Simulation(pair(0.99), method)
    assert len(told) == 1
    assert simulation.choice.until < math.pi


def test_free_bodies_that_touch_take_steps_that_resolve_it():
    world = fs.World()
    for sign in (-1, 1):
        motion = fs.Rigid((sign, 0, 0), velocity=(-0.5 * sign, 0, 0))
        world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(radius=0.3), motion=motion))
    with pytest.warns(fs.FieldsimWarning, match="steps through contacts were not tried"):
        simulation = fs.Simulation(world, "auto")
    assert simulation.integrator.dt <= simulation.bodies.longest_step


def test_too_many_that_pull_are_refused_by_number(monkeypatch):
    monkeypatch.setattr(auto, "MOST_PULLING", 11)
    world = fs.World()
    world.add_particles(np.random.default_rng(0).normal(size=(12, 3)), np.zeros((12, 3)), gravity=fs.Newtonian(0.1))
    with pytest.raises(fs.InputError, match=r"Auto: 12 particles pull each other, .* fs\.BlanesMoan6"):
        fs.Simulation(world, "auto")


def test_candidates_that_cannot_move_a_world_are_refused_in_words():
    world = fs.World()
    world.add_particles([(1, 0, 0), (-1, 0, 0)], [(0, 0.5, 0), (0, -0.5, 0)], contact=fs.Bounce())
    with pytest.raises(fs.InputError, match=r"no candidate can move this world: particles of set 0 have contact"):
        fs.Simulation(world, fs.Auto(candidates=(fs.Radau,)))


def test_samples_lose_nothing():
    rng = np.random.default_rng(0)
    world = fs.World(fog=fs.Fog(0.1), escape_radius=9.0)
    world.add_shape(fs.Ball((0, 0, 0), 1.0))
    world.add_particles(rng.normal(size=(100, 3)), np.zeros((100, 3)), name="dust")
    world.add_particles(rng.normal(size=(70, 3)), np.zeros((70, 3)), gravity=fs.Newtonian(0.1), mass=0.1)
    few = trials.sampled(world)
    assert [len(particles) for particles in few.particles] == [trials.SAMPLE, 70]
    assert (few.shapes, few.fog, few.escape_radius) == (world.shapes, world.fog, 9.0)
    assert few.particles[0].name == "dust"
    assert {tuple(x) for x in few.particles[0].positions} <= {tuple(x) for x in world.particles[0].positions}
