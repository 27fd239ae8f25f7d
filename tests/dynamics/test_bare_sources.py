"""A start on a bare source is refused in words, by whatever starts there; beside it and on soft ones it is not."""

import numpy as np
import pytest

import fieldsim as fs

STILL = fs.Pose()
ORIGIN = fs.Point((0, 0, 0))
WIRE = fs.Segment((-1, 0, 0), (1, 0, 0))
RING = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
PLACES = [
    (ORIGIN, (0, 0, 0)),
    (WIRE, (0.3, 0, 0)),
    (WIRE, (1, 0, 0)),
    (WIRE, (0, 0, 0)),
    (RING, (1, 0, 0)),
    (RING, (0.6, 0.8, 0)),  # on it but for rounding
    (fs.Arc((0, 0, 0), (0, 0, 1), (1, 0, 0), 1.0, 1.0), (np.cos(0.5), np.sin(0.5), 0)),
    (fs.TaperedSegment((-1, 0, 0), (1, 0, 0), 1.0, 2.0), (0.3, 0, 0)),
]
TEXT = r"Simulation: .* is at .*, on the bare skeleton of Body 0 \(it\), where the potential is infinite; .*softening="


def world_of(skeleton, place, gravity=None, motion=STILL, free=False):
    world = fs.World()
    world.add_body(fs.Body(skeleton, gravity=gravity or fs.Newtonian(), mass=1.0, motion=motion, name="it"))
    if free:
        world.add_body(fs.Body(ORIGIN, motion=fs.Rigid(place)))
    else:
        world.add_particles([(5, 0, 0)], [(0, 0, 0)])
        world.add_particles([(6, 0, 0), place], [(0, 0, 0), (0, 0.1, 0)])
    return world


@pytest.mark.parametrize(("skeleton", "place"), PLACES)
@pytest.mark.parametrize("free", [False, True])
def test_a_start_on_a_bare_source_is_refused(skeleton, place, free):
    with pytest.raises(fs.InputError, match=TEXT) as told:
        fs.Simulation(world_of(skeleton, place, free=free))
    assert ("mass of Body 1" if free else "particle 1 of set 1") in str(told.value)
    fs.Simulation(world_of(skeleton, place, gravity=fs.Newtonian(1e-3), free=free))
    fs.Simulation(world_of(skeleton, np.add(place, (0, 0, 1e-9)), free=free))


def test_discs_are_bare_where_their_potential_is_infinite():
    disc = fs.disc((0, 0, 0), (0, 0, 1), 1.0)
    fs.Simulation(world_of(disc, (0.1, 0.2, 0)))  # under 1 / r it is finite, and so is its slope
    with pytest.raises(fs.InputError, match=TEXT):
        fs.Simulation(world_of(disc, (0.1, 0.2, 0), gravity=fs.InverseSquare()))


@pytest.mark.parametrize(
    "motion",
    [
        fs.Pose((3.0, 0.1, 0.7)),
        fs.Pose((1e6, -2e6, 3e5), fs.Pose.turned((1, 2, 3), 1.0).rotation),
        fs.Spin(rate=2.0, axis=(1, 1, 0), phase=0.3),
        fs.Rigid((0.1, 0.2, 0.3), fs.Pose.turned((1, 2, 3), 2.0).rotation),
    ],
)
def test_wherever_the_source_is(motion):
    pose = motion(0.5) if callable(motion) else motion
    place = tuple(pose.apply((0.3, 0, 0)))
    with pytest.raises(fs.InputError, match=TEXT):
        fs.Simulation(world_of(WIRE, place, motion=motion), time=0.5)


@pytest.mark.parametrize(
    "use",
    [
        lambda world: fs.Simulation(world, fs.Radau()),
        lambda world: fs.Simulation(world, "auto"),
        lambda world: fs.poincare(world, fs.Section(), 1.0),
        lambda world: fs.poincare(world, fs.Section(), 1.0, fs.Radau()),
        lambda world: fs.lyapunov(world, 1.0),
    ],
)
def test_every_tool_refuses_it(use):
    with pytest.raises(fs.InputError, match=TEXT):
        use(world_of(WIRE, (0.3, 0, 0)))


def test_where_potentials_cancel_there_is_no_source():
    world = world_of(fs.Point((-1, 0, 0)), (0, 0.5, 0))
    world.add_body(fs.Body(fs.Point((1, 0, 0)), gravity=fs.Newtonian(), mass=-1.0))
    world.add_body(fs.Body(fs.Point((0, 0.5, 0)), gravity=fs.Newtonian(), mass=0.0))
    fs.Simulation(world).advance(0.1)


def test_bodies_and_particles_that_pull_at_one_place():
    world = fs.World()
    for _ in range(2):
        world.add_body(fs.Body(ORIGIN, gravity=fs.Newtonian(), motion=fs.Rigid((0.3, 0.1, 0.2))))
    with pytest.raises(fs.InputError, match=r"mass of Body 1 is at .* on the bare skeleton of Body 0"):
        fs.Simulation(world)
    world = fs.World()
    world.add_particles([(1, 0, 0), (0.1, 0, 0)], np.zeros((2, 3)))
    world.add_particles([(2, 0, 0), (0.1, 0, 0)], np.zeros((2, 3)), gravity=fs.Newtonian())
    with pytest.raises(fs.InputError, match="particle 1 of set 0 and particle 1 of set 1 pull each other at one place"):
        fs.Simulation(world)
    world = fs.World()
    world.add_particles([(1, 0, 0), (1, 0, 0)], np.zeros((2, 3)), gravity=fs.Newtonian(0.1))
    fs.Simulation(world)


def test_a_passage_through_a_source_is_told_of_and_leaves_no_nan():
    """Exactly through a point: rounding makes a number of what has none, and the log a warning."""
    world = world_of(ORIGIN, (1.0, 0, 0))
    object.__setattr__(world.particles[1], "velocities", np.array([(0, 0, 0), (-1.0, 0, 0)]))
    simulation = fs.Simulation(world, fs.Leapfrog(0.5))
    log = fs.EnergyLog(simulation)
    simulation.advance(1.0)
    with pytest.warns(fs.FieldsimWarning, match="has drifted by"):
        log.record()
    simulation.advance(1.5)
    log.record()
    assert not np.isnan(log.report().largest)
    assert not np.isnan(log.report().rms)
