"""Particles that pull each other under Radau: all with one step, as exact as rounding, in step with REBOUND."""

import math

import numpy as np
import pytest

import fieldsim as fs
from benchmarks.celestial import GRAVITY, PLACES, SPEEDS, energy
from benchmarks.celestial import MASSES as SUNS
from fieldsim.dynamics.radau import shared_run
from fieldsim.dynamics.radau.shared_run import few_kernels, many_kernels
from fieldsim.dynamics.splitting.groups import ALONE

# The pythagorean problem of Burrau: masses at the corners of a triangle of sides 3, 4 and 5, at rest.
MASSES = np.array([3.0, 4.0, 5.0])
CORNERS = np.array([(1.0, 3.0, 0.0), (-2.0, -1.0, 0.0), (1.0, -1.0, 0.0)])

YEAR = 365.25


def simulation(masses, places, speeds, *, g=1.0, bodies=(), others=(), integrator=None, threads=1):
    world = fs.World()
    for body in bodies:
        world.add_body(body)
    world.add_particles(places, speeds, gravity=fs.Newtonian(), mass=masses, G=g)
    for place, speed in others:
        world.add_particles([place], [speed])
    return fs.Simulation(world, integrator or fs.Radau(), threads=threads)


def triangle(**options):
    return simulation(MASSES, CORNERS, np.zeros((3, 3)), **options)


def test_three_bodies_fall_together_and_keep_their_energy():
    run = triangle()
    start = energy(MASSES, CORNERS, np.zeros((3, 3)))
    # Passages at a hundredth, where kinetic energies are a hundred times the whole, and rounded.
    for time, error in ((5.0, 1e-12), (15.0, 1e-11), (40.0, 1e-10)):
        run.advance(time)
        assert abs(energy(MASSES, run.positions[0], run.velocities[0]) / start - 1) < error
    np.testing.assert_allclose(MASSES @ run.velocities[0], 0.0, atol=1e-11)
    # Szebehely & Peters 1967: in the end the lightest is thrown out, and the other two go round each other.
    run.advance(70.0)
    x = run.positions[0]
    assert np.linalg.norm(x[1] - x[2]) < 1.5
    assert np.linalg.norm(x[0] - x[1]) > 15.0


def test_three_bodies_are_where_rebound_has_them():
    rebound = pytest.importorskip("rebound")
    peer = rebound.Simulation()
    peer.integrator = "ias15"
    for mass, (x, y, z) in zip(MASSES, CORNERS, strict=True):
        peer.add(m=mass, x=x, y=y, z=z)
    run = triangle()
    for time, apart in ((1.0, 1e-14), (5.0, 1e-11), (10.0, 1e-9)):
        run.advance(time)
        peer.integrate(time)
        np.testing.assert_allclose(run.positions[0], [p.xyz for p in peer.particles], rtol=0, atol=apart)


def test_the_planets_energy_walks_as_rounding_does():
    run = simulation(SUNS, PLACES, SPEEDS, g=GRAVITY)
    start = energy(SUNS, PLACES, SPEEDS, GRAVITY)
    errors = []
    for year in np.linspace(0.0, 3000.0, 101)[1:]:
        run.advance(YEAR * year)
        errors.append(energy(SUNS, run.positions[0], run.velocities[0], GRAVITY) / start - 1)
    # Some 9000 steps, each of which rounds by 1e-17 or so.
    assert np.abs(errors).max() < 4e-15
    assert run.steps_done < 5 * 12000


