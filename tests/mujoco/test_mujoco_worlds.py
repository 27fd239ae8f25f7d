"""MuJoCo with planets as geoms, many worlds at once, and the gymnasium environment."""

import subprocess
import sys

import mujoco
import numpy as np
import pytest

import fieldsim as fs
from fieldsim.mujoco.scene import planet

DONUT = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
CLAY = fs.Material(radius=0.25, blobbiness=-8.0)
PLANET = fs.Body(DONUT, gravity=fs.Newtonian(), mass=1.0, surface=CLAY, name="donut")
with_sdf = pytest.mark.skipif(planet.mujoco_version() < planet.SDF_SINCE, reason="this MuJoCo makes no distance field")


def model_with(geoms, bodies, timestep=0.005):
    asset = "".join(geom.asset for geom in geoms)
    world = "".join(geom.body for geom in geoms)
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0" timestep="{timestep}"/><asset>{asset}</asset>'
        f"<worldbody>{world}{bodies}</worldbody></mujoco>"
    )


# Planets as geoms


@with_sdf
def test_a_ball_rests_on_a_planet_as_a_geom():
    geom = fs.mujoco.planet_geom(PLANET, resolution=64, friction=0.7)
    model = model_with([geom], '<body pos="0 1 0.31"><joint type="slide" axis="0 0 1"/><geom size="0.05"/></body>')
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET):
        mujoco.mj_step(model, data, 400)
    assert data.ncon > 0
    # The bar for MuJoCo's distance fields, which interpolate in cells of a grid.
    assert data.xpos[-1, 2] == pytest.approx(0.3, rel=5e-3)
    assert model.geom("donut").friction.tolist() == [0.7, 0.005, 0.0001]
    np.testing.assert_allclose(model.mat("donut").rgba[0], CLAY.rgb[0] ** (1 / 2.2), rtol=1e-3)


@with_sdf
def test_a_ball_falls_through_the_hole_of_a_geom():
    geom = fs.mujoco.planet_geom(PLANET, resolution=24)
    model = model_with([geom], '<body name="ball" pos="0.01 0 1"><freejoint/><geom size="0.05"/></body>')
    data = mujoco.MjData(model)
    lowest = 1.0
    with fs.mujoco.FieldForces(model, data, PLANET):
        for _ in range(20):
            mujoco.mj_step(model, data, 40)
            lowest = min(lowest, data.body("ball").xpos[2])
            assert data.ncon == 0
    assert lowest < -0.8


def test_planets_are_where_their_bodies_are():
    pose = fs.Pose.turned((1, 0, 0), 0.5, (0.3, 0.2, 0.1))
    body = fs.Body(fs.Segment((-1, 0, 0), (1, 0, 0)), surface=CLAY, motion=pose)
    geom = fs.mujoco.planet_geom(body, kind="mesh", resolution=16)
    assert (geom.name, geom.mocap) == ("planet", False)
    model = model_with([geom], "")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    vertices = model.mesh_vert @ data.geom("planet").xmat.reshape(3, 3).T + data.geom("planet").xpos
    value = body.surface_field().value((vertices - pose.position) @ pose.matrix)
    # All vertices lie equally far outside the surface, so that the faces between them do not lie inside.
    assert 0.6 < value.min() < value.max() < 1.0
    assert np.ptp(value) < 0.03


def test_the_mesh_lies_half_outside():
    mesh = PLANET.surface_mesh(resolution=24)
    moved = fs.mujoco.planet_geom(PLANET, kind="mesh", resolution=24).mesh
    tube = 2 * np.pi**2 * 0.25**2
    assert mesh.volume < 0.992 * tube
    assert moved.volume == pytest.approx(tube, rel=5e-3)


def test_planets_follow_their_motion():
    spinning = fs.Body(DONUT, surface=CLAY, motion=fs.Spin(axis=(1, 0, 0), rate=0.5))
    geom = fs.mujoco.planet_geom(spinning, kind="mesh", name="wheel", resolution=16)
    assert geom.mocap
    model = model_with([geom], "")
    data = mujoco.MjData(model)
    data.time = 2.0
    fs.mujoco.follow(model, data, [geom])
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.body("wheel").xmat.reshape(3, 3), spinning.motion(2.0).matrix, atol=1e-12)
    with pytest.raises(fs.InputError, match="no mocap body 'wheel'"):
        fs.mujoco.follow(model_with([], "<body/>"), data, [geom])


