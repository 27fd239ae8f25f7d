"""Every splitting: its tables, its order on a donut and in a spinning world, reversibility, bytes; force gradients."""

import itertools
import math

import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim.dynamics import simulation as module
from fieldsim.dynamics.auto import choose
from fieldsim.dynamics.integrators.splittings import Splitting
from fieldsim.dynamics.simulation import Simulation
from fieldsim.dynamics.trials import Trial, scouted
from fieldsim.sources.elements import Sources
from fieldsim.sources.field import hessian_at
from fieldsim.sources.stages import Stages, upload

DONUT = fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=fs.Newtonian(0.5))
CIGAR = fs.Segment((-1, 0, 0), (1, 0, 0))
SPIN = fs.Spin(axis=(0, 1, 3), rate=0.5)
TURNING = fs.Body(CIGAR, gravity=fs.Newtonian(0.3), motion=SPIN)
METHODS = Splitting.__subclasses__()
TIME = 8.0
# Numbers of steps in TIME for which the leading term of the error rules: the next one no more, rounding not yet.
STEPS = {2: (128, 256), 4: (128, 192), 6: (40, 64), 8: (32, 48), 10: (32, 40)}


def every_method(test):
    return pytest.mark.parametrize("method", METHODS, ids=lambda method: method.__name__)(test)


def world_of(body=DONUT, positions=((2.0, 0, 0.5), (2.5, 0.1, 0.8)), velocities=((0, 0.6, 0.1), (0.2, 0.5, 0))):
    world = fs.World()
    world.add_body(body)
    world.add_particles(positions, velocities)
    return world


def state_of(simulation):
    return np.concatenate([*simulation.positions, *simulation.velocities])


def end_of(world, integrator, until=TIME, **options):
    simulation = Simulation(world, integrator, **options)
    simulation.advance(until)
    return state_of(simulation)


def slope(method, world):
    """Order of convergence towards a solution of much smaller steps, and the error of the shorter step."""
    steps = [TIME / count for count in STEPS[method.order]]
    reference = end_of(world, fs.KahanLi8(TIME / 400))
    errors = [np.abs(end_of(world, method(dt)) - reference).max() for dt in steps]
    return np.log(errors[0] / errors[1]) / np.log(steps[0] / steps[1]), errors[1]


@every_method
def test_tables_are_symmetric_and_complete(method):
    for table in (method.kicks, method.drifts, method.gradients):
        assert table == table[::-1]
    # Palindromes of rounded numbers: each rounding is at most half an ulp of a number of size 1.
    assert abs(math.fsum(method.kicks) - 1.0) < 4e-16
    assert abs(math.fsum(method.drifts) - 1.0) < 4e-16
    assert len(method.kicks) == len(method.gradients) == len(method.drifts) + 1 == len(method.nodes)
    assert (method.nodes[0], method.nodes[-1]) == (0.0, 1.0)
    assert method.evaluations == sum(map(bool, method.kicks[1:]))
    assert fs.__dict__[method.__name__] is method


@every_method
def test_methods_are_of_their_order(method):
    if method.order == 10:  # on the donut its leading term is never the largest
        sun = fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian())
        found, error = slope(method, world_of(sun, [(1.3, 0, 0), (1.2, 0, 0.1)], [(0, 0.75, 0), (0, 0.8, 0.1)]))
    else:
        found, error = slope(method, world_of())
    assert error > 4e-14, "rounding hides the order"
    assert abs(found - method.order) < 0.2


@every_method
def test_methods_see_a_spinning_cigar_at_their_stages_times(method):
    # Sources taken at any other times would leave an error of first or second order.
    world = world_of(TURNING)
    if method.order < 10:
        found, error = slope(method, world)
        assert error > 4e-14, "rounding hides the order"
        assert abs(found - method.order) < 0.2
    simulation = Simulation(world, method(TIME / STEPS[method.order][1]))
    start = fs.jacobi(simulation.snapshot(), SPIN)
    simulation.advance(TIME)
    bound = {2: 1e-4, 4: 3e-8, 6: 1e-8, 8: 1e-11, 10: 1e-14}[method.order]  # its error then, rounded up
    assert np.abs(fs.jacobi(simulation.snapshot(), SPIN) - start).max() < bound


@every_method
def test_methods_are_reversible(method):
    world = world_of()
    end = end_of(world, method(TIME / 40))
    back = world_of(DONUT, end[:2], -end[2:])
    start = end_of(back, method(TIME / 40))
    # Rounding only, amplified by the flow.
    np.testing.assert_allclose(start[:2], world.particles[0].positions, atol=1e-13)
    np.testing.assert_allclose(-start[2:], world.particles[0].velocities, atol=1e-13)


