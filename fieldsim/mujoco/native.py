"""The callback as native code: numba functions that work on the addresses MuJoCo hands over.

A plan's arrays are listed in a *head*: one row (address, length, length of a row) per array, in the order of `Plan`;
those of a source are followed by a row with the addresses of its sums. The last two rows: what is watched (address,
number, 3; see `Watch.rows`), and the address of what is called when one of it was changed.
"""

import ctypes
import functools

import numba
import numpy as np
from numba import types

from fieldsim.mujoco import layout
from fieldsim.mujoco.act import actor
from fieldsim.mujoco.addresses import allocate, call, differ, doubles, halves, release, words
from fieldsim.mujoco.tables import Plan, Source, Views

PLACES = layout.offsets()
_TIME, _XIPOS, _XIMAT, _SUBTREE_COM, _CDOF, _CVEL, _QFRC_PASSIVE = (PLACES[name] for name in layout.FIELDS)

# What MuJoCo calls: (model, data). Called by Python it would let go of the lock that guards Python's tables; LOCKED,
# for what acts on one model, does not.
POINTER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
CALLED = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
LOCKED = ctypes.PYFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)

# Models at most that feel fields at the same time.
MOST = 256
# Row 0: number of rows that follow, and address of the callback that was there before. The others: the addresses of a
# model, of the function that acts on it, and of its head.
REGISTRY = np.zeros((1 + MOST, 3), dtype=np.int64)
_REGISTRY_ADDRESS = REGISTRY.ctypes.data


@numba.njit
def _table(head, i):
    return numba.carray(doubles(head[i, 0]), (head[i, 1], head[i, 2]))


@numba.njit
def _column(head, i):
    return numba.carray(doubles(head[i, 0]), (head[i, 1],))


@numba.njit
def _indices(head, i):
    return numba.carray(words(head[i, 0]), (head[i, 1],))


@numba.njit
def _numbers(head, i):
    return numba.carray(words(head[i, 0]), (head[i, 1], head[i, 2]))


@numba.njit
def _kinds(head, i):
    return numba.carray(halves(head[i, 0]), (head[i, 1],))


@numba.njit
def _source(head, i):
    sums = head[i + 4]
    return Source(
        _table(head, i), _kinds(head, i + 1), _numbers(head, i + 2), _table(head, i + 3), sums[0], sums[1], sums[2]
    )


@numba.njit
def _plan(address):
    head = numba.carray(words(address), (ROWS, 3))
    return Plan(
        _indices(head, 0),
        _indices(head, 1),
        _indices(head, 2),
        _indices(head, 3),
        _indices(head, 4),
        _column(head, 5),
        _table(head, 6),
        _column(head, 7),
        _indices(head, 8),
        _table(head, 9),
        _indices(head, 10),
        _table(head, 11),
        _column(head, 12),
        _column(head, 13),
        _source(head, 14),
        _source(head, 19),
    )


WATCHED = 24
ROWS = WATCHED + 2


@numba.njit
def _renew(address):
    """Have the plan renewed if a number of the model is no longer what it was made of."""
    head = numba.carray(words(address), (ROWS, 3))
    watched = _numbers(head, WATCHED)
    for i in range(head[WATCHED, 1]):
        if differ(watched[i, 0], watched[i, 1], watched[i, 2]) != 0:
            call(head[WATCHED + 1, 0], 0, 0, 0)
            return


@numba.njit
def _array(data, place, shape):
    """The array whose pointer mjData keeps at a place."""
    return numba.carray(doubles(numba.carray(words(data + place), (1,))[0]), shape)


@numba.njit
def _views(data, bodies, dofs):
    return Views(
        numba.carray(doubles(data + _TIME), (1,))[0],
        _array(data, _XIPOS, (bodies, 3)),
        _array(data, _XIMAT, (bodies, 9)),
        _array(data, _SUBTREE_COM, (bodies, 3)),
        _array(data, _CDOF, (dofs, 6)),
        _array(data, _CVEL, (bodies, 6)),
        _array(data, _QFRC_PASSIVE, (dofs,)),
    )


def head_of(plan: Plan, watched=None, changed=None) -> np.ndarray:
    """The head (ROWS, 3) of a plan, which keeps the arrays alive.

    watched: rows of a `Watch`; changed: a CALLED, for when one of them differs.
    """
    rows = [_row(array) for array in plan[:-2]]
    for source in (plan.gravity, plan.surface):
        rows += [*map(_row, source[:4]), source[4:]]
    called = ctypes.cast(changed, ctypes.c_void_p).value if changed else 0
    rows += [(0, 0, 3) if watched is None else _row(watched), (called, 0, 0)]
    return np.array(rows, dtype=np.int64)


def _row(array):
    return array.ctypes.data, array.shape[0], array.shape[1] if array.ndim == 2 else 1


@functools.cache
def acting(points: bool, contact: bool):
    """C function (addresses of a head, an mjData, and room for what is found or 0); see `actor`."""
    act = actor(points, contact, True)

    @numba.cfunc(types.void(types.intp, types.intp, types.intp))
    def function(head, data, room):
        _renew(head)
        plan = _plan(head)
        found = numba.carray(doubles(room), (plan.bodies.shape[0] if room else 0, 8))
        bodies, dofs = plan.mass.shape[0], plan.first_dof[-1]
        turning, touching = plan.gravity.groups.shape[0], plan.surface.groups.shape[0]
        # Arrays of numba's own would cost more than a body's force: they are counted and found again one by one.
        work = allocate(8 * (9 * (turning + touching) + 6 * bodies))
        gravity_turns = numba.carray(doubles(work), (turning, 9))
        surface_turns = numba.carray(doubles(work + 72 * turning), (touching, 9))
        hung = numba.carray(doubles(work + 72 * (turning + touching)), (bodies, 6))
        act(plan, _views(data, bodies, dofs), gravity_turns, surface_turns, hung, found)
        release(work)

    return function


@functools.cache
def dispatcher():
    """C function for mjcb_passive: what was there before, then what is registered for the model."""

    @numba.cfunc(types.void(types.intp, types.intp))
    def dispatch(model, data):
        registry = numba.carray(words(_REGISTRY_ADDRESS), (1 + MOST, 3))
        if registry[0, 1] != 0:
            call(registry[0, 1], model, data, 0)
        for k in range(1, 1 + registry[0, 0]):
            if registry[k, 0] == model:
                call(registry[k, 1], registry[k, 2], data, 0)

    return dispatch
