"""Manoeuvres: what is set in a run moves on as in a simulation that starts so, and logs know that it was set."""

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics.rigid.diagnostics import body_energy

WIRE = fs.Segment((-1, 0, 0), (1, 0, 0))
ORIGIN = fs.Point((0, 0, 0))
SKIN = fs.Material(radius=0.3)
LAW = fs.Newtonian(softening=0.1)
STARTS = [(2.0, 0, 0), (3.0, 0, 0.5)], [(0, 0.6, 0), (0, 0.5, 0.1)]
STILL = fs.Body(WIRE, gravity=LAW)
SPINNING = fs.Body(WIRE, gravity=LAW, motion=fs.Spin(rate=0.7))
WOBBLING = fs.Body(WIRE, gravity=LAW, motion=lambda t: (0.1 * np.sin(t), 0, 0))


def world_of(*bodies, particles=(), **options):
    world = fs.World(**options)
    for body in bodies:
        world.add_body(body)
    for positions, velocities, more in particles:
        world.add_particles(positions, velocities, **more)
    return world


def orbits(body=STILL, **more):
    return world_of(body, particles=[(*STARTS, more), ([(0, 2.5, 0)], [(0.5, 0, 0)], more)])


def restarted(simulation):
    """A simulation that starts where another one is."""
    sets = zip(simulation.positions, simulation.velocities, simulation.world.particles, strict=True)
    fields = ("radius", "contact", "gravity", "mass", "G")
    world = simulation.world.replace(
        particles=[fs.Particles(x, v, **{name: getattr(p, name) for name in fields}) for x, v, p in sets]
    )
    return fs.Simulation(world, simulation.integrator, time=simulation.time, threads=1)


def state(simulation):
    bodies = simulation.bodies
    rows = [*simulation.positions, *simulation.velocities, bodies.centers, bodies.momenta, bodies.spins]
    return np.concatenate([array.ravel() for array in rows])


def burnt(simulation):
    """The simulation, all particles of which were given another place and motion."""
    for index, (x, v) in enumerate(zip(simulation.positions, simulation.velocities, strict=True)):
        simulation.set_particles(index, positions=x + np.array([0.1, 0, 0.05]), velocities=1.2 * v)
    return simulation


# Particles


@pytest.mark.parametrize("body", [STILL, SPINNING, WOBBLING], ids=["still", "spin", "wobble"])
@pytest.mark.parametrize("method", [fs.Leapfrog(0.02), fs.BlanesMoan6(0.05), fs.Omelyan4(0.05), fs.Radau()])
def test_what_was_set_flies_as_from_a_start_there(method, body):
    simulation = fs.Simulation(orbits(body), method, threads=1)
    simulation.advance(1.3)
    other = restarted(burnt(simulation))
    np.testing.assert_array_equal(state(simulation), state(other))
    for time in (1.3, 1.7, 4.0):
        simulation.advance(time)
        other.advance(time)
        if isinstance(method, fs.Radau) and body is not STILL:  # its table of what moves goes on
            np.testing.assert_allclose(state(simulation), state(other), atol=1e-12)
        else:
            np.testing.assert_array_equal(state(simulation), state(other))


@pytest.mark.parametrize("method", [fs.Leapfrog(0.02), fs.BlanesMoan6(0.05), fs.Radau()])
def test_the_others_go_on_as_if_nothing_had_happened(method):
    one, other, third = (fs.Simulation(orbits(SPINNING), method, threads=1) for _ in range(3))
    for simulation in (one, other, third):
        simulation.advance(1.3)
    rows = one.velocities[0].copy()
    rows[1] += (0, 0, 0.3)
    one.set_particles(0, velocities=rows)
    third.set_particles(0, positions=third.positions[0], velocities=third.velocities[0])  # changes nothing
    for simulation in (one, other, third):
        simulation.advance(3.0)
    np.testing.assert_array_equal(one.positions[0][0], other.positions[0][0])
    np.testing.assert_array_equal(one.positions[1], other.positions[1])
    assert np.linalg.norm(one.positions[0][1] - other.positions[0][1]) > 0.1
    np.testing.assert_array_equal(state(third), state(other))