@every_method
def test_cuts_and_threads_do_not_change_a_byte(method, monkeypatch):
    rng = np.random.default_rng(3)
    start = rng.normal(size=(83, 3))
    start *= (rng.uniform(2.0, 3.0, 83) / np.linalg.norm(start, axis=1))[:, None]
    world = world_of(TURNING, start, 0.4 * rng.normal(size=(83, 3)))
    ends = []
    for threads, steps in ((1, 256), (2, 256), (2, 7)):
        monkeypatch.setattr(module, "LAUNCH_STEPS", steps)
        ends.append(end_of(world, method(0.05), until=2.0, threads=threads).tobytes())
    assert ends[0] == ends[1] == ends[2]


def test_a_particle_moves_the_same_whoever_its_neighbours_are():
    crowd = world_of()
    crowd.add_particles(np.full((20, 3), 1.7), np.zeros((20, 3)))
    one, many = (Simulation(world, fs.Omelyan6(0.05)) for world in (world_of(), crowd))
    one.advance(1.0)
    many.advance(1.0)
    np.testing.assert_array_equal(one.positions[0], many.positions[0])


def test_the_force_gradient_is_that_of_the_force_squared():
    body = fs.Body([fs.Circle((0, 0, 0), (0, 0, 1), 1.0), CIGAR], gravity=fs.Newtonian())
    world = world_of(body)
    sources = Sources(world, "gravity", 0.0)
    stages = upload(sources, np.array([0.0]), "cpu")
    hessian = hessian_at(sources.kinds_used)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(points: wp.array(dtype=wp.vec3d), gravity: Stages, pushes: wp.array(dtype=wp.vec3d)):
        i = wp.tid()
        g, bend = hessian(points[i], gravity, 0)
        pushes[i] = bend * g

    points = np.random.default_rng(0).uniform(-2.0, 2.0, (50, 3))
    pushes = wp.full(len(points), np.nan, dtype=wp.vec3d, device="cpu")
    wp.launch(evaluate, len(points), [wp.array(points, dtype=wp.vec3d, device="cpu"), stages], [pushes], device="cpu")
    field = body.gravity_field()
    step = 1e-5
    square = lambda x: 0.5 * np.sum(field.gradient(x) ** 2, axis=1)  # noqa: E731
    expected = np.stack([(square(points + e) - square(points - e)) / (2 * step) for e in step * np.eye(3)], axis=1)
    # Central differences: step^2 times third derivatives, which grow near the skeleton, and rounding over the step.
    near = np.abs(pushes.numpy()).max(axis=1) > 30.0
    assert near.sum() < 10
    np.testing.assert_allclose(pushes.numpy()[~near], expected[~near], rtol=1e-6, atol=1e-8)


def test_errors_of_rounding_do_not_add_up():
    sun = fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian())
    simulation = Simulation(world_of(sun, [(1.0, 0, 0)], [(0, 1.0, 0)]), fs.KahanLi8(2 * math.pi / 64))
    start = fs.energy(simulation.snapshot()).total
    simulation.advance(2 * math.pi * 1000)
    # 64,000 steps of 17 kicks: at 1e-16 each, a sum is 1e-10, a random walk 1e-13; compensated sums leave the forces'.
    assert np.abs(fs.energy(simulation.snapshot()).total - start).max() < 6e-15


def test_bodies_with_surfaces_take_any_method():
    clay = fs.Material(radius=0.2)
    turning = fs.Body(CIGAR, gravity=fs.Newtonian(0.3), surface=clay, motion=SPIN)
    rng = np.random.default_rng(5)
    start = rng.normal(size=(60, 3))
    start *= (rng.uniform(1.6, 2.5, 60) / np.linalg.norm(start, axis=1))[:, None]
    ends = []
    for integrator in (fs.Leapfrog(1e-3), fs.Omelyan6(0.02)):
        world = fs.World()
        world.add_body(turning)
        world.add_particles(start, np.zeros((60, 3)), contact=fs.Bounce(1.0))
        simulation = Simulation(world, integrator)
        simulation.advance(3.0)
        ends.append(simulation)
    coarse = np.abs(ends[0].positions[0] - ends[1].positions[0]).max(axis=1)
    free = (ends[0].bounce_counts[0] == 0) & (ends[1].bounce_counts[0] == 0)
    once = (ends[0].bounce_counts[0] == 1) & (ends[1].bounce_counts[0] == 1)
    assert free.sum() > 5
    assert once.sum() > 5
    # Leapfrog's own error over 3 units of time.
    assert coarse[free].max() < 1e-5
    # Near the surface both are leapfrogs of a few 1e-3, and a bounce amplifies their difference.
    assert coarse[once].max() < 1e-2


