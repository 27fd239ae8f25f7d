"""Absorption, escape, repulsion, and the books that are kept of what happens to particles."""

import numpy as np
import pytest

import fieldsim as fs

BALL = 0.02
REST = 0.52


def planet(motion=None, **options):
    """A world with one Gaussian ball of radius 0.5 and mass 1 at the origin."""
    world = fs.World(**options)
    motion = fs.Pose() if motion is None else motion
    body = fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), surface=fs.Material(radius=0.5), motion=motion)
    world.add_body(body)
    return world


def directions(count, seed=0):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def test_every_particle_ends_up_in_the_books():
    world = planet(escape_radius=4.0)
    start = 1.5 * directions(120)
    speed = np.linspace(0.0, 3.0, 120)[:, None]
    world.add_particles(start[:60], speed[::2] * directions(60, seed=1), radius=BALL, contact=fs.Absorb())
    world.add_particles(start[60:], speed[1::2] * directions(60, seed=2), radius=BALL, contact=fs.Bounce(0.3, 0.5))
    simulation = fs.Simulation(world, fs.Leapfrog(1e-3), threads=1, log=64)
    for time in (0.5, 2.0, 20.0):
        simulation.advance(time)
        assert sum(simulation.census().values()) == 120
    census, events, states = simulation.census(), simulation.events, np.concatenate(simulation.states)
    assert min(census["resting"], census["absorbed"], census["escaped"]) > 10
    for kind, state in (("absorb", fs.Status.ABSORBED), ("escape", fs.Status.ESCAPED)):
        np.testing.assert_array_equal(np.sort(events.particles[events.kinds == kind]), np.flatnonzero(states == state))
    positions = np.concatenate(simulation.positions)
    distance = np.linalg.norm(positions, axis=1)
    np.testing.assert_allclose(distance[states == fs.Status.ABSORBED], REST, atol=1e-10)
    assert (distance[states == fs.Status.RESTING] - REST < 1e-10).all()
    gone = distance[states == fs.Status.ESCAPED]
    # Beyond the radius by less than a step of the fastest.
    assert (gone > 4.0).all()
    assert (gone < 4.0 + 4e-3).all()
    taken = events.kinds == "absorb"
    np.testing.assert_array_equal(np.concatenate(simulation.velocities)[events.particles[taken]], 0.0)
    np.testing.assert_allclose(np.linalg.norm(events.positions[taken], axis=1), 0.5, atol=1e-10)
    # Frozen: nothing of them changes any more.
    simulation.advance(21.0)
    frozen = states >= fs.Status.ABSORBED
    np.testing.assert_array_equal(np.concatenate(simulation.positions)[frozen], positions[frozen])


def test_escape_needs_no_surface():
    world = fs.World(escape_radius=3.0)
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian()))
    world.add_particles([(1.0, 0, 0), (1.0, 0, 0)], [(0, 2.0, 0), (0, 1.0, 0)])
    simulation = fs.Simulation(world, fs.Leapfrog(1e-3), threads=1)
    simulation.advance(20.0)
    assert simulation.census() == {"moving": 1, "resting": 0, "absorbed": 0, "escaped": 1}
    (time,) = simulation.events.times
    free = fs.World()
    free.add_body(world.bodies[0])
    free.add_particles([(1.0, 0, 0)], [(0, 2.0, 0)])
    other = fs.Simulation(free, fs.Leapfrog(1e-3), threads=1)
    other.advance(time)
    # The same steps; the last advance ends at `time`, which is a whole number of them up to rounding.
    np.testing.assert_allclose(other.positions[0][0], simulation.positions[0][0], atol=1e-11)
    assert fs.energy(simulation.snapshot()).total == pytest.approx([1.0, -0.5], abs=1e-5)


def test_an_absorbed_particle_turns_with_the_body_that_took_it():
    world = planet(motion=fs.Spin(rate=1.0))
    world.add_particles([(0.7, 0, 0)], [(-1.0, 0, 0)], radius=BALL, contact=fs.Absorb())
    simulation = fs.Simulation(world, fs.Leapfrog(1e-3), threads=1)
    simulation.advance(0.5)
    (taken,) = simulation.events.times
    angle = 0.5 - taken
    np.testing.assert_allclose(simulation.positions[0], [[REST * np.cos(angle), REST * np.sin(angle), 0]], atol=1e-9)
    np.testing.assert_allclose(simulation.velocities[0], np.cross([0, 0, 1.0], simulation.positions[0]), atol=1e-9)


