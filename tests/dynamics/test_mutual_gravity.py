"""Particles that pull each other: two-body orbits, what a cluster keeps, order, and what is refused."""

import math

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics.splitting import mutual_gravity
from fieldsim.dynamics.splitting.mutual_gravity import potential_kernel, stage_kernels, steps_kernel

LAW = fs.Newtonian(softening=0.05)


def cluster(count=12):
    rng = np.random.default_rng(4)
    world = fs.World()
    world.add_body(fs.Body(fs.Segment((-1, 0, 0), (1, 0, 0)), gravity=fs.Newtonian(0.2), mass=0.5))
    world.add_particles(rng.normal(size=(count, 3)), 0.3 * rng.normal(size=(count, 3)), gravity=LAW, mass=0.1)
    return world


def energy(simulation):
    """Of all particles, of mass 0.1 each."""
    return 0.1 * fs.energy(simulation.snapshot()).total.sum()


def test_two_particles_circle_each_other():
    world = fs.World()
    speed = math.sqrt(1.5 / 2.0)  # of the pair with masses 1 and 0.5, 2 apart: v^2 = G M / r
    world.add_particles([(0, 0, 0)], [(0, -speed / 3, 0)], gravity=fs.Newtonian(), mass=1.0)
    world.add_particles([(2, 0, 0)], [(0, 2 * speed / 3, 0)], gravity=fs.Newtonian(), mass=0.5)
    period = 2 * math.pi * 2.0 / speed
    simulation = fs.Simulation(world, fs.Leapfrog(period / 4000))
    simulation.advance(period)
    # Leapfrog's error is of second order in 2 pi / 4000: 2.5e-6, times the turn by 2 pi.
    np.testing.assert_allclose(np.concatenate(simulation.positions), [(0, 0, 0), (2, 0, 0)], atol=2e-5)


def test_momentum_is_kept_and_energy_swings_with_dt_squared():
    swings = []
    for dt in (4e-3, 2e-3, 1e-3):
        simulation = fs.Simulation(cluster(), fs.Leapfrog(dt))
        start, drift = energy(simulation), 0.0
        for time in np.arange(0.1, 1.05, 0.1):
            simulation.advance(time)
            drift = max(drift, abs(energy(simulation) - start))
        swings.append(drift)
    np.testing.assert_allclose(np.log2(np.divide(swings[:-1], swings[1:])), 2.0, atol=0.2)
    alone = cluster()
    alone.bodies = ()
    simulation = fs.Simulation(alone, fs.Leapfrog(2e-3))
    before = simulation.velocities[0].sum(axis=0)
    simulation.advance(2.0)
    np.testing.assert_allclose(simulation.velocities[0].sum(axis=0), before, atol=1e-13)


@pytest.mark.parametrize("method", [fs.Chin4, fs.Omelyan4, fs.Omelyan6])
def test_force_gradients_of_particles_that_pull_keep_their_order(method):
    """The error of a step against many short ones falls with the method's order; without its gradient, with 2."""
    ends = []
    for dt in (0.04, 0.02, 1e-3):
        simulation = fs.Simulation(cluster(5), method(dt))
        simulation.advance(0.4)
        ends.append(np.concatenate(simulation.positions + simulation.velocities))
    errors = [np.abs(end - ends[-1]).max() for end in ends[:-1]]
    assert math.log2(errors[0] / errors[1]) > method.order - 0.4


def test_each_particle_may_have_a_mass_of_its_own():
    rng = np.random.default_rng(5)
    places, speeds, masses = rng.normal(size=(4, 3)), 0.2 * rng.normal(size=(4, 3)), np.array([0.3, 0.0, -0.1, 0.5])
    one, many = fs.World(), fs.World()
    one.add_particles(places, speeds, gravity=LAW, mass=masses)
    for place, speed, mass in zip(places, speeds, masses, strict=True):
        many.add_particles([place], [speed], gravity=LAW, mass=mass)
    ends = []
    for world in (one, many):
        simulation = fs.Simulation(world, fs.Omelyan4(0.02))
        simulation.advance(0.5)
        ends.append(np.concatenate(simulation.positions))
    np.testing.assert_array_equal(*ends)
    before, after = (masses @ fs.energy(s.snapshot()).total for s in (fs.Simulation(one), simulation))
    assert abs(after - before) < 1e-6 * abs(before)
    assert one.particles[0].mass.tolist() == masses.tolist()
    for wrong in ([1.0, 2.0], [1.0, 2.0, 3.0, math.nan], "heavy"):
        with pytest.raises(fs.InputError, match="Particles: mass"):
            one.add_particles(places, speeds, gravity=LAW, mass=wrong)


def test_test_particles_feel_those_that_pull_and_not_each_other():
    world = fs.World()
    world.add_particles([(0, 0, 0)], [(0, 0, 0)], gravity=LAW, mass=1.0)
    world.add_particles([(1, 0, 0), (1, 1e-3, 0)], [(0, 1, 0), (0, 1, 0)])
    simulation = fs.Simulation(world, fs.Leapfrog(1e-2))
    simulation.advance(1.0)
    np.testing.assert_array_equal(simulation.positions[0], 0.0)
    fixed = fs.World()
    fixed.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=LAW))
    fixed.add_particles(world.particles[1].positions, world.particles[1].velocities)
    other = fs.Simulation(fixed, fs.Leapfrog(1e-2))
    other.advance(1.0)
    np.testing.assert_allclose(simulation.positions[1], other.positions[0], atol=1e-13)


def test_threads_do_not_change_a_byte():
    ends = []
    for threads in (1, 2):
        simulation = fs.Simulation(cluster(80), fs.Leapfrog(1e-2), threads=threads)
        simulation.advance(0.2)
        ends.append(simulation.positions[0].tobytes())
    assert ends[0] == ends[1]


@pytest.mark.parametrize("method", [fs.BlanesMoan6, fs.Omelyan4])
def test_a_few_are_moved_as_many_are(monkeypatch, method):
    world = cluster()
    world.add_particles([(1, 2, 0)], [(0, 0.2, 0)])
    ends = []
    for few in (mutual_gravity.FEW_PAIRS, 0):
        monkeypatch.setattr(mutual_gravity, "FEW_PAIRS", few)
        simulation = fs.Simulation(world, method(0.05))
        simulation.advance(2.0)
        ends.append(np.concatenate(simulation.positions + simulation.velocities))
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-13)


def test_what_does_not_go_together_is_refused():
    world = cluster()
    world.add_particles([(3, 3, 3)], [(0, 0, 0)], gravity=fs.Cauchy())
    with pytest.raises(fs.InputError, match="different kernels"):
        fs.Simulation(world)
    world = cluster()
    world.add_particles([(3, 3, 3)], [(0, 0, 0)], contact=fs.Bounce(0.5))
    with pytest.raises(fs.InputError, match="both pull each other and collide"):
        fs.Simulation(world)
    with pytest.raises(fs.InputError, match="Particles: gravity is 1"):
        world.add_particles([(0, 0, 0)], [(0, 0, 0)], gravity=1)


def test_kernels_compile_for_cuda(compiles_for_cuda):
    kinds = fs.Simulation(cluster())._gravity.kinds_used
    code = kinds, fs.Newtonian, True, 1
    for kernel in (*stage_kernels(*code), steps_kernel(*code), potential_kernel(fs.Newtonian)):
        compiles_for_cuda(kernel.module)
