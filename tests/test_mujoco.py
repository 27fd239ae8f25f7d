"""MuJoCo models in fields: the forces themselves, whose callback it is, and what is refused."""

import contextlib
import ctypes
import threading
import time

import mujoco
import numpy as np
import pytest

import fieldsim as fs
from fieldsim.mujoco import layout, native, points
from fieldsim.world.motion import pose_at

DONUT = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
PLANET = fs.Body(DONUT, gravity=fs.Newtonian(), mass=1.0)
TURN = fs.Pose.turned((1, 2, 0.5), 0.7)

BOX = '<body name="box" pos="2 0.3 0.4" quat="1 0.2 0.3 0.1"><freejoint/><geom type="box" size="0.3 0.2 0.1"/></body>'
BALL = '<body name="ball" pos="-2.5 0 0.2"><freejoint/><geom size="0.1"/></body>'
# Hinges, a slide and a ball joint on a base that moves: what Jacobians are made of.
ARM = """
<body name="base" pos="0 2 0.5"><freejoint/><geom type="capsule" size="0.05 0.2"/>
  <body name="upper" pos="0.1 0 0.3"><joint axis="0 1 0"/><joint type="slide" axis="0 1 1" pos="0 0 0.1"/>
    <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03"/>
    <body name="lower" pos="0.4 0 0"><joint type="ball"/>
      <geom type="cylinder" size="0.05 0.1" pos="0.1 0 0" euler="20 30 40"/></body>
  </body>
</body>
"""


def model_of(bodies, *, options="", integrator="RK4", timestep=0.01):
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0" integrator="{integrator}" timestep="{timestep}" {options}/>'
        f"<worldbody>{bodies}</worldbody></mujoco>"
    )


@pytest.fixture
def box():
    model = model_of(BOX + BALL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def passive(model, data):
    mujoco.mj_forward(model, data)
    return data.qfrc_passive.copy()


# Forces


def test_the_force_is_mass_times_the_fields_gradient(box):
    model, data = box
    field = PLANET.gravity_field()
    with fs.mujoco.FieldForces(model, data, PLANET) as forces:
        generalised = passive(model, data)
        force, _ = forces.wrenches()
    expected = model.body_mass[1:, None] * field.gradient(data.xipos[1:])
    np.testing.assert_allclose(force, expected, rtol=1e-14)
    np.testing.assert_allclose(generalised[[0, 1, 2, 6, 7, 8]], expected.ravel(), rtol=1e-13, atol=1e-16)


def test_the_torque_is_that_of_the_mass_all_over_the_body(box):
    """Against the sum over 24^3 points of a box so small that its size to the third power does not show."""
    size = np.array([3e-3, 2e-3, 1e-3])
    model = model_of(
        '<body pos="2 0.3 0.4" quat="1 0.2 0.3 0.1"><freejoint/><geom type="box" size="0.003 0.002 0.001"/></body>'
    )
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET) as forces:
        _, torque = forces.wrenches()
        energy = forces.potential_energy()
    mujoco.mj_forward(model, data)
    steps = (np.arange(24) + 0.5) / 12 - 1.0
    arms = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3) * size
    arms = arms @ data.xmat[1].reshape(3, 3).T
    field, gradient = PLANET.gravity_field().value_and_gradient(data.xipos[1] + arms)
    mass = model.body_mass[1] / len(arms)
    # 24 cells a side leave out 1/24^2 of the second moments.
    np.testing.assert_allclose(torque[0], mass * np.cross(arms, gradient).sum(axis=0), rtol=3e-3, atol=1e-19)
    np.testing.assert_allclose(energy, -mass * field.sum(), rtol=1e-9)


@pytest.mark.parametrize("accuracy", ["points", "geoms"])
def test_points_agree_with_the_gradients_torque(accuracy):
    model = model_of(BOX.replace("0.3 0.2 0.1", "0.003 0.002 0.001"))
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET) as forces:
        force, torque = forces.wrenches()
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy=accuracy) as forces:
        np.testing.assert_allclose(forces.wrenches()[0], force, rtol=1e-5)
        # The next term is smaller by (size / distance)^2, and by what cancels between the axes.
        np.testing.assert_allclose(forces.wrenches()[1], torque, rtol=1e-3, atol=1e-17)