def test_an_absorbed_particle_is_carried_by_growing_ground():
    growing = fs.Material(radius=fs.Keyframes([0.0, 1.0], [0.4, 0.6], interpolation="linear"))
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=growing, motion=lambda time: (0.0, 0.3 * time, 0.0)))
    world.add_particles([(0.45, 0, 0)], [(0, 0, 0)], radius=BALL, contact=fs.Absorb())
    simulation = fs.Simulation(world, fs.Leapfrog(1e-3), threads=1)
    simulation.advance(1.0)
    from_center = simulation.positions[0][0] - [0, 0.3, 0]
    assert np.linalg.norm(from_center) == pytest.approx(0.62, abs=1e-6)


def test_the_log_keeps_the_latest_of_each_and_counts_all():
    ends = []
    for log in (3, 400):
        world = planet()
        world.add_particles(
            [(0.9, 0, 0), (0, 1.1, 0), (0, 0, 9.0)], np.zeros((3, 3)), radius=BALL, contact=fs.Bounce(0.8)
        )
        simulation = fs.Simulation(world, fs.Leapfrog(1e-3), threads=1, log=log)
        simulation.advance(8.0)
        ends.append((simulation.events, simulation.bounces))
    (few, bounces), (many, _) = ends
    assert few.made == many.made == len(many)
    assert len(few) == 6
    assert (np.diff(many.times) >= 0.0).all()
    for particle in (0, 1):
        last = many.times[many.particles == particle][-3:]
        np.testing.assert_array_equal(few.times[few.particles == particle], last)
        assert many.kinds[many.particles == particle][-1] == "land"
    # The last bounce leaves so slowly that it is a landing too: two events, one contact.
    assert bounces == len(np.unique(np.column_stack([many.times, many.particles]), axis=0))
    first = many.impulses[many.particles == 0][0]
    fall = np.sqrt(2 * (1 / REST - 1 / 0.9))
    # The fall's speed is leapfrog's, of order dt^2.
    np.testing.assert_allclose(first, [1.8 * fall, 0, 0], atol=1e-5)


def test_repulsion_keeps_the_energy_and_the_ground():
    drifts = []
    for dt in (4e-3, 2e-3, 1e-3):
        world = planet()
        start = 1.2 * directions(40)
        across = np.cross(start, directions(40, seed=1))
        law = fs.Repulsion(stiffness=4.0, reach=0.2)
        world.add_particles(start, 0.5 * across, radius=BALL, contact=law)
        simulation = fs.Simulation(world, fs.Leapfrog(dt), threads=1)
        before = fs.energy(simulation.snapshot()).total
        worst, nearest = 0.0, 1.0
        for snapshot in simulation.snapshots(np.linspace(0.05, 12.0, 240)):
            worst = max(worst, np.abs(fs.energy(snapshot).total - before).max())
            nearest = min(nearest, np.linalg.norm(snapshot.positions[0], axis=1).min())
        drifts.append(worst)
    # Energy 4 is needed to touch; they fall with 1 or less, which is there at the gap 0.2 (1 - 4^(-1/3)) = 0.074.
    assert REST < nearest < REST + 0.1
    assert (np.log2(np.divide(drifts[:-1], drifts[1:])) > 1.7).all(), drifts
    assert len(simulation.events) == 0
    # What it is made of: the potential's slope is the force.
    points = np.array([[0.53, 0, 0], [0, 0.4, 0], [0, 0, 2.0]])
    world.particles = ()
    world.add_particles(points, np.zeros((3, 3)), contact=law)
    simulation = fs.Simulation(world, fs.Leapfrog(1e-6), threads=1)
    simulation.advance(1e-6)
    step = 1e-6
    for k, point in enumerate(points):
        heights = []
        for sign in (1, -1):
            world.particles = ()
            world.add_particles([point * (1 + sign * step)], [(0, 0, 0)], contact=law)
            heights.append(fs.energy(world.at(0.0)).potential[0])
        slope = (heights[0] - heights[1]) / (2 * step * np.linalg.norm(point))
        outward = point / np.linalg.norm(point)
        assert simulation.velocities[0][k] @ outward / 1e-6 == pytest.approx(-slope, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fs.World(escape_radius=0.0), "escape_radius is 0"),
        (lambda: fs.World(escape_radius=float("inf")), "escape_radius is inf"),
        (lambda: fs.Repulsion(-1.0), "stiffness is -1"),
        (lambda: fs.Repulsion(1.0, reach=0.0), "reach is 0"),
        (lambda: fs.Simulation(planet(escape_radius=1.0), log=0), "log is 0"),
        (lambda: fs.Particles(np.zeros((1, 3)), np.zeros((1, 3)), contact=0.5), r"contact is 0\.5"),
    ],
)
def test_nonsense_is_refused(make, words):
    with pytest.raises(fs.InputError, match=words):
        make()
