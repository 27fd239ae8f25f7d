"""Poincare sections: crossings lie on the plane, at the right time, and keep the invariants."""

import numpy as np
import pytest

from fieldsim.dynamics.diagnostics.energy_log import EnergyLog
from fieldsim.dynamics.integrators.splittings import BlanesMoan6, Leapfrog
from fieldsim.dynamics.radau.radau import Radau
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import InputError
from fieldsim.orbits.poincare import Section, poincare
from fieldsim.potentials.gravity import gravity
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce
from fieldsim.world.motion import Spin
from fieldsim.world.world import World

SUN = Body(Point((0, 0, 0)), gravity=Newtonian())


def world_of(body, positions, velocities, **options):
    world = World()
    world.add_body(body)
    world.add_particles(positions, velocities, **options)
    return world


def test_a_kepler_orbit_crosses_its_axis_once_a_period_each_way():
    # Eccentricity 0.5, semi-major axis 1, from the pericentre.
    world = world_of(SUN, [(0.5, 0, 0)], [(0, 3**0.5, 0)])
    method = BlanesMoan6(0.02)
    up = poincare(world, Section(normal=(0, 1, 0)), 40.0, method)
    # The start lies on the plane and counts as above it. Quintic interpolation of steps of 0.02 errs by 1e-10.
    np.testing.assert_allclose(up.times, 2 * np.pi * np.arange(1, 7), atol=1e-8)
    np.testing.assert_allclose(up.positions[:, 0], 0.5, atol=1e-8)
    np.testing.assert_allclose(up.velocities[:, 1], 3**0.5, atol=1e-7)
    down = poincare(world, Section(normal=(0, 1, 0), direction=-1), 40.0, method)
    np.testing.assert_allclose(down.times, np.pi + 2 * np.pi * np.arange(6), atol=1e-8)
    np.testing.assert_allclose(down.positions[:, 0], -1.5, atol=1e-8)
    both = poincare(world, Section(normal=(0, 1, 0), direction=0), 40.0, method)
    np.testing.assert_allclose(both.times, np.sort(np.concatenate([up.times, down.times])), atol=1e-13)


def test_a_turning_plane_sees_what_its_bodies_see():
    spin = Spin(rate=0.4)
    cigar = Segment((-1, 0, 0), (1, 0, 0))
    body = Body(cigar, gravity=Newtonian(0.1), motion=spin)
    world = world_of(body, [(2.0, 0, 0), (3.0, 0, 0.5)], [(0, 0.2, 0.3), (0, 0.6, 0)])
    found = poincare(world, Section(normal=(0, 1, 0), direction=0, spin=spin), 60.0, BlanesMoan6(0.02))
    assert len(found) > 10
    assert set(found.particles) == {0, 1}
    assert (np.diff(found.times) >= 0).all()
    np.testing.assert_allclose(found.positions[:, 1], 0.0, atol=1e-12)
    # In the turning frame the Jacobi integral v^2/2 - F - (omega rho)^2 / 2 is the start's.
    field = gravity(cigar, 1.0, kernel=Newtonian(0.1))

    def integral(x, v):
        return 0.5 * np.sum(v**2, axis=1) - field.value(x) - 0.5 * 0.16 * np.sum(x[:, :2] ** 2, axis=1)

    starts, speeds = world.particles[0].positions, world.particles[0].velocities
    wanted = integral(starts, speeds - np.cross((0, 0, 0.4), starts))
    np.testing.assert_allclose(integral(found.positions, found.velocities), wanted[found.particles], atol=1e-7)


def test_a_turning_plane_is_as_exact_as_one_that_stands():
    # A Kepler circle of radius 1 seen from a frame that turns the other way: one crossing each pi / 1.5, at any step.
    world = world_of(SUN, [(np.cos(0.3), np.sin(0.3), 0)], [(-np.sin(0.3), np.cos(0.3), 0)])
    plane = Section(point=(0, 0, 0), normal=(0, 1, 0), direction=0, spin=Spin(axis=(0, 0, -2), rate=0.5))
    found = poincare(world, plane, 20.0, BlanesMoan6(0.1))
    wanted = (np.arange(1, len(found) + 1) * np.pi - 0.3) / 1.5
    assert len(found) == 9
    np.testing.assert_allclose(found.times, wanted, atol=1e-7)
    np.testing.assert_allclose(found.positions[:, 1], 0.0, atol=1e-13)
    # Off the axis of its turn, too: the plane y = 0.5 through a frame about (2, 1, 0).
    away = Section(point=(0, 0.5, 0), normal=(0, 1, 0), direction=0, spin=Spin(rate=0.5, center=(2, 1, 0)))
    found = poincare(world, away, 20.0, BlanesMoan6(0.1))
    exact = poincare(world, away, 20.0, Radau())
    np.testing.assert_allclose(found.times, exact.times, atol=1e-6)
    np.testing.assert_allclose(found.positions[:, 1], 0.5, atol=1e-13)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda w: Section(normal=(0, 0, 0)), "normal"),
        (lambda w: Section(direction=2), "direction is 2"),
        (lambda w: poincare(w, "plane", 1.0), "give a fs.Section"),
        (lambda w: poincare(w, Section(), -1.0), "duration"),
        (lambda w: Section(spin=1.0), "spin is 1.0"),
    ],
)
def test_bad_sections_are_refused(change, words):
    with pytest.raises(InputError, match=words):
        change(world_of(SUN, [(1, 0, 0)], [(0, 1, 0)]))


