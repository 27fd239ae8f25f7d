"""The diagnostics themselves, on states whose values are known."""

import numpy as np
import pytest

from fieldsim.dynamics.diagnostics import angular_momentum, common_spin, energy, jacobi
from fieldsim.dynamics.energy_log import EnergyLog, EnergyReport
from fieldsim.dynamics.integrators import Leapfrog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import InputError
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.point import Point
from fieldsim.world.body import Body, Bounce
from fieldsim.world.material import Material
from fieldsim.world.motion import Spin
from fieldsim.world.world import World

SUN = Point((0.0, 0.0, 0.0))
OFF = Point((0.5, 0.0, 0.0))


def world_of(*bodies):
    world = World()
    for body in bodies:
        world.add_body(body)
    return world


def test_energy_and_angular_momentum_of_known_states():
    world = world_of(Body(SUN, gravity=Newtonian(), mass=3.0, G=2.0))
    world.add_particles([(2.0, 0, 0)], [(0, 1.0, 0)])
    world.add_particles([(0, 0, 4.0), (3.0, 0, 0)], [(1.0, 2.0, 2.0), (0, 0, 0)])
    snapshot = world.at(0.0)
    report = energy(snapshot)
    np.testing.assert_allclose(report.kinetic, [0.5, 4.5, 0.0])
    np.testing.assert_allclose(report.potential, [-3.0, -1.5, -2.0])
    np.testing.assert_allclose(report.total, [-2.5, 3.0, -2.0])
    np.testing.assert_allclose(angular_momentum(snapshot), [(0, 0, 2.0), (-8.0, 4.0, 0), (0, 0, 0)])
    np.testing.assert_allclose(angular_momentum(snapshot, center=(2.0, 0, 0))[0], 0.0)
    spin = Spin(axis=(0, 0, 2.0), rate=0.5, center=(1.0, 0, 0))
    # E - 0.5 Lz about the centre: Lz = 1, (-1, 0) x (1, 2) = -2, and 0.
    np.testing.assert_allclose(jacobi(snapshot, spin), [-3.0, 4.0, -2.0])
    with pytest.raises(InputError, match="Spin"):
        jacobi(snapshot, 0.5)
    with pytest.raises(InputError, match="center"):
        angular_momentum(snapshot, center=(0, 0))


def test_energy_uses_the_bodies_where_they_are():
    world = world_of(Body(SUN, gravity=Newtonian(), motion=lambda time: (time, 0, 0)))
    world.add_particles([(0, 0, 0)], [(0, 0, 0)])
    np.testing.assert_allclose(energy(world.at(2.0)).potential, [-0.5])


def test_an_empty_world_has_no_energy():
    assert len(energy(World().at(0.0)).total) == 0


def test_the_spin_common_to_all_that_pulls():
    def turning(**options):
        return Body(OFF, gravity=Newtonian(), motion=Spin(**options))

    assert common_spin(world_of(turning(rate=2.0), turning(rate=2.0, phase=1.0), Body(SUN))) == Spin(rate=2.0)
    assert common_spin(world_of(turning(rate=2.0), turning(rate=1.0))) is None
    assert common_spin(world_of(turning(), Body(SUN, gravity=Newtonian()))) is None
    assert common_spin(world_of(Body(OFF, gravity=Newtonian(), mass=lambda t: 1 + t, motion=Spin()))) is None
    assert common_spin(World()) is None


def run_log(world, until=2.0):
    simulation = Simulation(world, Leapfrog(1e-2), threads=1)
    log = EnergyLog(simulation)
    for time in np.linspace(0.1, until, 20):
        simulation.advance(time)
        log.record()
    return log.report()


@pytest.mark.parametrize(
    ("motion", "invariant"),
    [(None, "energy"), (Spin(rate=0.7), "Jacobi integral"), (lambda time: (0.1 * time, 0, 0), "energy less work")],
)
def test_the_log_follows_the_invariant_that_there_is(motion, invariant):
    world = world_of(Body(OFF, gravity=Newtonian(), **({"motion": motion} if motion else {})))
    world.add_particles([(2.0, 0, 0), (0, 3.0, 0)], [(0, 0.6, 0), (0, 0, 0.5)])
    report = run_log(world)
    assert (report.invariant, report.particles, report.total) == (invariant, 2, 2)
    assert 0.0 < report.rms < report.largest < 1e-4
    assert f"{invariant} drift" in str(report)
    assert ("did work" in str(report)) == (invariant == "energy less work")


def test_particles_that_touched_a_surface_are_left_out():
    world = world_of(Body(SUN, gravity=Newtonian(), surface=Material(radius=0.5)))
    world.add_particles([(1.0, 0, 0), (2.0, 0, 0)], [(0, 0, 0), (0, 0.7, 0)], contact=Bounce(0.3))
    report = run_log(world)
    assert (report.particles, report.total) == (1, 2)
    assert report.largest < 1e-4


def test_reports_read_as_sentences():
    assert str(EnergyReport("energy", 0.0, 0.0, 0, 0)) == "no particles"
    assert "all 5 particles" in str(EnergyReport("energy", 0.0, 0.0, 0, 5))
    assert "1.0e-06" in str(EnergyReport("energy", 1e-6, 1e-7, 4, 5))
    assert run_log(world_of(Body(SUN, gravity=Newtonian()))).total == 0
