"""A model's sensors in a field: as in MuJoCo's own gravity, where that is what the field is."""

import copy

import mujoco
import numpy as np
import pytest
from mujoco_models import PLANET, SURFACE

import fieldsim as fs

# So far away that its pull is the same everywhere, to 1e-9.
G, DISTANCE = 9.81, 1e9
FAR = fs.gravity(fs.Point((0, 0, -DISTANCE)), G * DISTANCE**2)
CHAIN = """
<mujoco>
  <option gravity="0 0 {gravity}" timestep="1e-3"/>
  <worldbody>
    <geom type="plane" size="3 3 1"/>
    <body name="plinth" pos="-2 0 1"><geom size=".1"/><site name="still"/></body>
    <body name="base" pos="0 0 .18" euler="10 20 30"><freejoint/><geom type="box" size=".3 .2 .1"/>
      <site name="corner" pos=".3 .2 .1" euler="40 10 5"/>
      <camera name="eye" pos=".1 0 .3" euler="0 30 0"/>
      <body name="upper" pos=".1 0 .3">
        <joint axis="0 1 0" stiffness="3"/><joint type="slide" axis="0 1 1" pos="0 0 .1"/>
        <geom type="capsule" fromto="0 0 0 .4 0 0" size=".03"/><site name="elbow" pos=".4 .1 0" euler="0 50 0"/>
        <body name="lower" pos=".4 0 0" gravcomp="{gravcomp}"><joint type="ball" damping=".1"/>
          <geom name="rod" type="cylinder" size=".05 .1" pos=".1 0 0" euler="20 30 40"/>
          <body name="tag" pos=".2 0 0">
            <geom size=".02" mass="0"/><site name="tip" pos=".05 0 0" euler="1 2 90"/></body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="pull" site="tip" gear="1 2 3 .1 .2 .3"/></actuator>
  <sensor>
    <accelerometer name="a0" site="corner"/><accelerometer site="elbow"/><accelerometer site="tip"/>
    <accelerometer name="clipped" site="tip" cutoff="2"/>
    <force name="f0" site="corner"/><force site="elbow"/><force site="tip"/><force site="still"/>
    <torque site="corner"/><torque site="elbow"/><torque name="t2" site="tip"/><torque site="still"/>
    <force site="elbow" cutoff="5"/>
    <framelinacc objtype="body" objname="lower"/><framelinacc objtype="xbody" objname="lower"/>
    <framelinacc objtype="geom" objname="rod"/><framelinacc objtype="site" objname="tip"/>
    <framelinacc objtype="camera" objname="eye"/><frameangacc objtype="body" objname="lower"/>
    <gyro site="tip"/><touch site="corner"/><actuatorfrc actuator="pull"/><clock/><e_kinetic/>
  </sensor>
</mujoco>
"""


def moving(gravity, gravcomp=0.0, seed=7):
    """The chain in the midst of a motion, with a motor at work, its base on the floor."""
    model = mujoco.MjModel.from_xml_string(CHAIN.format(gravity=gravity, gravcomp=gravcomp))
    data, random = mujoco.MjData(model), np.random.default_rng(seed)
    data.qvel[:] = random.normal(size=model.nv)
    data.qpos[7:] += 0.3 * random.normal(size=model.nq - 7)
    mujoco.mj_normalizeQuat(model, data.qpos)
    data.ctrl[:] = 1.5
    data.xfrc_applied[3] = random.normal(size=6)
    return model, data


@pytest.fixture
def told():
    with pytest.warns(fs.FieldsimWarning, match=r"sensor 'a0' \(accelerometer\), .*'f0' \(force\).*readings"):
        yield


