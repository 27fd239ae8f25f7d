"""MuJoCo models in pictures: geoms and skins where they should be, experiments that run, and the command."""

import pathlib
import re
import time

import imageio.v3 as imageio
import mujoco
import numpy as np
import pytest

import fieldsim as fs
from fieldsim import cli, launch, scenario
from fieldsim.mujoco.beside import Beside
from fieldsim.mujoco.fall import hit_speed
from fieldsim.mujoco.geoms import material_of, shape_of
from fieldsim.mujoco.models import model_of
from fieldsim.mujoco.skins import medial
from fieldsim.world.motion import pose_at

SCENARIOS = pathlib.Path(__file__).parents[1] / "scenarios"
HUMANOID = SCENARIOS / "humanoid.xml"
DONUT = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
CLAY = fs.Material(radius=0.25, blobbiness=-8.0)
PLANET = fs.Body(DONUT, gravity=fs.Newtonian(), mass=1.0, surface=CLAY, name="donut")
CAMERA = fs.Camera((2.5, -3.5, 2.0), fov=45.0)
SIZE = (96, 72)

# One geom of every type that is drawn, each turned.
ALL_KINDS = """
<mujoco>
  <option gravity="0 0 0"/>
  <asset>
    <mesh name="tent" vertex="0 0 0  .6 0 0  0 .6 0  .6 .6 0  .3 .3 .5"
      face="0 2 1  1 2 3  0 1 4  1 3 4  3 2 4  2 0 4"/>
    <material name="gold" rgba="1 .8 .2 1" specular=".7" shininess=".5"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" pos="0 0 -.8" size="3 2 1" euler="4 5 0"/>
    <geom type="sphere" pos="-1.4 0 0" size=".3" material="gold"/>
    <body pos="-.7 .3 .4" euler="30 40 10"><freejoint/><geom type="capsule" size=".15 .3" euler="20 0 0"/></body>
    <body pos="0 0 .5" euler="10 50 70"><freejoint/><geom type="ellipsoid" size=".4 .25 .15" rgba="1 0 0 1"/></body>
    <body pos=".8 .2 .1" euler="60 20 10"><freejoint/>
      <geom type="cylinder" size=".2 .3" material="gold" rgba="0 1 0 1"/></body>
    <body pos="0 -.9 -.2" euler="15 25 35"><freejoint/><geom type="box" size=".3 .2 .15"/></body>
    <body pos="1.2 -.9 .3" euler="15 35 5"><freejoint/><geom type="mesh" mesh="tent"/></body>
    <body pos="0 0 1.2"><freejoint/><geom size=".3" group="3"/><geom size=".2" rgba="1 1 1 0"/></body>
  </worldbody>
</mujoco>
"""


def posed(mjcf):
    model = model_of(mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def pixel_rays(camera, size):
    """Unit directions (H, W, 3) through the pixels' centres."""
    right, up, forward = camera.axes()
    width, height = size
    top = np.tan(np.radians(camera.fov) / 2)
    y, x = np.mgrid[:height, :width] + 0.5
    away = forward + top * ((2 * x - width) / height)[..., None] * right - top * (2 * y / height - 1)[..., None] * up
    return away / np.linalg.norm(away, axis=2, keepdims=True)


# Geoms


def test_geoms_are_where_mujocos_own_rays_find_them():
    model, data = posed(ALL_KINDS)
    scene = fs.mujoco.Scene(fs.World(), model)
    layers = fs.Renderer(SIZE).layers(scene.snapshot(data), CAMERA)
    rays, eye, found = pixel_rays(CAMERA, SIZE), np.array(CAMERA.eye), np.zeros(1, dtype=np.int32)
    seen = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)
    depth, owner = np.full(layers["depth"].shape, np.inf), np.full(layers["depth"].shape, -1)
    for place in np.ndindex(depth.shape):
        distance = mujoco.mj_ray(model, data, eye, rays[place], seen, 1, -1, found)
        if distance >= 0.0:
            depth[place], owner[place] = distance, scene.geoms.index(found[0])
    # Where a ray grazes an outline, either may be right.
    same = (owner == layers["owner"]) & np.isfinite(depth)
    missed = (owner < 0) & (layers["owner"] < 0)
    assert np.mean(same | missed) > 0.995
    assert set(owner[same]) == set(range(7))
    # float32 against float64, of lengths of 5; at a grazing hit an error of it grows by the slope.
    assert np.quantile(np.abs(depth[same] - layers["depth"][same]), 0.99) < 2e-5


