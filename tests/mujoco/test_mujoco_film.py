"""Experiments: MuJoCo models in the fields of a world, run, filmed and replayed; the scenarios with models."""

import math
import time

import imageio.v3 as imageio
import mujoco
import numpy as np
import pytest
from mujoco_scenes import BALL, CAMERA, CLAY, DONUT, HUMANOID, PLANET, SCENARIOS, ball_experiment

import fieldsim as fs
from fieldsim import launch, scenario
from fieldsim.mujoco.contact.impact import hit_speed
from fieldsim.mujoco.models import model_of
from fieldsim.render.solids.packing import solids_of
from fieldsim.world.motion import pose_at

# Experiments


def test_experiments_step_as_mujoco_does():
    experiment = ball_experiment(start=lambda model, data: data.qvel.__setitem__(1, 0.6))
    run, log = experiment.begin()
    for moment, steps in ((0.1, 20), (0.333, 67), (0.5, 100)):
        run.advance(moment)
        log.record()
        assert run.steps_done == steps  # the step nearest to the time
    model = model_of(BALL.format(gravity="0 0 0"))
    data = mujoco.MjData(model)
    data.qvel[1] = 0.6
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy="points"):
        mujoco.mj_step(model, data, 100)
    np.testing.assert_array_equal(run.data.qpos, data.qpos)
    np.testing.assert_array_equal(solids_of(run.snapshot()).origins[-1], data.qpos[:3])
    assert mujoco.get_mjcb_passive() is None
    assert 0.0 < log.report().totals[0].largest < 1e-9
    assert experiment.model.opt.timestep == 0.005


def test_an_experiment_is_controlled_and_its_gravity_switched_off():
    seen = []
    given = model_of(BALL.format(gravity="0 0 -9.81"))
    experiment = fs.mujoco.Experiment.of(
        ball_experiment(), given, keep_gravity=False, control=lambda model, data: seen.append(data.time)
    )
    run, log = experiment.begin()
    run.advance(0.1)
    log.record()
    assert seen == pytest.approx([0.005 * k for k in range(20)])
    assert log.report().totals[0].largest < 1e-9
    assert given.opt.gravity[2] == -9.81
    with pytest.raises(fs.InputError, match="the model has its own gravity"):
        ball_experiment("0 0 -9.81").begin()


def test_what_is_compiled_in_a_run_is_counted_once():
    before, begun = launch.load_seconds(), time.perf_counter()
    with launch.loading(), launch.loading():
        assert launch.loading_for() > 0.0
    assert 0.0 < launch.load_seconds() - before <= time.perf_counter() - begun
    assert launch.loading_for() == 0.0


@pytest.mark.parametrize(
    "control",
    [
        lambda model, data: setattr(data, "time", 0.0),
        lambda model, data: mujoco.mj_resetData(model, data) if data.time > 0.05 else None,
        lambda model, data: mujoco.mj_step(model, data),
        lambda model, data: setattr(model.opt, "timestep", 0.002),
    ],
    ids=["set", "reset", "stepped", "timestep"],
)
def test_a_control_that_moves_the_clock_is_refused(control):
    run, _ = ball_experiment(control=control).begin()
    with pytest.raises(fs.FieldsimError, match=r"at time 0\.2 of the run data\.time is .*; let control neither"):
        run.advance(0.2)


@pytest.mark.parametrize("step", [0.0, math.nan, -0.01, 0.6, 1e-300, 1e-10])
def test_a_timestep_that_does_not_fit_the_duration_is_refused(step):
    experiment = ball_experiment()
    experiment.model.opt.timestep = step
    with pytest.raises(fs.InputError, match="timestep"):
        experiment.begin()


def test_a_run_begins_at_time_0():
    with pytest.raises(fs.InputError, match=r"start leaves data\.time at 3, but a run begins at 0"):
        ball_experiment(start=lambda model, data: setattr(data, "time", 3.0)).begin()