def test_planets_that_cannot_be_are_refused(monkeypatch):
    for match, body, options in (
        ("no surface", fs.Body(DONUT, gravity=fs.Newtonian()), {"kind": "mesh"}),
        ("is no", None, {}),
        ("kind is 'hull'", PLANET, {"kind": "hull"}),
        ("fs.Rigid", fs.Body(DONUT, surface=CLAY, motion=fs.Rigid()), {}),
        ("quotes", PLANET, {"name": 'a"b', "kind": "mesh"}),
        ("friction is -1", PLANET, {"friction": -1, "kind": "mesh", "resolution": 8}),
        ("friction", PLANET, {"friction": (1, 1, 1, 1), "kind": "mesh", "resolution": 8}),
    ):
        with pytest.raises(fs.InputError, match=match if body else "give a fs.Body"):
            fs.mujoco.planet_geom(body, **options)
    monkeypatch.setattr(mujoco, "__version__", "3.3.0")
    with pytest.raises(fs.FieldsimError, match=r"MuJoCo 3\.3\.0 makes no signed distance field"):
        fs.mujoco.planet_geom(PLANET)


# Many worlds


@pytest.fixture
def ball():
    model = model_with([], '<body pos="2 0 0"><freejoint/><geom size="0.1"/></body>')
    return model, mujoco.MjData(model)


def test_rollouts_are_what_steps_are(ball):
    model, data = ball
    starts = np.tile(fs.mujoco.state_of(model, data), (5, 1))
    starts[:, 0] = np.arange(5)  # times
    starts[:, 8:11] = 0.3 * np.random.default_rng(1).normal(size=(5, 3))
    planet = fs.Body(fs.Segment((-1, 0, 0), (1, 0, 0)), gravity=fs.Newtonian(), motion=fs.Spin(rate=0.9))
    forces = fs.mujoco.FieldForces(model, data, planet)
    found, sensors = fs.mujoco.rollout(forces, starts, 50, threads=2)
    assert found.shape == (5, 50, fs.mujoco.state_size(model))
    assert sensors.shape == (5, 50, 0)
    assert mujoco.get_mjcb_passive() is None
    with forces:
        for start, run in zip(starts, found, strict=True):
            mujoco.mj_resetData(model, data)
            mujoco.mj_setState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
            mujoco.mj_step(model, data, 50)
            np.testing.assert_allclose(fs.mujoco.state_of(model, data), run[-1], rtol=1e-13, atol=1e-15)
        again, _ = fs.mujoco.rollout(forces, starts, 50, threads=1)
        assert mujoco.get_mjcb_passive() is not None
    np.testing.assert_array_equal(again, found)


def test_rollouts_refuse_what_threads_cannot_do(ball):
    model, data = ball
    start = fs.mujoco.state_of(model, data)
    forces = fs.mujoco.FieldForces(model, data, PLANET)
    with pytest.raises(fs.InputError, match=r"starts have shape \(1, 3\); give \(worlds, 14\)"):
        fs.mujoco.rollout(forces, [1, 2, 3], 5)
    with pytest.raises(fs.InputError, match="steps is 0"):
        fs.mujoco.rollout(forces, start, 0)
    moving = fs.Body(DONUT, gravity=fs.Newtonian(), motion=lambda time: (0.0, 0.0, time))
    with pytest.raises(fs.InputError, match="need Python, which threads cannot share"):
        fs.mujoco.rollout(fs.mujoco.FieldForces(model, data, moving), start, 5)
    assert mujoco.get_mjcb_passive() is None


