"""Fast sums of the pull of many particles on each other: as right as asked for, and refused where there are none."""

import math

import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim.dynamics.splitting import fast_pull, mutual_gravity
from fieldsim.dynamics.splitting.fast_pull import FastPull, unfit
from fieldsim.errors import InputError
from fieldsim.potentials.fast_summation import summation
from fieldsim.potentials.fast_summation.summation import Sum

COUNT = 1500


@pytest.fixture(autouse=True)
def far_is_expanded(monkeypatch):
    """Also where so few particles would be summed exactly."""
    monkeypatch.setattr(summation, "FEW_AT_ALL", 0)
    monkeypatch.setattr(summation, "FEW_IN_A_LEVEL", 0)


def cloud(seed=3, count=COUNT):
    """Places dense in the middle, with a few far away."""
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(count, 3))
    far = rng.random(count) ** 2 * 3.0
    far[:4] = 6.0
    return ways / np.linalg.norm(ways, axis=1)[:, None] * far[:, None]


def world_of(kernel, masses=None, *, planet=False):
    world = fs.World()
    if planet:
        world.add_body(fs.Body(fs.Segment((-1, 0, 0), (1, 0, 0)), gravity=fs.Newtonian(0.3), mass=0.5))
    masses = np.random.default_rng(5).uniform(0.5, 1.5, COUNT) / COUNT if masses is None else masses
    world.add_particles(cloud(), np.zeros((COUNT, 3)), gravity=kernel, mass=masses)
    world.add_particles(cloud(7, 20), np.zeros((20, 3)))  # they feel and do not pull
    return world


def accelerations(world, **options):
    return fs.Simulation(world, fs.Leapfrog(0.01), **options)._state.a.numpy()


@pytest.mark.parametrize(
    ("kernel", "tolerance"),
    [(fs.Newtonian(), 1e-3), (fs.Newtonian(0.05), 1e-2), (fs.Gaussian(1.5), 1e-2), (fs.Gaussian(1.5), 1e-5)],
    ids=str,
)
def test_accelerations_are_as_right_as_asked_for(kernel, tolerance):
    world = world_of(kernel)
    exact = accelerations(world, pull_tolerance=0)
    fast = accelerations(world, pull_tolerance=tolerance)
    errors = np.linalg.norm(fast - exact, axis=1)
    assert 0.0 < errors.max() < tolerance * np.sqrt((exact**2).sum() / len(exact))


def test_sums_that_are_too_wrong_are_made_finer_and_stay_so(monkeypatch):
    """By sums that are as wrong as allowed from a thousandth of the tolerance down."""
    asked = []

    def wrong(group, points, tolerance, order, *, threads):
        asked.append(tolerance)
        return Sum([np.zeros(COUNT), np.ones((COUNT, 3))], [], [0.0, 999.0 * tolerance * math.sqrt(3.0)], 1.0)

    monkeypatch.setattr(fast_pull, "fast_sum", wrong)
    pull = FastPull(fs.Gaussian(1.5), np.ones(COUNT), np.arange(COUNT), 1e-4)
    pull.accelerations(cloud())
    pull.accelerations(cloud())
    assert asked == pytest.approx([1e-4, 1e-7, 1e-7])


def test_masses_may_be_of_both_signs():
    masses = np.random.default_rng(6).normal(size=COUNT) / COUNT
    world = world_of(fs.Newtonian(), masses)
    exact, fast = (accelerations(world, pull_tolerance=tolerance) for tolerance in (0, 1e-3))
    assert 0.0 < np.abs(fast - exact).max() < 1e-3 * np.sqrt((exact**2).sum() / len(exact))


def test_energies_of_bare_particles_are_exact():
    """Their own potential, which is infinite, cannot be taken from a sum."""
    world = world_of(fs.Newtonian())
    exact, fast = (fs.Simulation(world, pull_tolerance=t).mutual.potential_energies(cloud()) for t in (0, 1e-2))
    assert exact.min() < 0.0
    np.testing.assert_array_equal(fast, exact)


def test_a_cluster_moves_as_by_exact_sums_and_keeps_its_energy():
    ends, energies = [], []
    for tolerance in (0, 1e-3):
        world = world_of(fs.Gaussian(1.5), planet=True)
        simulation = fs.Simulation(world, fs.Leapfrog(0.05), pull_tolerance=tolerance)
        simulation.advance(0.2)
        ends.append(np.concatenate(simulation.positions))
        energies.append(simulation.mutual.potential_energies(ends[0]))
    assert 0.0 < np.abs(ends[1] - ends[0]).max() < 1e-4
    assert 0.0 < np.abs(energies[1] - energies[0]).max() < 1e-3 * np.abs(energies[0]).max()


def test_threads_change_no_byte():
    ends = []
    for threads in (1, 2):
        simulation = fs.Simulation(world_of(fs.Gaussian(1.5)), fs.Leapfrog(1e-4), pull_tolerance=1e-2, threads=threads)
        simulation.advance(2e-4)
        ends.append(simulation.positions[0].tobytes())
    assert ends[0] == ends[1]


def test_many_are_summed_fast_if_nothing_is_said(monkeypatch):
    world = world_of(fs.Gaussian(1.5))
    assert fs.Simulation(world).mutual.tolerance == 0.0
    monkeypatch.setattr(mutual_gravity, "EXACT", COUNT - 1)
    assert fs.Simulation(world).mutual.tolerance == 1e-6
    assert fs.Simulation(world, pull_tolerance=0).mutual.tolerance == 0.0
    assert fs.Simulation(world, fs.Chin4(0.01)).mutual.tolerance == 0.0


def test_what_is_nowhere_is_told_of_and_not_summed():
    places = np.array([(0.0, 0.0, 0.0), (np.nan, 0.0, 0.0)])
    pull = FastPull(fs.Newtonian(0.1), np.ones(2), np.arange(2), 1e-3)
    assert np.isnan(pull.accelerations(places)).all()


@pytest.mark.parametrize(
    ("world", "method", "words"),
    [
        (fs.World(), fs.Leapfrog(0.01), "no particles pull each other"),
        (
            world_of(fs.Newtonian(0.1)),
            fs.Chin4(0.01),
            r"force gradients, which Chin4\(dt=0.01\) has, are summed exactly",
        ),
    ],
)
def test_where_there_are_no_fast_sums_they_are_refused(world, method, words):
    with pytest.raises(InputError, match=f"Simulation: pull_tolerance is 0.001, but {words}; leave it out"):
        fs.Simulation(world, method, pull_tolerance=1e-3)


def test_a_gpu_sums_exactly():
    class Device:
        is_cuda = True

    assert "made on the CPU" in unfit(fs.Newtonian(), Device(), fs.Leapfrog(0.01))
    assert unfit(fs.Newtonian(), wp.get_device("cpu"), fs.Leapfrog(0.01)) is None


@pytest.mark.parametrize("tolerance", [-1e-3, 1e-12, 0.5, np.nan, "fine", True])
def test_bad_tolerances(tolerance):
    with pytest.raises(InputError, match="Simulation: pull_tolerance is"):
        fs.Simulation(world_of(fs.Newtonian(0.1)), pull_tolerance=tolerance)
