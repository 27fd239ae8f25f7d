"""The callback as native code: numba functions that work on the addresses MuJoCo hands over.

A plan's arrays are listed in a *head*: one row (address, length, length of a row) per array, in the order of `Plan`;
those of a source are followed by a row with the addresses of its sums.

Which model feels what stands in `ROWS`, which threads read while others write. An *entry* (see `entry_of`) never
changes; publishing one is to write its address, and whoever takes it out waits until nobody works with it (`release`).
"""

import ctypes
import functools
import glob
import os
import threading

import mujoco
import numba
import numpy as np
from numba import types

from fieldsim import launch
from fieldsim.errors import FieldsimError
from fieldsim.mujoco.callback import layout
from fieldsim.mujoco.callback.addresses import allocate, call, count, differ, doubles, halves, release, words
from fieldsim.mujoco.callback.generalised_forces import actor
from fieldsim.mujoco.callback.rows import BYTES, COPY, OWN, PLACE, WATCHED_WIDTH
from fieldsim.mujoco.callback.tables import Plan, Source, Views

PLACES = layout.offsets()
_TIME, _XIPOS, _XIMAT, _SUBTREE_COM, _CDOF, _CVEL, _QFRC_PASSIVE = (PLACES[name] for name in layout.FIELDS)
_NV, _NBODY, _SIGNATURE, _MASS, _INERTIA, _GRAVCOMP = (PLACES[name] for name in layout.MODEL_FIELDS)
_TIMESTEP, _OWN, _MARK, _SIZE = (PLACES[name] for name in ("timestep", "gravity", "mark", "size"))

# What MuJoCo calls: (model, data). Called by Python it would let go of the lock that guards Python's tables; LOCKED,
# for what acts on one model, does not.
POINTER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
LOCKED = ctypes.PYFUNCTYPE(None, *[ctypes.c_void_p] * 4)

# Models at most that feel fields at the same time.
MOST = 256
# How many of the rows may be in use, and the address of the callback that was there before.
HEADER = np.zeros(2, dtype=np.int64)
# Of each: 0-3 its model's address, mark, sizes and signature; 4 the address of the entry, 0 where there is none; 5 how
# many threads are at work with it; 6 the thread that entered the field; 7 where its data keeps the time; 8-10 see
# `_strange`.
ROWS = np.zeros((MOST, 11), dtype=np.int64)
_HEADER_ADDRESS, _ROWS_ADDRESS = HEADER.ctypes.data, ROWS.ctypes.data
_MODEL, _MARKED, _SIZES, _SIGNED, _ENTRY, BUSY, _THREAD, _CLOCK, _TWINS, _HEIRS, _FRESH = range(ROWS.shape[1])


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
    head = numba.carray(words(address), (HEAD, 3))
    return Plan(
        _indices(head, 0),
        _indices(head, 1),
        _indices(head, 2),
        _indices(head, 3),
        _indices(head, 4),
        _indices(head, 5),
        _table(head, 6),
        _indices(head, 7),
        _table(head, 8),
        _column(head, 9),
        _column(head, 10),
        _source(head, 11),
        _source(head, 16),
    )


HEAD = 21


@numba.njit
def _word(address):
    return numba.carray(words(address), (1,))[0]


@numba.njit
def _double(address):
    return numba.carray(doubles(address), (1,))[0]


@numba.njit
def _array(struct, place, shape):
    """The array whose pointer a struct keeps at a place."""
    return numba.carray(doubles(_word(struct + place)), shape)


@numba.njit
def _views(model, data, bodies, dofs):
    return Views(
        _double(data + _TIME),
        _array(data, _XIPOS, (bodies, 3)),
        _array(data, _XIMAT, (bodies, 9)),
        _array(data, _SUBTREE_COM, (bodies, 3)),
        _array(data, _CDOF, (dofs, 6)),
        _array(data, _CVEL, (bodies, 6)),
        _array(data, _QFRC_PASSIVE, (dofs,)),
        _array(model, _MASS, (bodies,)),
        _array(model, _INERTIA, (bodies, 3)),
        _array(model, _GRAVCOMP, (bodies,)),
        _double(model + _TIMESTEP),
    )


