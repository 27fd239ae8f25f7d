"""Many worlds: open-loop runs of one model from many starts, on threads, in the fields of a FieldForces."""

import os

import mujoco
import mujoco.rollout
import numpy as np

from fieldsim.errors import InputError

# Positions, velocities, activations and time: what a run starts from and what it returns.
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS


def state_size(model) -> int:
    """How many numbers the state of a model is."""
    return mujoco.mj_stateSize(model, STATE)


def state_of(model, data) -> np.ndarray:
    """The state (state_size,) of data: time, positions, velocities, activations, as `rollout` takes and gives it."""
    state = np.empty(state_size(model))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def rollout(forces, starts, steps: int, *, controls=None, threads: int | None = None):
    """States (worlds, steps, state) and sensors (worlds, steps, sensors) of many runs of forces.model.

    Sensors are MuJoCo's own: to some of them the field is a push (see `FieldForces.readings`).
    starts (worlds, state): see `state_of`; controls (worlds or 1, steps or 1, nu). threads: all cores unless told. The
    forces may be active already. Raises InputError for what does not fit, and for forces that need Python (functions of
    time, native=False, or a callback of Python's that was there before): threads would queue for its lock.
    """
    model = forces.model
    starts = np.atleast_2d(np.asarray(starts, dtype=float))
    if starts.shape[1] != state_size(model):
        raise InputError(
            f"rollout: starts have shape {starts.shape}; give (worlds, {state_size(model)}): time, positions, "
            "velocities and activations (see fs.mujoco.state_of)"
        )
    if not isinstance(steps, int | np.integer) or steps < 1:
        raise InputError(f"rollout: steps is {steps!r}; give a whole number of at least 1")
    threads = threads or os.cpu_count() or 1
    worlds = [mujoco.MjData(model) for _ in range(min(threads, len(starts)))]
    with forces.running():
        if not forces.running_natively:
            raise InputError(
                "rollout: these forces need Python, which threads cannot share; use sources that stand still or spin, "
                "native=True, and no callback of Python's own"
            )
        return mujoco.rollout.rollout(model, worlds, starts, controls, nstep=int(steps))
