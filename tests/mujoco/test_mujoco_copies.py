"""Which models and data a field knows: its own and copies of it; others are let be, refused or told of."""

import copy
import math
import pickle
import threading

import mujoco
import mujoco.rollout
import numpy as np
import pytest
from mujoco_models import BALL, BOX, DONUT, PLANET, model_of, passive

import fieldsim as fs

SOURCES = {
    "native": PLANET,
    "timed": fs.Body(DONUT, gravity=fs.Newtonian(), mass=1.0, motion=lambda time: (0.0, 0.0, 0.1 * math.sin(time))),
}
MJCF = f'<mujoco><option gravity="0 0 0" integrator="RK4"/><worldbody>{BOX}{BALL}</worldbody></mujoco>'
STEPS = 20


def new():
    model = mujoco.MjModel.from_xml_string(MJCF)
    return model, mujoco.MjData(model)


def stepped(model, data=None, steps=STEPS):
    data = mujoco.MjData(model) if data is None else data
    mujoco.mj_step(model, data, steps)
    return data.qpos.copy()


def rolled(model):
    starts = np.tile(fs.mujoco.state_of(model, mujoco.MjData(model)), (3, 1))
    models, worlds = [copy.copy(model) for _ in starts], [mujoco.MjData(model) for _ in range(2)]
    states, _ = mujoco.rollout.rollout(models, worlds, starts, nstep=STEPS)
    return states[:, -1, 1 : 1 + model.nq]


def batch_of(model, *options):
    return pytest.importorskip("mujoco.batch").Batch(model, 3, 2, *options)


def batched(model, *options):
    batch = batch_of(model, *options)
    batch.step(nstep=STEPS)
    return batch.bind("qpos").copy()


def of_data(make):
    def run(model):
        data = make(mujoco.MjData(model))
        return stepped(data.model, data)

    return run


COPIES = {
    "copy": lambda model: stepped(copy.copy(model)),
    "deepcopy": lambda model: stepped(copy.deepcopy(model)),
    "pickle": lambda model: stepped(pickle.loads(pickle.dumps(model))),
    "deepcopy of data": of_data(copy.deepcopy),
    "pickle of data": of_data(lambda data: pickle.loads(pickle.dumps(data))),
    "rollout": rolled,
    "batch": batched,
    "persistent batch": lambda model: batched(model, True),
}


@pytest.mark.parametrize("source", SOURCES)
def test_copies_feel_the_field(source):
    model, _ = new()
    with fs.mujoco.FieldForces(model, mujoco.MjData(model), SOURCES[source]):
        wanted = stepped(model)
        for name, run in COPIES.items():
            np.testing.assert_array_equal(np.broadcast_to(wanted, np.shape(run(model))), run(model), err_msg=name)
    assert np.abs(stepped(model) - wanted).max() > 1e-5, "without the field they move otherwise"


@pytest.mark.parametrize("accuracy", ["points", "torque"])
def test_copies_may_have_masses_of_their_own(accuracy):
    model, data = new()
    other = copy.copy(model)
    other.body_mass[1], other.body_inertia[1] = 3.0, (0.5, 0.4, 0.3)
    with fs.mujoco.FieldForces(other, mujoco.MjData(other), PLANET, accuracy=accuracy) as forces:
        wanted, energy = stepped(other), forces.energy().total
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy=accuracy) as forces:
        own = stepped(model)
        another = copy.copy(model)
        another.body_mass[1], another.body_inertia[1] = 3.0, (0.5, 0.4, 0.3)
        np.testing.assert_array_equal(stepped(another), wanted)
        assert forces.energy(mujoco.MjData(another)).total == energy
    assert np.abs(own - wanted).max() > 1e-5


@pytest.mark.parametrize("motion", [fs.Spin(), lambda time: (0.0, 0.0, 0.0)])
def test_copies_of_another_shape_in_contact_are_told_of(motion):
    model, data = new()
    model.opt.timestep = 1e-3
    wall = fs.Body(DONUT, surface=fs.Material(radius=0.25), motion=motion)
    forces = fs.mujoco.FieldForces(model, data, wall, contact=fs.mujoco.Contact(0.1, depth=0.5))

    def run(factor):
        other = copy.copy(model)
        other.geom_size[1] *= factor
        with forces:
            stepped(other)
        return other

    with pytest.warns(fs.FieldsimWarning, match="copies of the model had other masses or shapes"):
        other = run(2.0)
    with pytest.raises(fs.InputError, match="a copy with other masses or shapes"):
        forces.energy(mujoco.MjData(other))
    run(1.0)


def test_a_copy_may_be_in_a_field_of_its_own():
    model, data = new()
    with fs.mujoco.FieldForces(model, data, PLANET):
        other = copy.copy(model)
        once = passive(model, data)
        with fs.mujoco.FieldForces(other, mujoco.MjData(other), 2.0 * PLANET.gravity_field()):
            np.testing.assert_allclose(passive(other, mujoco.MjData(other)), 2.0 * once, rtol=1e-13)
            np.testing.assert_array_equal(passive(model, data), once)
            np.testing.assert_allclose(passive(copy.copy(other), mujoco.MjData(other)), 2.0 * once, rtol=1e-13)