def test_geoms_look_as_in_mujoco():
    scene = fs.mujoco.Scene(fs.World(), ALL_KINDS)
    ball, cylinder = (scene.world.shapes[0].materials[k] for k in (1, 4))
    assert ball.color == pytest.approx((1.0, 0.8, 0.2))
    assert (ball.specular, ball.shininess) == pytest.approx((0.7, 64.0))
    assert cylinder.color == (0.0, 1.0, 0.0)  # a geom's own colour goes before its material's
    assert scene.world.shapes[0].shapes[0].extent == (3.0, 2.0)


def test_geoms_are_as_clear_and_as_mirroring_as_in_mujoco():
    model = model_of(
        '<mujoco><asset><material name="ice" rgba=".5 .7 1 .25" reflectance=".3"/></asset><worldbody>'
        '<geom type="box" size="1 1 1" material="ice"/><geom size="1" material="ice"/></worldbody></mujoco>'
    )
    box, ball = (material_of(model, geom) for geom in range(2))
    assert (box.transmission, box.ior, box.reflection) == pytest.approx((0.75, 1.0, 0.3))
    assert (ball.transmission, ball.reflection) == pytest.approx((0.75, 0.0))


CHECKERED = """
<mujoco><asset>
  <texture name="grid" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1" width="64" height="64"/>
  <material name="floor" texture="grid" texrepeat="4 4" texuniform="{uniform}" rgba="1 1 .5 1" specular="0"/>
</asset><worldbody>
  <geom type="plane" size="2 2 1" material="floor"/><geom size=".1" pos="0 0 1" material="floor"/>
</worldbody></mujoco>
"""


def test_textures_become_checkers_and_means():
    for uniform, tile in (("true", 0.25), ("false", 0.5)):
        group = fs.mujoco.Scene(fs.World(), CHECKERED.format(uniform=uniform)).world.shapes[0]
        assert group.shapes[0].tile == tile
        np.testing.assert_allclose(group.shapes[0].checker, (1, 0, 0), atol=1e-6)
        np.testing.assert_allclose(group.materials[0].color, (0, 0, 0.5), atol=1e-6)
        np.testing.assert_allclose(group.materials[1].color, (0.5, 0, 0.25), atol=1e-2)


def test_what_the_world_holds_stays_in_the_picture():
    world = fs.World()
    world.add_body(PLANET)
    world.add_shape([fs.Ball(), fs.Ball()], motion=fs.Spin())
    world.add_particles([(0, 0, 2)], [(0, 0, 0)])
    model, data = posed(ALL_KINDS)
    data.time = 0.5
    snapshot = fs.mujoco.Scene(world, model).snapshot(data)
    assert len(snapshot.shapes) == 2 + 7
    np.testing.assert_allclose(snapshot.shapes.axes[0], world.at(0.5).shapes.axes[0])
    assert len(snapshot.surface.materials) == len(snapshot.spheres[1]) == 1
    assert len(world.shapes) == 1  # the world itself is left as it was


def test_a_planets_geom_is_not_drawn_twice():
    planet = fs.mujoco.planet_geom(PLANET, kind="mesh", resolution=12)
    model, _ = posed(
        f"<mujoco><asset>{planet.asset}</asset><worldbody>{planet.body}<geom size='1'/></worldbody></mujoco>"
    )
    assert len(fs.mujoco.Scene(fs.World(), model).geoms) == 2
    assert len(fs.mujoco.Scene(fs.World(), model, planets=planet).geoms) == 1


