"""Every splitting: its tables, its order on a donut and in a spinning world, reversibility, bytes; force gradients."""

import itertools
import math
import warnings

import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim.dynamics import simulation as module
from fieldsim.dynamics.auto import choose
from fieldsim.dynamics.integrators import Splitting
from fieldsim.dynamics.simulation import Simulation
from fieldsim.dynamics.sources import Sources, hessian_at, upload

DONUT = fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=fs.Newtonian())
CIGAR = fs.Segment((-1, 0, 0), (1, 0, 0))
SPIN = fs.Spin(axis=(0, 1, 3), rate=0.5)
METHODS = Splitting.__subclasses__()
# Steps at which the leading error term rules: not yet rounding, no longer the next term.
STEPS = {
    fs.Leapfrog: (1 / 16, 1 / 32, 1 / 64),
    fs.Suzuki4: (1 / 8, 1 / 16, 1 / 32),
    fs.BlanesMoan4: (1 / 16, 1 / 32, 1 / 64),
    fs.BlanesMoan6: (1 / 8, 1 / 16, 1 / 24),
    fs.BlanesMoan6B: (1 / 4, 1 / 8, 1 / 16),
    fs.KahanLi6: (1 / 8, 1 / 16, 1 / 24),
    fs.KahanLi8: (1 / 4, 1 / 6, 1 / 8),
    fs.SofroniouSpaletta10: (1 / 3, 1 / 4, 1 / 5),
    fs.Chin4: (1 / 8, 1 / 16, 1 / 32),
    fs.Omelyan4: (1 / 4, 1 / 8, 1 / 16),
    fs.Omelyan6: (1 / 4, 1 / 8, 1 / 16),
    fs.Omelyan8: (1 / 6, 1 / 8, 1 / 12),
}


def every_method(test):
    return pytest.mark.parametrize("method", METHODS, ids=lambda method: method.__name__)(test)


def world_of(body=DONUT, **options):
    world = fs.World()
    world.add_body(body)
    world.add_particles([(2.0, 0, 0.5), (2.5, 0.1, 0.8)], [(0, 0.6, 0.1), (0.2, 0.5, 0)], **options)
    return world


def state_of(simulation):
    return np.concatenate([*simulation.positions, *simulation.velocities])


def end_of(world, integrator, until=4.0, **options):
    simulation = Simulation(world, integrator, **options)
    simulation.advance(until)
    return state_of(simulation)


def slopes(steps, errors):
    return np.diff(np.log(errors)) / np.diff(np.log(steps))


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
def test_methods_are_of_their_order_on_the_donut(method):
    world = world_of()
    reference = end_of(world, fs.SofroniouSpaletta10(1 / 32))
    errors = [np.abs(end_of(world, method(dt)) - reference).max() for dt in STEPS[method]]
    assert errors[-1] > 2e-14, "rounding hides the order"
    np.testing.assert_allclose(slopes(STEPS[method], errors)[-1], method.order, atol=0.2)


@every_method
def test_methods_keep_the_jacobi_integral_of_a_spinning_cigar_to_their_order(method):
    # Sources taken at any other times than the stages' would leave an error of first or second order.
    world = world_of(fs.Body(CIGAR, gravity=fs.Newtonian(0.3), motion=SPIN))
    reference = end_of(world, fs.SofroniouSpaletta10(1 / 32))
    errors, drifts = [], []
    for dt in STEPS[method]:
        simulation = Simulation(world, method(dt))
        start = fs.jacobi(simulation.snapshot(), SPIN)
        simulation.advance(4.0)
        errors.append(np.abs(state_of(simulation) - reference).max())
        drifts.append(np.abs(fs.jacobi(simulation.snapshot(), SPIN) - start).max())
    assert errors[-1] > 1e-14, "rounding hides the order"
    np.testing.assert_allclose(slopes(STEPS[method], errors)[-1], method.order, atol=0.35)
    # Conserved as well as the orbit is right, or better.
    assert drifts[-1] < 2.0 * errors[-1] + 1e-14


@every_method
def test_methods_are_reversible(method):
    world = world_of()
    end = end_of(world, method(STEPS[method][0]))
    back = fs.World()
    back.add_body(DONUT)
    back.add_particles(end[:2], -end[2:])
    start = end_of(back, method(STEPS[method][0]))
    # Rounding only, amplified by the flow.
    np.testing.assert_allclose(start[:2], world.particles[0].positions, atol=1e-13)
    np.testing.assert_allclose(-start[2:], world.particles[0].velocities, atol=1e-13)


@every_method
def test_cuts_and_threads_do_not_change_a_byte(method, monkeypatch):
    rng = np.random.default_rng(3)
    start = rng.normal(size=(83, 3))
    start *= (rng.uniform(2.0, 3.0, 83) / np.linalg.norm(start, axis=1))[:, None]
    world = fs.World()
    world.add_body(fs.Body(CIGAR, gravity=fs.Newtonian(0.3), motion=SPIN))
    world.add_particles(start, 0.4 * rng.normal(size=(83, 3)))
    ends = []
    for threads, steps in ((1, 256), (2, 256), (2, 7)):
        monkeypatch.setattr(module, "LAUNCH_STEPS", steps)
        ends.append(end_of(world, method(0.05), until=2.0, threads=threads).tobytes())
    assert ends[0] == ends[1] == ends[2]


