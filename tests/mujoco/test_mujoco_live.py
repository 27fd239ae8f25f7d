"""MuJoCo models whose numbers are changed after their FieldForces was made: it answers as one that is made afresh."""

import mujoco
import numpy as np
import pytest
from mujoco_models import PLANET, SURFACE, model_of, passive

import fieldsim as fs
from fieldsim.mujoco.forces import FIXED

# Bodies start in the surface on purpose, so that contact is felt at once.
pytestmark = pytest.mark.filterwarnings("ignore:FieldForces. .* deep in a surface:fieldsim.FieldsimWarning")
LAW = fs.mujoco.Contact(1.0, depth=0.3, damping=0.2, friction=0.4)
# A box and a ball in the ring's surface, a bead that has no mass yet, on an arm that has.
BODIES = """
<body name="box" pos="1.24 0 0.05" euler="20 30 40"><freejoint/><geom type="box" size=".05 .03 .02"/>
  <geom name="tip" type="capsule" size=".01 .05" pos=".05 .02 0" euler="50 0 0"/></body>
<body name="ball" pos="-1.25 0 0.05"><freejoint/><geom size=".06"/></body>
<body name="arm" pos="0 1.25 .1"><freejoint/><geom size=".06"/>
  <body name="bead" pos=".1 0 0"><joint/><geom size=".03" mass="0" contype="0" conaffinity="0"/>
    <body><geom size=".02"/></body></body></body>
"""


def double(name, body=1, factor=2.0):
    def change(model):
        getattr(model, name)[body] *= factor

    return change


def turn(name):
    def change(model):
        quat = getattr(model, name)[1]
        mujoco.mju_mulQuat(quat, quat.copy(), np.array((0.9, 0.3, 0.2, 0.1)) / np.linalg.norm((0.9, 0.3, 0.2, 0.1)))

    return change


def give_mass(model):
    model.body_mass[4], model.body_inertia[4] = 0.2, 1e-4


CHANGES = {
    "mass": double("body_mass"),
    "inertia": double("body_inertia", factor=np.array((5.0, 1.0, 4.0))),
    "place of mass": lambda model: model.body_ipos.__setitem__(1, (0.01, -0.02, 0.03)),
    "axes of mass": turn("body_iquat"),
    "first mass": give_mass,
    "gravcomp": lambda model: model.body_gravcomp.__setitem__(1, 0.4),
    "size": double("geom_size"),
    "type": lambda model: model.geom_type.__setitem__(0, mujoco.mjtGeom.mjGEOM_ELLIPSOID),
    "place": lambda model: model.geom_pos.__setitem__(1, (0.0, 0.05, 0.03)),
    "axes": turn("geom_quat"),
    "touching": lambda model: (model.geom_contype.__setitem__(0, 0), model.geom_conaffinity.__setitem__(0, 0)),
    "time step": lambda model: setattr(model.opt, "timestep", 3e-4),
}


def started(seed=3):
    model = model_of(BODIES, options='density="0"', timestep=1e-4)
    data = mujoco.MjData(model)
    data.qvel[:] = 3e-4 * np.random.default_rng(seed).normal(size=model.nv)
    return model, data


def answers(forces):
    """Generalised forces, wrenches and energies."""
    energy = forces.energy()
    return passive(forces.model, forces.data), *forces.wrenches(), [energy.field, energy.contact]


def assert_alike(found, wanted):
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize(
    ("accuracy", "native"), [("points", True), ("geoms", False), ("points", False), ("torque", False)]
)
def test_changes_are_seen_by_steps_questions_and_entering(accuracy, native, change):
    options = {"accuracy": accuracy, "contact": LAW, "native": native}
    model, data = started()
    before_entering = fs.mujoco.FieldForces(model, data, SURFACE, **options)
    with fs.mujoco.FieldForces(model, data, SURFACE, **options) as within:
        old = passive(model, data)
        CHANGES[change](model)
        stepped = passive(model, data)  # before any question
        found = answers(within)
    with fs.mujoco.FieldForces(model, data, SURFACE, **options) as afresh:
        wanted = answers(afresh)
    assert_alike(found, wanted)
    np.testing.assert_allclose(stepped, wanted[0], rtol=1e-9, atol=1e-12)
    with before_entering:
        assert_alike(answers(before_entering), wanted)
    assert np.abs(wanted[0] - old).max() > 1e-6, "it makes a difference"


def test_a_mass_that_burns_away_while_stepping():
    """A rocket's: every step has its own mass and inertia; against one made afresh for every step."""

    def run(afresh):
        model, data = started()
        forces = fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW)
        for _ in range(20):
            model.body_mass[1] *= 0.98
            model.body_inertia[1] *= (0.97, 0.98, 0.99)
            if afresh:
                forces = fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW)
            with forces:
                mujoco.mj_step(model, data)
        return data.qpos.copy()

    model, data = started()
    with fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW):
        for _ in range(20):
            model.body_mass[1] *= 0.98
            model.body_inertia[1] *= (0.97, 0.98, 0.99)
            mujoco.mj_step(model, data)
    wanted = run(afresh=True)
    np.testing.assert_array_equal(run(afresh=False), wanted)
    np.testing.assert_array_equal(data.qpos, wanted)


