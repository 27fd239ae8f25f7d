"""Adaptive Gauss-Radau: what it keeps, where it is when asked, and what moves meanwhile."""

import math
from fractions import Fraction

import numpy as np
import pytest

from fieldsim.dynamics.diagnostics.invariants import energy, jacobi
from fieldsim.dynamics.integrators.splittings import BlanesMoan6, Leapfrog
from fieldsim.dynamics.radau import tables
from fieldsim.dynamics.radau.radau import Radau
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import FieldsimError, InputError
from fieldsim.potentials.kernels import Metaball, Newtonian
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce, Status
from fieldsim.world.motion import Keyframes, Pose, Spin
from fieldsim.world.world import World

STAR = Point((0, 0, 0))
BAR = Segment((-1, 0, 0), (1, 0, 0))
RING = Circle((0, 0, 0), (0, 0, 1), 1.0)
TURN = Spin(axis=(0, 0, 1), rate=0.3)
STILL = Pose()


def simulation(skeleton, positions, velocities, *, motion=STILL, kernel=None, integrator=None, threads=1):
    world = World()
    world.add_body(Body(skeleton, gravity=kernel or Newtonian(), mass=1.0, motion=motion))
    world.add_particles(positions, velocities)
    return Simulation(world, integrator or Radau(), threads=threads)


def comets(eccentricity, count=8):
    """Kepler orbits of semi-major axis 1 about a mass of 1, from their pericentres: (positions, velocities, frames).

    frames: unit vectors towards the pericentre and along the velocity there.
    """
    rng = np.random.default_rng(1)
    toward = rng.normal(size=(count, 3))
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    ahead = np.cross(toward, rng.normal(size=(count, 3)))
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    e = eccentricity
    return (1 - e) * toward, math.sqrt((1 + e) / (1 - e)) * ahead, (toward, ahead)


def kepler(eccentricity, frames, time):
    """Where `comets` are at a time."""
    anomaly = time
    for _ in range(60):
        anomaly -= (anomaly - eccentricity * math.sin(anomaly) - time) / (1 - eccentricity * math.cos(anomaly))
    toward, ahead = frames
    side = math.sqrt(1 - eccentricity**2)
    return (math.cos(anomaly) - eccentricity) * toward + side * math.sin(anomaly) * ahead