def views_at(model: int, data: int, bodies: int, dofs: int) -> Views:
    """Views of the structs at two addresses, of so many bodies and degrees of freedom, for Python."""

    def array(address, *shape):
        return np.ctypeslib.as_array(ctypes.cast(ctypes.c_void_p.from_address(address), _DOUBLES), shape)

    return Views(
        ctypes.c_double.from_address(data + _TIME).value,
        array(data + _XIPOS, bodies, 3),
        array(data + _XIMAT, bodies, 9),
        array(data + _SUBTREE_COM, bodies, 3),
        array(data + _CDOF, dofs, 6),
        array(data + _CVEL, bodies, 6),
        array(data + _QFRC_PASSIVE, dofs),
        array(model + _MASS, bodies),
        array(model + _INERTIA, bodies, 3),
        array(model + _GRAVCOMP, bodies),
        ctypes.c_double.from_address(model + _TIMESTEP).value,
    )


_DOUBLES = ctypes.POINTER(ctypes.c_double)


def head_of(plan: Plan) -> np.ndarray:
    """The head (HEAD, 3) of a plan, which keeps the arrays alive."""
    rows = [_row(array) for array in plan[:-2]]
    for source in (plan.gravity, plan.surface):
        rows += [*map(_row, source[:4]), source[4:]]
    return np.array(rows, dtype=np.int64)


def _row(array):
    return array.ctypes.data, array.shape[0], array.shape[1] if array.ndim == 2 else 1


@functools.cache
@launch.loading()
def acting(accuracy: str, contact: bool):
    """C function (addresses of a head, an mjModel, an mjData, and room for what is found or 0); see `actor`."""
    act = actor(accuracy, contact, True)

    @numba.cfunc(types.void(types.intp, types.intp, types.intp, types.intp))
    def function(head, model, data, room):
        plan = _plan(head)
        found = numba.carray(doubles(room), (plan.bodies.shape[0] if room else 0, 8))
        bodies, dofs = plan.places.shape[0], plan.first_dof[-1]
        turning, touching = plan.gravity.groups.shape[0], plan.surface.groups.shape[0]
        # Arrays of numba's own would cost more than a body's force: they are counted and found again one by one.
        work = allocate(8 * (9 * (turning + touching) + 6 * bodies))
        gravity_turns = numba.carray(doubles(work), (turning, 9))
        surface_turns = numba.carray(doubles(work + 72 * turning), (touching, 9))
        hung = numba.carray(doubles(work + 72 * (turning + touching)), (bodies, 6))
        act(plan, _views(model, data, bodies, dofs), gravity_turns, surface_turns, hung, found)
        release(work)

    return function


# What a model in a field is known by


def mark_of(model: int) -> int:
    """The mark of the model at an address: that of the field it, or what it was copied of, was made ready for; or 0."""
    return ctypes.c_uint32.from_address(model + _MARK).value if _MARK >= 0 else 0


def signature_of(model: int) -> int:
    """MuJoCo's number for the structure of the model at an address, signed; 0 of one that was stored."""
    return ctypes.c_int64.from_address(model + _SIGNATURE).value


def set_mark(model: int, mark: int) -> None:
    """Write the mark, which copies of the model keep."""
    if _MARK >= 0:
        ctypes.c_uint32.from_address(model + _MARK).value = mark


@numba.njit
def _mark(model):
    return numba.carray(halves(model + _MARK), (1,))[0] & 0xFFFFFFFF if _MARK >= 0 else 0


@numba.njit
def _sizes(model):
    """The numbers of degrees of freedom and of bodies, in one word."""
    if _SIZE == 8:
        return (_word(model + _NBODY) << 32) + _word(model + _NV)
    return (numba.carray(halves(model + _NBODY), (1,))[0] << 32) + numba.carray(halves(model + _NV), (1,))[0]


@numba.njit
def _is_of(known, model, mark, sizes, signature):
    """Whether a model is the one of a row or an entry: by its address, or as a copy by its mark, sizes and signature.

    Copies that were stored have no signature. The mark alone will not do: it goes along where one model's options are
    given to another.
    """
    if known[0] == model:
        return True
    alike = known[3] == signature or known[3] == 0 or signature == 0
    return mark != 0 and known[1] == mark and known[2] == sizes and alike


