"""Which model feels what: rows that threads of MuJoCo read while Python writes others.

An *entry* (see `entry_of`) never changes; publishing one is to write its address into a row of `ROWS`, and whoever
takes it out waits until nobody works with it (`is_busy`). A model is known by its address, copies of it by their mark.
"""

import ctypes
import functools
import threading

import numba
import numpy as np
from numba import types

from fieldsim.mujoco.callback import layout
from fieldsim.mujoco.callback.addresses import (
    THREAD_IDENT,
    THREAD_STATE,
    call,
    count,
    differ,
    doubles,
    halves,
    words,
)
from fieldsim.mujoco.callback.memory import PLACES, double, word
from fieldsim.mujoco.callback.rows import BYTES, COPY, OWN, PLACE, WATCHED_WIDTH
from fieldsim.native import inner, known, native_function, place_of

_NV, _NBODY, _SIGNATURE = (PLACES[name] for name in layout.MODEL_FIELDS[:3])
_TIME, _TIMESTEP, _OWN, _MARK, _SIZE = (PLACES[name] for name in ("time", "timestep", "gravity", "mark", "size"))

# Numbers of an entry.
ENTRY_WIDTH = 11
# Models at most that feel fields at the same time.
MOST = 256
# How many of the rows may be in use, and the address of the callback that was there before.
HEADER = np.zeros(2, dtype=np.int64)
# Of each: 0-3 its model's address, mark, sizes and signature; 4 the address of the entry, 0 where there is none; 5 how
# many threads are at work with it; 6 the thread that entered the field; 7 where its data keeps the time; 8-10 see
# `count_strangers`; 11 the bits of the time at which its data was last, see `is_set_back`.
ROWS = np.zeros((MOST, 12), dtype=np.int64)
place_of("header", HEADER.ctypes.data)
place_of("rows", ROWS.ctypes.data)
MODEL, _MARKED, _SIZES, _SIGNED, ENTRY, BUSY, _THREAD, _CLOCK, _TWINS, HEIRS, FRESH, _LATEST = range(ROWS.shape[1])


def mark_of(model: int) -> int:
    """The mark of the model at an address: that of the field it, or what it was copied of, was made ready for; or 0."""
    return ctypes.c_uint32.from_address(model + _MARK).value if _MARK >= 0 else 0


def signature_of(model: int) -> int:
    """MuJoCo's number for the structure of the model at an address, signed; 0 of one that was stored."""
    return ctypes.c_int64.from_address(model + _SIGNATURE).value


def sizes_of(model: int) -> int:
    """`sizes_in` for Python."""
    size = ctypes.c_int64 if _SIZE == ctypes.sizeof(ctypes.c_int64) else ctypes.c_int32
    return (size.from_address(model + _NBODY).value << 32) + size.from_address(model + _NV).value


def set_mark(model: int, mark: int) -> None:
    """Write the mark, which copies of the model keep."""
    if _MARK >= 0:
        ctypes.c_uint32.from_address(model + _MARK).value = mark


@inner
def mark_in(model):
    """`mark_of` for native code."""
    return numba.carray(halves(model + _MARK), (1,))[0] & 0xFFFFFFFF if _MARK >= 0 else 0


@inner
def sizes_in(model):
    """The numbers of degrees of freedom and of bodies, in one word."""
    if _SIZE == 8:
        return (word(model + _NBODY) << 32) + word(model + _NV)
    return (numba.carray(halves(model + _NBODY), (1,))[0] << 32) + numba.carray(halves(model + _NV), (1,))[0]


@inner
def is_of(known, model, mark, sizes, signature):
    """Whether a model is the one of a row or an entry: by its address, or as a copy by its mark, sizes and signature.

    Copies that were stored have no signature. The mark alone will not do: it goes along where one model's options are
    given to another.
    """
    if known[0] == model:
        return True
    alike = known[3] == signature or known[3] == 0 or signature == 0
    return mark != 0 and known[1] == mark and known[2] == sizes and alike


def entry_of(
    model,
    mark: int,
    function: int,
    head: int,
    watched: np.ndarray,
    told: np.ndarray,
    *,
    weightless: bool,
    touching: bool,
):
    """Entry (ENTRY_WIDTH,): 0-3 a model's address, mark, sizes and signature; 4 the function that acts (0: Python).

    5 its head; 6, 7 address and number of the rows of a `Watch`; 8 address of `told` (2,), which counts how often
    copies of the model differed in what is watched, so that they felt the field as the model would, and how often they
    had gravity of their own where they should be (9) weightless; 10 whether starts inside of surfaces are looked for.
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
    return np.array([*row, weightless, touching], dtype=np.int64)


@inner
def changed(entry, model):
    """Whether Python must renew what the entry was made of first; counts copies that differ."""
    rows = numba.carray(words(entry[6]), (entry[7], WATCHED_WIDTH))
    for i in range(rows.shape[0]):
        if differ(word(model + rows[i, PLACE]), rows[i, COPY], rows[i, BYTES]) != 0:
            if model == entry[0]:
                return True
            if rows[i, OWN] == 0:
                numba.carray(words(entry[8]), (1,))[0] += 1
                return False
    return False


@inner
def count_weight(entry, model):
    """Count a copy that has gravity of its own where the model's is switched off."""
    if entry[9] != 0 and model != entry[0]:
        own = numba.carray(doubles(model + _OWN), (3,))
        if own[0] != 0.0 or own[1] != 0.0 or own[2] != 0.0:
            numba.carray(words(entry[8]), (2,))[1] += 1