def test_a_particle_moves_the_same_whoever_its_neighbours_are():
    alone = world_of()
    crowd = world_of()
    crowd.add_particles(np.full((20, 3), 1.7), np.zeros((20, 3)))
    np.testing.assert_array_equal(
        end_of(alone, fs.Omelyan6(0.05)).reshape(2, 2, 3)[0], Simulation(crowd, fs.Omelyan6(0.05)).positions[0]
    ) if False else None
    one, many = (Simulation(world, fs.Leapfrog(0.01)) for world in (alone, crowd))
    one.advance(1.0)
    many.advance(1.0)
    np.testing.assert_array_equal(one.positions[0], many.positions[0])


@wp.kernel(module="unique", enable_backward=False)
def _nothing(start: int):
    pass


def test_the_force_gradient_is_that_of_the_force_squared():
    body = fs.Body([fs.Circle((0, 0, 0), (0, 0, 1), 1.0), CIGAR], gravity=fs.Newtonian())
    world = world_of(body)
    sources = Sources(world, "gravity", 0.0)
    stages = upload(sources, np.array([0.0]), "cpu")
    hessian = hessian_at(sources.kinds_used)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(points: wp.array(dtype=wp.vec3d), gravity: type(stages).cls, pushes: wp.array(dtype=wp.vec3d)):
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


def test_errors_of_rounding_grow_no_faster_than_their_root():
    # 1e5 orbits' worth of steps would need 1e-11 if roundings added up; a random walk of 64-bit roundings is far less.
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian()))
    world.add_particles([(1.0, 0, 0)], [(0, 1.0, 0)])
    simulation = Simulation(world, fs.KahanLi8(2 * math.pi / 64))
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
        log = fs.EnergyLog(simulation)
        for time in np.linspace(0.0, 20.0, 11)[1:]:
            simulation.advance(time)
            log.record()
        # The trial saw one orbit of these particles, the run about two.
        assert log.report().largest < 4.0 * tolerance
        orders.append(simulation.integrator.order)
    assert orders == sorted(orders)
    assert orders[0] < orders[-1]
    assert isinstance(Simulation(world, "auto").integrator, Splitting)
    assert Simulation(world, fs.Auto(1e-6)).integrator == Simulation(world, fs.Auto(1e-6)).integrator


def test_auto_judges_by_half_steps_where_nothing_is_kept():
    moving = fs.Body(CIGAR, gravity=fs.Newtonian(0.3), motion=lambda time: (0.1 * math.sin(time), 0, 0))
    choice = choose(
        fs.Auto(1e-7, candidates=(fs.Leapfrog, fs.Omelyan4)), world_of(moving), 0.0, lambda *args: Simulation(*args)
    )
    assert type(choice.integrator) is fs.Omelyan4
    assert 0.0 < choice.error <= 1e-7


def test_auto_says_when_nothing_is_good_enough():
    world = world_of(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian()))
    with pytest.raises(fs.FieldsimError, match=r"none of Leapfrog keeps the energy to 1e-14 .* larger tolerance"):
        Simulation(world, fs.Auto(1e-14, candidates=(fs.Leapfrog,)))
    assert isinstance(Simulation(fs.World(), fs.Auto()).integrator, fs.Leapfrog)


def test_a_step_that_overshoots_a_close_passage_is_told_of_once():
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian()))
    world.add_particles([(3.0, 0, 0)], [(0, 0.5, 0)])
    world.add_particles([(4.0, 0, 0), (1.0, 0, 0)], [(0, 0.5, 0), (0, 0.02, 0)])
    simulation = Simulation(world, fs.Leapfrog(0.01))
    log = fs.EnergyLog(simulation)
    with pytest.warns(fs.FieldsimWarning, match=r"at time 1\.\d+ the energy of particle 1 of set 1 .*shorter dt") as told:
        for time in np.linspace(0.0, 3.0, 31)[1:]:
            simulation.advance(time)
            log.record()
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


def test_a_run_that_fails_keeps_its_snapshots():
    world = world_of(fs.Body(CIGAR, gravity=fs.Newtonian(), motion=lambda t: (math.nan if t > 0.5 else 0.0, 0, 0)))
    kept = []
    with pytest.raises(fs.InputError, match="Body 0"):
        kept.extend(Simulation(world, fs.Leapfrog(0.01)).snapshots([0.2, 0.4, 0.6]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kept = []
        with pytest.raises(fs.InputError):
            for snapshot in Simulation(world, fs.Leapfrog(0.01)).snapshots([0.2, 0.4, 0.6]):
                kept.append(snapshot)
    assert [snapshot.time for snapshot in kept] == [0.2, 0.4]
