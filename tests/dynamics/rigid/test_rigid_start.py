"""What free bodies may start as: pulls that are mutual, and surfaces apart, found quickly."""

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics.rigid import start
from fieldsim.dynamics.rigid.diagnostics import body_energy

ORIGIN = fs.Point((0, 0, 0))
ROD = fs.Segment((-1, 0, 0), (1, 0, 0))
SKIN = fs.Material(radius=0.2)
LAW = fs.Newtonian(softening=0.1)


def world_of(*bodies):
    world = fs.World()
    for body in bodies:
        world.add_body(body)
    return world


def free(place, *, skeleton=ORIGIN, surface=None, gravity=LAW, mass=1.0, G=1.0, resists=None, **motion):
    """A free body; resists: its inertial mass."""
    place = (place, 0, 0) if np.isscalar(place) else place
    return fs.Body(skeleton, gravity, mass, G, surface, fs.Rigid(place, mass=resists, **motion))


# Which pulls are mutual


@pytest.mark.parametrize(
    ("one", "two"),
    [
        ({"G": 1.0}, {"G": 2.0}),
        ({"G": 1.0 + 1e-6}, {}),
        ({"mass": 2.0}, {"mass": 0.7, "resists": 0.8}),
        ({"mass": -1.0, "resists": 1.0}, {}),
        ({"gravity": fs.Newtonian(0.2)}, {}),
        ({"gravity": fs.Gaussian(1.0)}, {}),
    ],
)
def test_pulls_that_would_not_be_opposite_are_refused(one, two):
    with pytest.raises(fs.InputError, match=r"Body 0 and Body 1 pull each other with .* opposite; give them"):
        fs.Simulation(world_of(free(-1.0, **one), free(1.0, **two)))


@pytest.mark.parametrize(
    ("one", "two"),
    [
        ({"G": 2.0, "mass": 0.5, "resists": 1.5}, {"G": 1.0, "mass": 2.0, "resists": 3.0}),
        ({"G": -1.0, "mass": 2.0}, {"G": 1.0, "mass": -0.5, "resists": 0.5}),
        ({"G": 3.0, "mass": 2.0}, {"gravity": None, "mass": 0.7, "resists": 0.2, "G": 9.0}),
        ({"mass": -2.0, "resists": 1.0}, {"gravity": None}),
        ({"mass": 2.0}, {"mass": 0.0, "resists": 0.5}),
    ],
)
def test_forces_are_those_of_the_others_own_pull_and_opposite(one, two):
    """Where only one pulls, what it does to the other comes back to it."""
    bodies = free(-1.0, skeleton=ROD, **one), free(2.0, velocity=(0, 0.2, 0), **two)
    simulation = fs.Simulation(world_of(*bodies), fs.Leapfrog(1e-3))
    found = simulation.wrenches().forces[0, 1]
    field = fs.gravity(ROD, bodies[0].mass, G=bodies[0].G, kernel=LAW)
    right = bodies[1].motion.mass or bodies[1].mass
    np.testing.assert_allclose(found, right * field.gradient((3.0, 0, 0)), rtol=1e-6)
    np.testing.assert_allclose(simulation.wrenches().forces[1, 0], -found, rtol=1e-12)
    momenta, energy = simulation.bodies.momenta, body_energy(simulation.bodies).total
    simulation.advance(0.01)
    np.testing.assert_allclose(simulation.bodies.momenta[1] - momenta[1], 0.01 * found, rtol=1e-2, atol=1e-4)
    np.testing.assert_allclose(simulation.bodies.momenta.sum(axis=0), momenta.sum(axis=0), atol=1e-14)
    assert body_energy(simulation.bodies).total == pytest.approx(energy, abs=1e-7)


def test_particles_that_pull_are_not_mixed_with_free_bodies():
    world = world_of(free(3.0, gravity=None))
    world.add_particles([(1, 0, 0)], [(0, 0, 0)], gravity=LAW)
    with pytest.raises(fs.InputError, match=r"Body 0 moves freely .* nor pull what moves freely"):
        fs.Simulation(world)


def test_totals_of_particles_that_repel_are_measured_by_their_sizes():
    """Of masses 1 and -1 energies cancel; the drift of their sum is told in units of theirs."""
    world = fs.World()
    for mass, x in ((1.0, 0.0), (-1.0, 1.0)):
        world.add_particles([(x, 0, 0)], [(0, 0.3, 0)], gravity=LAW, mass=mass)
    simulation = fs.Simulation(world, fs.BlanesMoan6(1e-2))
    log = fs.EnergyLog(simulation)
    for time in (0.5, 1.0, 1.5):
        simulation.advance(time)
        log.record()
    drifts = {drift.quantity: drift.largest for drift in log.report().totals}
    assert drifts["momentum"] < 1e-14
    assert drifts["energy"] < 1e-10


