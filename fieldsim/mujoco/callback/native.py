"""The callback as native code: what MuJoCo calls at every stage of every step, whatever the model."""

import ctypes
import functools

import numba
import numpy as np
from numba import types

from fieldsim.mujoco.callback import layout
from fieldsim.mujoco.callback.addresses import (
    ASKED,
    FORGET,
    HEADER_PLACE,
    INVOKE,
    LEAVE,
    LOCK,
    MESSAGE,
    NUMBER,
    PUT,
    ROWS_PLACE,
    THREAD_STATE,
    TUPLE,
    UNLOCK,
    address_of,
    call,
    count,
    library,
    words,
)
from fieldsim.mujoco.callback.entries import (
    BUSY,
    ENTRY,
    ENTRY_WIDTH,
    FRESH,
    HEIRS,
    MODEL,
    MOST,
    ROWS,
    changed,
    count_strangers,
    count_weight,
    is_of,
    is_set_back,
    mark_in,
    sizes_in,
)
from fieldsim.mujoco.callback.memory import PLACES, double, word
from fieldsim.native import NativeFunction, inner, known, native_function, place_of

_TIME, _SIGNATURE, _WIDTH = PLACES["time"], PLACES["signature"], ROWS.shape[1]

# What MuJoCo calls: (model, data). Called by Python it lets go of Python's lock.
POINTER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
# MuJoCo's binding raises the exception that is set, and this only where there is none.
_FAILED = np.frombuffer(b"fieldsim: the field failed\0", dtype=np.uint8)


@inner
def _ask(model, data):
    """Call the Python function ASKED with these addresses, and leave MuJoCo with what it raises.

    A third argument: whether the thread is none of Python's, where nobody may be there to catch what is raised.
    """
    foreign = call(known(THREAD_STATE), 0, 0, 0, 0) == 0
    state = call(known(LOCK), 0, 0, 0, 0)
    arguments = call(known(TUPLE), 3, 0, 0, 0)
    for i, value in enumerate((model, data, 1 if foreign else 0)):
        call(known(PUT), arguments, i, call(known(NUMBER), value, 0, 0, 0), 0)
    answer = call(known(INVOKE), known(ASKED), arguments, 0, 0)
    call(known(FORGET), arguments, 0, 0, 0)
    if answer != 0:
        call(known(FORGET), answer, 0, 0, 0)
    call(known(UNLOCK), state, 0, 0, 0)
    if answer == 0:
        call(known(LEAVE), known(MESSAGE), 0, 0, 0)


@inner
def _find(rows, used, model, mark, sizes, signature):
    """The row of a model, or of what it is a copy of; -1 where there is none."""
    for k in range(used):
        if rows[k, MODEL] == model:
            return k
    for k in range(used):
        if is_of(rows[k], model, mark, sizes, signature):
            return k
    return -1


@functools.cache
def dispatcher(function) -> NativeFunction:
    """C function for mjcb_passive: what was there before, then what is published for the model, or for what it copies.

    function: for what needs Python, see `_ask`; it has to outlive the dispatcher. Models that no row knows are let
    be, such as those that MuJoCo tries out while it compiles them.
    """
    place_of("asked", id(function))
    place_of("message", _FAILED.ctypes.data)
    place_of("mju_error", address_of(library().mju_error))
    signature = types.void(types.intp, types.intp)
    return native_function("dispatch", lambda: _dispatch, signature, folders=layout.FOLDERS, takes=layout.taken())


def _dispatch(model, data):
    header = numba.carray(words(known(HEADER_PLACE)), (2,))
    rows = numba.carray(words(known(ROWS_PLACE)), (MOST, _WIDTH))
    if header[1] != 0:
        call(header[1], model, data, 0, 0)
    mark, sizes, signature = mark_in(model), sizes_in(model), word(model + _SIGNATURE)
    k = _find(rows, header[0], model, mark, sizes, signature)
    if k < 0:
        count_strangers(rows, header[0], model, sizes, signature, double(data + _TIME))
        return
    # The row may be withdrawn just now: its entry holds from here until the count is back.
    row = known(ROWS_PLACE) + 8 * k * _WIDTH
    count(row + 8 * BUSY, 1)
    python, place = False, rows[k, ENTRY]
    if place != 0:
        entry = numba.carray(words(place), (ENTRY_WIDTH,))
        if is_of(entry, model, mark, sizes, signature):
            rows[k, FRESH], rows[k, HEIRS] = 1, 0
            count_weight(entry, model)
            back = is_set_back(row, entry, data)
            python = back or entry[4] == 0 or changed(entry, model)
            if not python:
                call(entry[4], entry[5], model, data, 0)
    count(row + 8 * BUSY, -1)
    if python:
        _ask(model, data)