def test_what_fails_under_way_leaves_no_callback():
    def fail(model, data):
        raise RuntimeError("no more")

    run, _ = ball_experiment(control=fail).begin()
    words = r"control, a function, failed at .*RuntimeError: no more.*test_mujoco_film.py:\d+"
    with pytest.raises(fs.FieldsimError, match=words):
        run.advance(0.1)
    assert mujoco.get_mjcb_passive() is None


def test_experiments_film_the_same_and_are_replayed(tmp_path):
    world = fs.World()
    world.add_body(PLANET)
    world.add_shape(fs.Ground(-1.5), motion=fs.Pose((0, 0, -0.1)))
    world.add_particles([(2, 0, 1)], [(0, 0, 0)])
    humanoid = model_of(HUMANOID)
    arm = fs.mujoco.skin(humanoid, "left_arm")
    experiment = fs.mujoco.Experiment(world, CAMERA, model=humanoid, skins=arm, duration=0.3, fps=10)
    report = fs.film(experiment, tmp_path / "a_%d.png", size=(48, 27), record=tmp_path / "run.npz")
    assert "MuJoCo steps/s, IMPLICITFAST of 0.0005" in str(report)
    assert "1 of 1 particles" in str(report)
    assert "the MuJoCo model: drift of total energy" in str(report)
    assert report.particle_steps == 400
    fs.film(experiment, tmp_path / "b_%d.png", size=(48, 27))
    fs.film(experiment, tmp_path / "c_%d.png", size=(48, 27), replay=tmp_path / "run.npz")
    pictures = [[(tmp_path / f"{name}_{k}.png").read_bytes() for k in range(3)] for name in "ab"]
    assert pictures[0] == pictures[1]
    assert pictures[0][0] != pictures[0][2]
    # Poses pass through quaternions on their way: an edge may round the other way.
    for k in range(3):
        one, other = (imageio.imread(tmp_path / f"{name}_{k}.png").astype(int) for name in "ac")
        assert np.mean(np.abs(one - other) > 2) < 1e-3


@pytest.mark.parametrize("motion", [fs.Spin(axis=(1, 0, 0), rate=2), fs.Pose((0, 0, 0.1))], ids=["moving", "still"])
def test_planets_as_geoms_are_where_their_bodies_are(motion):
    body = fs.Body(DONUT, gravity=fs.Newtonian(), surface=CLAY, motion=motion)
    planet = fs.mujoco.planet_geom(body, kind="mesh", resolution=12)
    world = fs.World()
    world.add_body(body)
    model = (
        f'<mujoco><option gravity="0 0 0"/><asset>{planet.asset}</asset><worldbody>{planet.body}'
        '<body pos="0 0 2"><freejoint/><geom size=".1"/></body></worldbody></mujoco>'
    )
    run, _ = fs.mujoco.Experiment(world, CAMERA, model=model, planets=planet, duration=1.0).begin()
    run.advance(0.5)
    assert len(solids_of(run.snapshot())) == 1
    # Its place is that before the last step.
    expected = pose_at(motion, 0.5 - run.experiment.model.opt.timestep)
    np.testing.assert_allclose(run.data.body("planet").xmat.reshape(3, 3), expected.matrix, atol=1e-12)
    np.testing.assert_allclose(run.data.body("planet").xpos, expected.position, atol=1e-12)


def test_motions_that_blow_up_are_told(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log
    push = lambda model, data: data.qvel.__setitem__(0, 1e11)  # noqa: E731
    run, _ = ball_experiment(start=push).begin()
    with pytest.raises(fs.FieldsimError, match=r"between times 0 and 0\.1 the model's motion blew up"):
        run.advance(0.1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"model": 7}, "model is 7; give a mujoco.MjModel"),
        ({"model": "nowhere.xml"}, "there is no model 'nowhere.xml'"),
        ({"model": "<mujoco><worldbody><geom type='cube'/>"}, "MuJoCo cannot read the MJCF: "),
        ({"integrator": fs.Radau()}, "integrator is Radau.*, which moves particles, and there are none"),
        ({"start": 1.0}, "start is 1.0; give a function"),
        ({"skins": ["pelvis"]}, r"skins\[0\] is 'pelvis'; give fs\.mujoco\.skin"),
        ({"planets": [PLANET]}, r"planets\[0\] is .*; give fs\.mujoco\.planet_geom"),
    ],
)
def test_experiments_that_cannot_be_are_refused(options, words):
    with pytest.raises(fs.InputError, match=words):
        fs.mujoco.Experiment(fs.World(), CAMERA, **{"model": BALL.format(gravity="0 0 0"), "duration": 1.0, **options})


