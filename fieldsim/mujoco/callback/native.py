"""The callback as native code: what MuJoCo calls at every stage of every step, whatever the model."""

import ctypes
import functools

import numba
import numpy as np
from numba import types

from fieldsim import launch
from fieldsim.mujoco.callback.addresses import (
    THREAD_STATE,
    address_of,
    call,
    count,
    library,
    python_function,
    words,
)
from fieldsim.mujoco.callback.entries import (
    BUSY,
    ENTRY,
    ENTRY_WIDTH,
    FRESH,
    HEADER_ADDRESS,
    HEIRS,
    MODEL,
    MOST,
    ROWS,
    ROWS_ADDRESS,
    changed,
    count_strangers,
    count_weight,
    is_of,
    is_set_back,
    mark_in,
    sizes_in,
)
from fieldsim.mujoco.callback.memory import PLACES, double, word

_TIME, _SIGNATURE = PLACES["time"], PLACES["signature"]

# What MuJoCo calls: (model, data). Called by Python it lets go of Python's lock.
POINTER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
# MuJoCo's binding raises the exception that is set, and this only where there is none.
_FAILED = np.frombuffer(b"fieldsim: the field failed\0", dtype=np.uint8)


def _asking(function):
    """Numba function (model, data): call a Python function of these addresses, and leave MuJoCo with what it raises.

    A third argument: whether the thread is none of Python's, where nobody may be there to catch what is raised.
    """
    lock, unlock = python_function("PyGILState_Ensure"), python_function("PyGILState_Release")
    number, triple = python_function("PyLong_FromSsize_t"), python_function("PyTuple_New")
    put = python_function("PyTuple_SetItem")
    invoke, forget = python_function("PyObject_CallObject"), python_function("Py_DecRef")
    leave, message, function = address_of(library().mju_error), _FAILED.ctypes.data, id(function)

    @numba.njit
    def ask(model, data):
        foreign = call(THREAD_STATE, 0, 0, 0, 0) == 0
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
            if rows[k, MODEL] == model:
                return k
        for k in range(used):
            if is_of(rows[k], model, mark, sizes, signature):
                return k
        return -1

    @numba.cfunc(types.void(types.intp, types.intp))
    def dispatch(model, data):
        header = numba.carray(words(HEADER_ADDRESS), (2,))
        rows = numba.carray(words(ROWS_ADDRESS), (MOST, width))
        if header[1] != 0:
            call(header[1], model, data, 0, 0)
        mark, sizes, signature = mark_in(model), sizes_in(model), word(model + _SIGNATURE)
        k = find(rows, header[0], model, mark, sizes, signature)
        if k < 0:
            count_strangers(rows, header[0], model, sizes, signature, double(data + _TIME))
            return
        # The row may be withdrawn just now: its entry holds from here until the count is back.
        busy = ROWS_ADDRESS + 8 * (k * width + BUSY)
        count(busy, 1)
        python, place = False, rows[k, ENTRY]
        if place != 0:
            entry = numba.carray(words(place), (ENTRY_WIDTH,))
            if is_of(entry, model, mark, sizes, signature):
                rows[k, FRESH], rows[k, HEIRS] = 1, 0
                count_weight(entry, model)
                back = is_set_back(ROWS_ADDRESS + 8 * k * width, entry, data)
                python = back or entry[4] == 0 or changed(entry, model)
                if not python:
                    call(entry[4], entry[5], model, data, 0)
        count(busy, -1)
        if python:
            ask(model, data)

    return dispatch
