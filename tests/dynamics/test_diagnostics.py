"""The diagnostics themselves, on states whose values are known."""

import math

import numpy as np
import pytest

from fieldsim.dynamics.diagnostics.energy_log import EnergyLog, EnergyReport
from fieldsim.dynamics.diagnostics.invariants import angular_momentum, common_spin, energy, jacobi
from fieldsim.dynamics.integrators.splittings import Leapfrog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import InputError
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce, Repulsion
from fieldsim.world.material import Material
from fieldsim.world.motion import Pose, Spin
from fieldsim.world.rigid import Rigid
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
    assert common_spin(world_of(turning(), Body(OFF, gravity=Newtonian()))) is None
    assert common_spin(world_of(Body(OFF, gravity=Newtonian(), mass=lambda t: 1 + t, motion=Spin()))) is None
    assert common_spin(World()) is None


CIGAR = Segment((-1.0, 0, 0), (1.0, 0, 0))
QUARTER = 0.5 * math.pi
UP = {"axis": (0, 0, 1), "rate": 0.5}


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (UP, UP | {"center": (0, 0, 0.5)}, True),
        (UP, {"axis": (0, 0, -3), "rate": -0.5, "phase": 2.0}, True),
        ({"axis": (1, 1, 1), "center": (1, 2, 0)}, {"axis": (0.1, 0.1, 0.1), "center": (0, 1, -1)}, True),
        ({"axis": (1, 1, 1)}, {"axis": (-0.3, -0.3, -0.3), "rate": -1.0, "center": (7.3, 7.3, 7.3)}, True),
        (UP | {"rate": 0.0}, {"axis": (1, 0, 0), "rate": 0.0, "center": (0, 3, 0)}, True),
        (UP, UP | {"rate": -0.5}, False),
        (UP, {"axis": (0, 0, -1), "rate": 0.5}, False),
        (UP, UP | {"center": (1e-6, 0, 0)}, False),
        (UP, UP | {"axis": (1e-6, 0, 1)}, False),
        (UP, UP | {"rate": 0.5 + 1e-9}, False),
        (UP, UP | {"rate": 0.0}, False),
    ],
)
def test_one_spin_written_in_two_ways_is_one(one, other, same):
    found = common_spin(world_of(*(Body(CIGAR, gravity=Newtonian(), motion=Spin(**spin)) for spin in (one, other))))
    assert found == (Spin(**one) if same else None)


def test_what_lies_evenly_about_the_axis_turns_with_any_spin():
    spin = Spin(axis=(0, 1, 0), rate=0.5, center=(1, 0, 0))
    turning = Body(CIGAR, gravity=Newtonian(), motion=spin)
    even = [
        Body(Point((1, 3, 0)), gravity=Newtonian()),
        Body(Circle((1, -1, 0), (0, -1, 0), 0.5), gravity=Newtonian(0.1)),
        Body(
            Segment((0, 0, 0), (0, 0, 2)), gravity=Newtonian(), motion=Pose.turned((1, 0, 0), -math.pi / 2, (1, 0, 0))
        ),
        Body(Segment((1, 0, 0), (1, 2, 0)), gravity=Newtonian(), motion=Spin((0, 2, 0), rate=3.0, center=(1, 9, 0))),
    ]
    assert common_spin(world_of(*even, turning)) == spin
    # Each alone stands still, or turns in its own way.
    assert common_spin(world_of(*even[:3])) is None
    for uneven in (
        Body(Point((1.1, 3, 0)), gravity=Newtonian()),
        Body(Circle((1, -1, 0), (1, 1, 0), 0.5), gravity=Newtonian(0.1)),
        Body(Arc((1, 0, 0), (0, 1, 0), (1, 0, 0), 0.5, 1.0), gravity=Newtonian(0.1)),
        Body(Point((1, 0, 0)), gravity=Newtonian(), motion=Spin((0, 1, 0), rate=1.0)),
        Body(Point((1, 0, 0)), gravity=Newtonian(), motion=Rigid()),
        Body(Point((1, 0, 0)), gravity=Newtonian(), motion=lambda time: (0.0, time, 0.0)),
    ):
        assert common_spin(world_of(turning, uneven)) is None


def test_the_jacobi_integral_is_followed_where_equal_spins_are_written_in_two_ways():
    still = Body(SUN, gravity=Newtonian(0.1))
    world = world_of(*(Body(CIGAR, gravity=Newtonian(0.1), motion=Spin((0, 0, s), 0.5 * s)) for s in (1, -1)), still)
    world.add_particles([(3.0, 0, 0)], [(0, 0.9, 0.1)])
    report = run_log(world)
    assert report.invariant == "Jacobi integral"
    assert 0.0 < report.largest < 1e-5


# Repulsion, and particles that pull


def test_moving_surfaces_that_repel_are_no_still_world():
    skin = Material(radius=0.5)
    world = world_of(Body(OFF, surface=skin, motion=lambda time: (-0.5 * time, 0, 0)))
    world.add_particles([(-1.5, 0, 0)], [(0.4, 0, 0)], contact=Repulsion(1.0, 4.0))
    assert run_log(world).invariant == ""
    still = world_of(Body(OFF, surface=skin))
    still.add_particles([(-1.5, 0, 0)], [(0.4, 0, 0)], contact=Repulsion(1.0, 4.0))
    report = run_log(still)
    assert report.invariant == "energy"
    assert report.largest < 1e-2


def test_particles_that_pull_share_the_energy_of_each_pair():
    world = world_of(Body(SUN, gravity=Newtonian(), mass=3.0))
    law = {"gravity": Newtonian(0.5)}
    world.add_particles([(2, 0, 0), (-2, 0, 0)], [(0, 1, 0), (0, 0, 0)], mass=0.5, G=2.0, **law)
    world.add_particles([(0, 4, 0)], [(0, 0, 1)], mass=0.25, G=1.0, **law)
    world.add_particles([(0, 0, 1)], [(0, 0, 0)])
    pull = np.array([1.0, 1.0, 0.25, 0.0])
    x = np.concatenate([p.positions for p in world.particles])
    apart = np.linalg.norm(x[:, None] - x, axis=2)
    pairs = -(1.0 - np.eye(4)) / np.sqrt(apart**2 + 0.25)
    found = energy(world.at(0.0))
    own = -3.0 / np.linalg.norm(x, axis=1)
    np.testing.assert_allclose(found.potential, own + [0.5, 0.5, 0.5, 1.0] * (pairs @ pull), rtol=1e-13)
    total = pull @ (found.kinetic + own) + 0.5 * pull @ pairs @ pull
    assert pull @ found.total == pytest.approx(total, rel=1e-13)
    spin = Spin(rate=0.3)
    assert pull @ jacobi(world.at(0.0), spin) == pytest.approx(
        total - 0.3 * pull @ np.cross(x, velocities(world))[:, 2]
    )
    with pytest.raises(InputError, match="energy: snapshot is 3"):
        energy(3)


def velocities(world):
    return np.concatenate([p.velocities for p in world.particles])


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