def entry_of(model, mark: int, function: int, head: int, watched: np.ndarray, told: np.ndarray, weightless: bool):
    """Entry (10,): 0-3 a model's address, mark, sizes and signature; 4 the function that acts on it (0: Python).

    5 its head; 6, 7 address and number of the rows of a `Watch`; 8 address of `told` (2,), which counts how often
    copies of the model differed in what is watched, so that they felt the field as the model would, and how often they
    had gravity of their own where they should be (9) weightless.
    """
    address, sizes = model._address, (model.nbody << 32) + model.nv
    row = [
        address,
        mark,
        sizes,
        signature_of(address),
        function,
        head,
        watched.ctypes.data,
        len(watched),
        told.ctypes.data,
    ]
    return np.array([*row, told.ctypes.data, weightless], dtype=np.int64)


@numba.njit
def _changed(entry, model):
    """Whether Python must renew what the entry was made of first; counts copies that differ."""
    rows = numba.carray(words(entry[6]), (entry[7], WATCHED_WIDTH))
    for i in range(rows.shape[0]):
        if differ(_word(model + rows[i, PLACE]), rows[i, COPY], rows[i, BYTES]) != 0:
            if model == entry[0]:
                return True
            if rows[i, OWN] == 0:
                numba.carray(words(entry[8]), (1,))[0] += 1
                return False
    return False


@numba.njit
def _count_weight(entry, model):
    """Count a copy that has gravity of its own where the model's is switched off."""
    if entry[9] != 0 and model != entry[0]:
        own = numba.carray(doubles(model + _OWN), (3,))
        if own[0] != 0.0 or own[1] != 0.0 or own[2] != 0.0:
            numba.carray(words(entry[8]), (2,))[1] += 1


def is_copy(entry, model: int) -> bool:
    """Whether the model at an address is that of an entry, or a copy of it."""
    return bool(_is_of(entry, model, mark_of(model), _sizes(model), signature_of(model)))


def publish(row: int, entry: np.ndarray, data: int) -> None:
    """Let a row be of an entry, from now on; data: the address of its own."""
    ROWS[row, :4] = entry[:4]
    ROWS[row, _THREAD:] = threading.get_ident(), data + _TIME, 0, 0, 1
    HEADER[0] = max(HEADER[0], row + 1)
    renew(row, entry)


def renew(row: int, entry: np.ndarray) -> None:
    """Let a row have another entry. The one before must stay as long as the row `is_busy`."""
    ROWS[row, _ENTRY] = entry.ctypes.data


def withdraw(row: int) -> None:
    """Let a row be of none. Its entry must stay as long as the row `is_busy`."""
    ROWS[row, [_ENTRY, _MODEL, _MARKED, _SIZES]] = 0


def is_busy(row: int) -> bool:
    """Whether a thread is at work with what the row is, or was just now, of."""
    return bool(_counted()[0](_ROWS_ADDRESS + 8 * (row * ROWS.shape[1] + BUSY)))


@functools.cache
@launch.loading()
def _counted():
    @numba.cfunc(types.intp(types.intp))
    def counted(address):
        return count(address, 0)

    return ctypes.CFUNCTYPE(ctypes.c_ssize_t, ctypes.c_void_p)(counted.address), counted


def time_of(data: int) -> float:
    """The time of the mjData at an address."""
    return ctypes.c_double.from_address(data + _TIME).value


# Python and MuJoCo, called by native code


def library():
    """MuJoCo's library, which is loaded already; raises FieldsimError where it is not beside its package."""
    names = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    found = [path for folder in mujoco.__path__ for name in names for path in glob.glob(os.path.join(folder, name))]
    if not found:
        raise FieldsimError(f"fieldsim finds no library of MuJoCo in {list(mujoco.__path__)}; install mujoco with pip")
    return ctypes.CDLL(found[0])


def _address(function):
    return ctypes.cast(function, ctypes.c_void_p).value


def _python(name):
    return _address(getattr(ctypes.pythonapi, name))


_THREAD_IDENT, _THREAD_STATE = _python("PyThread_get_thread_ident"), _python("PyGILState_GetThisThreadState")
# MuJoCo's binding raises the exception that is set, and this only where there is none.
_FAILED = np.frombuffer(b"fieldsim: the field failed\0", dtype=np.uint8)