SHAPES = {
    "sphere": 'type="sphere" size="0.2"',
    "ellipsoid": 'type="ellipsoid" size="0.3 0.2 0.1"',
    "box": 'type="box" size="0.3 0.2 0.1"',
    "capsule": 'type="capsule" size="0.1 0.2"',
    "cylinder": 'type="cylinder" size="0.1 0.3"',
}


@pytest.mark.parametrize("shape", SHAPES)
def test_points_fill_the_geoms(shape):
    """They have the body's centre, mass and inertia without having been moved there, and sum up the field."""
    model = model_of(f'<body><freejoint/><geom {SHAPES[shape]} pos="0.1 0.2 0.3" euler="10 20 30"/></body>')
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    places, volumes = points._filled(model, 0)
    shares = volumes / volumes.sum()
    np.testing.assert_allclose(volumes.sum() * 1000, model.body_mass[1], rtol=1e-10)
    inertial = points.into_inertial(model, 0, places)
    np.testing.assert_allclose(shares @ inertial, 0.0, atol=1e-12)
    moments = np.einsum("n,ni,nj->ij", shares, inertial, inertial) * model.body_mass[1]
    np.testing.assert_allclose(moments, np.diag(points.second_moments(model.body_inertia[1])), atol=1e-12)


def test_points_take_on_a_stated_inertia():
    model = model_of(
        '<body><freejoint/><geom type="box" size="0.3 0.2 0.1"/>'
        '<inertial pos="0.05 0 0" mass="3" diaginertia="0.3 0.2 0.2"/></body>'
    )
    found = points.geom_points(model, 1)
    places, shares = found[:, :3], found[:, 3]
    np.testing.assert_allclose(shares @ places, 0.0, atol=1e-14)
    moments = np.einsum("n,ni,nj->ij", shares, places, places) * 3.0
    np.testing.assert_allclose(moments, np.diag(points.second_moments(model.body_inertia[1])), atol=1e-14)


def test_meshes_are_filled():
    vertices = "0 0 0  0.6 0 0  0 0.4 0  0.6 0.4 0  0 0 0.2  0.6 0 0.2  0 0.4 0.2  0.6 0.4 0.2"
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="m" vertex="{vertices}"/></asset><worldbody><body><freejoint/>'
        '<geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
    )
    _, volumes = points._filled(model, 0)
    np.testing.assert_allclose(volumes.sum(), 0.6 * 0.4 * 0.2, rtol=1e-6)


def test_forces_reach_joints_through_the_jacobian():
    """The generalised force against MuJoCo's own transport of the same wrenches."""
    model = model_of(ARM)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(5)
    data.qpos[:] += 0.3 * rng.normal(size=model.nq)
    mujoco.mj_normalizeQuat(model, data.qpos)
    data.qvel[:] = rng.normal(size=model.nv)
    before = passive(model, data)
    with fs.mujoco.FieldForces(model, data, PLANET) as forces:
        added = passive(model, data) - before
        expected = np.zeros(model.nv)
        for body, force, torque in zip(forces.bodies, *forces.wrenches(), strict=True):
            mujoco.mj_applyFT(model, data, force, torque, data.xipos[body], int(body), expected)
    np.testing.assert_allclose(added, expected, rtol=1e-12, atol=1e-13)


def test_forces_are_minus_the_slope_of_the_energy():
    """Generalised, of sums over points, which derive from their energy exactly."""
    model = model_of(ARM)
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy="points") as forces:
        slope = np.zeros(model.nv)
        step = 1e-5
        for i in range(model.nv):
            for side in (-1, 1):
                moved = mujoco.MjData(model)
                direction = np.zeros(model.nv)
                direction[i] = side
                mujoco.mj_integratePos(model, moved.qpos, direction, step)
                slope[i] += side * forces.potential_energy(moved) / (2 * step)
        # The energy's rounding over the step.
        np.testing.assert_allclose(passive(model, data), -slope, atol=1e-8)


MOVING = {
    "pose": (TURN, True),
    "spin": (fs.Spin(axis=(1, 0, 2), rate=1.3, phase=0.2, center=(0.3, 0.1, 0)), True),
    "keyframes": (fs.Keyframes([0, 1, 3], [(0, 0, 0), (0.2, 0, 0.1), (0, 0.3, 0)]), False),
    "function": (lambda time: fs.Pose.turned((0, 1, 0), 0.5 * time, (0, 0.1 * time, 0)), False),
}


