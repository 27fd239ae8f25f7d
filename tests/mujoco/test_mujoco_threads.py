"""FieldForces where threads, errors and the user's own settings meet it: right, refused or told, and never a crash."""

import copy
import dataclasses
import math
import os
import subprocess
import sys
import threading

import mujoco
import mujoco.rollout
import numpy as np
import pytest
from mujoco_models import BALL, BOX, DONUT, PLANET, at_start, model_of, passive

import fieldsim as fs

MOVING = fs.Body(DONUT, gravity=fs.Newtonian(), mass=1.0, motion=lambda time: (0.0, 0.0, 0.1 * math.sin(time)))
SOURCES = {"native": PLANET, "timed": MOVING}


@pytest.fixture
def box():
    return at_start(model_of(BOX + BALL))


# Threads


@pytest.mark.parametrize("source", SOURCES)
def test_threads_that_enter_and_leave_fields_of_their_own(source):
    """Each run is that of a lone one, bit for bit, whatever others do."""
    steps, failures, stop = {"native": 1000, "timed": 40}[source], [], threading.Event()

    def run(count):
        model = model_of(BOX)
        data = mujoco.MjData(model)
        forces = fs.mujoco.FieldForces(model, data, SOURCES[source])
        with forces:
            mujoco.mj_step(model, data, count)
        return data.qpos.copy()

    def churn():
        try:
            while not stop.is_set():
                run(1)
        except Exception as error:
            failures.append(error)

    alone = run(steps)
    threads = [threading.Thread(target=churn) for _ in range(3)]
    for thread in threads:
        thread.start()
    for _ in range(5):
        np.testing.assert_array_equal(run(steps), alone)
    stop.set()
    for thread in threads:
        thread.join()
    assert not failures
    assert mujoco.get_mjcb_passive() is None


@pytest.mark.parametrize("is_native", [True, False])
def test_threads_share_one_field_of_a_source_that_python_moves(box, is_native):
    model, data = box
    found = {}

    def run(begin):
        own = mujoco.MjData(model)
        own.time = begin
        mujoco.mj_step(model, own, 10)
        found[begin] = own.qpos.copy()

    with fs.mujoco.FieldForces(model, data, MOVING, native=is_native) as forces:
        wanted = {}
        for begin in (0.0, 1.0, 2.0):
            run(begin)
        wanted, found = found, {}
        threads = [threading.Thread(target=run, args=(begin,)) for begin in wanted]
        for thread in threads:
            thread.start()
        for _ in range(5):
            forces.energy()
        for thread in threads:
            thread.join()
    for begin, positions in wanted.items():
        np.testing.assert_array_equal(found[begin], positions)


# Runs in a process of its own: what is tried here crashed, or could.
HOSTILE = """
import threading, mujoco, numpy as np, fieldsim as fs
ball = '<body pos="3 0 0"><freejoint/><geom size=".1"/></body>'
def new(count):
    xml = '<mujoco><option gravity="0 0 0"/><worldbody>' + ball * count + '</worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(xml)
    return model, mujoco.MjData(model)
ring = fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=fs.Newtonian())
big, data = new(100)
small, other = new(1)
forces = fs.mujoco.FieldForces(big, data, ring)
with forces:
    for call in (forces.act, forces.energy, lambda other: fs.mujoco.state_of(big, other)):
        try:
            call(other)
        except fs.InputError:
            continue
        raise SystemExit(f"{call} took data of another model")
# The field is left, and its tables are given up, while other threads are at work with them.
stop = []
def work():
    own = mujoco.MjData(big)
    while not stop:
        mujoco.mj_step(big, own, 5)
threads = [threading.Thread(target=work) for _ in range(2)]
for thread in threads:
    thread.start()
for turn in range(30):
    with fs.mujoco.FieldForces(big, data, ring):
        mujoco.mj_step(big, data)
        big.body_mass[1] *= 1.01
        mujoco.mj_step(big, data)
stop.append(True)
for thread in threads:
    thread.join()
print("whole", mujoco.get_mjcb_passive())
"""


def test_data_of_other_models_and_fields_that_are_left_in_the_middle_do_no_harm():
    command = [sys.executable, "-W", "error", "-c", HOSTILE]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert result.stdout == "whole None\n", (result.returncode, result.stderr[-1000:])


# Tables without rows