def _asking(function):
    """Numba function (model, data): call a Python function of these addresses, and leave MuJoCo with what it raises.

    A third argument tells whether the thread is none of Python's: nobody may be there to take what is raised.
    """
    lock, unlock = _python("PyGILState_Ensure"), _python("PyGILState_Release")
    number, triple, put = _python("PyLong_FromSsize_t"), _python("PyTuple_New"), _python("PyTuple_SetItem")
    invoke, forget = _python("PyObject_CallObject"), _python("Py_DecRef")
    leave, message, function = _address(library().mju_error), _FAILED.ctypes.data, id(function)

    @numba.njit
    def ask(model, data):
        foreign = call(_THREAD_STATE, 0, 0, 0, 0) == 0
        state = call(lock, 0, 0, 0, 0)
        arguments = call(triple, 3, 0, 0, 0)
        for i, value in enumerate((model, data, 1 if foreign else 0)):
            call(put, arguments, i, call(number, value, 0, 0, 0), 0)
        answer = call(invoke, function, arguments, 0, 0)
        call(forget, arguments, 0, 0, 0)
        if answer != 0:
            call(forget, answer, 0, 0, 0)
        call(unlock, state, 0, 0, 0)
        if answer == 0:
            call(leave, message, 0, 0, 0)

    return ask


# The callback


@functools.cache
@launch.loading()
def dispatcher(function):
    """C function for mjcb_passive: what was there before, then what is published for the model, or for what it copies.

    function: for what needs Python, see `_asking`; it has to outlive the dispatcher. Models that no row knows are let
    be, such as those that MuJoCo tries out while it compiles them.
    """
    ask = _asking(function)
    width = ROWS.shape[1]

    @numba.njit
    def find(rows, used, model, mark, sizes, signature):
        for k in range(used):
            if rows[k, _MODEL] == model:
                return k
        for k in range(used):
            if _is_of(rows[k], model, mark, sizes, signature):
                return k
        return -1

    @numba.cfunc(types.void(types.intp, types.intp))
    def dispatch(model, data):
        header = numba.carray(words(_HEADER_ADDRESS), (2,))
        rows = numba.carray(words(_ROWS_ADDRESS), (MOST, width))
        if header[1] != 0:
            call(header[1], model, data, 0, 0)
        mark, sizes, signature = _mark(model), _sizes(model), _word(model + _SIGNATURE)
        k = find(rows, header[0], model, mark, sizes, signature)
        if k < 0:
            _strange(rows, header[0], model, sizes, signature, _double(data + _TIME))
            return
        # The row may be withdrawn just now: its entry holds from here until the count is back.
        busy = _ROWS_ADDRESS + 8 * (k * width + BUSY)
        count(busy, 1)
        python, place = False, rows[k, _ENTRY]
        if place != 0:
            entry = numba.carray(words(place), (10,))
            if _is_of(entry, model, mark, sizes, signature):
                rows[k, _FRESH], rows[k, _HEIRS] = 1, 0
                _count_weight(entry, model)
                python = entry[4] == 0 or _changed(entry, model)
                if not python:
                    call(entry[4], entry[5], model, data, 0)
        count(busy, -1)
        if python:
            ask(model, data)

    return dispatch


@numba.njit
def _strange(rows, used, model, sizes, signature, now):
    """Count what moves without a field, though its user may believe otherwise: twins and heirs of a model in one.

    A twin has the same structure, but was made or copied apart; an heir goes on at the time where the model stopped, as
    what is recompiled from a spec does, or moves while the model never did. Threads of Python's other than the one that
    entered the field know what they do.
    """
    # Without a signature are models that were stored, and those that MuJoCo tries out, one step long, to compile them.
    if now <= (0.0 if signature else _double(model + _TIMESTEP)):
        return
    thread = call(_THREAD_IDENT, 0, 0, 0, 0)
    foreign = call(_THREAD_STATE, 0, 0, 0, 0) == 0
    for k in range(used):
        if rows[k, _ENTRY] != 0 and (foreign or rows[k, _THREAD] == thread):
            if rows[k, _SIGNED] == signature or (signature == 0 and rows[k, _SIZES] == sizes):
                rows[k, _TWINS] += 1
            elif rows[k, _FRESH] == 1:
                rows[k, _FRESH] = 0
                clock = _double(rows[k, _CLOCK])
                rows[k, _HEIRS] = 1 if clock == now or clock == 0.0 else 0


def strangers(row: int) -> tuple[int, int]:
    """How often twins of a row's model were evaluated without a field, and whether an heir of it moved last."""
    return int(ROWS[row, _TWINS]), int(ROWS[row, _HEIRS])