def test_radau_that_flew_ahead_comes_back():
    """As after an interrupted run, whose table of what moves has gone on."""
    simulation = fs.Simulation(orbits(SPINNING), fs.Radau(), threads=1)
    start = simulation.radau.steps
    simulation.radau.advance(30.0)
    assert simulation.radau._windows.start > 0.0
    flown = simulation.radau.steps
    other = restarted(burnt(simulation))
    for each in (simulation, other):
        each.advance(2.0)
    np.testing.assert_array_equal(state(simulation), state(other))
    assert start == 0
    assert simulation.steps_done == flown + other.steps_done


def test_particles_that_pull_each_other():
    simulation = fs.Simulation(orbits(gravity=LAW, mass=0.1), fs.Leapfrog(0.02), threads=1)
    log = fs.EnergyLog(simulation)
    simulation.advance(1.0)
    other = restarted(burnt(simulation))
    for time in (1.5, 2.0):
        simulation.advance(time)
        other.advance(time)
        log.record()
    np.testing.assert_array_equal(state(simulation), state(other))
    (drift,) = log.report().totals
    assert drift.largest < 1e-4


GROUND = fs.Body(fs.Plane((0, 0, 0), (0, 0, 1)), surface=fs.Material(radius=0.5))
DEEP = fs.Body(fs.Plane((0, 0, -5), (0, 0, 1)), surface=fs.Material(radius=0.5))
SUN = fs.Body(fs.Point((0, 0, -50)), gravity=fs.Newtonian(), mass=2500.0)


@pytest.mark.parametrize("contact", [fs.Bounce(0.3, friction=0.5), fs.Absorb()])
def test_what_rests_is_thrown_again(contact):
    """A landed ball that is thrown flies as one that starts there; bounces and events are kept, and go on."""
    at, v = [(0.0, 0, 0.8), (3.0, 0, 0.8)], [(0, 0, 0), (0, 0, 0)]
    world = world_of(GROUND, SUN, particles=[(at, v, {"radius": 0.1, "contact": contact})])
    simulation = fs.Simulation(world, fs.Leapfrog(0.01), threads=1)
    simulation.advance(4.0)
    status = fs.Status.RESTING if isinstance(contact, fs.Bounce) else fs.Status.ABSORBED
    np.testing.assert_array_equal(simulation.states[0], status)
    events, bounces, there = len(simulation.events), simulation.bounces, simulation.positions[0]
    simulation.set_particles(0, velocities=[(0.5, 0, 1.5), (0, 0, 0)])
    assert simulation.states[0].tolist() == [fs.Status.MOVING, status]
    assert (len(simulation.events), simulation.bounces) == (events, bounces)
    other = restarted(simulation)
    for each in (simulation, other):
        each.advance(5.0)
    np.testing.assert_array_equal(simulation.positions[0][0], other.positions[0][0])
    assert simulation.positions[0][0][2] > there[0][2] + 0.3
    np.testing.assert_array_equal(simulation.positions[0][1], there[1])
    simulation.advance(9.0)
    assert simulation.bounces > bounces
    assert simulation.states[0][0] == status


def test_what_escaped_comes_back():
    world = world_of(STILL, particles=[([(2.0, 0, 0)], [(9.0, 0, 0)], {})], escape_radius=5.0)
    simulation = fs.Simulation(world, fs.Leapfrog(0.01), threads=1)
    log = fs.EnergyLog(simulation)
    simulation.advance(1.0)
    log.record()
    assert simulation.census()["escaped"] == 1
    simulation.set_particles(0, positions=[(2.0, 0, 0)], velocities=[(0, 0.6, 0)])
    other = restarted(simulation)
    for each in (simulation, other):
        each.advance(2.0)
    log.record()
    np.testing.assert_array_equal(state(simulation), state(other))
    assert simulation.census()["moving"] == 1
    assert log.report().particles == 1
    assert log.report().largest < 1e-3


def test_spins_are_set_too():
    rolling = {"radius": 0.1, "contact": fs.Bounce(0.3, friction=1.0, rolling=True)}
    simulation = fs.Simulation(
        world_of(GROUND, SUN, particles=[([(0, 0, 0.8)], [(0, 0, 0)], rolling)]), fs.Leapfrog(0.01)
    )
    simulation.set_particles(0, spins=[(0, 5.0, 0)])
    np.testing.assert_array_equal(simulation.spins[0], [(0, 5.0, 0)])
    simulation.advance(3.0)
    assert simulation.positions[0][0][0] > 0.1  # it rolled off