@pytest.mark.parametrize(
    ("accuracy", "is_native"), [("points", True), ("points", False), ("torque", False), ("geoms", False)]
)
def test_a_surface_without_gravity_stops_what_flies_at_it(accuracy, is_native):
    """Beside one that spins, too; and it pulls nothing from afar."""
    model = model_of('<body pos="1.5 0 0"><freejoint/><geom size="0.1"/></body>', timestep=2e-3)
    data = mujoco.MjData(model)
    data.qvel[0] = -1.0
    wall = fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(radius=0.25))
    walls = [wall, dataclasses.replace(wall, motion=fs.Spin())]
    options = {"contact": fs.mujoco.Contact(1.5, depth=0.4), "accuracy": accuracy, "native": is_native}
    for wall in walls if is_native else walls[:1]:
        mujoco.mj_resetData(model, data)
        data.qvel[0] = -1.0
        with fs.mujoco.FieldForces(model, data, wall, **options) as forces:
            assert not forces.wrenches()[0].any()
            mujoco.mj_step(model, data, 700)
            assert data.qpos[0] > 0.25
            assert data.qvel[0] > 0.9, "and it flies back"


# What the user sets within the block


def mine(model, data):
    data.qfrc_passive[1] += 1.0


def test_a_callback_that_is_set_within_outlives_the_block_and_is_told_of(box):
    model, data = box

    def run(own):
        with fs.mujoco.FieldForces(model, data, PLANET) as forces:
            mujoco.set_mjcb_passive(own)
            assert not forces.running_natively

    try:
        for own in (mine, None):
            with pytest.warns(fs.FieldsimWarning, match=r"the field was off: MuJoCo's passive callback was set within"):
                run(own)
            assert mujoco.get_mjcb_passive() is own
    finally:
        mujoco.set_mjcb_passive(None)


def test_the_next_field_takes_in_a_callback_that_was_set_within(box):
    model, data = box
    other = copy.copy(model)

    def run():
        with fs.mujoco.FieldForces(model, data, PLANET):
            once = passive(model, data)
            mujoco.set_mjcb_passive(mine)
            with fs.mujoco.FieldForces(other, mujoco.MjData(other), PLANET):
                once[1] += 1.0
                np.testing.assert_array_equal(passive(model, data), once)
            mujoco.set_mjcb_passive(mujoco.get_mjcb_passive())

    try:
        with pytest.warns(fs.FieldsimWarning, match="the field was off"):
            run()
        assert mujoco.get_mjcb_passive() is mine
    finally:
        mujoco.set_mjcb_passive(None)


@pytest.mark.parametrize("own", [(0.0, 0.0, -1.0), (0.0, 0.0, 0.0)])
def test_gravity_that_is_set_within_outlives_the_block(box, own):
    model, data = box
    model.opt.gravity[:] = 0, 0, -3
    with fs.mujoco.FieldForces(model, data, PLANET, keep_gravity=False):
        assert not model.opt.gravity.any()
        model.opt.gravity[:] = own
    assert model.opt.gravity.tolist() == list(own)


def test_passive_forces_that_are_disabled_within_are_told_of(box):
    model, data = box
    bits = mujoco.mjtDisableBit

    def run():
        with fs.mujoco.FieldForces(model, data, PLANET):
            model.opt.disableflags = getattr(bits, "mjDSBL_PASSIVE", 0) or bits.mjDSBL_SPRING | bits.mjDSBL_DAMPER

    with pytest.warns(fs.FieldsimWarning, match="an option set within the block disables passive forces; enable"):
        run()


@pytest.mark.skipif(not hasattr(mujoco.mjtEnableBit, "mjENBL_SLEEP"), reason="this MuJoCo has no sleep")
def test_sleep_that_is_enabled_within_is_told_of(box):
    model, data = box

    def run():
        with fs.mujoco.FieldForces(model, data, PLANET):
            model.opt.enableflags = int(mujoco.mjtEnableBit.mjENBL_SLEEP)

    with pytest.warns(fs.FieldsimWarning, match="the flag sleep was enabled within the block"):
        run()


# Functions of the user's that fail


def failing(time):
    if time > 0.05:
        raise ZeroDivisionError("no more")
    return 0.0, 0.0, time


def test_a_motion_that_fails_surfaces_in_words(box):
    model, data = box
    moving = fs.Body(DONUT, gravity=fs.Newtonian(), motion=failing)
    with fs.mujoco.FieldForces(model, data, moving) as forces:
        for _ in range(2):
            with pytest.raises(fs.FieldsimError, match=r"motion, a function, failed at .*ZeroDivisionError: no more"):
                mujoco.mj_step(model, data, 100)
        assert data.time <= 0.05 + model.opt.timestep
        mujoco.mj_resetData(model, data)
        first = passive(model, data)
        with pytest.raises(fs.FieldsimError, match="no more"):
            mujoco.mj_step(model, data, 100)
        mujoco.mj_resetData(model, data)
        np.testing.assert_array_equal(passive(model, data), first, "the sources are where they were at that time")
        assert np.isfinite(forces.energy().total)