def test_two_bodies_and_a_test_particle_beside_a_body_that_turns():
    ring = fs.Body(
        fs.Circle((1.0, 0, 0), (0, 1, 1), 0.5), gravity=fs.Newtonian(0.1), mass=0.3, motion=fs.Spin(rate=0.4)
    )
    pair = (np.array([1.0, 0.5]), np.array([(0, 0, 3.0), (2, 0, 3.0)]), np.array([(0, -0.3, 0), (0, 0.6, 0)]))
    options = {"bodies": [ring], "others": [((0, 4, 3.0), (0.5, 0, 0))]}
    run, other = simulation(*pair, **options), simulation(*pair, **options, integrator=fs.SofroniouSpaletta10(5e-3))
    for one in (run, other):
        one.advance(6.0)
    for found, expected in zip(run.positions + run.velocities, other.positions + other.velocities, strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    assert run.radau.steps < 0.2 * other.steps_done


def test_output_between_steps_changes_nothing_and_is_as_good():
    whole, cut = triangle(), triangle()
    whole.advance(8.0)
    for time in (0.3, 0.3, 2.0, 7.77, 8.0):
        cut.advance(time)
        fresh = triangle()
        fresh.advance(time)
        np.testing.assert_array_equal(cut.positions[0], fresh.positions[0])
    np.testing.assert_array_equal(cut.positions[0], whole.positions[0])
    assert cut.steps_done == whole.steps_done
    begin, end = whole.radau.span
    assert (begin == begin[0]).all()
    assert begin[0] <= 8.0 <= end[0]
    # Both ends of a step, and a place between that a run with other steps reaches, too.
    start = energy(MASSES, CORNERS, np.zeros((3, 3)))
    for time in np.linspace(begin[0], end[0], 5):
        assert abs(energy(MASSES, *whole.radau.at(time)) / start - 1) < 1e-12


def cluster(count=30, **options):
    rng = np.random.default_rng(4)
    masses = np.where(np.arange(count) % 3, 1.0 / count, 0.0)
    rod = fs.Body(fs.Segment((-1, 0, 0), (1, 0, 0)), gravity=fs.Newtonian(0.2), mass=0.5, motion=fs.Spin(rate=1.0))
    x, v = rng.normal(size=(count, 3)), 0.3 * rng.normal(size=(count, 3))
    return simulation(masses, x, v, bodies=[rod], **options)


def test_many_are_moved_as_few_are(monkeypatch):
    few = cluster()
    few.advance(0.5)
    monkeypatch.setattr(shared_run, "FEW_PAIRS", 0)
    for threads in (1, 2):
        many = cluster(threads=threads)
        many.advance(0.2)
        many.advance(0.5)
        np.testing.assert_array_equal(many.positions[0], few.positions[0])
        np.testing.assert_array_equal(many.velocities[0], few.velocities[0])
        assert many.steps_done == few.steps_done
        assert many.radau.evaluations == few.radau.evaluations


def test_nodes_of_particles_that_pull_one_after_the_other(monkeypatch):
    lanes = cluster()
    monkeypatch.setattr("fieldsim.dynamics.radau.radau.lanes_on", lambda device: 1)
    alone = cluster()
    monkeypatch.setattr(shared_run, "FEW_PAIRS", 0)
    many = cluster()
    for run in (lanes, alone, many):
        run.advance(0.5)
        np.testing.assert_allclose(run.positions[0], lanes.positions[0], rtol=0, atol=1e-12)


def test_a_manoeuvre_begins_anew():
    run = triangle()
    run.advance(1.0)
    x, v, steps = run.positions[0], run.velocities[0] * 0.9, run.steps_done
    run.set_particles(0, velocities=v)
    fresh = simulation(MASSES, x, v)
    run.advance(3.0)
    fresh.advance(2.0)
    np.testing.assert_allclose(run.positions[0], fresh.positions[0], rtol=0, atol=1e-11)
    assert run.steps_done > steps


def test_a_fall_onto_each_other_ends_with_a_clear_error():
    run = simulation(np.ones(2), [(0, 0, 0), (1.0, 0, 0)], np.zeros((2, 3)))
    with pytest.raises(fs.FieldsimError, match="soften what they fall into"):
        run.advance(5.0)


def test_auto_takes_radau_where_two_pass_closely():
    e = 0.99
    place, speed = np.array([(1 - e, 0, 0), (0, 0, 0)]), np.array([(0, math.sqrt((1 + e) / (1 - e)), 0), (0, 0, 0)])
    world = fs.World()
    world.add_particles(place[:1], speed[:1], gravity=fs.Newtonian(), mass=1e-6)
    world.add_particles(place[1:], speed[1:], gravity=fs.Newtonian(), mass=1.0)
    run = fs.Simulation(world, fs.Auto(1e-10, span=7.0))
    assert isinstance(run.integrator, fs.Radau)


def test_kernels_of_particles_that_pull_compile_for_cuda(compiles_for_cuda):
    kinds = cluster().radau._sources.kinds_used
    kernels = [*few_kernels(kinds, fs.Newtonian, ALONE), *many_kernels(kinds, fs.Newtonian, ALONE).values()]
    for kernel in kernels:
        compiles_for_cuda(kernel.module)