def test_a_change_within_one_call_of_many_steps_is_seen_by_its_next_step():
    """By the control callback of MuJoCo's."""
    model, data = started()

    def burn(model, data):
        model.body_inertia[1] *= 1.001

    def run(steps):
        mujoco.mj_resetData(model, data)
        model.body_inertia[1] = 1e-4, 2e-4, 2.5e-4
        with fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW) as forces:
            mujoco.set_mjcb_control(burn)
            try:
                for _ in range(30 // steps):
                    forces.refresh()
                    mujoco.mj_step(model, data, steps)
            finally:
                mujoco.set_mjcb_control(None)
        return data.qpos.copy()

    np.testing.assert_array_equal(run(30), run(1))


def test_vertices_of_meshes_are_seen_by_questions():
    vertices = "0 0 0  .1 0 0  0 .1 0  0 0 .1"
    mjcf = (
        f'<mujoco><option gravity="0 0 0"/><asset><mesh name="m" vertex="{vertices}"/></asset><worldbody>'
        '<body pos="1.2 0 0"><freejoint/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    forces = fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW)
    before = forces.energy().contact
    model.mesh_vert[:] *= 1.5
    after = forces.energy().contact
    assert after == fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW).energy().contact != before


def step_and_leave(forces):
    try:
        mujoco.mj_forward(forces.model, forces.data)
    finally:
        forces.__exit__(None, None, None)


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize(("name", "value"), [("body_inertia", np.nan), ("body_mass", -1.0), ("geom_size", np.nan)])
def test_numbers_that_cannot_be_are_refused(name, value, native, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log where it works
    model, data = started()
    forces = fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW, native=native)
    array = getattr(model, name)
    good = array.copy()
    words = f"the model's {name} of .* is .*; give finite numbers of at least 0"
    with forces:
        array[0 if name == "geom_size" else 1] = value
        with pytest.raises(fs.InputError, match=words):
            forces.wrenches()
        array[:] = good
        forces.wrenches()
    forces.__enter__()
    array[0 if name == "geom_size" else 1] = value
    with pytest.raises(fs.InputError, match=words):
        step_and_leave(forces)
    array[0 if name == "geom_size" else 1] = value
    with pytest.raises(fs.InputError, match=words):
        fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW, native=native)
    assert mujoco.get_mjcb_passive() is None


def test_a_longer_time_step_is_told_of():
    model, data = started()
    with fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW) as forces:
        model.opt.timestep = 0.1
        with pytest.warns(fs.FieldsimWarning, match=r"timestep of 0.1 is too long"):
            forces.wrenches()


def test_a_body_with_gravcomp_floats():
    """As in MuJoCo's own gravity, and its energy is kept."""
    model = model_of('<body pos="2 0 0" gravcomp="1"><freejoint/><geom type="box" size=".1 .2 .3"/></body>')
    data = mujoco.MjData(model)
    for accuracy in ("points", "torque"):
        with fs.mujoco.FieldForces(model, data, PLANET, accuracy=accuracy, native=False) as forces:
            assert not passive(model, data).any()
            assert forces.potential_energy() == 0.0
        model.body_gravcomp[1] = 0.25
        with fs.mujoco.FieldForces(model, data, PLANET, accuracy=accuracy, native=False) as forces:
            less = forces.wrenches()
            model.body_gravcomp[1] = 0.0
            np.testing.assert_allclose(less, 0.75 * np.array(forces.wrenches()), rtol=1e-14)
        model.body_gravcomp[1] = 1.0


def test_a_world_that_gets_other_bodies_is_told_of():
    model, data = started()
    world = fs.World()
    world.add_body(PLANET)
    forces = fs.mujoco.FieldForces(model, data, [world], native=False)
    world.add_body(SURFACE)
    for ask in (forces.__enter__, forces.wrenches, forces.energy, forces.refresh):
        with pytest.raises(fs.InputError, match=r"its world has other bodies \(2\) than when it was made \(1\)"):
            ask()
    assert mujoco.get_mjcb_passive() is None

    def run():
        with fs.mujoco.FieldForces(model, data, world, native=False):
            world.add_body(PLANET)

    with pytest.warns(fs.FieldsimWarning, match="its world got other bodies within the block"):
        run()


@pytest.mark.parametrize("name", FIXED)
def test_what_tables_are_made_of_stays(name):
    model, data = started()
    forces = fs.mujoco.FieldForces(model, data, PLANET, native=False)
    with pytest.raises(fs.InputError, match=f"FieldForces: {name} stays as it is"):
        setattr(forces, name, getattr(forces, name))
    with pytest.raises(ValueError, match="read-only"):
        forces.bodies[0] = 10**6


def test_what_surfaces_do_not_touch_is_named():
    mjcf = BODIES.replace(
        '<geom size=".03" mass="0" contype="0" conaffinity="0"/>', '<geom name="hull" size=".03" mass="0"/>'
    ) + (
        '<flexcomp name="jelly" type="grid" count="3 3 3" spacing=".2 .2 .2" pos="5 0 0" dim="3" mass="1" radius=".02" '
        'dof="trilinear"><elasticity young="1e3"/></flexcomp><body mocap="true"><geom size=".1"/></body>'
    )
    model = model_of(mjcf)
    data = mujoco.MjData(model)
    with pytest.warns(fs.FieldsimWarning, match=r"do not touch geom 'hull' \(its body has no mass\), flex 'jelly'; "):
        fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW, native=False)
    fs.mujoco.FieldForces(model, data, SURFACE, native=False)
    fs.mujoco.FieldForces(model, data, SURFACE, contact=LAW, bodies=["box", "ball"], native=False)
