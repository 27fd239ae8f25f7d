"""What is handed out is a copy to read only, and snapshots fit their world."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

import fieldsim as fs

SKIN = fs.Material(radius=0.2)


def world():
    made = fs.World(escape_radius=50.0)
    made.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(0.1), surface=SKIN))
    made.add_body(fs.Body(fs.Point((0, 0, 0)), mass=0.1, motion=fs.Rigid((0, 3, 0))))
    made.add_particles([(1, 0, 0), (2, 0, 0)], [(0, 1, 0), (0, 0, 0)], contact=fs.Bounce(0.5))
    made.add_particles([(3, 0, 0)], [(0, 0, 0)])
    made.add_shape([fs.Ball((0, 0, 1), 0.2), fs.Ball((0, 0, 2), 0.2)])
    return made


def arrays_of(simulation):
    """Every array that a simulation hands out, by name."""
    snapshot, bodies, events = simulation.snapshot(), simulation.bodies, simulation.events
    found = {f"particles.{name}": getattr(simulation.world.particles[0], name) for name in ("positions", "velocities")}
    for name in ("positions", "velocities", "states", "spins", "bounce_counts"):
        found |= {f"{name}[{k}]": array for k, array in enumerate(getattr(simulation, name))}
    for name in ("positions", "velocities"):
        found |= {f"snapshot.{name}[{k}]": array for k, array in enumerate(getattr(snapshot, name))}
        found |= {f"at.{name}[{k}]": array for k, array in enumerate(getattr(simulation.world.at(0.0), name))}
    for name in ("masses", "centers", "momenta", "spins", "angular_velocities", "kinetic_energies"):
        found[f"bodies.{name}"] = getattr(bodies, name)
    found |= {f"events.{f.name}": getattr(events, f.name) for f in dataclasses.fields(events) if f.name != "made"}
    found["strengths"] = simulation.mutual.strengths
    found["accelerations"] = bodies.accelerations()
    found |= {f"wrenches.{name}": getattr(simulation.wrenches(), name) for name in ("forces", "torques")}
    found |= {f"snapshot.spheres[{k}]": array for k, array in enumerate(snapshot.spheres)}
    return found


def test_arrays_that_are_handed_out_refuse_to_be_written():
    simulation = fs.Simulation(world(), fs.Leapfrog(0.01))
    simulation.advance(4.0)
    assert len(simulation.events)
    for array in arrays_of(simulation).values():
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0
    with pytest.raises(TypeError):
        simulation.velocities[0] = np.zeros((2, 3))
    with pytest.raises(AttributeError):
        simulation.time = 0.0
    # Those that were handed out stay as they were.
    before = simulation.positions[0]
    kept = before.copy()
    simulation.advance(4.5)
    np.testing.assert_array_equal(before, kept)


def test_what_users_give_is_copied_and_stays_theirs():
    rows = np.array([(1.0, 0, 0)])
    made = fs.World()
    made.add_particles(rows, rows)
    snapshot = fs.Snapshot(made, 0.0, (), [rows], [rows])
    rows[:] = 7.0
    for array in (made.particles[0].positions, snapshot.positions[0], snapshot.velocities[0]):
        np.testing.assert_array_equal(array, [(1.0, 0, 0)])


CHANGES = [
    lambda made: made.add_body(fs.Body(fs.Point((9, 0, 0)))),
    lambda made: made.add_particles([(9, 0, 0)], [(0, 0, 0)]),
    lambda made: setattr(made, "particles", made.particles[:-1]),
    lambda made: setattr(made, "bodies", made.bodies[::-1]),
    lambda made: setattr(made, "escape_radius", 0.5),
]


@pytest.mark.parametrize("change", CHANGES)
def test_a_world_that_changes_under_way_is_refused(change):
    made = world()
    simulation = fs.Simulation(made, fs.Leapfrog(0.01))
    with pytest.raises(fs.InputError, match="make another Simulation"):
        change(simulation.world)
    simulation.advance(0.01)
    change(made)
    with pytest.raises(fs.InputError, match="make another Simulation"):
        simulation.advance(1.0)
    with pytest.raises(fs.InputError, match="make another Simulation"):
        simulation.snapshot()


LOOKS = [
    lambda made: made.add_shape(fs.Ball()),
    lambda made: setattr(made, "lights", [fs.PointLight(position=(0, 0, 5))]),
    lambda made: setattr(made, "note", "kept"),
]


@pytest.mark.parametrize("change", CHANGES + LOOKS)
def test_a_frozen_world_stays_as_it_is(change):
    made = world()
    value = made.frozen()
    assert made.frozen() is value is value.frozen(), "one value until the world changes"
    before = vars(value).copy()
    with pytest.raises(fs.InputError, match="stays as it is"):
        change(value)
    with pytest.raises(fs.InputError, match="stays as it is"):
        del value.fog
    change(made)
    assert vars(value) == before
    assert made.frozen() is not value
    own = value.replace()
    change(own)
    assert vars(value) == before
    for copied in (copy.copy(value), pickle.loads(pickle.dumps(value))):
        with pytest.raises(fs.InputError, match="stays as it is"):
            change(copied)


@pytest.mark.parametrize("name", ["bodies", "particles", "shapes", "lights"])
def test_what_a_world_holds_is_no_back_door(name):
    held = getattr(world(), name)
    assert type(held) is tuple
    for refused in ("append", "clear", "pop", "reverse", "__setitem__"):
        assert not hasattr(held, refused)


def test_what_is_only_seen_may_change_under_way():
    made = world()
    simulation = fs.Simulation(made, fs.Leapfrog(0.01))
    before = simulation.snapshot()
    made.add_shape(fs.Ball())
    made.fog = fs.Fog(0.1)
    simulation.advance(0.1)
    after = simulation.snapshot()
    assert (len(before.world.shapes), before.world.fog) == (1, None)
    assert (len(after.world.shapes), after.world.fog) == (2, fs.Fog(0.1))
    assert after.world is simulation.world is made.frozen()


def test_without_free_bodies_there_are_no_rows():
    bodies = fs.Simulation(fs.World()).bodies
    shapes = {name: getattr(bodies, name).shape for name in ("masses", "centers", "spins", "kinetic_energies")}
    assert shapes == {"masses": (0,), "centers": (0, 3), "spins": (0, 3), "kinetic_energies": (0,)}
    assert bodies.potential_energy() == 0.0


PLACES = (np.zeros((2, 3)), np.tile((1.0, 0, 0, 0), (2, 1)))
BAD = [
    ("world", 1, "give a fs.World"),
    ("time", np.nan, "time is nan"),
    ("time", "0", "time is '0'"),
    ("poses", (), "0 poses for 2 bodies of its world"),
    ("poses", (fs.Pose(),) * 3, "3 poses for 2 bodies"),
    ("poses", fs.Pose(), "give a list"),
    ("poses", ((0, 0, 0), (0, 0, 0)), r"poses\[0\] is \(0, 0, 0\); give a fs.Pose"),
    ("poses", None, "poses is None"),
    ("positions", (np.zeros((2, 3)),), "1 positions for 2 sets of particles"),
    ("positions", (np.zeros((3, 3)), np.zeros((1, 3))), r"3 rows of positions\[0\] for 2 particles"),
    ("velocities", (np.zeros((2, 3)), np.zeros((100, 3))), r"100 rows of velocities\[1\]"),
    ("velocities", (np.zeros((2, 3)), np.zeros((0, 3))), r"0 rows of velocities\[1\]"),
    ("positions", (np.zeros((2, 2)), np.zeros((1, 3))), r"positions\[0\] has shape \(2, 2\)"),
    ("positions", (np.full((2, 3), np.nan), np.zeros((1, 3))), r"positions\[0\]\[0\] is \(nan"),
    ("velocities", (np.zeros((2, 3), complex), np.zeros((1, 3))), "complex numbers"),
    ("positions", 3, "positions is 3"),
    ("shape_poses", (), "0 shape_poses for 1 groups"),
    ("shape_poses", (PLACES, PLACES), "2 shape_poses for 1 groups"),
    ("shape_poses", (PLACES[0],), r"poses of shape \(3,\)|has shape"),
    ("shape_poses", ((*PLACES, 1),), r"shape_poses\[0\] has 3 parts"),
    ("shape_poses", ((PLACES[0][:1], PLACES[1][:1]),), "2 shapes; give"),
    ("shape_poses", ((PLACES[0], np.full((2, 4), np.nan)),), "give finite numbers"),
    ("shape_poses", ((PLACES[0], "turned"),), "'turned'"),
    ("shape_poses", 1, "shape_poses is 1"),
]


@pytest.mark.parametrize(("name", "value", "text"), BAD)
def test_a_snapshot_that_does_not_fit_its_world_is_refused(name, value, text):
    whole = world().at(0.0)
    fields = {f.name: getattr(whole, f.name) for f in dataclasses.fields(whole)}
    fs.Snapshot(**fields | {"shape_poses": (PLACES,)})
    with pytest.raises(fs.InputError, match=text):
        fs.Snapshot(**fields | {name: value})


@pytest.mark.parametrize("change", CHANGES + LOOKS)
def test_a_snapshot_stays_what_it_was_whatever_its_world_gets(change):
    made = world()
    snapshot, wanted = made.at(0.0), made.at(0.0)
    place = (0.1, 0.2, 0.3)
    kept = [wanted.surface_field().value(place), wanted.spheres, wanted.world.lights]
    change(made)
    np.testing.assert_equal([snapshot.surface_field().value(place), snapshot.spheres, snapshot.world.lights], kept)
    fields = {f.name: getattr(snapshot, f.name) for f in dataclasses.fields(snapshot)}
    fs.Snapshot(**fields)


@pytest.mark.parametrize(
    "change",
    [
        lambda made: setattr(made, "escape_radius", 0.5),
        lambda made: setattr(made, "bodies", made.bodies[1:]),
        lambda made: made.add_body(made.bodies[0]),
        lambda made: setattr(made, "particles", made.particles[1:]),
    ],
)
def test_what_a_world_is_given_later_does_not_move_in_silence(change):
    made = world()
    simulation = fs.Simulation(made, fs.Leapfrog(0.01))
    wanted = simulation.wrenches()
    change(made)
    for call in (lambda: simulation.advance(0.1), simulation.snapshot, simulation.wrenches):
        with pytest.raises(fs.InputError, match="escape_radius"):
            call()
    # The free bodies still tell what acts on them.
    np.testing.assert_array_equal(simulation.bodies.wrenches()[0], wanted.forces)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("bodies", ["planet"]),
        ("particles", np.zeros((2, 3))),
        ("shapes", None),
        ("lights", 3),
        ("background", "blue"),
        ("fog", 0.2),
        ("escape_radius", -1.0),
        ("escape_radius", "far"),
    ],
)
def test_what_is_assigned_to_a_world_is_checked(name, value):
    made = world()
    before = getattr(made, name)
    with pytest.raises(fs.InputError, match=f"World: {name}"):
        setattr(made, name, value)
    with pytest.raises(fs.InputError, match=rf"World.replace: {name}"):
        made.replace(**{name: value})
    assert getattr(made, name) is before