def test_places_within_things():
    world = world_of(fs.Body(ORIGIN, gravity=fs.Newtonian(), surface=SKIN), particles=[([(2, 0, 0)], [(0, 0, 0)], {})])
    world.add_particles([(3.0, 0, 0)], [(0, 0, 0)], radius=0.1, contact=fs.Bounce())
    simulation = fs.Simulation(world, fs.Leapfrog(0.01))
    before = state(simulation)
    with pytest.raises(fs.InputError, match=r"particle 0 of set 0 is at .* bare skeleton of Body 0"):
        simulation.set_particles(0, positions=[(0, 0, 0)], velocities=[(1, 1, 1)])
    np.testing.assert_array_equal(state(simulation), before)
    with pytest.warns(fs.FieldsimWarning, match="1 of 2 particles start inside a surface and were moved out"):
        simulation.set_particles(1, positions=[(0.1, 0, 0)])
    assert np.linalg.norm(simulation.positions[1]) == pytest.approx(0.4, abs=1e-6)
    np.testing.assert_array_equal(simulation.positions[0], [(2, 0, 0)])


# Free bodies


def bodies(*more):
    one = fs.Rigid((2.0, 0, 0), velocity=(0, 0.4, 0), angular_velocity=(0, 0.3, 0.5), inertia="solid")
    two = fs.Rigid((-2.0, 0, 0), velocity=(0, -0.4, 0.1))
    made = [fs.Body(WIRE, LAW, motion=one, surface=SKIN), fs.Body(ORIGIN, LAW, motion=two, surface=SKIN), *more]
    return world_of(*made, particles=[(*STARTS, {})])


TURN = fs.Pose.turned((1, 2, 3), 0.7).rotation
SETS = [
    {"velocity": (0.1, 0.2, 0.3)},
    {"angular_velocity": (0.5, -0.2, 0.1)},
    {"position": (2.5, 1.0, 0.3)},
    {"rotation": TURN},
    {"position": (3.0, 0, 1.0), "rotation": TURN, "velocity": (0, 0, 0), "angular_velocity": (0, 0, 1)},
]


@pytest.mark.parametrize("given", SETS, ids=lambda given: "+".join(given))
def test_bodies_that_were_set_move_as_from_a_start_there(given):
    simulation = fs.Simulation(bodies(), fs.Leapfrog(0.002), threads=1)
    log = fs.EnergyLog(simulation)
    simulation.advance(1.0)
    rows = simulation.bodies
    before = {"velocity": rows.momenta / rows.masses[:, None], "angular_velocity": rows.angular_velocities}
    poses, other = simulation.snapshot().poses, rows.centers[1]
    simulation.set_body(0, **given)
    for name, value in given.items():
        found = {
            "position": simulation.snapshot().poses[0].position,
            "rotation": simulation.snapshot().poses[0].rotation,
            "velocity": rows.momenta[0] / rows.masses[0],
            "angular_velocity": rows.angular_velocities[0],
        }[name]
        np.testing.assert_allclose(found, value, atol=1e-14)
    starts = {"position": poses[0].position, "rotation": poses[0].rotation}
    starts |= {name: array[0] for name, array in before.items()} | given
    made = [fs.Body(WIRE, LAW, motion=fs.Rigid(**starts, inertia="solid"), surface=SKIN)]
    place = {"position": poses[1].position, "rotation": poses[1].rotation, "velocity": before["velocity"][1]}
    made.append(fs.Body(ORIGIN, LAW, motion=fs.Rigid(**place), surface=SKIN))
    fresh = world_of(*made, particles=[(simulation.positions[0], simulation.velocities[0], {})])
    fresh = fs.Simulation(fresh, fs.Leapfrog(0.002), time=1.0, threads=1)
    np.testing.assert_array_equal(rows.centers[1], other)
    np.testing.assert_allclose(simulation.bodies.stiffnesses, fresh.bodies.stiffnesses, rtol=1e-12)
    np.testing.assert_allclose(simulation.wrenches().forces, fresh.wrenches().forces, atol=1e-13)
    for time in (1.0, 1.5, 3.0):
        simulation.advance(time)
        fresh.advance(time)
        log.record()
        np.testing.assert_allclose(state(simulation), state(fresh), atol=1e-11)
    drifts = {drift.quantity: drift.largest for drift in log.report().totals}
    assert drifts["energy"] < 1e-4
    assert drifts["momentum"] < 1e-13
    assert drifts["angular momentum"] < 1e-13