def test_auto_meets_its_tolerance_and_prefers_high_order_for_high_accuracy():
    rng = np.random.default_rng(2)
    start = rng.normal(size=(40, 3))
    start *= (rng.uniform(2.5, 3.5, 40) / np.linalg.norm(start, axis=1))[:, None]
    velocities = np.cross(start, rng.normal(size=(40, 3)))
    velocities *= (0.6 / np.linalg.norm(velocities, axis=1))[:, None]
    world = fs.World()
    world.add_body(fs.Body(CIGAR, gravity=fs.Newtonian(0.3)))
    world.add_particles(start, velocities)
    orders = []
    for tolerance in (1e-3, 1e-6, 1e-12):
        simulation = Simulation(world, fs.Auto(tolerance))
        assert simulation.integrator == simulation.choice.integrator
        assert type(simulation.integrator).__name__ in str(simulation.choice)
        log = run_with_log(simulation, np.linspace(2.0, 20.0, 10))
        # The trial saw one orbit of these particles, the run about two.
        assert log.report().largest < 4.0 * tolerance
        orders.append(simulation.integrator.order)
    assert orders == sorted(orders)
    assert orders[0] < orders[-1]
    assert isinstance(Simulation(world, "auto").integrator, Splitting)
    assert Simulation(world, fs.Auto(1e-6)).integrator == Simulation(world, fs.Auto(1e-6)).integrator


def test_auto_judges_by_half_steps_where_nothing_is_kept():
    moving = fs.Body(CIGAR, gravity=fs.Newtonian(0.3), motion=lambda time: (0.1 * math.sin(time), 0, 0))
    auto = fs.Auto(1e-5, span=5.0, candidates=(fs.Leapfrog, fs.Omelyan4))
    choice = choose(auto, world_of(moving), 0.0, Simulation)
    assert type(choice.integrator) is fs.Omelyan4
    assert 0.0 < choice.error <= 1e-5


def test_auto_says_when_nothing_is_good_enough():
    world = world_of(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian()))
    with pytest.raises(fs.FieldsimError, match=r"none of Leapfrog keeps the energy to 1e-14 .* larger tolerance"):
        Simulation(world, fs.Auto(1e-14, candidates=(fs.Leapfrog,)))
    assert isinstance(Simulation(fs.World(), fs.Auto()).integrator, fs.Leapfrog)


def falling(count=40):
    """Eccentric, inclined orbits, which a bare ring deflects into ever new ones."""
    rng = np.random.default_rng(0)
    x = rng.normal(size=(count, 3))
    x *= (rng.uniform(2.0, 3.5, count) / np.linalg.norm(x, axis=1))[:, None]
    across = np.cross(x, rng.normal(size=(count, 3)))
    across *= (rng.uniform(0.4, 0.6, count) / np.linalg.norm(across, axis=1))[:, None]
    return x, across


def test_auto_flies_ahead_and_takes_radau_where_fixed_steps_would_fail():
    bare = fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=fs.Newtonian())
    world = world_of(bare, *falling())
    simulation = Simulation(world, fs.Auto(1e-5))
    assert simulation.integrator == fs.Radau()
    assert "Radau(tolerance=1e-09), chosen for" in str(simulation.choice)
    # Over 25 orbits: rounding, magnified by speeds near the wire.
    assert run_with_log(simulation, np.linspace(10.0, 400.0, 40)).report().largest < 1e-10
    # The trial meets within half its time what the scout met in thirty.
    (trial,) = scouted(Trial(world, 0.0), 20.0, Simulation)
    whole, first, near = (Simulation(w, fs.Radau()) for w in (world, world, trial.world))
    for run, until in ((whole, 600.0), (first, 20.0), (near, 10.0)):
        run.advance(until)
    np.testing.assert_allclose(near.radau.closest[0], whole.radau.closest[0], rtol=0.1)
    assert np.quantile(near.radau.closest[0] / first.radau.closest[0], 0.1) < 0.1
    # Where nothing is known of Radau, nothing is chosen that would not do.
    with pytest.raises(fs.FieldsimError, match="soften what the particles pass closely"):
        Simulation(world, fs.Auto(1e-5, candidates=(fs.Leapfrog,)))


