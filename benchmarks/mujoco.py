"""MuJoCo in a field: time of a step, energy and trajectories of a free body, contact, many worlds.

A step is timed without a field, natively, and with a callback in Python as a user would write it: `Field.gradient` at
all centres of mass, then mj_applyFT. The field's own cost is that of lanes alone, at as many places as a step asks for.
Steps are timed in processor time of the thread, which a busy machine disturbs less.
"""

import contextlib
import pathlib
import time

import mujoco
import numpy as np

import fieldsim as fs
from benchmarks.fields import evaluation
from benchmarks.mujoco_motion import PLANET, contacts, orbits, world
from fieldsim.mujoco.models import model_of

ROUNDS = 40
# RK4 asks for the forces this often in a step.
STAGES = 4
# How many evaluations one body takes, and of what.
COSTS = {"points": (6, "field"), "torque": (1, "jet")}


def rows(full: bool = False):
    """Steps, orbits, contact, rollouts; with `full` the rain of 200 objects."""
    for name, bodies, steps in (
        ("two free bodies", _scattered(2), 500),
        ("100 bodies", _scattered(100), 40),
        ("chain of 20", _chain(20), 150),
    ):
        yield from _steps(f"{name}, RK4", world(bodies, timestep=1e-3), steps, PLANET)
    yield from _steps("humanoid, 10 segments", _humanoid(), 200, _segments(10))
    yield from orbits()
    yield from contacts(full)
    yield from _rollouts()


_HUMANOID = pathlib.Path(__file__).parents[1] / "scenarios" / "humanoid.xml"


def _humanoid():
    """The ragdoll of the scenarios, 3 above the origin."""
    model = model_of(_HUMANOID)
    model.qpos0[2] += 3.0
    return model


def _segments(count):
    """A planet of segments, each from the end of the one before, within a ball of radius 1."""
    ends = np.random.default_rng(3).normal(size=(count + 1, 3))
    ends *= 0.8 / np.linalg.norm(ends, axis=1)[:, None]
    pairs = zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)
    return fs.Body([fs.Segment(start, end) for start, end in pairs], gravity=fs.Newtonian(), mass=1.0)


def _scattered(count):
    rng = np.random.default_rng(1)
    places = rng.normal(size=(count, 3))
    places *= 3.0 / np.linalg.norm(places, axis=1)[:, None]
    geom = '<geom type="box" size="0.1 0.05 0.02" contype="0" conaffinity="0"/>'
    return "".join(f'<body pos="{x} {y} {z}"><freejoint/>{geom}</body>' for x, y, z in places)


def _chain(count):
    geom = '<geom type="capsule" size="0.02" fromto="0 0 0 0.1 0 0" contype="0" conaffinity="0"/>'
    bodies = ""
    for k in reversed(range(count)):
        joint = f'<joint axis="0 {k % 2} {1 - k % 2}"/>'
        bodies = f'<body pos="{0.1 if k else 3.0} 0 0">{joint}{geom}{bodies}</body>'
    return bodies


# Steps


@contextlib.contextmanager
def _python_callback(model, planet):
    """What a user would write without FieldForces."""
    field = planet.gravity_field()
    none = np.zeros(3)

    def callback(model, data):
        pulls = model.body_mass[1:, None] * field.gradient(data.xipos[1:])
        for body, pull in enumerate(pulls, start=1):
            mujoco.mj_applyFT(model, data, pull, none, data.xipos[body], body, data.qfrc_passive)

    mujoco.set_mjcb_passive(callback)
    try:
        yield
    finally:
        mujoco.set_mjcb_passive(None)


def _steps(name, model, steps, planet):
    """Microseconds a step, the best of many short rounds in turn, and what of it neither MuJoCo nor the field costs."""
    data = mujoco.MjData(model)
    none = contextlib.nullcontext()
    best = dict.fromkeys(["no field", "Python callback", *COSTS, *(("alone", accuracy) for accuracy in COSTS)], np.inf)
    forces = {accuracy: fs.mujoco.FieldForces(model, data, planet, accuracy=accuracy) for accuracy in COSTS}
    stages = STAGES if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4 else 1
    for _ in range(ROUNDS):
        best["no field"] = min(best["no field"], _timed(model, data, none, steps))
        for accuracy, context in forces.items():
            best[accuracy] = min(best[accuracy], _timed(model, data, context, steps))
            places, kind = COSTS[accuracy]
            alone = _field_alone(planet, kind, np.repeat(data.xipos[1:], stages * places, axis=0))
            best["alone", accuracy] = min(best["alone", accuracy], alone)
        python = _timed(model, data, _python_callback(model, planet), max(5, steps // 40))
        best["Python callback"] = min(best["Python callback"], python)
    base = {"unit": "us/step", "peer": "no field", "peer_value": best["no field"]}
    yield {"name": f"{name}, no field", "value": best["no field"], "unit": "us/step"}
    yield {"name": f"{name}, Python callback, centres of mass", "value": best["Python callback"]} | base
    for accuracy in COSTS:
        sum_of_both = best["no field"] + best["alone", accuracy]
        yield {"name": f"{name}, native, {accuracy}", "value": best[accuracy]} | base
        yield {"name": f"{name}, the field alone, {accuracy}", "value": best["alone", accuracy], "unit": "us/step"}
        over = 100.0 * (best[accuracy] / sum_of_both - 1.0)
        yield {"name": f"{name}, native over no field plus the field alone, {accuracy}", "value": over, "unit": "%"}


def _timed(model, data, context, steps):
    """Microseconds a step of bodies that move and turn: MuJoCo spares itself much of the work for those at rest."""
    mujoco.mj_resetData(model, data)
    data.qvel[:] = 0.3 * np.random.default_rng(2).normal(size=model.nv)
    with context:
        mujoco.mj_step(model, data, 2)
        start = time.thread_time()
        mujoco.mj_step(model, data, steps)
        return 1e6 * (time.thread_time() - start) / steps


def _field_alone(planet, kind, places, times=20):
    """Microseconds that lanes take for the "field", or with its Hessian the "jet", at places (n, 3)."""
    # So many that what a launch takes is little.
    order = {"field": 1, "jet": 2}[kind]
    run = evaluation(planet.gravity_elements(0.0), np.tile(places, (times, 1)), order)
    run()
    start = time.thread_time()
    run()
    return 1e6 * (time.thread_time() - start) / times


# Many worlds


def _rollouts(worlds: int = 64, steps: int = 500):
    model = world(_scattered(2), timestep=1e-3)
    data = mujoco.MjData(model)
    starts = np.tile(fs.mujoco.state_of(model, data), (worlds, 1))
    starts[:, -model.nv :] = 0.1 * np.random.default_rng(1).normal(size=(worlds, model.nv))
    best = {1: 0.0, 2: 0.0}
    with fs.mujoco.FieldForces(model, data, PLANET) as forces:
        for _ in range(5):
            for threads in best:
                start = time.perf_counter()
                fs.mujoco.rollout(forces, starts, steps, threads=threads)
                best[threads] = max(best[threads], worlds * steps / (time.perf_counter() - start))
    name = f"rollouts of {worlds} worlds of two bodies, RK4"
    yield {"name": f"{name}, 1 thread", "value": best[1], "unit": "steps/s"}
    yield {"name": f"{name}, 2 threads", "value": best[2], "unit": "steps/s", "peer": "1 thread", "peer_value": best[1]}