@pytest.mark.parametrize("motion", MOVING)
def test_sources_are_where_they_are_at_the_time(box, motion):
    model, data = box
    motion, _ = MOVING[motion]
    moving = fs.Body(DONUT, gravity=fs.Newtonian(), motion=motion)
    for now in (0.0, 0.8, 2.1):
        data.time = now
        with fs.mujoco.FieldForces(model, data, moving) as forces:
            force, torque = forces.wrenches()
        pose = pose_at(motion, now)
        local = (data.xipos[1:] - pose.position) @ pose.matrix
        field = PLANET.gravity_field()
        expected = field.gradient(local) @ pose.matrix.T
        np.testing.assert_allclose(force, model.body_mass[1:, None] * expected, rtol=1e-12)
        hessian = pose.matrix @ field.hessian(local[0]) @ pose.matrix.T
        frame = data.ximat[1].reshape(3, 3)
        inertia = frame @ np.diag(model.body_inertia[1]) @ frame.T
        product = -inertia @ hessian
        axial = product[[1, 2, 0], [2, 0, 1]] - product[[2, 0, 1], [1, 2, 0]]
        np.testing.assert_allclose(torque[0], axial, rtol=1e-9, atol=1e-13)


@pytest.mark.parametrize("motion", MOVING)
def test_every_stage_of_a_step_sees_the_sources_of_its_time(box, motion, monkeypatch):
    """Steps of the native callback, and of a callback in Python that knows the source at any time."""
    model, data = box
    motion, pure = MOVING[motion]
    moving = fs.Body(DONUT, gravity=fs.Newtonian(), motion=motion)
    with fs.mujoco.FieldForces(model, data, moving) as forces:
        assert forces.running_natively == pure
        mujoco.mj_step(model, data, 3)
    other = mujoco.MjData(model)

    def callback(model, data):
        pose = pose_at(motion, data.time)
        local = (data.xipos[2] - pose.position) @ pose.matrix
        pull = model.body_mass[2] * (pose.matrix @ PLANET.gravity_field().gradient(local))
        mujoco.mj_applyFT(model, data, pull, np.zeros(3), data.xipos[2], 2, data.qfrc_passive)

    mujoco.set_mjcb_passive(callback)
    try:
        mujoco.mj_step(model, other, 3)
    finally:
        mujoco.set_mjcb_passive(None)
    # The ball, which the torque does not turn.
    np.testing.assert_allclose(data.qpos[7:10], other.qpos[7:10], rtol=0, atol=1e-14)


def test_fields_that_deform_and_several_sources(box):
    model, data = box
    growing = fs.gravity(fs.Circle((0, 0, 0), (0, 0, 1), lambda time: 1.0 + 0.1 * time), 2.0)
    other = fs.gravity(fs.Segment((-3, 0, 3), (3, 0, 3)), 0.5, kernel=fs.Cauchy())
    data.time = 1.5
    world = fs.World()
    world.add_body(PLANET)
    with fs.mujoco.FieldForces(model, data, [growing, other, world]) as forces:
        force, _ = forces.wrenches()
    whole = growing.at(1.5) + other + PLANET.gravity_field()
    np.testing.assert_allclose(force, model.body_mass[1:, None] * whole.gradient(data.xipos[1:]), rtol=1e-12)


def test_only_the_chosen_bodies_feel(box):
    model, data = box
    with fs.mujoco.FieldForces(model, data, PLANET, bodies="ball") as forces:
        found = passive(model, data)
        assert forces.bodies.tolist() == [2]
    assert not found[:6].any()
    assert found[6:9].any()


def test_masses_are_seen_live(box):
    model, data = box
    with fs.mujoco.FieldForces(model, data, PLANET):
        before = passive(model, data)
        model.body_mass[2] *= 2.0
        np.testing.assert_allclose(passive(model, data)[6:9], 2.0 * before[6:9], rtol=1e-15)


SURFACE = fs.Body(DONUT, gravity=fs.Newtonian(), motion=fs.Spin(rate=0.4), surface=fs.Material(radius=0.25))
TOUCHING = '<body pos="1.28 0 0"><freejoint/><geom type="ellipsoid" size="0.08 0.06 0.05" euler="20 30 40"/></body>'