# Surfaces that start in each other


def still(place, skeleton=ORIGIN, **material):
    return fs.Body(skeleton, surface=fs.Material(**{"radius": 0.2} | material), motion=fs.Pose(place))


HUGE = {"skeleton": ORIGIN, "surface": fs.Material(radius=2.0)}
RING = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)


@pytest.mark.parametrize(
    ("bodies", "right"),
    [
        ([free(0.0, surface=SKIN), free(0.0, surface=SKIN)], False),
        ([free(0.0, surface=SKIN), free(1e-3, surface=SKIN)], False),
        ([free(0.0, surface=SKIN), free(0.39, surface=SKIN)], False),
        ([free(0.0, surface=SKIN), free(0.41, surface=SKIN)], True),
        ([free(0.0, surface=SKIN), still((0, 0, 0))], False),
        ([still((0, 0, 0)), free(0.0, surface=SKIN)], False),
        ([free(0.0, skeleton=ROD, surface=SKIN), free(0.0, skeleton=ROD, surface=SKIN)], False),
        ([free(0.0, skeleton=RING, surface=SKIN), free(0.0, skeleton=RING, surface=SKIN)], False),
        # One wholly within the other, whichever moves.
        ([free(0.0, **HUGE), free(0.3, surface=SKIN)], False),
        ([free(0.0, **HUGE), still((0.3, 0, 0))], False),
        ([still((0, 0, 0), radius=2.0), free(0.3, surface=SKIN)], False),
        ([still((0, 0, 0), fs.Segment((-5, 0.3, 0), (5, 0.3, 0)), radius=0.01), free(0.0, **HUGE)], False),
        # In the hole of a ring there is room, also for a ring that is linked with it.
        ([free(0.0, skeleton=RING, surface=SKIN), free(0.0, surface=SKIN)], True),
        ([still((0, 0, 0), RING), free((1, 0, 0), skeleton=fs.Circle((0, 0, 0), (0, 1, 0), 1.0), surface=SKIN)], True),
        ([free(0.0, skeleton=RING, surface=SKIN), free((1, 0, 0), surface=SKIN)], False),
        ([still((0, 0, 0), fs.Plane((0, 0, 0), (0, 0, 1))), free((0, 0, 0.1), surface=SKIN)], False),
        ([still((0, 0, 0), fs.Plane((0, 0, 0), (0, 0, 1))), free((0, 0, 1.0), surface=SKIN)], True),
        # Nothing to see, nothing to touch.
        ([free(0.0), free(0.0, gravity=None)], True),
    ],
)
def test_surfaces_that_start_in_each_other_are_refused(bodies, right):
    if right:
        fs.Simulation(world_of(*bodies))
        return
    with pytest.raises(fs.InputError, match=r"Body [01] and Body [01] overlap at the start, time 0; move them apart"):
        fs.Simulation(world_of(*bodies))


def test_only_neighbours_are_looked_at(monkeypatch):
    """Making a row of bodies looks as often as it has neighbours, not pairs."""
    calls = []
    holds = start.Extent.holds
    monkeypatch.setattr(start.Extent, "holds", lambda *given: calls.append(1) or holds(*given))
    made, short = [], fs.Segment((-0.2, 0, 0), (0.2, 0, 0))
    for count in (10, 20):
        calls.clear()
        rows = (free((0, 0.45 * k, 0), skeleton=short, gravity=None, surface=SKIN) for k in range(count))
        fs.Simulation(world_of(*rows))
        made.append(len(calls))
    assert 0 < made[1] < 3 * made[0]  # of pairs there are four times as many


def test_wrenches_of_many_add_up_to_what_moves_each():
    """Each by each, of free and of given bodies, in gravity and where surfaces press on each other."""
    short = fs.Segment((-0.2, 0, 0), (0.2, 0, 0))
    world = world_of(*(free((0.9 * k, 0.3 * k * k, 0), skeleton=short, surface=SKIN) for k in range(4)))
    world.add_body(fs.Body(ROD, gravity=LAW, surface=SKIN, motion=fs.Pose((0, 5, 0))))
    bodies = fs.Simulation(world).bodies
    bodies.state.x.numpy()[1] = bodies.centers[0] + (0.3, 0.1, 0.1)  # into each other
    bodies.potential_energy()
    forces, torques = bodies.wrenches()
    force, torque = bodies.state.force.numpy(), bodies.state.torque.numpy()
    bodies.potential_energy()
    np.testing.assert_allclose(forces.sum(axis=0), force, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(torques.sum(axis=0), torque, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(forces[:4], -forces[:4].swapaxes(0, 1), atol=1e-12)
    assert (np.linalg.norm(forces, axis=2)[~np.eye(5, 4, dtype=bool)] > 0).all()