@inner
def is_set_back(row, entry, data):
    """Whether a row's own data, of what touches, is at an earlier time than before: it was reset.

    row: the row's address. Else the time is noted, here, and where it is by `begin_anew`.
    """
    clock, latest = word(row + 8 * _CLOCK), row + 8 * _LATEST
    if entry[10] == 0 or clock != data + _TIME:
        return False
    if double(clock) < double(latest):
        return True
    numba.carray(words(latest), (1,))[0] = word(clock)
    return False


def begin_anew(row: int, data: int) -> bool:
    """Whether the data at an address is that of a row and `is_set_back`, which then is noted."""
    clock, latest = data + _TIME, ROWS[row, _LATEST : _LATEST + 1]
    if not ROWS[row, _CLOCK] == clock or not _time_at(clock) < latest.view(np.float64)[0]:
        return False
    latest.view(np.float64)[0] = _time_at(clock)
    return True


def _time_at(clock):
    return ctypes.c_double.from_address(clock).value


def is_copy(entry, model: int) -> bool:
    """Whether the model at an address is that of an entry, or a copy of it."""
    return bool(is_of.py_func(entry, model, mark_of(model), sizes_of(model), signature_of(model)))


def publish(row: int, entry: np.ndarray, data: int) -> None:
    """Let a row be of an entry, from now on; data: the address of its own."""
    ROWS[row, :4] = entry[:4]
    ROWS[row, _THREAD:] = threading.get_ident(), data + _TIME, 0, 0, 1, ctypes.c_int64.from_address(data + _TIME).value
    HEADER[0] = max(HEADER[0], row + 1)
    renew(row, entry)


def renew(row: int, entry: np.ndarray) -> None:
    """Let a row have another entry. The one before must stay as long as the row `is_busy`."""
    ROWS[row, ENTRY] = entry.ctypes.data


def withdraw(row: int) -> None:
    """Let a row be of none. Its entry must stay as long as the row `is_busy`."""
    ROWS[row, [ENTRY, MODEL, _MARKED, _SIZES]] = 0


def is_busy(row: int) -> bool:
    """Whether a thread is at work with what the row is, or was just now, of."""
    return bool(_counted()(ROWS.ctypes.data + 8 * (row * ROWS.shape[1] + BUSY)))


@functools.cache
def _counted():
    function = native_function("counted", lambda: _count_of, types.intp(types.intp), folders=layout.FOLDERS)
    return ctypes.CFUNCTYPE(ctypes.c_ssize_t, ctypes.c_void_p)(function.address)


def _count_of(address):
    return count(address, 0)


@inner
def count_strangers(rows, used, model, sizes, signature, now):
    """Count what moves without a field, though its user may believe otherwise: twins and heirs of a model in one.

    A twin has the same structure, but was made or copied apart; an heir goes on at the time where the model stopped, as
    what is recompiled from a spec does, or moves while the model never did. Threads of Python's other than the one that
    entered the field know what they do.
    """
    # Without a signature are models that were stored, and those that MuJoCo tries out, one step long, to compile them.
    if now <= (0.0 if signature else double(model + _TIMESTEP)):
        return
    thread = call(known(THREAD_IDENT), 0, 0, 0, 0)
    foreign = call(known(THREAD_STATE), 0, 0, 0, 0) == 0
    for k in range(used):
        if rows[k, ENTRY] != 0 and (foreign or rows[k, _THREAD] == thread):
            if rows[k, _SIGNED] == signature or (signature == 0 and rows[k, _SIZES] == sizes):
                rows[k, _TWINS] += 1
            elif rows[k, FRESH] == 1:
                rows[k, FRESH] = 0
                clock = double(rows[k, _CLOCK])
                rows[k, HEIRS] = 1 if clock == now or clock == 0.0 else 0


def strangers(row: int) -> tuple[int, int]:
    """How often twins of a row's model were evaluated without a field, and whether an heir of it moved last."""
    return int(ROWS[row, _TWINS]), int(ROWS[row, HEIRS])