@pytest.mark.usefixtures("told")
@pytest.mark.parametrize("gravcomp", [0.0, 0.4])
@pytest.mark.parametrize("accuracy", ["points", "torque"])
def test_in_a_uniform_field_they_read_as_in_gravity(accuracy, gravcomp):
    """Hinges, slides, balls, welds, sites off the middle, contacts, motors, cutoffs, static bodies, spinning ones."""
    model, data = moving(-G, gravcomp)
    mujoco.mj_forward(model, data)
    assert data.ncon > 0
    other, others = moving(0.0, gravcomp)
    forces = fs.mujoco.FieldForces(other, others, FAR, accuracy=accuracy, native=False)
    with forces:
        found = forces.readings()
        again = forces.readings(others)
        mujoco.mj_forward(other, others)
    np.testing.assert_allclose(found, data.sensordata, rtol=1e-6, atol=1e-6)
    assert np.abs(others.sensordata - data.sensordata).max() > 1.0, "without the correction"
    np.testing.assert_allclose(others.qacc, data.qacc, rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(again, found)
    np.testing.assert_array_equal(forces.readings(), found, "outside the block, too")


@pytest.mark.usefixtures("told")
def test_inverse_dynamics_take_the_field_off_as_gravity():
    model, data = moving(-G)
    other, others = moving(0.0)
    for one in (data, others):
        one.qacc[:] = np.linspace(-1, 1, model.nv)
    mujoco.mj_inverse(model, data)
    with fs.mujoco.FieldForces(other, others, FAR, native=False):
        mujoco.mj_inverse(other, others)
    np.testing.assert_allclose(others.qfrc_inverse, data.qfrc_inverse, rtol=1e-6, atol=1e-6)


@pytest.mark.usefixtures("told")
def test_the_models_own_gravity_counts_too():
    """Half of it by the model, half by the field."""
    model, data = moving(-G)
    mujoco.mj_forward(model, data)
    other, others = moving(-G / 2)
    forces = fs.mujoco.FieldForces(other, others, 0.5 * FAR, keep_gravity=True, native=False)
    np.testing.assert_allclose(forces.readings(), data.sensordata, rtol=1e-6, atol=1e-6)
    off = fs.mujoco.FieldForces(other, others, FAR, keep_gravity=False, native=False)
    np.testing.assert_allclose(off.readings(), data.sensordata, rtol=1e-6, atol=1e-6)


SENSED = """
<mujoco><option gravity="0 0 0"/><worldbody><body pos="0 0 {height}">{joint}<geom size=".1" mass="1"/>
<site name="s" pos="0 0 .05"/></body>{beside}</worldbody>
<sensor><accelerometer name="imu" site="s"/><force name="hold" site="s"/><e_potential name="e"/>{more}</sensor></mujoco>
"""


def sensed(joint, sources, height=3.0, more="", beside="", **options):
    model = mujoco.MjModel.from_xml_string(SENSED.format(joint=joint, height=height, more=more, beside=beside))
    data = mujoco.MjData(model)
    with pytest.warns(fs.FieldsimWarning, match=r"'imu' \(accelerometer\)") as told:
        forces = fs.mujoco.FieldForces(model, data, sources, native=False, **options)
    return forces, str(told[0].message)


def test_free_fall_and_holding_in_a_planets_field():
    """The pull of 9 at distance 3 is 1, and the accelerometer, 0.05 higher, feels the tide."""
    planet = fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), mass=9.0)
    here = 9.0 / 3.05**2
    forces, _ = sensed("<freejoint/>", planet)
    # A ball of radius 0.1 as six points: to the fourth order of 0.1 / 3.
    np.testing.assert_allclose(forces.readings()[:6], (0, 0, here - 1.0, 0, 0, 0), atol=2e-6)
    assert forces.readings()[6] == pytest.approx(forces.energy().potential) == pytest.approx(-3.0, rel=1e-4)
    for joint in ('<joint type="slide" axis="1 0 0"/>', ""):
        # Beside one that moves, for there must be one; versions of MuJoCo differ in what is fixed to the world.
        forces, _ = sensed(joint, planet, beside='<body pos="9 0 0"><freejoint/><geom size=".1"/></body>')
        np.testing.assert_allclose(forces.readings()[:6], (0, 0, here, 0, 0, 1.0), atol=2e-6)


@pytest.mark.filterwarnings("ignore:FieldForces. .* deep in a surface:fieldsim.FieldsimWarning")
def test_what_a_surface_pushes_is_a_push():
    """Held against a surface, an accelerometer feels nothing of it, and what holds the body does."""
    law = fs.mujoco.Contact(speed=0.1, depth=0.3)
    surface = fs.Body(SURFACE.skeleton, gravity=fs.Newtonian(), mass=0.01, surface=fs.Material(radius=0.25))
    more = '<touch name="skin" site="s"/><rangefinder name="eye" site="s"/>'
    held = {"height": 0.28, "contact": law, "more": more}
    forces, told = sensed('<joint type="slide" axis="1 0 0"/>', surface, **held)
    assert "'skin' (touch), sensor 'eye' (rangefinder) take no account" in told
    data = forces.data
    data.qpos[0] = 1.0
    mujoco.mj_kinematics(forces.model, data)
    force, _ = forces.wrenches()
    readings, pull = forces.readings(), forces.gravity_at(data.site_xpos)
    free, _ = sensed("<freejoint/>", surface, **held)
    free.data.qpos[:3] = 1.0, 0.0, 0.28
    pushed = free.readings()
    assert force[0, 2] > 0.01, "it touches"
    np.testing.assert_allclose(readings[3:6], (0.0, -force[0, 1], -force[0, 2]), atol=1e-12)
    np.testing.assert_allclose(pushed[:3], force[0] - pull[0], atol=1e-4)  # it turns a little
    np.testing.assert_allclose(pushed[3:6], 0.0, atol=1e-9)