@pytest.mark.parametrize("accuracy", ["torque", "points"])
def test_python_gives_the_same(accuracy):
    model = model_of(BOX.replace("2 0.3 0.4", "1.1 0.1 0.42") + TOUCHING, timestep=0.001)
    data = mujoco.MjData(model)
    data.qvel[:] = 0.3
    contact = fs.mujoco.Contact(speed=1.0, depth=0.2, damping=0.5, friction=0.5)
    found = []
    for is_native in (True, False):
        options = {"accuracy": accuracy, "contact": contact, "native": is_native}
        with fs.mujoco.FieldForces(model, data, SURFACE, **options) as forces:
            assert forces.running_natively == is_native
            found.append((passive(model, data), forces.energy()))
            assert forces.energy().contact > 0.0
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=1e-11, atol=1e-14)
    assert found[0][1].total == pytest.approx(found[1][1].total, rel=1e-13)


# Whose callback


def test_the_callback_is_back_after_an_exception_and_an_interrupt(box):
    model, data = box
    calls = []

    def mine(model, data):
        calls.append(data.time)

    mujoco.set_mjcb_passive(mine)
    try:
        for failure in (RuntimeError, KeyboardInterrupt):
            with contextlib.suppress(failure), fs.mujoco.FieldForces(model, data, PLANET):
                assert mujoco.get_mjcb_passive() is not mine
                raise failure
            assert mujoco.get_mjcb_passive() is mine
        with fs.mujoco.FieldForces(model, data, PLANET) as forces:
            assert not forces.running_natively
            calls.clear()
            pulled = passive(model, data)
        assert len(calls) == 1, "what was there runs still"
        assert pulled.any()
        assert not passive(model, data).any()
    finally:
        mujoco.set_mjcb_passive(None)


def test_an_interrupt_within_a_motion_comes_through(box):
    model, data = box
    stop = []

    def motion(time):
        if stop:
            raise KeyboardInterrupt
        return (0.0, 0.0, 0.0)

    moving = fs.Body(DONUT, gravity=fs.Newtonian(), motion=motion)
    with fs.mujoco.FieldForces(model, data, moving):
        stop.append(True)
        with pytest.raises(KeyboardInterrupt):
            mujoco.mj_step(model, data)
    assert mujoco.get_mjcb_passive() is None


def test_a_native_callback_that_was_there_runs_first(box):
    model, data = box
    seen = []
    foreign = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(lambda m, d: seen.append((m, d)))
    mujoco.set_mjcb_passive(foreign)
    try:
        with fs.mujoco.FieldForces(model, data, PLANET) as forces:
            assert forces.running_natively
            assert passive(model, data).any()
        assert seen == [(model._address, data._address)]
        assert mujoco.get_mjcb_passive() is foreign
    finally:
        mujoco.set_mjcb_passive(None)


def test_two_models_in_one_process(box):
    model, data = box
    other = model_of(BALL)
    others = mujoco.MjData(other)
    with fs.mujoco.FieldForces(model, data, PLANET):
        assert passive(model, data).any()
        assert not passive(other, others).any()
        with fs.mujoco.FieldForces(other, others, 2.0 * PLANET.gravity_field()):
            first = passive(model, data)
            np.testing.assert_allclose(passive(other, others)[:3], 2.0 * first[6:9], rtol=1e-13)
        assert not passive(other, others).any()
        np.testing.assert_array_equal(passive(model, data), first)
    assert mujoco.get_mjcb_passive() is None


def test_a_model_is_in_one_set_of_forces_at_a_time(box):
    model, data = box
    with fs.mujoco.FieldForces(model, data, PLANET) as forces:
        with pytest.raises(fs.InputError, match="another FieldForces already"):
            fs.mujoco.FieldForces(model, mujoco.MjData(model), PLANET).__enter__()
        with pytest.raises(fs.InputError, match="another FieldForces already"):
            forces.__enter__()
        assert passive(model, data).any()
    assert mujoco.get_mjcb_passive() is None
    with forces:
        assert passive(model, data).any(), "it can be entered again"


def test_the_callback_takes_no_lock(box):
    """One thread steps while another holds Python's lock all along, in a call that does not let go of it."""
    model, data = box
    sleep = ctypes.PyDLL(None).usleep
    with fs.mujoco.FieldForces(model, data, PLANET):
        thread = threading.Thread(target=mujoco.mj_step, args=(model, data, 20_000))
        thread.start()
        while data.time == 0.0:
            time.sleep(0.0)
        before = data.time
        sleep(50_000)
        steps = (data.time - before) / model.opt.timestep
        thread.join()
    assert steps > 100


