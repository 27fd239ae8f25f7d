"""Lyapunov exponents against cases that have closed forms, and against neighbouring orbits."""

import numpy as np
import pytest

from fieldsim.dynamics.integrators.splittings import BlanesMoan4, Chin4
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import InputError
from fieldsim.orbits.lyapunov import lyapunov
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce
from fieldsim.world.world import World

RING = Body(Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=Newtonian(0.1))


def world_of(positions, velocities, **options):
    world = World()
    world.add_body(RING)
    world.add_particles(positions, velocities, **options)
    return world


def test_the_unstable_centre_of_a_ring():
    # At rest in the centre: x'' = k x across the axis, oscillation along it, so the exponents are +-sqrt(k) and 0.
    world = world_of([(0, 0, 0)], [(0, 0, 0)])
    k = RING.gravity_field().hessian((0.0, 0.0, 0.0))[0, 0]
    result = lyapunov(world, 200.0, BlanesMoan4(0.05), count=6, samples=4)
    assert result.exponents.shape == (4, 1, 6)
    # The finite time leaves an error of the order 1 / time.
    np.testing.assert_allclose(result.exponents[-1, 0], np.sqrt(k) * np.array([1, 1, 0, 0, -1, -1]), atol=0.02)
    # A symplectic map keeps volumes: the exponents add up to nothing.
    np.testing.assert_allclose(result.exponents.sum(axis=2), 0.0, atol=1e-13)


def test_a_regular_orbit_has_none_and_a_chaotic_one_parts_as_neighbours_do():
    start, speed = np.array([(2.5, 0, 0), (0.8, 0, 0.0)]), np.array([(0, 0.62, 0.05), (0.1, 0.375, 0.9)])
    result = lyapunov(world_of(start, speed), 400.0, BlanesMoan4(0.05), samples=2)
    assert result.largest[0] < 0.025  # log(t) / t
    assert result.largest[1] > 2 * result.largest[0]
    # Two neighbours at 1e-9, put back to that distance every unit of time.
    x, v, grown = start[1], speed[1], 0.0
    dx, dv = np.array([1e-9, 0, 0]), np.zeros(3)
    for _ in range(400):
        simulation = Simulation(world_of([x, x + dx], [v, v + dv]), BlanesMoan4(0.05))
        simulation.advance(1.0)
        (x, other), (v, speed_of_other) = simulation.positions[0], simulation.velocities[0]
        size = np.sqrt(np.sum((other - x) ** 2) + np.sum((speed_of_other - v) ** 2))
        grown += np.log(size / 1e-9)
        dx, dv = (other - x) * 1e-9 / size, (speed_of_other - v) * 1e-9 / size
    assert result.largest[1] == pytest.approx(grown / 400.0, rel=0.1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"count": 7}, "count is 7"),
        ({"samples": 0}, "samples is 0"),
        ({"integrator": Chin4(0.1)}, "Chin4 has force gradients"),
        ({"duration": 0.0}, "duration"),
    ],
)
def test_bad_requests_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        lyapunov(world_of([(2, 0, 0)], [(0, 1, 0)]), **({"duration": 1.0} | options))


def test_contact_is_refused():
    with pytest.raises(InputError, match="lyapunov: particles of set 0 have contact"):
        lyapunov(world_of([(2, 0, 0)], [(0, 1, 0)], contact=Bounce()), 1.0)