def test_what_a_rollout_leaves_out_is_told_of():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0"/><worldbody><body name="hook" mocap="true" pos="2 0 1"/><body name="ball" '
        'pos="2 0 0"><freejoint/><geom size=".1"/></body></worldbody>'
        '<equality><connect name="rope" body1="hook" body2="ball" anchor="0 0 -1"/></equality></mujoco>'
    )
    data = mujoco.MjData(model)
    forces = fs.mujoco.FieldForces(model, data, PLANET)
    start = fs.mujoco.state_of(model, data)
    fs.mujoco.rollout(forces, start, 3)
    data.mocap_pos[0] = 2, 0, 1.5
    with pytest.warns(fs.FieldsimWarning, match="mocap body 'hook' in forces.data"):
        fs.mujoco.rollout(forces, start, 3)
    data.eq_active[0] = False
    with pytest.warns(fs.FieldsimWarning, match="mocap body 'hook', equality 'rope' in forces.data"):
        fs.mujoco.rollout(forces, start, 3)
    # The remedy is one.
    model.body_pos[1], model.eq_active0[0] = data.mocap_pos[0], False
    found, _ = fs.mujoco.rollout(forces, start, 20)
    with forces:
        mujoco.mj_step(model, data, 20)
    np.testing.assert_allclose(fs.mujoco.state_of(model, data), found[0, -1], rtol=1e-13, atol=1e-15)


# The environment


def test_the_lander_is_a_gymnasium_environment():
    gymnasium = pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("fieldsim.mujoco.lander:FieldSim/DonutLander-v0")
    check_env(env.unwrapped)
    assert mujoco.get_mjcb_passive() is None
    with pytest.raises(fs.InputError, match="render_mode is 'human'"):
        type(env.unwrapped)(render_mode="human")


def braking(observation):
    """An action that sinks slowly, upright."""
    velocity, x, z, spin = (observation[3 * k : 3 * k + 3] for k in (1, 2, 3, 4))
    gravity, height = observation[15:18], observation[18]
    up = -gravity / np.linalg.norm(gravity)
    wanted = 3.0 * (-0.25 * min(1.0, height + 0.06) * up - velocity) - gravity
    aim = wanted / np.linalg.norm(wanted) if wanted @ up > 0.0 else up
    frame = np.stack([x, np.cross(z, x), z])
    torque = frame @ (np.cross(z, aim) - 0.4 * spin)
    return np.clip([max(0.0, wanted @ z) - 1.0, *torque], -1.0, 1.0)


def test_the_lander_can_be_landed_and_lost():
    gymnasium = pytest.importorskip("gymnasium")
    env = gymnasium.make("fieldsim.mujoco.lander:FieldSim/DonutLander-v0")
    ends = []
    for choose in (braking, lambda observation: np.array([1.0, 0.0, 0.0, 0.0]), lambda observation: -np.ones(4)):
        observation, _ = env.reset(seed=3)
        over = False
        while not over:
            observation, reward, terminated, truncated, told = env.step(choose(observation))
            over = terminated or truncated
        ends.append((told["landed"], told["crashed"], told["lost"], reward > 50.0, reward < -50.0))
    assert ends[0] == (True, False, False, True, False)
    assert ends[1][1] or ends[1][2]
    assert all(end[4] for end in ends[1:])


def test_the_landers_pictures():
    gymnasium = pytest.importorskip("gymnasium")
    env = gymnasium.make("fieldsim.mujoco.lander:FieldSim/DonutLander-v0", render_mode="rgb_array")
    env.reset(seed=1)
    first = env.render()
    assert first.shape == (240, 320, 3)
    for _ in range(8):
        env.step(np.zeros(4))
    assert np.abs(env.render().astype(int) - first).max() > 50
    assert env.unwrapped.__class__().render() is None


def test_the_lander_needs_gymnasium():
    script = (
        "import sys; sys.modules['gymnasium'] = None\n"
        "import fieldsim as fs\n"
        "try: import fieldsim.mujoco.lander\n"
        "except fs.InputError as reason: print(reason)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "pip install 'fieldsim[gym]'" in done.stdout


@pytest.mark.parametrize("value", [None, "x", [1.0], [np.nan] * 4, np.zeros((4, 1))])
def test_the_lander_takes_no_bad_action(value):
    lander = pytest.importorskip("fieldsim.mujoco.lander").DonutLander()
    lander.reset(seed=1)
    with pytest.raises(fs.InputError, match=r"DonutLander\.step: action"):
        lander.step(value)
    with pytest.raises(fs.InputError, match=r"DonutLander\.reset: seed"):
        lander.reset(seed="x")
