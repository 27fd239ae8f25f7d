"""MuJoCo models in fields: the forces themselves."""

import mujoco
import numpy as np
import pytest
from mujoco_models import ARM, BALL, BOX, DONUT, PLANET, SURFACE, at_start, model_of, passive

import fieldsim as fs
from fieldsim.mujoco import points
from fieldsim.world.motion import pose_at

TURN = fs.Pose.turned((1, 2, 0.5), 0.7)


@pytest.fixture
def box():
    return at_start(model_of(BOX + BALL))


# Forces


def test_the_force_is_mass_times_the_fields_gradient(box):
    model, data = box
    field = PLANET.gravity_field()
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy="torque") as forces:
        generalised = passive(model, data)
        force, _ = forces.wrenches()
    expected = model.body_mass[1:, None] * field.gradient(data.xipos[1:])
    np.testing.assert_allclose(force, expected, rtol=1e-14)
    np.testing.assert_allclose(generalised[[0, 1, 2, 6, 7, 8]], expected.ravel(), rtol=1e-13, atol=1e-16)


@pytest.mark.parametrize("accuracy", ["points", "torque"])
def test_the_torque_is_that_of_the_mass_all_over_the_body(accuracy):
    """Against the sum over 24^3 points of a box so small that its size to the third power does not show."""
    size = np.array([3e-3, 2e-3, 1e-3])
    model = model_of(
        '<body pos="2 0.3 0.4" quat="1 0.2 0.3 0.1"><freejoint/><geom type="box" size="0.003 0.002 0.001"/></body>'
    )
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy=accuracy) as forces:
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
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy="torque") as forces:
        force, torque = forces.wrenches()
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy=accuracy) as forces:
        np.testing.assert_allclose(forces.wrenches()[0], force, rtol=1e-5)
        # The next term is smaller by (size / distance)^2, and by what cancels between the axes.
        np.testing.assert_allclose(forces.wrenches()[1], torque, rtol=1e-3, atol=1e-17)


def test_the_default_has_the_tides_pull():
    """Force and torque on a box of a tenth of its distance, against Gauss's rule of 8^3 points: right to order 4."""
    model, data = at_start(model_of(BOX.replace("0.3 0.2 0.1", "0.2 0.12 0.06")))
    nodes, weights = np.polynomial.legendre.leggauss(8)
    places = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3) * (0.2, 0.12, 0.06)
    shares = model.body_mass[1] * np.einsum("i,j,k->ijk", weights, weights, weights).ravel() / 8
    arms = places @ data.xmat[1].reshape(3, 3).T
    pulls = shares[:, None] * PLANET.gravity_field().gradient(data.xipos[1] + arms)
    pull = pulls.sum(axis=0)
    errors = {}
    for accuracy in ("points", "torque"):
        force, _ = fs.mujoco.FieldForces(model, data, PLANET, accuracy=accuracy).wrenches()
        errors[accuracy] = np.linalg.norm(force[0] - pull) / np.linalg.norm(pull)
    # (size / distance to the wire)^2 is 0.03, its square 8e-4.
    assert errors["points"] < 8e-4
    assert errors["torque"] > 5e-3, "without the tide it is of the second order"
    _, torque = fs.mujoco.FieldForces(model, data, PLANET).wrenches()
    np.testing.assert_allclose(torque[0], np.cross(arms, pulls).sum(axis=0), rtol=0.03)


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
    places, volumes = points.filled(model, 0)
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
    _, volumes = points.filled(model, 0)
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
        with fs.mujoco.FieldForces(model, data, moving, accuracy="torque") as forces:
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
    with fs.mujoco.FieldForces(model, data, moving, accuracy="torque") as forces:
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
    with fs.mujoco.FieldForces(model, data, [growing, other, world], accuracy="torque") as forces:
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
        model.body_inertia[2] *= 2.0
        np.testing.assert_allclose(passive(model, data)[6:9], 2.0 * before[6:9], rtol=1e-15)


TOUCHING = '<body pos="1.28 0 0"><freejoint/><geom type="ellipsoid" size="0.08 0.06 0.05" euler="20 30 40"/></body>'


@pytest.mark.filterwarnings("ignore:FieldForces. .* deep in a surface:fieldsim.FieldsimWarning")
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