@pytest.mark.parametrize("source", SOURCES)
def test_copies_with_gravity_of_their_own_are_told_of(source):
    model, data = new()
    model.opt.gravity[2] = -9.81
    forces = fs.mujoco.FieldForces(model, data, SOURCES[source], keep_gravity=False)
    before = copy.copy(model)

    def run():
        with forces:
            stepped(model)
            stepped(copy.copy(model))
            stepped(before)

    with pytest.warns(fs.FieldsimWarning, match="copies of the model had gravity of their own"):
        run()
    before.opt.gravity[:] = 0.0
    run()


def test_options_of_another_model_make_no_copy():
    # As many bodies and degrees of freedom, in one tree and in two.
    first = '<body pos="2 0 0.5"><joint/><geom size=".1" pos=".3 0.1 0"/>'
    second = '<body pos="0.5 0 0"><joint axis="0 1 0"/><geom size=".1" pos=".3 0.1 0"/></body>'
    model, other = model_of(f"{first}{second}</body>"), model_of(f"{first}</body>{second}")
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET):
        other.opt = model.opt
        assert passive(model, data).any()
        assert not passive(other, mujoco.MjData(other)).any()


# Models made anew


def recompiled(before, change):
    spec = mujoco.MjSpec.from_string(MJCF)
    model = spec.compile()
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET):
        if before:
            mujoco.mj_step(model, data, before)
        change(spec)
        stepped(*spec.recompile(model, data))


def grow(spec):
    spec.body("box").geoms[0].size[0] = 0.4


def add(spec):
    body = spec.worldbody.add_body(pos=(0, 3, 0))
    body.add_freejoint()
    body.add_geom(size=(0.1, 0.1, 0.1))


@pytest.mark.parametrize("before", [0, 7])
@pytest.mark.parametrize("change", [grow, add])
def test_models_that_are_recompiled_within_are_told_of(before, change):
    with pytest.warns(fs.FieldsimWarning, match=r"another model moved without the field.*MjSpec.recompile"):
        recompiled(before, change)


def test_copies_that_were_made_before_are_told_of():
    made = {
        "copy": lambda model: (stepped, copy.copy(model)),
        "pickle": lambda model: (stepped, pickle.loads(pickle.dumps(model))),
        "batch": lambda model: (lambda batch: batch.step(nstep=STEPS), batch_of(model)),
    }
    for make in made.values():
        model, data = new()
        run, other = make(model)
        with pytest.warns(fs.FieldsimWarning, match="copied before a FieldForces of its own"):
            with fs.mujoco.FieldForces(model, data, PLANET):
                run(other)


@pytest.mark.parametrize("source", SOURCES)
def test_other_models_are_let_be_without_a_word(source):
    """Loaded, compiled and moved within the block, and twins in threads of their own."""
    model, data = new()
    other = model_of(BALL)
    free = stepped(other)
    with fs.mujoco.FieldForces(model, data, SOURCES[source]):
        first = model_of(BALL)
        spec = mujoco.MjSpec.from_string(MJCF)
        second = spec.compile()
        assert not passive(second, mujoco.MjData(second)).any()
        spec.recompile(second, mujoco.MjData(second))
        stepped(model, data, 3)
        np.testing.assert_array_equal(stepped(first), free)
        np.testing.assert_array_equal(stepped(other), free)
        twin, twins = new()
        thread = threading.Thread(target=stepped, args=(twin, twins))
        thread.start()
        thread.join()
        stepped(model, data, 3)
    assert twins.qvel.any() is np.False_


# Data of other models


def test_data_of_other_models_are_refused():
    model, data = new()
    forces = fs.mujoco.FieldForces(model, data, PLANET)
    small = mujoco.MjData(model_of(BALL))
    twin = new()[1]
    questions = (forces.act, forces.wrenches, forces.potential_energy, forces.energy, forces.readings)
    for question in questions:
        for other in (small, twin):
            with pytest.raises(fs.InputError, match="belongs to another model"):
                question(other)
        for other in (5, "data", model, [data]):
            with pytest.raises(fs.InputError, match=r"give a mujoco.MjData of the model"):
                question(other)
    with pytest.raises(fs.InputError, match="belongs to another model"):
        fs.mujoco.state_of(model, small)
    for arguments in ((5, data), (model, None)):
        with pytest.raises(fs.InputError, match=r"give a mujoco.Mj"):
            fs.mujoco.state_of(*arguments)
    assert fs.mujoco.state_of(model, pickle.loads(pickle.dumps(data))).tolist() == [0.0, *data.qpos, *data.qvel]
    with pytest.raises(fs.InputError, match=r"state_size: model is 5; give a mujoco.MjModel"):
        fs.mujoco.state_size(5)


def test_states_that_are_not_finite_are_refused():
    model, data = new()
    forces = fs.mujoco.FieldForces(model, data, PLANET)
    data.qpos[3] = np.nan
    for call in (forces.__enter__, forces.energy, lambda: fs.mujoco.FieldForces(model, data, PLANET)):
        with pytest.raises(fs.InputError, match=r"data.qpos\[3\] is nan; give a finite state"):
            call()
    assert mujoco.get_mjcb_passive() is None