def test_a_line_that_is_turned_spins_on_across_itself():
    """What it turned about its new direction, which has no moment, is left out."""
    simulation = fs.Simulation(world_of(fs.Body(WIRE, motion=fs.Rigid(angular_velocity=(0, 0.3, 0.5)))))
    simulation.set_body(0, rotation=fs.Pose.turned((0, 0, 1), np.pi / 2).rotation)
    np.testing.assert_allclose(simulation.bodies.angular_velocities, [(0, 0, 0.5)], atol=1e-15)


def test_a_kick_hardens_contacts():
    """A body kicked to a hundred times the energy does not fly through another one."""
    world = world_of(
        fs.Body(ORIGIN, motion=fs.Rigid((-2, 0, 0), velocity=(0.1, 0, 0)), surface=SKIN),
        fs.Body(ORIGIN, surface=SKIN, motion=fs.Pose((1, 0, 0))),
    )
    simulation = fs.Simulation(world, fs.Leapfrog(4e-4))
    simulation.advance(0.5)
    simulation.set_body(0, velocity=(10.0, 0, 0))
    simulation.advance(2.0)
    np.testing.assert_allclose(simulation.bodies.momenta[0], (-10.0, 0, 0), atol=0.05)
    assert body_energy(simulation.bodies).total == pytest.approx(50.0, rel=1e-3)


def test_bodies_that_come_over_particles_move_them_out():
    world = bodies()
    world.add_particles([(0.0, 5.0, 0)], [(0, 0, 0)], radius=0.1, contact=fs.Bounce())
    simulation = fs.Simulation(world, fs.Leapfrog(0.01))
    with pytest.warns(fs.FieldsimWarning, match="1 of 3 particles start inside a surface"):
        simulation.set_body(1, position=(0, 5.1, 0))
    assert np.linalg.norm(simulation.positions[1][0] - (0, 5.1, 0)) == pytest.approx(0.4, abs=1e-6)


@pytest.mark.parametrize("contact", [fs.Bounce(0.0, friction=1.0), fs.Absorb()])
def test_what_rested_on_a_body_that_is_set_falls(contact):
    one = fs.Body(ORIGIN, gravity=LAW, mass=4.0, motion=fs.Rigid(), surface=SKIN)
    two = fs.Body(ORIGIN, gravity=LAW, mass=4.0, motion=fs.Pose((9, 0, 0)), surface=SKIN)
    world = world_of(
        one, two, particles=[([(0, 0, 0.5), (9, 0, 0.5)], np.zeros((2, 3)), {"radius": 0.1, "contact": contact})]
    )
    simulation = fs.Simulation(world, fs.Leapfrog(4e-3))
    simulation.advance(0.5)
    assert simulation.census()["moving"] == 0
    simulation.set_body(0, velocity=(0, 0, 0))
    assert simulation.census()["moving"] == 0
    simulation.set_body(0, position=(0, 0, -1.5))
    assert (simulation.states[0] == fs.Status.MOVING).tolist() == [True, False]
    height = simulation.positions[0][0][2]
    simulation.advance(0.7)
    assert simulation.positions[0][0][2] < height - 0.01


def test_bodies_are_not_set_into_others():
    bare = fs.Body(fs.Point((0, 6, 0)), gravity=fs.Newtonian())
    simulation = fs.Simulation(bodies(DEEP, bare), fs.Leapfrog(0.01))
    simulation.advance(0.003)
    before = state(simulation)
    for place, text in (
        ((-2.0, 0, 0), "Body 0 and Body 1 overlap"),
        ((0, 0, -4.7), "Body 0 and Body 2 overlap"),
    ):
        with pytest.raises(fs.InputError, match=text):
            simulation.set_body(0, position=place, velocity=(9, 9, 9))
        np.testing.assert_array_equal(state(simulation), before)
    with pytest.raises(fs.InputError, match=r"mass of Body 1 is at .* bare skeleton of Body 3"):
        simulation.set_body(1, position=(0, 6, 0))
    with pytest.raises(fs.InputError, match="Body 1: its mass lies on a point"):
        simulation.set_body(1, angular_velocity=(0, 0, 1))
    np.testing.assert_array_equal(state(simulation), before)