def test_readings_of_a_copys_data_are_the_copys():
    planet = fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), mass=9.0)
    forces, _ = sensed('<joint axis="0 1 0" pos=".3 0 0"/>', planet)
    other = copy.copy(forces.model)
    other.body_mass[1], other.site_pos[0], other.body_pos[1] = 3.0, (0.1, 0.0, 0.0), (0.0, 1.0, 3.0)
    data = mujoco.MjData(other)
    data.qvel[:] = 0.4
    found, own = forces.readings(data), forces.readings()
    with pytest.warns(fs.FieldsimWarning, match="'imu'"):
        wanted = fs.mujoco.FieldForces(other, data, planet, native=False).readings()
    np.testing.assert_array_equal(found, wanted)
    np.testing.assert_array_equal(forces.readings(), own)
    assert np.abs(found - own).max() > 0.1


def test_bodies_that_do_not_feel_the_field_do_not_sense_it():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0"/><worldbody><body name="a" pos="2 0 0"><freejoint/><geom size=".1"/>'
        '<site name="a"/><body><geom size=".1"/><site name="fixed"/></body></body>'
        '<body name="b" pos="-2 0 0"><freejoint/><geom size=".1"/><site name="b"/></body></worldbody><sensor>'
        '<accelerometer site="a"/><accelerometer site="fixed"/><accelerometer site="b"/></sensor></mujoco>'
    )
    words = r"sensor 0 \(accelerometer\), sensor 1 \(accelerometer\)"
    with pytest.warns(fs.FieldsimWarning, match=words):
        alone = fs.mujoco.FieldForces(model, mujoco.MjData(model), FAR, bodies="b", native=False)
    with pytest.warns(fs.FieldsimWarning, match=words):
        forces = fs.mujoco.FieldForces(model, mujoco.MjData(model), FAR, bodies=["a", 2], native=False)
    np.testing.assert_allclose(forces.readings(), 0.0, atol=1e-6)
    # What does not feel it floats; what is fixed to what feels it feels it, too.
    np.testing.assert_allclose(alone.readings(), 0.0, atol=1e-6)
    assert [alone.felt_by(b) for b in range(1, 4)] == [False, False, True]
    assert [forces.felt_by(b) for b in range(1, 4)] == [True, True, False]


def test_models_without_such_sensors_are_not_warned_of():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0"/><worldbody><body pos="2 0 0"><freejoint/><geom size=".1"/><site name="s"/>'
        '</body></worldbody><sensor><gyro site="s"/><touch site="s"/><rangefinder site="s"/></sensor></mujoco>'
    )
    data = mujoco.MjData(model)
    data.qvel[:] = 1.0
    forces = fs.mujoco.FieldForces(model, data, PLANET, native=False)
    np.testing.assert_allclose(forces.readings()[:3], 1.0)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    with pytest.raises(fs.InputError, match="disables sensors"):
        forces.readings()


def test_gravity_at_a_point_moves_with_its_sources():
    spinning = fs.Body(fs.Point((1, 0, 0)), gravity=fs.Newtonian(), mass=2.0, motion=fs.Spin(rate=np.pi / 2))
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body pos="9 0 0"><joint/><geom size=".1"/></body></worldbody></mujoco>'
    )
    forces = fs.mujoco.FieldForces(
        model, mujoco.MjData(model), [spinning, fs.gravity(fs.Point((0, 0, 3)), 1.0)], keep_gravity=True, native=False
    )
    found = forces.gravity_at([(0, 0, 0)], time=1.0)
    np.testing.assert_allclose(found, [(0, 2.0, 1 / 9)], atol=1e-12)
    with pytest.raises(fs.InputError, match="points"):
        forces.gravity_at("here")


def test_compensation_that_actuators_would_do_is_told_of():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0"/><worldbody><body pos="2 0 0" gravcomp="1">'
        '<joint name="j" actuatorgravcomp="true"/><geom size=".1" pos=".3 0 0"/></body></worldbody>'
        '<sensor><jointactuatorfrc name="motor" joint="j"/></sensor></mujoco>'
    )
    data = mujoco.MjData(model)
    with pytest.warns(fs.FieldsimWarning, match=r"sensor 'motor' \(jointactfrc\) take no account"):
        fs.mujoco.FieldForces(model, data, PLANET, native=False)
    model.body_gravcomp[:] = 0.0
    fs.mujoco.FieldForces(model, data, PLANET, native=False)
