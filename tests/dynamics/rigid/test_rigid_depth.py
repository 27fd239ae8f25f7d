"""Depth of contact: a true distance, a stiffness for each body, energy to the integrator's order, thin beside thick."""

import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim.dynamics.rigid.bodies import FreeBodies
from fieldsim.dynamics.rigid.diagnostics import body_angular_momentum, body_energy, body_momentum
from fieldsim.dynamics.rigid.diagnostics import wrenches as wrenches_of
from fieldsim.numerics import quaternion

ORIGIN = fs.Point((0, 0, 0))


def ball(place, radius, *, velocity=(0, 0, 0), mass=1.0, **motion):
    motion = fs.Rigid(place, velocity=velocity, inertia="solid", **motion)
    return fs.Body(ORIGIN, mass=mass, surface=fs.Material(radius=radius), motion=motion)


def world_of(*bodies):
    world = fs.World()
    for body in bodies:
        world.add_body(body)
    return world


def put(bodies, places):
    bodies.state.x = wp.array(np.array(places), dtype=wp.vec3d, device="cpu")


def points_of(start, place):
    """Points on a body's surface, turned as it starts, with its centre at `place`."""
    return start.shell.points @ quaternion.matrices(start.turn[None])[0].T + place


GROUNDS = {
    "ball": (fs.Body(fs.Point((0, 0, -0.7)), surface=fs.Material(radius=0.7)), lambda p: 0.7 - distance(p, 0.7)),
    "flat": (fs.Body(fs.Plane((0, 0, -0.5), (0, 0, 1)), surface=fs.Material(radius=0.5)), lambda p: -p[:, 2]),
    "Cauchy": (
        fs.Body(fs.Point((0, 0, -0.7)), surface=fs.Material(radius=0.7, kernel=fs.Cauchy)),
        lambda p: 0.7 - distance(p, 0.7),
    ),
}


def distance(p, below):
    return np.linalg.norm(np.add(p, (0, 0, below)), axis=1)


@pytest.mark.parametrize("name", GROUNDS)
def test_the_energy_is_that_of_true_distances(name):
    ground, depth = GROUNDS[name]
    bodies = FreeBodies(world_of(ground, ball((0, 0, 0.35), 0.3, stiffness=7.0)), 0.0)
    areas = bodies.starts[0].shell.areas
    for place in ((0, 0, 0.28), (0.05, 0.02, 0.2), (0.01, 0, -0.02)):
        put(bodies, [place])
        p = points_of(bodies.starts[0], place)
        deep = np.maximum(depth(p), 0.0)
        assert bodies.potential_energy() == pytest.approx(np.sum(7.0 * areas * deep**3 / 3.0), rel=1e-9)
        push = 7.0 * areas * deep**2
        normals = (0, 0, 1) if name == "flat" else np.add(p, (0, 0, 0.7)) / distance(p, 0.7)[:, None]
        np.testing.assert_allclose(
            bodies.state.force.numpy()[0], (push[:, None] * normals).sum(axis=0), atol=1e-9 * push.sum()
        )


def test_each_body_has_its_own_stiffness():
    """Two balls share the mean of both: points of each are pressed with the stiffness of their own body."""
    pair = world_of(ball((-0.31, 0, 0), 0.3, stiffness=2.0), ball((0.31, 0, 0), 0.3, stiffness=50.0))
    bodies = FreeBodies(pair, 0.0)
    put(bodies, [(-0.27, 0, 0), (0.27, 0, 0)])
    wanted = 0.0
    for start, sign, k in zip(bodies.starts, (-1, 1), (2.0, 50.0), strict=True):
        p = points_of(start, (sign * 0.54, 0, 0))
        deep = np.maximum(0.3 - np.linalg.norm(p, axis=1), 0.0)
        wanted += 0.5 * np.sum(k * start.shell.areas * deep**3 / 3.0)
    assert bodies.potential_energy() == pytest.approx(wanted, rel=1e-9)


def swing(world, dt, until):
    """The greatest change of the total energy, and how it ended."""
    simulation = fs.Simulation(world, fs.Leapfrog(dt))
    bodies = simulation.bodies
    energy, most = body_energy(bodies).total, 0.0
    for time in np.linspace(0.0, until, 31)[1:]:
        simulation.advance(time)
        most = max(most, abs(body_energy(bodies).total - energy))
    return most, bodies


def test_a_thin_body_bounces_off_a_thick_one_with_energy_of_second_order():
    """Its points are finer than the thick one's, and its stiffness is its own; what is kept by both is kept."""
    rod = fs.Segment((-0.3, 0, 0), (0.3, 0, 0))
    motion = fs.Rigid((0.1, 0.05, 0.56), velocity=(0, 0, -1), inertia="solid", stiffness=3e5)
    thin = fs.Body(rod, mass=0.2, surface=fs.Material(radius=0.03), motion=motion)
    world = world_of(ball((0, 0, 0), 0.5, stiffness=3e3), thin)
    swings = []
    for dt in (4e-4, 2e-4, 1e-4):
        most, bodies = swing(world, dt, 0.12)
        swings.append(most)
    np.testing.assert_allclose(np.log2(np.divide(swings[:-1], swings[1:])), 2.0, atol=0.3)
    assert bodies.momenta[1, 2] > 0.0
    np.testing.assert_allclose(body_momentum(bodies).sum(axis=0), (0, 0, -0.2), atol=1e-14)
    np.testing.assert_allclose(body_angular_momentum(bodies).sum(axis=0), (-0.01, 0.02, 0), atol=1e-14)


@pytest.mark.parametrize(
    "motion", [fs.Pose(), fs.Keyframes([0, 9], [(0, 0, 0), (0, 0, 1e-9)])], ids=["still", "moving"]
)
def test_a_wide_body_lands_on_the_tip_of_a_thin_prescribed_one(motion):
    """The tip is thinner than the points of the ball are apart: it has points of its own, which find the ball."""
    needle = fs.Body(fs.Segment((0.05, 0.03, -1), (0.05, 0.03, 0)), surface=fs.Material(radius=0.03), motion=motion)
    world = world_of(needle, ball((0, 0, 1.1), 1.0, velocity=(0, 0, -1), stiffness=3e4))
    swings = []
    for dt in (2e-3, 1e-3):
        most, bodies = swing(world, dt, 0.8)
        swings.append(most)
    assert bodies.momenta[0, 2] > 0.8
    assert np.log2(swings[0] / swings[1]) == pytest.approx(2.0, abs=0.3)
    put(bodies, [(0, 0, 0.9)])
    bodies.potential_energy()
    found = wrenches_of(bodies)
    np.testing.assert_allclose(found.forces[0, 0], bodies.state.force.numpy()[0], atol=1e-12)
    assert found.forces[0, 0, 2] > 1.0