def test_a_world_without_bodies_has_no_field():
    with pytest.raises(fs.InputError, match="there are no sources"):
        fs.mujoco.Experiment(fs.World(), CAMERA, model=BALL.format(gravity="0 0 0"), duration=1.0).begin()


def test_the_speed_of_a_fall():
    world = fs.World()
    world.add_body(PLANET)
    field = PLANET.gravity_field()
    highest = max(field.value((1.0 - 0.25, 0, 0)), field.value((1, 0, 0.25)))
    expected = np.sqrt(2 * (highest - field.value((2, 0, 0.3))))
    # A grid of 24 cells a side finds points within a cell of the surface, where 1 / distance changes by a tenth.
    assert hit_speed(world, model_of(BALL.format(gravity="0 0 0"))) == pytest.approx(expected, rel=0.1)


# Scenarios


def built(name, **options):
    return scenario.call(scenario.load(str(SCENARIOS / f"{name}.py")), options)


def test_the_pendulum_keeps_its_energy():
    run, log = built("mujoco_cross_pendulum").begin()
    for moment in (0.5, 1.0, 1.5, 2.0):
        run.advance(moment)
        log.record()
    assert np.abs(run.data.qvel).max() > 0.5
    assert log.report().totals[0].largest < 1e-8


def test_the_tether_is_pulled_along_the_tide():
    """Between equal masses m at a distance l that turn at w: tension = m / 2 (difference of the pulls + w^2 l)."""
    experiment = built("mujoco_tether", tilt=0.0)
    field = experiment.world.bodies[0].gravity_field()
    mass, step = experiment.model.body_mass[-1], experiment.model.opt.timestep
    run, log = experiment.begin()
    ends = []
    for k in range(100, 103):
        run.advance(k * step)
        log.record()
        ends.append(run.data.xipos[[1, -1]].copy())
    acceleration = (ends[0] - 2.0 * ends[1] + ends[2]) / step**2
    pulls = field.gradient(ends[1])
    inner, outer = ends[1]
    length = np.linalg.norm(outer - inner)
    along = (outer - inner) / length
    # What the satellites need beyond the pulls on them, the tether gives.
    tension = mass * (acceleration - pulls)
    across = tension - np.outer(tension @ along, along)
    assert np.linalg.norm(across) < 0.02 * np.linalg.norm(tension)
    spin = np.linalg.norm(np.diff(ends[2] - ends[0], axis=0)) / (2 * step * length)
    expected = 0.5 * mass * ((pulls[1] - pulls[0]) @ along + spin**2 * length)
    # The links have 5 % of the mass of a satellite.
    assert tension @ along == pytest.approx((expected, -expected), rel=0.05)
    assert log.report().totals[0].largest < 1e-9


def test_some_of_the_rain_falls_through_the_hole_and_none_through_the_tube():
    run, log = built("mujoco_donut", boxes=8, capsules=8, links=4).begin()
    ring = run.experiment.world.bodies[0].surface_field()
    lowest = 0.0
    for moment in np.arange(0.25, 2.6, 0.25):
        run.advance(moment)
        middles = run.data.geom_xpos
        lowest = min(lowest, middles[:, 2].min())
        # The thinnest are 0.07 thick and go in by a fifth of half of that: F where 0.028 is left of it.
        assert ring.value(middles).max() < ring.value((1.278, 0, 0))
        log.record()
    assert lowest < -0.5
    drift, gains = log.report().totals
    assert drift.largest > 1e-3  # hits cost energy,
    assert gains.largest < 1e-6  # and nothing gives any