def orbits(count=8):
    """Inclined, mildly eccentric orbits at 2 to 3.5."""
    rng = np.random.default_rng(0)
    x = rng.normal(size=(count, 3))
    x /= np.linalg.norm(x, axis=1)[:, None]
    across = np.cross(x, rng.normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    radius = rng.uniform(2.0, 3.5, count)[:, None]
    return radius * x, rng.uniform(0.85, 1.1, (count, 1)) * across / np.sqrt(radius)


def test_weights_are_exact_for_polynomials_of_degree_14():
    nodes = tables.NODES[1:]
    single = [Fraction(row[tables.SPEED]) + Fraction(row[tables.SPEED_REST]) for row in tables.ENDS[1:]]
    double = [Fraction(row[tables.WAY]) + Fraction(row[tables.WAY_REST]) for row in tables.ENDS[1:]]
    for degree in range(1, 15):
        speed = sum(w * s**degree for w, s in zip(single, nodes, strict=True))
        # Degrees above 7 owe their exactness to the nodes, which are rounded to 2^-54.
        assert abs(speed - Fraction(1, degree + 1)) < (1e-32 if degree <= 7 else 1e-15)
    for degree in range(1, 14):
        way = sum(w * s**degree for w, s in zip(double, nodes, strict=True))
        assert abs(way - Fraction(1, (degree + 1) * (degree + 2))) < 1e-15


def test_tables_of_weights_are_exact_for_what_a_step_can_follow():
    nodes = np.array([float(node) for node in tables.NODES])
    powers = np.random.default_rng(2).normal(size=8)
    values = np.polynomial.polynomial.polyval(nodes, powers)
    differences = np.array([values[0], *(values[1:] - values[0])])
    np.testing.assert_allclose(differences @ tables.IN_POWERS, powers, rtol=0, atol=1e-10)
    whole = np.polynomial.Polynomial(powers)
    ways = whole.integ(2)(nodes)
    np.testing.assert_allclose(differences @ tables.WAYS, ways, rtol=0, atol=1e-14)
    np.testing.assert_allclose(powers @ tables.WAYS_OF_POWERS, ways, rtol=0, atol=1e-15)
    ahead = np.polynomial.polynomial.polyval(nodes, powers @ tables.AHEAD)
    np.testing.assert_allclose(ahead, whole(1.0 + nodes), rtol=1e-13)
    ends = differences @ tables.ENDS
    derivatives = [whole.deriv(order)(1.0) for order in range(4)]
    np.testing.assert_allclose(ends[[tables.PULL, tables.FIRST, tables.SECOND, tables.THIRD]], derivatives, rtol=1e-9)
    assert ends[tables.WAY] == pytest.approx(whole.integ(2)(1.0), rel=1e-14)
    assert ends[tables.SPEED] + values[0] == pytest.approx(whole.integ()(1.0), rel=1e-14)


def test_a_comet_keeps_its_energy_to_rounding_over_fifty_orbits():
    x, v, _ = comets(0.9)
    run = simulation(STAR, x, v)
    drifts = []
    for turn in range(1, 51):
        run.advance(2 * math.pi * turn * 0.9997)
        kinetic = 0.5 * np.einsum("ij,ij->i", run.velocities[0], run.velocities[0])
        drifts.append(np.abs((kinetic - 1 / np.linalg.norm(run.positions[0], axis=1)) / -0.5 - 1).max())
    # 5000 steps, each rounding kinetic energies of up to 19 in an energy of 1/2 at 1e-16: a walk of 1e-14 or less.
    assert max(drifts) < 3e-14
    assert run.steps_done < 8 * 50 * 110


def test_positions_between_steps_are_as_good_as_at_their_ends():
    x, v, frames = comets(0.5)
    run = simulation(STAR, x, v)
    for time in np.linspace(0.0, 7.0, 61)[1:]:
        run.advance(time)
        # An orbit's phase feels rounding at each of some 60 steps.
        np.testing.assert_allclose(run.positions[0], kepler(0.5, frames, time), rtol=0, atol=2e-14)
    begin, end = run.radau.span
    assert (begin <= 7.0).all()
    assert (end >= 7.0).all()
    middle = 0.5 * (begin + end)
    at, _ = run.radau.at(middle)
    expected = [kepler(0.5, (frames[0][i], frames[1][i]), t) for i, t in enumerate(middle)]
    np.testing.assert_allclose(at, expected, rtol=0, atol=2e-14)


def test_single_steps_go_on_from_each_other():
    x, v, _ = comets(0.5)
    run = simulation(STAR, x, v)
    before = run.radau.span[1]
    for _ in range(5):
        run.radau.step()
        begin, end = run.radau.span
        np.testing.assert_array_equal(begin, before)
        assert (end > begin).all()
        before = end
    run.radau.step(np.median(before))
    stay = before >= np.median(before)
    np.testing.assert_array_equal(run.radau.span[1][stay], before[stay])
    assert (run.radau.span[1][~stay] > before[~stay]).all()


def test_the_closest_passage_is_remembered():
    x, v, _ = comets(0.9)
    run = simulation(STAR, x, v)
    run.advance(3.0)
    far = run.radau.closest[0]
    run.advance(7.0)
    tau, when = run.radau.closest
    # The pericentre, where the acceleration a = 1 / d^2 changes in about sqrt(d / a) = d^1.5; steps are a tenth of it.
    np.testing.assert_allclose(np.abs(when - 2 * math.pi * np.round(when / (2 * math.pi))), 0.0, atol=0.02)
    assert ((tau > 0.3 * 0.1**1.5) & (tau < 3 * 0.1**1.5)).all()
    assert (tau <= far).all()


def test_a_close_passage_that_leapfrog_fails():
    x, v, _ = comets(0.9999, 2)
    run = simulation(STAR, x, v)
    run.advance(4 * math.pi * 0.9)
    per_particle = run.radau.evaluations / 2
    plain = simulation(STAR, x, v, integrator=Leapfrog(4 * math.pi * 0.9 / per_particle))
    plain.advance(4 * math.pi * 0.9)
    drift = [np.abs(energy(r.snapshot()).total / -0.5 - 1).max() for r in (run, plain)]
    # Rounding of speeds of 141 near the pericentre, 1e-16 * 141^2 / 2 each.
    assert drift[0] < 1e-10
    assert drift[1] > 1e-1


def test_a_spinning_cigar_keeps_the_jacobi_integral():
    run = simulation(BAR, *orbits(), motion=TURN)
    start = jacobi(run.snapshot(), TURN)
    for time in (1.0, 17.0, 40.0, 100.0):
        run.advance(time)
        np.testing.assert_allclose(jacobi(run.snapshot(), TURN), start, rtol=0, atol=1e-14)


def test_cutting_a_run_anywhere_changes_nothing():
    whole, cut = (simulation(BAR, *orbits(40), motion=TURN, threads=threads) for threads in (1, 2))
    whole.advance(30.0)
    for time in (0.001, 0.002, 3.0, 3.0, 16.5, 29.0, 30.0):
        cut.advance(time)
    np.testing.assert_array_equal(cut.positions[0], whole.positions[0])
    np.testing.assert_array_equal(cut.velocities[0], whole.velocities[0])
    assert cut.steps_done == whole.steps_done


def test_many_particles_share_rows_in_batches(monkeypatch):
    whole = simulation(BAR, *orbits(), motion=TURN)
    monkeypatch.setattr("fieldsim.dynamics.radau.radau.SCRATCH_ROWS", 24)  # three at a time
    parts = simulation(BAR, *orbits(), motion=TURN)
    for run in (whole, parts):
        run.advance(5.0)
    np.testing.assert_array_equal(parts.positions[0], whole.positions[0])


def test_nodes_one_after_the_other_as_on_a_gpu_are_as_in_lanes(monkeypatch):
    lanes = simulation(BAR, *orbits(), motion=TURN)
    monkeypatch.setattr("fieldsim.dynamics.radau.radau.lanes_on", lambda device: 1)
    alone = simulation(BAR, *orbits(), motion=TURN)
    for run in (lanes, alone):
        run.advance(20.0)
    np.testing.assert_allclose(alone.positions[0], lanes.positions[0], rtol=0, atol=1e-13)


def test_kinks_in_keyframes_are_found_named_or_not():
    curve = Keyframes([0, 1, 2.5, 4], [(0, 0, 0), (0.3, 0, 0.1), (0, 0.5, 0), (-0.2, 0, 0)])
    loop = Keyframes([0, 1, 2.5, 4], [(0, 0, 0), (0.3, 0, 0.1), (0, 0.5, 0), (0, 0, 0)], loop=True)
    for motion in (curve, loop):
        named, hidden = (simulation(BAR, *orbits(), motion=m) for m in (motion, lambda t, m=motion: tuple(m(t))))
        for run in (named, hidden):
            run.advance(9.0)
        np.testing.assert_allclose(hidden.positions[0], named.positions[0], rtol=0, atol=1e-13)


def test_a_jump_is_passed():
    run = simulation(BAR, *orbits(), motion=lambda t: (0.0, 0.0, 0.0) if t < 1.25 else (1.0, 0.0, 0.0))
    before = simulation(BAR, *orbits())
    for r in (run, before):
        r.advance(1.25)
    np.testing.assert_allclose(run.positions[0], before.positions[0], rtol=0, atol=1e-9)
    after = simulation(BAR, before.positions[0] - (1.0, 0, 0), before.velocities[0])
    run.advance(3.25)
    after.advance(2.0)
    # The window that holds the jump is 1e-9 long.
    np.testing.assert_allclose(run.positions[0] - (1.0, 0, 0), after.positions[0], rtol=0, atol=1e-8)


@pytest.mark.parametrize("unit", [1e-20, 1e-12, 1e9])
@pytest.mark.parametrize("start", [0.0, 0.5])
def test_moving_sources_in_any_unit_of_time(unit, start):
    def end(unit):
        world = World()
        motion = lambda t: (0.3 * math.sin(t / unit), 0.1 * math.cos(3 * t / unit), 0.0)  # noqa: E731
        world.add_body(Body(Point((0, 0, 0)), gravity=Newtonian(0.1), motion=motion, G=1 / unit**2))
        world.add_particles([(1.2, 0, 0.1)], [(0, 0.8 / unit, 0)])
        simulation = Simulation(world, Radau(), time=start * unit)
        simulation.advance((start + 3.0) * unit)
        return simulation.positions[0]

    np.testing.assert_allclose(end(unit), end(1.0), atol=1e-12)


def test_a_jump_at_the_start_is_passed():
    world = World()
    world.add_body(Body(Point((0, 0, 0)), gravity=Newtonian(0.1), mass=lambda t: 9.0 if t <= 0 else 1.0))
    world.add_particles([(1.0, 0, 0)], [(0, 1.0, 0)])
    still = World()
    still.add_body(Body(Point((0, 0, 0)), gravity=Newtonian(0.1)))
    still.add_particles([(1.0, 0, 0)], [(0, 1.0, 0)])
    runs = [Simulation(one, Radau()) for one in (world, still)]
    for run in runs:
        run.advance(3.0)
    np.testing.assert_allclose(runs[0].positions[0], runs[1].positions[0], atol=1e-12)


def test_a_fall_into_a_bare_point_ends_with_a_clear_error():
    run = simulation(STAR, [[1.0, 0.5, 0.0], [3.0, 0.0, 0.0]], [[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]])
    with pytest.raises(
        FieldsimError, match=r"particle 0 of set 0 .* \(1 such particles\); soften what they fall into$"
    ):
        run.advance(10.0)
    assert run.steps_done < 1000
    np.testing.assert_array_equal(np.isnan(run.positions[0]).any(axis=1), [True, False])


def test_swinging_through_a_ring_where_its_pull_passes_zero():
    x = np.array([[0, 0, 0.5], [0, 0, 0], [0, 0, 1e-12]])
    run = simulation(RING, x, np.zeros((3, 3)))
    start = energy(run.snapshot()).total
    reached = []
    for time in np.linspace(0.0, 40.0, 41)[1:]:
        run.advance(time)
        reached.append(run.positions[0][:, 2])
    # Each step rounds an energy of order 1; there are some 500.
    np.testing.assert_allclose(energy(run.snapshot()).total, start, rtol=0, atol=5e-15)
    assert np.min(reached, axis=0)[0] < -0.49
    np.testing.assert_array_equal(np.array(reached)[:, 1], 0.0)
    # Near the centre the ring pulls like a spring of angular frequency 1; the start is 1e4 roundings away from it.
    np.testing.assert_allclose(np.array(reached)[:, 2], 1e-12 * np.cos(np.linspace(1, 40, 40)), rtol=0, atol=1e-15)


def test_nothing_of_short_reach_is_leapt_over():
    starts = np.array((-50.0, 0.1, 0.0)) + np.linspace(0.0, 1.0, 50)[:, None] * (1.0, 0.0, 0.0)
    run = simulation(STAR, starts, np.broadcast_to((5.0, 0.0, 0.0), starts.shape), kernel=Metaball(0.5))
    start = energy(run.snapshot()).total
    run.advance(20.0)
    assert (run.positions[0][:, 0] > 45).all()
    assert (np.abs(run.velocities[0][:, 1]) > 0.05).all()
    # Its second derivative jumps on two spheres, which steps must feel their way across: how well is a matter of where
    # they meet them.
    errors = np.abs(energy(run.snapshot()).total / start - 1.0)
    assert errors[0] < 2e-9
    assert np.median(errors) < 2e-9
    assert errors.max() < 1e-4


@pytest.mark.parametrize("tolerance", [0.0, -1e-9, math.nan, 0.1, "fine"])
def test_tolerances_that_make_no_sense_are_refused(tolerance):
    with pytest.raises(InputError, match="Radau: tolerance is"):
        Radau(tolerance)


ESCAPE = 3.0


def escaping(integrator, count=40, motion=STILL, threads=1):
    """Particles around a bar, half of which come to leave for good."""
    rng = np.random.default_rng(5)
    x, v = orbits(count)
    x, v = x / np.linalg.norm(x, axis=1)[:, None] * 1.5, v * rng.uniform(0.7, 2.4, (count, 1))
    world = World(escape_radius=ESCAPE)
    world.add_body(Body(BAR, gravity=Newtonian(0.1), mass=1.0, motion=motion))
    world.add_particles(x, v)
    return Simulation(world, integrator, threads=threads)


@pytest.mark.parametrize("motion", [STILL, TURN], ids=["still", "turning"])
def test_particles_stop_where_they_cross_the_escape_radius(motion):
    run, plain = escaping(Radau(), motion=motion), escaping(BlanesMoan6(1e-3), motion=motion)
    free = Simulation(run.world.replace(escape_radius=None), Radau(), threads=1)
    for time in (2.0, 5.0):
        run.advance(time)
        plain.advance(time)
        # What will have escaped later has not yet.
        np.testing.assert_array_equal(run.states[0], plain.states[0])
    assert run.census() == plain.census()
    events = run.events
    assert 10 < len(events) < 35
    np.testing.assert_array_equal(events.particles, plain.events.particles)
    assert (events.kinds == "escape").all()
    np.testing.assert_allclose(np.linalg.norm(events.positions, axis=1), ESCAPE, rtol=4e-16)
    # The splitting sees them at the end of its step.
    late = plain.events.times - events.times
    assert ((late > -1e-9) & (late < 1e-3 + 1e-9)).all()
    np.testing.assert_array_equal(run.positions[0][events.particles], events.positions)
    for k in range(0, len(events), 5):
        there = Simulation(free.world, Radau(), threads=1)
        there.advance(events.times[k])
        i = events.particles[k]
        np.testing.assert_allclose(there.positions[0][i], run.positions[0][i], rtol=0, atol=2e-14)
        np.testing.assert_allclose(there.velocities[0][i], run.velocities[0][i], rtol=0, atol=2e-14)
    free.advance(5.0)
    stay = run.states[0] == Status.MOVING
    np.testing.assert_array_equal(run.positions[0][stay], free.positions[0][stay])
    again = escaping(Radau(), motion=motion, threads=2)
    again.advance(5.0)
    np.testing.assert_array_equal(again.positions[0], run.positions[0])
    np.testing.assert_array_equal(again.events.times, events.times)


def test_who_starts_beyond_the_escape_radius_stays_and_may_be_put_back():
    world = World(escape_radius=ESCAPE)
    world.add_body(Body(STAR, gravity=Newtonian(), mass=1.0))
    world.add_particles([[4.0, 0, 0], [1.0, 0, 0]], [[-1.0, 0, 0], [0, 1.0, 0]])
    run = Simulation(world, Radau(), threads=1)
    run.advance(1.0)
    np.testing.assert_array_equal(run.states[0], [Status.ESCAPED, Status.MOVING])
    np.testing.assert_array_equal(run.positions[0][0], [4.0, 0, 0])
    assert run.events.times == [0.0]
    run.set_particles(0, positions=[[2.0, 0, 0], run.positions[0][1]], velocities=[[0, 0.5, 0], run.velocities[0][1]])
    assert run.census()["escaped"] == 0
    start = energy(run.snapshot()).total
    run.advance(4.0)
    np.testing.assert_allclose(energy(run.snapshot()).total, start, rtol=1e-14)
    assert run.census()["moving"] == 2
    run.advance(5.0)
    assert run.events.made == 1


def test_contact_is_refused():
    world = World()
    world.add_particles([[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0]], contact=Bounce(0.5))
    with pytest.raises(
        InputError, match=r"set 0 have contact Bounce\(restitution=0.5, .*\), which Radau does not know"
    ):
        Simulation(world, Radau())


def test_an_empty_world_is_left_by_straight_lines():
    world = World()
    world.add_particles([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]], [[1.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
    run = Simulation(world, Radau(), threads=1)
    run.advance(1e6)
    np.testing.assert_array_equal(run.positions[0], [[1e6 + 1, 2, 3 - 1e6], [0, 0, 0]])