def test_the_layout_is_checked(box):
    _, data = box
    layout.check(data, native.PLACES)
    wrong = native.PLACES | {"xipos": native.PLACES["ximat"]}
    with pytest.raises(fs.FieldsimError, match="keeps xipos elsewhere"):
        layout.check(data, wrong)


# Bad input


def refused(match, *arguments, error=fs.InputError, **options):
    with pytest.raises(error, match=match):
        fs.mujoco.FieldForces(*arguments, **options)
    assert mujoco.get_mjcb_passive() is None


def test_what_cannot_be_is_refused(box):
    model, data = box
    refused("belongs to another model", model, mujoco.MjData(model_of(BALL)), PLANET)
    refused("is not a model|give a mujoco.MjModel", "model.xml", data, PLANET)
    refused("give a mujoco.MjData", model, None, PLANET)
    refused(r"no body 'bal'; it has 'box', 'ball'", model, data, PLANET, bodies="bal")
    refused("numbers from 1 to 2", model, data, PLANET, bodies=[0])
    refused("names one twice", model, data, PLANET, bodies=["ball", 2])
    refused("bodies is empty", model, data, PLANET, bodies=[])
    refused("accuracy is 'exact'", model, data, PLANET, accuracy="exact")
    refused("no sources", model, data, [])
    refused(r"sources\[1\] is 3", model, data, [PLANET, 3])
    refused("no source pulls", model, data, fs.Body(DONUT, surface=fs.Material()))
    refused("no source has a surface", model, data, PLANET, contact=fs.mujoco.Contact(speed=1.0))
    refused("contact is 3", model, data, SURFACE, contact=3)
    refused("fs.Rigid", model, data, fs.Body(DONUT, gravity=fs.Newtonian(), motion=fs.Rigid()))
    with pytest.raises(fs.InputError, match="speed is 0"):
        fs.mujoco.Contact(speed=0.0)


def test_models_that_cannot_feel_are_refused():
    still = model_of('<geom size="0.1"/>')
    refused("no degree of freedom", still, mujoco.MjData(still), PLANET)
    model = model_of(BALL + '<body name="rock"><geom size="0.1"/></body>')
    refused("'rock' is fixed to the world", model, mujoco.MjData(model), PLANET, bodies="rock")
    model = model_of('<body name="carrier"><freejoint/><body name="load" pos="0 2 0"><geom size="0.1"/></body></body>')
    refused("'carrier' has no mass", model, mujoco.MjData(model), PLANET, bodies="carrier")
    off = mujoco.mjtDisableBit
    model = model_of(BALL)
    model.opt.disableflags = getattr(off, "mjDSBL_PASSIVE", 0) or off.mjDSBL_SPRING | off.mjDSBL_DAMPER
    with pytest.raises(fs.InputError, match="asks for no forces at all"):
        fs.mujoco.FieldForces(model, mujoco.MjData(model), PLANET).__enter__()


@pytest.mark.skipif(not hasattr(mujoco.mjtEnableBit, "mjENBL_SLEEP"), reason="this MuJoCo has no sleep")
def test_sleep_is_refused(box):
    model, data = box
    model.opt.enableflags = int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    with pytest.raises(fs.InputError, match="sleep"):
        fs.mujoco.FieldForces(model, data, PLANET).__enter__()


def test_the_models_own_gravity_is_asked_about(box):
    model, data = box
    model.opt.gravity[:] = 0, 0, -3
    refused("keep_gravity=True for both", model, data, PLANET)
    with fs.mujoco.FieldForces(model, data, PLANET, keep_gravity=True) as forces:
        mujoco.mj_forward(model, data)
        both = data.qacc[8]
        assert forces.energy().model != 0.0
    with contextlib.suppress(ZeroDivisionError), fs.mujoco.FieldForces(model, data, PLANET, keep_gravity=False):
        mujoco.mj_forward(model, data)
        assert data.qacc[8] == pytest.approx(both + 3.0)
        raise ZeroDivisionError
    assert model.opt.gravity.tolist() == [0, 0, -3]


def test_a_start_where_the_field_is_singular_is_refused():
    model = model_of(BOX + BALL.replace("-2.5 0 0.2", "0 0 1"))
    data = mujoco.MjData(model)
    with (
        pytest.raises(fs.InputError, match="singular where body 'ball' starts"),
        fs.mujoco.FieldForces(model, data, fs.gravity(fs.Point((0, 0, 1)), 1.0)),
    ):
        pass
    assert mujoco.get_mjcb_passive() is None