def test_height_fields_are_told_of():
    model = model_of(
        '<mujoco><asset><hfield name="hills" nrow="4" ncol="4" size="1 1 1 1"/></asset><worldbody>'
        '<geom name="land" type="hfield" hfield="hills"/></worldbody></mujoco>'
    )
    with pytest.warns(fs.FieldsimWarning, match="geom 'land' is not drawn: its type hfield is none of"):
        assert shape_of(model, 0) is None


# Skins


def test_what_a_skin_makes_of_sizes():
    def ends(half):
        primitives, radius = medial(half)
        return [tuple(getattr(p, n) for n in p.points) for p in primitives], radius

    assert ends((0.2, 0.2, 0.2)) == ([((0.0, 0.0, 0.0),)], pytest.approx(0.2))
    assert ends((0.1, 0.1, 0.5)) == ([((0, 0, -0.4), (0, 0, 0.4))], 0.1)
    plates, radius = ends((0.5, 0.1, 0.3))
    assert radius == 0.1
    assert len(plates) == 2
    corners = np.unique(np.concatenate(plates), axis=0)
    np.testing.assert_allclose(np.abs(corners), [(0.4, 0.0, 0.2)] * 4)


def test_skins_follow_their_bodies():
    model, data = posed(HUMANOID)
    skin = fs.mujoco.skin(model)
    assert len(skin.bodies) == len(skin.geoms) == model.ngeom
    data.qpos[:] += 0.3 * np.random.default_rng(1).normal(size=model.nq)
    mujoco.mj_kinematics(model, data)
    scene = fs.mujoco.Scene(fs.World(), model, skins=skin)
    snapshot = scene.snapshot(data)
    assert not scene.geoms
    field = fs.Field.of_elements(snapshot.surface.elements)
    for geom in range(model.ngeom):
        # The axis of every geom is well within the skin, up to its ends; and far from all of them there is nothing.
        along = model.geom_size[geom, 1] * data.geom_xmat[geom].reshape(3, 3)[:, 2]
        assert field.value(data.geom_xpos[geom] + np.outer((-1, 0, 1), along)).min() > 1.5
    assert field.value(data.xpos[1] + (0, 0, 3)) < 1e-6
    # A sphere's skin is the sphere, where no other part is near: the top of the head.
    skull = model.geom("skull").id
    up = data.geom_xmat[skull].reshape(3, 3)[:, 2]
    assert field.value(data.geom_xpos[skull] + model.geom_size[skull, 0] * up) == pytest.approx(1.0, abs=0.02)


def test_a_skin_may_be_of_a_part_and_of_one_material():
    model = model_of(HUMANOID)
    moss = fs.Material("moss", blobbiness=-3.0)
    arm = fs.mujoco.skin(model, "left_arm", material=moss, swell=1.5)
    assert {body.surface.color for body in arm.bodies} == {"moss"}
    assert sorted(body.surface.radius for body in arm.bodies) == pytest.approx([0.0525, 0.06, 0.0675])
    assert len(fs.mujoco.Scene(fs.World(), model, skins=[arm]).geoms) == model.ngeom - 3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"root": "tail"}, "no body 'tail'; it has 'pelvis', 'chest'"),
        ({"root": 99}, "no body 99"),
        ({"material": "moss"}, "material is 'moss'; give a fs.Material"),
        ({"swell": 0}, "swell is 0"),
    ],
)
def test_skins_that_cannot_be_are_refused(options, words):
    with pytest.raises(fs.InputError, match=words):
        fs.mujoco.skin(HUMANOID, **options)


def test_a_model_without_geoms_has_no_skin():
    with pytest.raises(fs.InputError, match="no geom to be seen that moves"):
        fs.mujoco.skin("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")


# Experiments

