"""What motion keeps: energy, angular momentum and the Jacobi integral, around donut and cigar."""

import math

import numpy as np
import pytest

from fieldsim.dynamics.diagnostics.energy_log import EnergyLog
from fieldsim.dynamics.diagnostics.invariants import angular_momentum, energy, jacobi
from fieldsim.dynamics.integrators.splittings import Leapfrog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.motion import Spin
from fieldsim.world.world import World

RING = Circle((0, 0, 0), (0, 0, 1), 1.0)
BAR = Segment((-1.0, 0, 0), (1.0, 0, 0))
TURN = Spin(axis=(0, 0, 1), rate=0.3)


def orbits(primitive, dt, motion=None, count=12, seed=0):
    """Particles on inclined, mildly eccentric orbits at 2 to 3.5 radii of a body of mass 1."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(count, 3))
    x /= np.linalg.norm(x, axis=1)[:, None]
    across = np.cross(x, rng.normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    radius = rng.uniform(2.0, 3.5, count)[:, None]
    world = World()
    options = {} if motion is None else {"motion": motion}
    world.add_body(Body(primitive, gravity=Newtonian(), mass=1.0, **options))
    world.add_particles(radius * x, rng.uniform(0.85, 1.1, (count, 1)) * across / np.sqrt(radius))
    return Simulation(world, Leapfrog(dt), threads=1)


def worst_drift(simulation, invariant, times):
    """Largest change of an invariant over a run, absolute; the invariants here are of order 0.2."""
    start = invariant(simulation.snapshot())
    return max(np.abs(invariant(snapshot) - start).max() for snapshot in simulation.snapshots(times))


def total_energy(snapshot):
    return energy(snapshot).total


@pytest.mark.parametrize(
    ("primitive", "motion", "invariant"),
    [(RING, None, total_energy), (BAR, TURN, lambda snapshot: jacobi(snapshot, TURN))],
    ids=["donut", "spinning cigar"],
)
def test_leapfrog_keeps_its_invariant_to_second_order(primitive, motion, invariant):
    times = 0.8 * np.arange(1, 26)  # whole steps of every dt, so that none is shortened
    drifts = [worst_drift(orbits(primitive, dt, motion), invariant, times) for dt in (0.08, 0.04, 0.02)]
    slopes = np.log2(np.divide(drifts[:-1], drifts[1:]))
    np.testing.assert_allclose(slopes, 2.0, atol=0.2)


def test_energy_error_stays_bounded_over_a_thousand_orbits_of_the_donut():
    simulation = orbits(RING, 0.05)
    period = 2 * math.pi * 2.5**1.5
    start = total_energy(simulation.snapshot())
    # Looks within one orbit at the beginning and within one at the end show the same swing: no secular drift.
    first = worst_drift(simulation, total_energy, np.linspace(0.0, period, 100))
    last = [total_energy(s) - start for s in simulation.snapshots(np.linspace(999 * period, 1000 * period, 100))]
    assert simulation.steps_done > 12 * 400_000
    assert first < 1e-3
    assert np.abs(last).max() < 1.5 * first
    assert abs(np.mean(last)) < first


def test_the_ring_keeps_angular_momentum_about_its_axis_to_rounding():
    simulation = orbits(RING, 0.01)
    start = angular_momentum(simulation.snapshot())
    simulation.advance(200.0)
    end = angular_momentum(simulation.snapshot())
    # 20,000 steps, each rounding at 1e-16 of values of order 1.
    np.testing.assert_allclose(end[:, 2], start[:, 2], atol=1e-13)
    assert np.abs(end[:, 0] - start[:, 0]).max() > 0.01  # the others change: the ring is no point


def test_a_spinning_cigar_keeps_the_jacobi_integral_but_not_the_energy():
    simulation = orbits(BAR, 0.01, TURN)
    before, start = jacobi(simulation.snapshot(), TURN), total_energy(simulation.snapshot())
    simulation.advance(100.0)
    after, end = jacobi(simulation.snapshot(), TURN), total_energy(simulation.snapshot())
    assert np.abs(end - start).max() > 1e-2
    np.testing.assert_allclose(after, before, atol=2e-5)


def test_free_fall_along_the_axis_of_the_ring_has_the_period_of_the_exact_solution():
    height = 1.5

    def potential(z):  # of a ring of mass 1 and radius 1, on its axis
        return -1.0 / np.sqrt(1.0 + z * z)

    # period = 4 integral dz / sqrt(2 (U(height) - U(z))), smooth in the angle where z = height sin(angle).
    nodes, weights = np.polynomial.legendre.leggauss(60)
    angle = (nodes + 1.0) * math.pi / 4
    speed = np.sqrt(2.0 * (potential(height) - potential(height * np.sin(angle))))
    period = math.pi * np.sum(weights * height * np.cos(angle) / speed)
    world = World()
    world.add_body(Body(RING, gravity=Newtonian(), mass=1.0))
    world.add_particles([(0, 0, height)], [(0, 0, 0)])
    simulation = Simulation(world, Leapfrog(1e-3), threads=1)
    seen = [s.positions[0][0] for s in simulation.snapshots([period / 4, period / 2, period])]
    # Phase error of leapfrog: (omega dt)^2 / 24 of the time elapsed.
    np.testing.assert_allclose(seen, [(0, 0, 0), (0, 0, -height), (0, 0, height)], atol=2e-6)
    np.testing.assert_array_equal(np.array(seen)[:, :2], 0.0)


def test_a_report_says_that_particles_escaped():
    world = World(escape_radius=3.0)
    world.add_body(Body(RING, gravity=Newtonian(), mass=1.0))
    world.add_particles([(2.5, 0, 0)], [(3, 0, 0)])
    simulation = Simulation(world, Leapfrog(0.01))
    log = EnergyLog(simulation)
    simulation.advance(1.0)
    log.record()
    assert str(log.report()) == "energy not judged: all 1 particles touched a surface or escaped"