def test_auto_leaves_radau_out_where_it_does_not_know_the_world():
    world = world_of(DONUT)
    world.add_particles([(3.0, 0, 0)], [(0, 0.5, 0)], contact=fs.Bounce())
    choice = Simulation(world, fs.Auto(1e-6, candidates=(fs.Leapfrog, fs.Radau))).choice
    assert isinstance(choice.integrator, fs.Leapfrog)
    with pytest.raises(fs.FieldsimError, match="no candidate can move this world: particles of set 1 have contact"):
        Simulation(world, fs.Auto(1e-6, candidates=(fs.Radau,)))


def run_with_log(simulation, times):
    log = fs.EnergyLog(simulation)
    for time in times:
        simulation.advance(time)
        log.record()
    return log


def test_a_step_that_overshoots_a_close_passage_is_told_of_once():
    world = world_of(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian()), [(3.0, 0, 0)], [(0, 0.5, 0)])
    world.add_particles([(4.0, 0, 0), (1.0, 0, 0)], [(0, 0.5, 0), (0, 0.02, 0)])
    text = r"at time 1\.\d+ the energy of particle 1 of set 1 .* give Leapfrog\(dt=0\.01\) a shorter dt"
    with pytest.warns(fs.FieldsimWarning, match=text) as told:
        run_with_log(Simulation(world, fs.Leapfrog(0.01)), np.linspace(0.1, 3.0, 30))
    assert len(told) == 1


def test_bad_steps_and_tables_are_refused():
    for method, dt in itertools.product(METHODS, (0.0, -1.0, math.nan, math.inf)):
        with pytest.raises(fs.InputError, match=f"{method.__name__}: dt"):
            method(dt)
    with pytest.raises(fs.InputError, match="Auto: tolerance"):
        fs.Auto(0.0)
    for tables in (
        {"kicks": (0.5, 0.5), "drifts": (0.5, 0.5), "gradients": (0.0, 0.0)},
        {"kicks": (0.5, 0.5), "drifts": (1.0,), "gradients": (0.1, 0.1)},
        {"kicks": (0.0, 1.0), "drifts": (1.0,), "gradients": (0.0, 0.0)},
        {"kicks": (0.5, 0.0, 0.5), "drifts": (0.5, 0.5), "gradients": (0.0, 0.0, 0.0)},
    ):
        with pytest.raises(fs.InputError, match="Mine: "):
            type("Mine", (Splitting,), {"order": 1, **tables})
    good = {"order": 2, "kicks": (0.25, 0.5, 0.25), "drifts": (0.5, 0.5), "gradients": (0.0, 0.0, 0.0)}
    assert type("Mine", (Splitting,), good).evaluations == 2
    for name in good:
        with pytest.raises(fs.InputError, match=f"Mine: the splitting has no '{name}'; give"):
            type("Mine", (Splitting,), {key: value for key, value in good.items() if key != name})
    for name, value, words in (
        ("kicks", (0.25, 0.6, 0.25), "the sum of kicks is 1.1; give"),
        ("drifts", (0.4, 0.5), "the sum of drifts is 0.9; give"),
        ("drifts", (0.4, 0.6), "drifts is no palindrome; give"),
        ("gradients", (0.0, "x", 0.0), "gradients is an array of strings"),
        ("order", 2.5, "order is 2.5; give a whole number"),
    ):
        with pytest.raises(fs.InputError, match=f"Mine: {words}"):
            type("Mine", (Splitting,), {**good, name: value})


def test_a_run_that_fails_keeps_its_snapshots():
    world = world_of(fs.Body(CIGAR, gravity=fs.Newtonian(0.3), motion=lambda t: (math.nan if t > 0.55 else 0.0, 0, 0)))
    kept = []
    with pytest.raises(fs.InputError, match="Body 0"):
        kept.extend(Simulation(world, fs.Leapfrog(0.01)).snapshots([0.2, 0.4, 0.6]))
    assert [snapshot.time for snapshot in kept] == [0.2, 0.4]


def test_a_film_that_fails_keeps_its_frames(tmp_path):
    body = fs.Body(
        CIGAR,
        gravity=fs.Newtonian(0.3),
        surface=fs.Material(radius=0.2),
        motion=lambda t: (math.nan if t > 0.55 else 0.0, 0, 0),
    )
    camera = fs.Camera(eye=(5, 0, 1), look_at=(0, 0, 0), fov=38)
    scenario = fs.Scenario(world_of(body), camera, duration=1.0, fps=10, integrator=fs.Leapfrog(0.01))
    with pytest.raises(fs.FieldsimError, match=r"Body 0.*keeps the 6 of \d+ frames made before"):
        fs.film(scenario, tmp_path / "walk.gif", size=(16, 8), quality="draft")
    assert (tmp_path / "walk.gif").stat().st_size > 0
