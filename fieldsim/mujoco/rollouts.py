"""Many worlds: open-loop runs of one model from many starts, on threads, in the fields of a FieldForces."""

import math
import os
import warnings

import mujoco
import mujoco.rollout
import numpy as np

from fieldsim import validate
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.mujoco.forces import FieldForces
from fieldsim.mujoco.models import alike, named
from fieldsim.types import ArrayLike, WholeLike

# Positions, velocities, activations and time: what a run starts from and what it returns.
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
# Greatest size of a rollout's result, in bytes.
MOST = 2**36


def state_size(model: mujoco.MjModel) -> int:
    """How many numbers the state of a model is."""
    validate.instance("state_size", "model", model, mujoco.MjModel, "give a mujoco.MjModel")
    return mujoco.mj_stateSize(model, STATE)


def state_of(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """The state (state_size,) of data: time, positions, velocities, activations, as `rollout` takes and gives it.

    Raises InputError for data of another model.
    """
    validate.instance("state_of", "model", model, mujoco.MjModel, "give a mujoco.MjModel")
    alike(model, data, "state_of")
    state = np.empty(state_size(model))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def rollout(
    forces: FieldForces,
    starts: ArrayLike,
    steps: WholeLike,
    *,
    controls: ArrayLike | None = None,
    threads: WholeLike | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """States (worlds, steps, state) and sensors (worlds, steps, sensors) of many runs of forces.model.

    Sensors are MuJoCo's own: to some of them the field is a push (see `FieldForces.readings`).
    What no state holds is as the model has it, whatever forces.data has: mocap bodies and equalities, of which a
    FieldsimWarning tells, and applied forces, which are 0.
    starts (worlds, state): see `state_of`; controls (worlds or 1, steps or 1, nu). threads: default all cores. The
    forces may be active already. A world that blows up stays as it was then, with a FieldsimWarning. Raises InputError
    for what does not fit, and for forces that need Python (functions of time, native=False, or a callback of Python's
    that was there before): threads would wait for its lock.
    """
    validate.instance("rollout", "forces", forces, FieldForces, "give a fs.mujoco.FieldForces")
    model = forces.model
    starts = _starts(model, starts)
    steps = validate.whole("rollout", "steps", steps, at_least=1, at_most=2**53)
    size = 8 * len(starts) * steps * (starts.shape[1] + model.nsensordata)
    if size > MOST:
        raise InputError(
            f"rollout: {len(starts)} worlds of {steps} steps are {size:.3g} bytes; give fewer steps at a time, and "
            "start again from the last states"
        )
    controls = _controls(model, controls, len(starts), steps)
    threads = os.cpu_count() or 1 if threads is None else validate.whole("rollout", "threads", threads, at_least=1)
    worlds = [mujoco.MjData(model) for _ in range(min(threads, len(starts)))]
    with forces.running():
        if not forces.running_natively:
            raise InputError(
                "rollout: these forces need Python, which threads cannot share, or are off; use sources that stand "
                "still or spin, native=True, and set no passive callback of Python's own"
            )
        found = mujoco.rollout.rollout(model, worlds, starts, controls, nstep=steps)
    _tell_of_blown_up(model, starts, steps, found[0])
    _tell_of_what_is_left_out(model, forces.data)
    return found


def _starts(model, starts):
    width = state_size(model)
    remedy = f"give (worlds, {width}): time, positions, velocities and activations (see fs.mujoco.state_of)"
    starts = np.atleast_2d(validate.numbers("rollout", "starts", starts, remedy=remedy))
    if starts.shape[1:] != (width,) or not len(starts):
        raise InputError(f"rollout: starts have shape {starts.shape}; {remedy}")
    return np.ascontiguousarray(starts)


def _controls(model, controls, worlds, steps):
    """Controls (worlds, steps, nu), or None."""
    if controls is None:
        return None
    remedy = f"give (worlds or 1, steps or 1, {model.nu}), here ({worlds} or 1, {steps} or 1, {model.nu})"
    given = validate.numbers("rollout", "controls", controls, shape=(None, None, model.nu), remedy=remedy)
    if given.shape[0] not in (1, worlds) or given.shape[1] not in (1, steps):
        raise InputError(f"rollout: controls have shape {given.shape}; {remedy}")
    return np.ascontiguousarray(np.broadcast_to(given, (worlds, steps, model.nu)))


def _tell_of_blown_up(model, starts, steps, states):
    """MuJoCo ends a world's run where it warns, and repeats its state: its time does not go on."""
    ran = (states[:, -1, 0] - starts[:, 0]) / model.opt.timestep
    stopped = np.flatnonzero(~(ran > steps - 0.5))
    if len(stopped):
        first = int(stopped[0])
        warnings.warn(
            f"rollout: {len(stopped)} of {len(starts)} worlds blew up, the first is world {first} before its step "
            f"{math.floor(max(ran[first], 0.0)) + 1}; their last states are repeated: give a timestep below "
            f"{model.opt.timestep:g} or a softened kernel",
            FieldsimWarning,
            stacklevel=3,
        )


def _tell_of_what_is_left_out(model, data):
    """Worlds have mocap bodies and equalities as the model has them, not as the data of the forces."""
    mocap = np.flatnonzero(model.body_mocapid >= 0)
    order = model.body_mocapid[mocap]
    there = np.hstack([data.mocap_pos[order], data.mocap_quat[order]])
    moved = mocap[(there != np.hstack([model.body_pos[mocap], model.body_quat[mocap]])).any(axis=1)]
    words = [f"mocap body {named(model, 'body', body)}" for body in moved.tolist()]
    words += [
        f"equality {named(model, 'equality', k)}" for k in np.flatnonzero(data.eq_active != model.eq_active0).tolist()
    ]
    if words:
        warnings.warn(
            f"rollout: states do not hold where mocap bodies are and which equalities are active: {', '.join(words)} "
            "in forces.data are not as in the worlds, which have them as the model has; set model.body_pos, "
            "model.body_quat and model.eq_active0",
            FieldsimWarning,
            stacklevel=3,
        )
