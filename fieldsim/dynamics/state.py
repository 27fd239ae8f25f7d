"""Particles on their way: what kernels of motion read and write."""

import contextlib
from typing import Any

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.arrays import kept
from fieldsim.errors import FieldsimError
from fieldsim.numerics.running_sums import added


@wp.struct
class State:
    """Particles under way, one entry each (N,), world frame.

    x, v: positions and velocities; x_rest, v_rest: what rounding has left out of them so far (compensated summation);
    a: accelerations at x, kept up by the methods whose last evaluation serves the next step.
    """

    x: wp.array(dtype=wp.vec3d)
    v: wp.array(dtype=wp.vec3d)
    x_rest: wp.array(dtype=wp.vec3d)
    v_rest: wp.array(dtype=wp.vec3d)
    a: wp.array(dtype=wp.vec3d)


def state_of(positions, velocities, device) -> State:
    """A `State` of particles at given positions and velocities (N, 3), its accelerations still to be found."""
    state = State()
    state.x = wp.array(positions, dtype=wp.vec3d, device=device)
    state.v = wp.array(velocities, dtype=wp.vec3d, device=device)
    for name in ("x_rest", "v_rest", "a"):
        setattr(state, name, wp.zeros(len(positions), dtype=wp.vec3d, device=device))
    return state


def state_of_sets(sets, device) -> State:
    """The `State` of the particles of all sets, as they start."""
    nothing = np.zeros((0, 3))
    positions, velocities = ([getattr(p, name) for p in sets] for name in ("positions", "velocities"))
    return state_of(np.concatenate([nothing, *positions]), np.concatenate([nothing, *velocities]), device)


def split_by_sets(array: wp.array, sizes) -> tuple[np.ndarray, ...]:
    """Rows of all particles as copies on the host to read only, one array for each set of so many particles."""
    ends = np.cumsum(sizes)
    rows = array.numpy()
    return tuple(kept(rows[end - size : end]) for end, size in zip(ends, sizes, strict=True))


def renew(kind, table, fresh, which, names=None) -> None:
    """Replace rows `which` (N,) of the arrays `names` (default all) of a Warp struct by those of `fresh`."""
    for name in names or columns(kind):
        array = getattr(table, name)
        rows = array.numpy().copy()
        rows[which] = getattr(fresh, name).numpy()[which]
        setattr(table, name, wp.array(rows, dtype=array.dtype, device=array.device))


def columns(struct: Any) -> list[str]:
    """Names of the arrays of a Warp struct's class."""
    return list(struct.vars)


def refuse_nonsense(time: float, positions, velocities, remedy: str) -> None:
    """Raise FieldsimError where a particle is too far or too fast; positions, velocities: (N, 3) per set."""
    for index, (x, v) in enumerate(zip(positions, velocities, strict=True)):
        bad = np.flatnonzero(~(np.abs([x, v]) <= validate.FARTHEST).all(axis=(0, 2)))
        if bad.size:
            raise FieldsimError(
                f"at time {time:g} particle {bad[0]} of set {index} is at {tuple(x[bad[0]].tolist())} with "
                f"velocity {tuple(v[bad[0]].tolist())} ({bad.size} such particles); {remedy}"
            )


@contextlib.contextmanager
def restored_if_broken_off(arrays):
    """Context manager: if the block is broken off, as by Ctrl-C, the Warp arrays are as before it."""
    before = [wp.clone(array) if array.device.is_cuda else array.numpy().copy() for array in arrays]
    try:
        yield
    except BaseException:
        for array, values in zip(arrays, before, strict=True):
            array.assign(values)
        raise


@wp.func
def drifted(x: Any, x_rest: Any, v: Any, v_rest: Any, kick: Any, drift: wp.float64):
    """The position x after a drift with v and a kick that v does not yet hold, and its new rest."""
    return added(x, x_rest, drift * (v + (v_rest + kick)))