BALL = """
<mujoco><option gravity="{gravity}" integrator="RK4" timestep="0.005"/><worldbody>
  <body name="ball" pos="2 0 0.3"><freejoint/><geom size="0.1"/></body>
</worldbody></mujoco>
"""


def ball_experiment(gravity="0 0 0", **options):
    world = fs.World()
    world.add_body(PLANET)
    return fs.mujoco.Experiment(world, CAMERA, model=BALL.format(gravity=gravity), **{"duration": 0.5, **options})


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
    np.testing.assert_array_equal(run.snapshot().shapes.origins[-1], data.qpos[:3])
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


def test_what_fails_under_way_leaves_no_callback():
    def fail(model, data):
        raise RuntimeError("no more")

    run, _ = ball_experiment(control=fail).begin()
    with pytest.raises(RuntimeError, match="no more"):
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
    assert len(run.snapshot().shapes) == 1
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


# The command


def fieldsim(*arguments):
    """Exit status of the command."""
    with pytest.raises(SystemExit) as end:
        cli.main(argv=[str(a) for a in arguments])
    return end.value.code


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with scenarios/still.py, a donut, and ball.xml, to work in."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "still.py").write_text(
        '"""A donut.\n\nmass: its mass\n"""\nimport fieldsim as fs\n\n'
        "def build(mass: float = 1.0):\n"
        "    world = fs.World()\n"
        "    ring = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)\n"
        "    clay = fs.Material(radius=0.25, blobbiness=-8.0)\n"
        "    world.add_body(fs.Body(ring, gravity=fs.Newtonian(), mass=mass, surface=clay))\n"
        "    return fs.Scenario(world, fs.Camera((2.5, -3.5, 2.0)), duration=0.2, fps=10)\n"
    )
    (tmp_path / "ball.xml").write_text(BALL.format(gravity="0 0 -9.81"))
    return tmp_path


DRAFT = ("--size", "48x27", "--quality", "draft")


def test_the_command_films_a_model_in_a_scenario(here, capsys):
    assert fieldsim("mujoco", "ball.xml", "still", *DRAFT, "--mass", 2) == 0
    told = capsys.readouterr()
    assert told.err == ""
    assert told.out.startswith("ball-still.mp4: 2 frames of 48x27 in ")
    assert "MuJoCo steps/s" in told.out
    assert (
        fieldsim("mujoco", "--skin", *DRAFT, HUMANOID, "--duration", 1, "--fps", 2, "still", "--out", "p_%d.png") == 0
    )
    first, last = (imageio.imread(f"p_{k}.png").astype(int) for k in range(2))
    assert np.abs(last - first).max() > 20