def test_a_motion_that_fails_in_a_thread_of_mujocos_fails_the_block(box, tmp_path, monkeypatch):
    """Where nobody takes an error MuJoCo would end the process."""
    monkeypatch.chdir(tmp_path)  # for MuJoCo's log
    model, data = box
    moving = fs.Body(DONUT, gravity=fs.Newtonian(), motion=failing)
    starts = np.tile(fs.mujoco.state_of(model, data), (4, 1))

    def run():
        with fs.mujoco.FieldForces(model, data, moving):
            mujoco.rollout.rollout(model, [mujoco.MjData(model) for _ in range(2)], starts, nstep=20)

    with pytest.raises(fs.FieldsimError, match=r"motion, a function, failed at .*ZeroDivisionError: no more"):
        run()
    assert mujoco.get_mjcb_passive() is None


# Rollouts


def test_rollouts_that_cannot_be_are_refused(box):
    model, data = box
    model = model_of(BALL + '<body><joint name="j"/><geom size="0.1"/></body>')
    data = mujoco.MjData(model)
    forces = fs.mujoco.FieldForces(model, data, PLANET)
    starts = fs.mujoco.state_of(model, data)
    singular = starts.copy()
    singular[3] = np.nan
    words = {
        r"forces is 5; give a fs.mujoco.FieldForces": (5, starts, 3),
        r"starts\[3\] is nan": (forces, singular, 3),
        r"starts have shape \(1, 15\); give \(worlds, 16\)": (forces, starts[1:], 3),
        r"starts have shape \(0, 16\)": (forces, np.zeros((0, 16)), 3),
        r"steps is 0; give a whole number of at least 1": (forces, starts, 0),
        r"steps is 2.5": (forces, starts, 2.5),
        r"are 1.28e\+14 bytes; give fewer steps at a time": (forces, starts, 10**12),
        r"threads is -1; give a whole number of at least 1": (forces, starts, 3, {"threads": -1}),
        r"controls has shape \(1, 1, 9\); give \(worlds or 1": (forces, starts, 3, {"controls": np.zeros((1, 1, 9))}),
        r"controls have shape \(1, 2, 0\)": (forces, starts, 3, {"controls": np.zeros((1, 2, 0))}),
    }
    for match, (given, states, steps, *options) in words.items():
        with pytest.raises(fs.InputError, match=match):
            fs.mujoco.rollout(given, states, steps, **(options[0] if options else {}))


def test_worlds_that_blow_up_are_told_of(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # for MuJoCo's log
    model = model_of(BALL)
    data = mujoco.MjData(model)
    forces = fs.mujoco.FieldForces(model, data, PLANET)
    starts = np.tile(fs.mujoco.state_of(model, data), (3, 1))
    starts[1, 8] = 1e11
    with pytest.warns(fs.FieldsimWarning, match=r"1 of 3 worlds blew up, the first is world 1 before its step"):
        states, _ = fs.mujoco.rollout(forces, starts, 5)
    assert np.isfinite(states[[0, 2]]).all()


# Runs in a process of its own, that is forked while another thread is in the field.
FORKED = """
import os, threading, mujoco, fieldsim as fs
ball = '<body pos="2 0 0"><freejoint/><geom size=".1"/></body>'
xml = '<mujoco><option gravity="0 0 0"/><worldbody>' + ball + '</worldbody></mujoco>'
model = mujoco.MjModel.from_xml_string(xml)
data = mujoco.MjData(model)
ring = fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=fs.Newtonian(), motion=lambda time: (0, 0, 0))
stop = []
def work():
    own = mujoco.MjData(model)
    while not stop:
        mujoco.mj_step(model, own, 5)
def child():
    mujoco.mj_step(model, data, 5)
    forces.__exit__(None, None, None)
    with fs.mujoco.FieldForces(model, data, ring):
        mujoco.mj_step(model, data, 5)
    os._exit(0 if data.qvel[0] < 0 and mujoco.get_mjcb_passive() is None else 3)
with fs.mujoco.FieldForces(model, data, ring, native=NATIVE) as forces:
    thread = threading.Thread(target=work)
    thread.start()
    for _ in range(5):
        process = os.fork()
        if not process:
            child()
        print(os.waitpid(process, 0)[1], end=" ")
    stop.append(True)
    thread.join()
"""


@pytest.mark.full
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.parametrize("is_native", [True, False])
def test_a_forked_child_steps_leaves_and_enters(is_native):
    command = [sys.executable, "-c", FORKED.replace("NATIVE", str(is_native))]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert result.stdout == "0 0 0 0 0 ", (result.returncode, result.stderr[-1000:])
