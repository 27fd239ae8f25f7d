"""Every method of motion in every kind of world: the same bytes however it is run, near to the truth, or refused.

A new integrator is tested here without a line written for it; a new kind of world needs one function.
"""

import functools

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics.refusals import method_refusal

TIME, PARTS = 0.5, 4
CLAY = fs.Material(radius=0.3)


def families(root):
    for one in root.__subclasses__():
        yield one
        yield from families(one)


def method_of(kind):
    return kind(0.0125) if issubclass(kind, fs.Splitting) else kind()


METHODS = {
    kind.__name__: method_of(kind)
    for kind in families(fs.Integrator)
    # `Auto` is replaced by one of the others; its own tests hold what it takes.
    if kind.__module__.startswith("fieldsim.") and kind not in (fs.Splitting, fs.Auto)
}


STILL_POSE = fs.Pose()


def bodies(motion=STILL_POSE, primitive=None, surface=None, **options):
    world = fs.World(**options)
    primitive = primitive or fs.Segment((-0.5, 0, 0), (0.5, 0, 0))
    world.add_body(fs.Body(primitive, gravity=fs.Newtonian(0.1), motion=motion, surface=surface))
    return world


def flying(world, **options):
    """Seven particles, most of which meet a surface within the time, where there is one."""
    positions = np.random.default_rng(3).uniform(-0.6, 0.6, (7, 3)) + np.array((0.0, 0.0, 1.0))
    world.add_particles(positions, [(0.3, 0, -1.5)] * 7, radius=0.02, **options)
    return world


def keyframed():
    return fs.Keyframes([0.0, 0.3, 1.0], [fs.Pose((0, 0, 0)), fs.Pose((0.1, 0, 0)), fs.Pose((0.4, 0.2, 0))])


def with_moon():
    world = bodies()
    motion = fs.Rigid(position=(0, 2, 0), velocity=(-0.5, 0, 0), angular_velocity=(0.0, 0.1, 0.2))
    rod = fs.Segment((-0.2, 0, 0), (0.2, 0, 0))
    world.add_body(fs.Body(rod, gravity=fs.Newtonian(0.1), mass=0.1, motion=motion))
    return flying(world)


SPIN = fs.Spin((0, 1, 0.2), rate=2.0)
WORLDS = {
    "still": lambda: flying(bodies()),
    "spinning": lambda: flying(bodies(SPIN)),
    "keyframed": lambda: flying(bodies(keyframed())),
    "a function": lambda: flying(bodies(lambda t: fs.Pose((0.1 * t * t, 0, 0)))),
    "deforming": lambda: flying(bodies(primitive=fs.Segment((-0.5, 0, 0), lambda t: (0.5 + t, 0.0, 0.0)))),
    "nothing pulls": lambda: flying(fs.World()),
    "bounces": lambda: flying(bodies(surface=CLAY), contact=fs.Bounce(0.6, friction=0.3)),
    "bounces off what spins": lambda: flying(bodies(SPIN, surface=CLAY), contact=fs.Bounce(0.6, friction=0.3)),
    "absorption": lambda: flying(bodies(surface=CLAY), contact=fs.Absorb()),
    "repulsion": lambda: flying(bodies(surface=CLAY), contact=fs.Repulsion(20.0, reach=0.5)),
    "escape": lambda: flying(bodies(escape_radius=1.2)),
    "mutual pulls": lambda: flying(bodies(), gravity=fs.Newtonian(0.05), mass=0.01),
    "a free body": with_moon,
    "two sets": lambda: flying(flying(bodies()), contact=None),
}
# Whether and where an event happens differs from method to method, and repulsion is stiff within these steps.
STILL = {"still", "nothing pulls", "bounces", "absorption", "repulsion", "escape", "mutual pulls", "two sets"}
EVENTFUL = {"bounces", "bounces off what spins", "absorption", "escape"}
STIFF = {"repulsion"}
# The same without an event, or a repulsion.
WITHOUT = {kind: "spinning" if "spins" in kind else "still" for kind in EVENTFUL | STIFF}


@functools.cache
def world_of(kind):
    return WORLDS[kind]()


@functools.cache
def refused(name, kind):
    return method_refusal(METHODS[name], world_of(kind))


def run(name, kind, parts=1, threads=1):
    """Positions and velocities at the end, (2, particles, 3), and the simulation."""
    simulation = fs.Simulation(world_of(kind), METHODS[name], threads=threads)
    for k in range(1, parts + 1):
        simulation.advance(TIME * k / parts)
    return np.array([np.concatenate(simulation.positions), np.concatenate(simulation.velocities)]), simulation


@functools.cache
def first_run(name, kind):
    """What other runs, and the truth, are compared with."""
    return run(name, kind)


every_pair = pytest.mark.parametrize(("name", "kind"), [(name, kind) for name in METHODS for kind in WORLDS])


@every_pair
def test_each_method_moves_each_world_or_refuses_it_when_made(name, kind):
    if refused(name, kind):
        with pytest.raises(fs.InputError, match=r"Simulation: .*which (Radau does|force gradients do) not know"):
            fs.Simulation(world_of(kind), METHODS[name])
        return
    found, simulation = first_run(name, kind)
    assert simulation.time == TIME
    assert np.isfinite(found).all()
    np.testing.assert_array_equal(run(name, kind, threads=2)[0], found)
    # In parts the times of stages, and so where sources are, may round differently.
    still = kind in STILL and isinstance(METHODS[name], fs.Splitting)
    rounding = 0.0 if still else 1e-12
    np.testing.assert_allclose(run(name, kind, parts=PARTS)[0], found, rtol=0.0, atol=rounding)
    snapshots = list(fs.Simulation(world_of(kind), METHODS[name]).snapshots([0.25 * TIME, TIME]))
    np.testing.assert_allclose(np.concatenate(snapshots[-1].positions), found[0], rtol=0.0, atol=rounding)


@functools.cache
def truth(kind):
    """By a method of order 10 with steps a quarter as long, which knows all but contact that is no potential."""
    simulation = fs.Simulation(world_of(kind), fs.SofroniouSpaletta10(0.003125))
    simulation.advance(TIME)
    return np.array([np.concatenate(simulation.positions), np.concatenate(simulation.velocities)])


@every_pair
def test_each_method_is_near_the_truth_or_feels_what_it_meets(name, kind):
    if refused(name, kind):
        return
    found, _ = first_run(name, kind)
    if kind in WITHOUT:
        bare, _ = first_run(name, WITHOUT[kind])
        assert np.abs(found - bare).max() > 1e-2
        return
    error = np.abs(found - truth(kind)).max()
    order = getattr(METHODS[name], "order", 15)
    # Within 0.1 of a Newtonian rod a step of 0.0125 is a hundredth of the time scale there.
    assert error < {2: 5e-3, 4: 2e-5}.get(order, 2e-7), error


@pytest.mark.parametrize("kind", sorted(EVENTFUL))
def test_each_event_happens(kind):
    """Otherwise the tests above show nothing of it."""
    _, simulation = first_run("Leapfrog", kind)
    census = simulation.census()
    assert len(simulation.events) > 0
    assert census["moving"] < 7 or simulation.bounces > 0


def test_every_refusal_stands_in_the_table_once():
    """Some are refused and most are not: a table that refuses all, or none, would pass the tests above."""
    count = sum(bool(refused(name, kind)) for name in METHODS for kind in WORLDS)
    assert 8 < count < len(METHODS) * len(WORLDS) / 3