# Logs


@pytest.mark.parametrize(
    ("body", "invariant"), [(STILL, "energy"), (SPINNING, "Jacobi integral"), (WOBBLING, "energy less work")]
)
def test_logs_take_off_what_was_given(body, invariant):
    simulation = fs.Simulation(orbits(body), fs.BlanesMoan6(0.02), threads=1)
    log = fs.EnergyLog(simulation)
    assert log.invariant == invariant
    given = 0.0
    for time in (0.7, 1.4, 2.0):
        simulation.advance(time)
        log.record()
        before = fs.energy(simulation.snapshot()).total.sum()
        spin = fs.common_spin(simulation.world)
        before = fs.jacobi(simulation.snapshot(), spin).sum() if spin else before
        burnt(simulation)
        after = fs.energy(simulation.snapshot()).total.sum()
        given += (fs.jacobi(simulation.snapshot(), spin).sum() if spin else after) - before
        log.record()
    report = log.report()
    assert report.largest < 1e-9
    assert report.manoeuvres == pytest.approx(given, rel=1e-12)
    assert f"manoeuvres gave {given:.3g}" in str(report)


def test_auto_says_that_it_did_not_foresee():
    simulation = fs.Simulation(orbits(), fs.Auto(1e-3, candidates=(fs.Leapfrog,)))
    with pytest.warns(fs.FieldsimWarning, match="was chosen for the motion as it started"):
        simulation.set_particles(0, velocities=-simulation.velocities[0])


# What cannot be

BAD = [
    ({}, "nothing is given"),
    ({"index": 2, "velocities": STARTS[1]}, "index is 2; give a whole number of at most 1"),
    ({"index": -1, "velocities": STARTS[1]}, "index is -1"),
    ({"index": "0", "velocities": STARTS[1]}, "index is '0'"),
    ({"velocities": STARTS[1][:1]}, r"velocities has shape \(1, 3\); give an array of shape \(2, 3\)"),
    ({"positions": (1, 0, 0)}, r"positions has shape \(3,\)"),
    ({"positions": np.full((2, 3), np.nan)}, "give finite numbers"),
    ({"velocities": np.ones((2, 3)) * 1j}, "complex"),
    ({"spins": "fast"}, "spins is 'fast'"),
]


@pytest.mark.parametrize(("given", "text"), BAD)
def test_bad_rows_are_refused(given, text):
    simulation = fs.Simulation(orbits())
    before = state(simulation)
    with pytest.raises(fs.InputError, match=f"Simulation.set_particles: .*{text}"):
        simulation.set_particles(**given)
    np.testing.assert_array_equal(state(simulation), before)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"index": 0}, "nothing is given"),
        ({"index": 9, "velocity": (0, 0, 0)}, "index is 9"),
        ({"index": 2, "velocity": (0, 0, 0)}, "Body 2 moves as it is told; give it motion=fs.Rigid"),
        ({"index": 0, "velocity": 1.0}, "velocity has shape"),
        ({"index": 0, "velocity": (np.inf, 0, 0)}, "velocity is"),
        ({"index": 0, "rotation": (1, 0, 0)}, r"rotation has shape \(3,\)"),
        ({"index": 0, "rotation": (0, 0, 0, 0)}, "rotation"),
    ],
)
def test_bad_motions_are_refused(given, text):
    simulation = fs.Simulation(bodies(DEEP), fs.Leapfrog(0.01))
    with pytest.raises(fs.InputError, match=text):
        simulation.set_body(**given)


def test_worlds_without_what_is_to_be_set():
    simulation = fs.Simulation(fs.World())
    with pytest.raises(fs.InputError, match="its world has no particles"):
        simulation.set_particles(0, positions=np.zeros((0, 3)))
    with pytest.raises(fs.InputError, match="no body of its world moves freely"):
        simulation.set_body(0, velocity=(0, 0, 0))
