"""MuJoCo models in fields: whose callback it is, and what is refused."""

import contextlib
import ctypes
import math
import os
import signal
import threading
import time

import mujoco
import numpy as np
import pytest
from mujoco_models import BALL, BOX, DONUT, PLANET, SURFACE, at_start, model_of, passive

import fieldsim as fs
from fieldsim.mujoco.callback import layout, memory


@pytest.fixture
def box():
    return at_start(model_of(BOX + BALL))


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


def step_on(model, data):
    """Steps until it is interrupted, or for so long that no interrupt will come."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        mujoco.mj_step(model, data)


@pytest.mark.parametrize("is_native", [True, False])
def test_control_c_while_stepping_puts_the_callback_back(box, is_native):
    model, data = box
    model.opt.gravity[:] = 0, 0, -3
    forces = fs.mujoco.FieldForces(model, data, PLANET, native=is_native, keep_gravity=False)
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt), forces:
        step_on(model, data)
    assert mujoco.get_mjcb_passive() is None
    assert model.opt.gravity.tolist() == [0, 0, -3]


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
    layout.check(data, memory.PLACES)
    wrong = memory.PLACES | {"xipos": memory.PLACES["ximat"]}
    with pytest.raises(fs.FieldsimError, match="keeps xipos elsewhere"):
        layout.check(data, wrong)


def test_a_layout_that_is_not_known_is_refused(monkeypatch):
    monkeypatch.setattr(layout, "FIELDS", (*layout.FIELDS, "xquaternion"))
    with pytest.raises(fs.FieldsimError, match=r"describes mjData in a way that is not known.*install a version"):
        layout.offsets()


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


def test_questions_about_another_models_data_are_refused(box):
    model, data = box
    forces = fs.mujoco.FieldForces(model, data, PLANET)
    others = mujoco.MjData(model_of(BALL))
    for question in (forces.wrenches, forces.potential_energy, forces.energy):
        with pytest.raises(fs.InputError, match="belongs to another model"):
            question(others)


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


def test_a_timestep_that_is_none_is_refused(box):
    model, data = box
    forces = fs.mujoco.FieldForces(model, data, PLANET)
    law = fs.mujoco.Contact(1.0)
    for step in (0.0, math.nan, math.inf, -math.inf):
        model.opt.timestep = step
        refused(f"the model's timestep is {step:g}", model, data, PLANET)
        with pytest.raises(fs.InputError, match="the model's timestep is"):
            forces.__enter__()
    model.opt.timestep = -0.01  # back in time
    refused("the model's timestep is -0.01", model, data, SURFACE, contact=law)
    with forces:
        mujoco.mj_step(model, data)


def test_a_gravcomp_that_is_no_number_is_named(box):
    model, data = box
    model.body_gravcomp[1] = math.nan
    with pytest.raises(fs.InputError, match="body 'box' has gravcomp nan; give a finite number"):
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


@pytest.mark.parametrize("accuracy", ["points", "torque"])
@pytest.mark.parametrize("is_native", [True, False])
def test_a_start_where_the_field_is_singular_is_refused(accuracy, is_native):
    """Also where the six points stand round the singular place and feel nothing odd."""
    model = model_of(BOX + BALL.replace("-2.5 0 0.2", "0 0 1"))
    data = mujoco.MjData(model)
    point = fs.gravity(fs.Point((0, 0, 1)), 1.0)
    with (
        pytest.raises(fs.InputError, match="singular where body 'ball' starts"),
        fs.mujoco.FieldForces(model, data, point, accuracy=accuracy, native=is_native),
    ):
        pass
    assert mujoco.get_mjcb_passive() is None
