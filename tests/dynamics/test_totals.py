"""What free bodies, and particles that pull each other, keep together; and how the log and its picture tell of it."""

import numpy as np
import pytest

import fieldsim as fs

ROD = fs.Segment((-0.5, 0, 0), (0.5, 0, 0))
STAR = fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(0.3), mass=2.0)
LAW = fs.Newtonian(softening=0.05)


def rods(*others, skin=None):
    """Two rods that circle each other, and what else there is."""
    world = fs.World()
    for side in (-1.0, 1.0):
        motion = fs.Rigid((side, 0, 0.1 * side), velocity=(0, 0.4 * side, 0.1), angular_velocity=(0, 0.3, 0.2))
        world.add_body(fs.Body(ROD, gravity=fs.Newtonian(0.2), mass=1.0 + 0.5 * side, surface=skin, motion=motion))
    for body in others:
        world.add_body(body)
    return world


def cluster(*others, count=12):
    rng = np.random.default_rng(4)
    world = fs.World()
    for body in others:
        world.add_body(body)
    world.add_particles(rng.normal(size=(count, 3)), 0.3 * rng.normal(size=(count, 3)), gravity=LAW, mass=0.1)
    world.add_particles([(3.0, 0, 0)], [(0, 0.3, 0)])
    return world


def logged(world, integrator, until=2.0):
    simulation = fs.Simulation(world, integrator, threads=1)
    log = fs.EnergyLog(simulation)
    for time in np.linspace(0.1, until, 20):
        simulation.advance(time)
        log.record()
    return log


def drifts(world, integrator):
    return {(drift.whose, drift.quantity): drift.largest for drift in logged(world, integrator).report().totals}


@pytest.mark.parametrize(("make", "whose"), [(rods, "free bodies"), (cluster, "particles together")])
def test_what_is_alone_keeps_energy_momentum_and_angular_momentum(make, whose):
    fine, coarse = (drifts(make(), fs.Leapfrog(dt)) for dt in (1e-3, 2e-3))
    assert set(fine) == {(whose, name) for name in ("energy", "momentum", "angular momentum")}
    # Forces and torques come in equal and opposite pairs: rounding is all that is left, of some thousand steps.
    assert fine[whose, "momentum"] < 1e-14
    assert fine[whose, "angular momentum"] < 1e-14
    assert np.log2(coarse[whose, "energy"] / fine[whose, "energy"]) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("make", [rods, cluster])
def test_bodies_from_outside_leave_energy_if_they_stand_still_and_nothing_else(make):
    (kept,) = drifts(make(STAR), fs.Leapfrog(1e-3)).items()
    assert kept[0][1] == "energy"
    assert 0.0 < kept[1] < 1e-4
    turning = fs.Body(ROD, gravity=fs.Newtonian(0.3), motion=fs.Spin(rate=0.5))
    assert drifts(make(turning), fs.Leapfrog(1e-2)) == {}
    growing = fs.Body(ROD, gravity=fs.Newtonian(0.3), mass=lambda time: 1.0 + time)
    assert drifts(make(growing), fs.Leapfrog(1e-2)) == {}


def test_contacts_of_free_bodies_keep_their_energy():
    skin = fs.Material(radius=0.3)
    (drift,) = (d for d in logged(rods(skin=skin), fs.Leapfrog(1e-3), 4.0).report().totals if d.quantity == "energy")
    assert 0.0 < drift.largest < 1e-3


def test_weights_are_those_of_the_pull():
    """Of two particles with different G, momentum weighted by G m is kept."""
    world = fs.World()
    world.add_particles([(0, 0, 0)], [(0.1, 0, 0)], gravity=LAW, mass=1.0, G=2.0)
    world.add_particles([(1, 0, 0)], [(0, 0.5, 0)], gravity=LAW, mass=0.5, G=1.0)
    kept = drifts(world, fs.BlanesMoan6(1e-3))
    assert kept["particles together", "momentum"] < 1e-14
    assert kept["particles together", "energy"] < 1e-10


def test_a_loss_of_the_whole_is_told_of_once():
    world = fs.World()
    world.add_particles([(0, 0, 0), (1.0, 0, 0)], [(0, 0, 0), (0, 0.01, 0)], gravity=fs.Newtonian(1e-3), mass=1.0)
    text = r"energy of particles together has drifted .* give Leapfrog\(dt=0\.01\) a shorter dt, or a larger softening"
    with pytest.warns(fs.FieldsimWarning, match=text) as told:
        logged(world, fs.Leapfrog(1e-2), 3.0)
    assert len(told) == 1


def test_reports_name_what_was_judged():
    assert str(logged(rods(), fs.Leapfrog(1e-2)).report()).startswith("free bodies: drift of energy ")
    assert str(logged(cluster(), fs.Leapfrog(1e-2)).report()).startswith("particles together: drift of energy ")
    still = rods(fs.Body(fs.Point((0, 9, 0)), surface=fs.Material()))
    for body in still.bodies[:2]:
        object.__setattr__(body, "gravity", None)
    still.add_particles([(3.0, 0, 0)], [(0, 0.3, 0)])
    text = str(logged(still, fs.Leapfrog(1e-2)).report())
    assert text.startswith("energy drift at most 0.0e+00")
    assert "; free bodies: drift of energy" in text


def test_the_picture_has_a_line_for_each():
    log = logged(rods(), fs.Leapfrog(1e-2))
    axes = fs.plots.energy(log).axes[0]
    lines = {line.get_label(): line.get_xydata() for line in axes.get_lines()}
    assert set(lines) == {f"{name}, free bodies" for name in ("energy", "momentum", "angular momentum")}
    drift = lines["energy, free bodies"]
    np.testing.assert_array_equal(drift[:, 0], log.history.times)
    assert drift[:, 1].max() == log.report().totals[0].largest


def test_films_report_on_free_bodies():
    world = rods()
    scenario = fs.Scenario(world, fs.Camera((0, -5, 0)), integrator=fs.Leapfrog(1e-2), duration=1.0)
    report = fs.Report("", (8, 8))
    from fieldsim.filming import pipeline

    assert len(list(pipeline.snapshots(scenario, [0.0, 0.5], None, report))) == 2
    assert "free bodies" in str(report.energy)
    assert report.energy == report.log.report()