def test_the_commands_help_teaches(here, capsys):
    assert fieldsim("mujoco", "--help") == 0
    shown = capsys.readouterr().out
    for words in ("MODEL.xml SCENARIO", "fieldsim mujoco humanoid.xml donut", "still  A donut."):
        assert words in shown
    assert fieldsim("mujoco", "ball.xml", "--help") == 0
    assert capsys.readouterr().out == shown
    assert fieldsim("mujoco") == 2
    assert capsys.readouterr().err.strip() == shown.strip()
    assert fieldsim("mujoco", "ball.xml", "still", "--help") == 0
    shown = capsys.readouterr().out
    for words in ("--skin", "--mass FLOAT", "--beside", "--size WxH", "--keep-gravity"):
        assert words in shown


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["nothing.xml", "still"], 2, "there is no model 'nothing.xml'"),
        (["bad.xml", "still"], 2, "MuJoCo cannot read 'bad.xml': "),
        (["ball.xml", "stil"], 2, "did you mean still?"),
        (["ball.xml"], 2, "name a SCENARIO besides the options"),
        ([], 2, "name MODEL.xml and a SCENARIO besides the options"),
        (["ball.xml", "still", "--speed", "-1"], 2, "-1 is not a positive number"),
        (["ball.xml", "still", "--beside", "--replay", "a.npz"], 2, "not a recording"),
        (["ball.xml", "still", "--damping", "-1"], 1, "Contact: damping is -1"),
        (["fixed.xml", "still", "--no-contact"], 1, "the model has no degree of freedom"),
        (["fixed.xml", "still"], 1, "no fall onto a surface"),
        (["ball.xml", "own"], 1, "own has a model of its own; film it with: fieldsim run own"),
        (["ball.xml", "empty"], 1, "there are no sources"),
        (["ball.xml", "plot"], 2, "the scenario is a picture"),
    ],
)
def test_wrong_models_and_scenarios_are_told(here, capsys, arguments, status, words):
    (here / "bad.xml").write_text("<mujoco><worldbody><geom type='cube'/></worldbody></mujoco>")
    (here / "fixed.xml").write_text("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    imports = "import fieldsim as fs\n"
    start = "fs.World(), fs.Camera((3, 0, 0)), duration=1.0"
    (here / "scenarios" / "own.py").write_text(
        f"{imports}def build(): return fs.mujoco.Experiment({start}, model='ball.xml')"
    )
    (here / "scenarios" / "empty.py").write_text(f"{imports}def build(): return fs.Scenario({start})")
    (here / "scenarios" / "plot.py").write_text(f"{imports}def build(): return fs.Picture(fs.plots.figure)")
    assert fieldsim("mujoco", *arguments, *DRAFT) == status
    told = capsys.readouterr()
    assert re.search(re.escape(words), told.err), told.err
    assert told.out == ""
    assert not list(here.glob("*.mp4"))


def test_mujocos_own_picture_needs_opengl(here, capsys, monkeypatch):
    def fail(*arguments):
        raise RuntimeError("no display")

    monkeypatch.setattr(mujoco, "Renderer", fail)
    assert fieldsim("mujoco", "ball.xml", "still", "--beside", *DRAFT) == 1
    assert "no OpenGL context here (no display); set the environment variable MUJOCO_GL=egl" in capsys.readouterr().err
    assert not list(here.glob("*.mp4"))


@pytest.fixture
def opengl():
    """Skip where MuJoCo has nothing to draw with."""
    try:
        Beside(model_of(BALL.format(gravity="0 0 0")), (8, 8))
    except fs.FieldsimError:
        pytest.skip("no OpenGL context here")


@pytest.mark.parametrize("uniform", ["true", "false"])
def test_checkers_lie_as_mujoco_has_them(opengl, uniform):
    model, data = posed(CHECKERED.format(uniform=uniform))
    snapshot = fs.mujoco.Scene(fs.World(), model).snapshot(data)
    above = fs.Camera((0, 0, 20), up=(0, 1, 0), fov=11.0)
    own = Beside(model, (180, 180)).frame(snapshot, above).astype(int)
    ours = fs.render(snapshot, above, size=(180, 180)).astype(int)
    # All but pixels on the edges of squares.
    assert np.mean((own[..., 0] > own[..., 2]) == (ours[..., 0] > ours[..., 2])) > 0.95


def test_mujocos_own_picture_stands_beside(opengl, tmp_path):
    """Both see the same ball at the same pixels."""
    experiment = ball_experiment(fps=10)
    beside = lambda size: Beside(experiment.model, size)  # noqa: E731
    fs.film(experiment, tmp_path / "p_%d.png", size=(64, 48), beside=beside)
    picture = imageio.imread(tmp_path / "p_0.png")
    assert picture.shape == (48, 128, 3)
    snapshot = experiment.begin()[0].snapshot()
    own = Beside(experiment.model, (64, 48)).frame(snapshot, CAMERA)
    ours = fs.Renderer((64, 48)).layers(snapshot, CAMERA)["thing"] == 3
    theirs = own.sum(axis=2) > 0
    assert theirs.sum() > 10
    assert np.sum(ours ^ theirs) < 0.5 * theirs.sum()