def test_sections_know_no_contact():
    world = world_of(SUN, [(1, 0, 0)], [(0, 1, 0)], contact=Bounce())
    with pytest.raises(InputError, match="set 0 have contact"):
        poincare(world, Section(), 1.0)


# Work


@pytest.mark.parametrize("method", [Leapfrog, BlanesMoan6])
def test_energy_less_work_is_kept_to_the_methods_order(method):
    def drift(dt):
        world = World()
        motion = lambda t: (0.3 * np.sin(t), 0.1 * t, 0.0)  # noqa: E731
        world.add_body(Body(Point((0, 0, 0)), gravity=Newtonian(0.2), motion=motion))
        world.add_particles([(1.0, 0, 0), (0, 1.5, 0.4)], [(0, 0.9, 0), (0.7, 0, 0)])
        simulation = Simulation(world, method(dt))
        log = EnergyLog(simulation)
        for time in (1.0, 2.0, 3.0, 4.0):
            simulation.advance(time)
            log.record()
        report = log.report()
        assert report.invariant == "energy less work"
        assert abs(report.work) > 0.01
        return report.largest

    dt = {Leapfrog: 0.02, BlanesMoan6: 0.2}[method]
    slope = np.log2(drift(dt) / drift(dt / 2))
    assert abs(slope - method.order) < 0.5 if method is Leapfrog else slope > method.order - 0.5


# Radau


def test_under_radau_crossings_are_exact():
    # Eccentricity 0.5, semi-major axis 1, from the pericentre; two others, one of them off the plane at first.
    starts = [(0.5, 0, 0), (0.1, 0, 0), (0.5, -0.3, 0)]
    world = world_of(SUN, starts, [(0, 3**0.5, 0), (0, 19**0.5, 0), (0, 1.5, 0.2)])
    up = poincare(world, Section(normal=(0, 1, 0)), 40.0, Radau())
    first = up.particles == 0
    # Rounding of some 60 steps an orbit shifts its phase.
    np.testing.assert_allclose(up.times[first], 2 * np.pi * np.arange(1, 7), rtol=0, atol=2e-13)
    np.testing.assert_allclose(up.positions[first], np.tile(starts[0], (6, 1)), rtol=0, atol=2e-13)
    np.testing.assert_allclose(up.velocities[first, 1], 3**0.5, rtol=0, atol=2e-13)
    second = up.particles == 1
    np.testing.assert_allclose(up.times[second], 2 * np.pi * np.arange(1, 7), rtol=0, atol=2e-12)
    assert (np.diff(up.times) >= 0).all()
    assert (up.times <= 40.0).all()
    down = poincare(world, Section(normal=(0, 1, 0), direction=-1), 40.0, Radau())
    both = poincare(world, Section(normal=(0, 1, 0), direction=0), 40.0, Radau())
    # Times are rounded to 4e-15 at 40.
    np.testing.assert_allclose(both.times, np.sort(np.concatenate([up.times, down.times])), rtol=0, atol=1e-14)
    assert (np.abs(both.positions[:, 1]) <= 2e-14 * np.linalg.norm(both.velocities, axis=1)).all()
    leapt = poincare(world, Section(normal=(0, 1, 0)), 40.0, BlanesMoan6(0.002))
    np.testing.assert_array_equal(leapt.particles[leapt.particles != 1], up.particles[~second])
    np.testing.assert_allclose(leapt.times[leapt.particles == 2], up.times[up.particles == 2], rtol=0, atol=1e-9)


def test_under_radau_a_turning_plane_is_exact_too():
    spin = Spin(rate=0.4, center=(0.1, 0, 0))
    body = Body(Segment((-1, 0, 0), (1, 0, 0)), gravity=Newtonian(0.1), motion=spin)
    world = world_of(body, [(2.0, 0, 0), (3.0, 0, 0.5)], [(0, 0.2, 0.3), (0, 0.6, 0)])
    section = Section(normal=(0, 1, 0), direction=0, spin=spin)
    found = poincare(world, section, 60.0, Radau())
    np.testing.assert_allclose(found.positions[:, 1], 0.0, atol=1e-13)
    leapt = poincare(world, section, 60.0, BlanesMoan6(0.005))
    # Both start on the plane and leave it at once: at a time of rounding.
    np.testing.assert_array_equal(found.particles[2:], leapt.particles[2:])
    np.testing.assert_allclose(found.times, leapt.times, rtol=0, atol=1e-5)  # the plane's table is interpolated


def test_one_that_is_lost_does_not_keep_the_others():
    world = world_of(SUN, [(0.5, 0, 0), (1.0, 0, 0)], [(0, 3**0.5, 0), (0, 0, 0)])
    found = poincare(world, Section(normal=(0, 1, 0)), 20.0, Radau())
    np.testing.assert_array_equal(found.particles, [0, 0, 0])
