"""Bare addresses: numba functions that read values and call C functions there, and where C functions are."""

import ctypes
import functools
import glob
import os

import mujoco
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from fieldsim.errors import FieldsimError
from fieldsim.native import place_of


def _pointer(dtype):
    """Numba function: the pointer to values of `dtype` at an address."""

    @intrinsic
    def pointer(typing_context, address):
        def generate(context, builder, signature, arguments):
            return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

        return types.CPointer(dtype)(types.intp), generate

    return pointer


doubles, words, halves = _pointer(types.float64), _pointer(types.int64), _pointer(types.int32)


@intrinsic
def call(typing_context, function, one, two, three, four):
    """What the C function at an address gives for four words (one that takes fewer leaves the others unread).

    Of a function that gives nothing, or less than a word, what stands beside it means nothing.
    """

    def generate(context, builder, signature, arguments):
        word = context.get_value_type(types.intp)
        kind = ir.FunctionType(word, [word] * 4)
        return builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])

    return types.intp(*[types.intp] * 5), generate


@intrinsic
def call_five(typing_context, function, one, two, three, four, five):
    """`call` for five words."""

    def generate(context, builder, signature, arguments):
        word = context.get_value_type(types.intp)
        kind = ir.FunctionType(word, [word] * 5)
        return builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])

    return types.intp(*[types.intp] * 6), generate


@intrinsic
def count(typing_context, address, change):
    """Add to the word at an address, at once for all threads, and in order with what stands before and behind it."""

    def generate(context, builder, signature, arguments):
        word = context.get_value_type(types.intp)
        pointer = builder.inttoptr(arguments[0], word.as_pointer())
        return builder.atomic_rmw("add", pointer, arguments[1], "seq_cst")

    return types.intp(types.intp, types.intp), generate


@intrinsic
def allocate(typing_context, size):
    """The address of `size` bytes of memory, from C's malloc."""

    def generate(context, builder, signature, arguments):
        word = context.get_value_type(types.intp)
        malloc = cgutils.get_or_insert_function(builder.module, ir.FunctionType(word, [word]), "malloc")
        return builder.call(malloc, arguments)

    return types.intp(types.intp), generate


@intrinsic
def differ(typing_context, one, other, size):
    """Whether `size` bytes at two addresses differ, by C's memcmp: 0 where they do not."""

    def generate(context, builder, signature, arguments):
        word, half = context.get_value_type(types.intp), context.get_value_type(types.int32)
        memcmp = cgutils.get_or_insert_function(builder.module, ir.FunctionType(half, [word] * 3), "memcmp")
        return builder.call(memcmp, arguments)

    return types.int32(types.intp, types.intp, types.intp), generate


@intrinsic
def release(typing_context, address):
    """Give memory back to C's free."""

    def generate(context, builder, signature, arguments):
        word = context.get_value_type(types.intp)
        free = cgutils.get_or_insert_function(builder.module, ir.FunctionType(ir.VoidType(), [word]), "free")
        builder.call(free, arguments)
        return context.get_dummy_value()

    return types.void(types.intp), generate


@functools.cache
def call_sum(length: int):
    """Numba function: call the C function of a sum (see `field_callbacks`); the numbers it gives, as a tuple."""
    inputs = (types.intp, types.float64, types.float64, types.float64, *[types.intp] * 5)

    @intrinsic
    def invoke(typing_context, function, x, y, z, rows, width, kinds, first, count):
        result = types.UniTuple(types.float64, length)

        def generate(context, builder, signature, arguments):
            word, real = context.get_value_type(types.intp), context.get_value_type(types.float64)
            kind = ir.FunctionType(ir.VoidType(), [real] * 3 + [word] * 6)
            with builder.goto_entry_block():
                out = builder.alloca(real, size=ir.Constant(word, length))
            callee = builder.inttoptr(arguments[0], kind.as_pointer())
            builder.call(callee, [*arguments[1:], builder.ptrtoint(out, word)])
            numbers = [builder.load(builder.gep(out, [ir.Constant(word, i)])) for i in range(length)]
            return context.make_tuple(builder, signature.return_type, numbers)

        return result(*inputs), generate

    return invoke


# Functions of Python and of MuJoCo


def address_of(function) -> int:
    """The address of a ctypes function."""
    return ctypes.cast(function, ctypes.c_void_p).value or 0


def library():
    """MuJoCo's library, which is loaded already; raises FieldsimError where it is not beside its package."""
    names = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    found = [path for folder in mujoco.__path__ for name in names for path in glob.glob(os.path.join(folder, name))]
    if not found:
        raise FieldsimError(f"fieldsim finds no library of MuJoCo in {list(mujoco.__path__)}; install mujoco with pip")
    return ctypes.CDLL(found[0])


def python_function(name: str) -> int:
    """The address of a function of Python's C interface."""
    return address_of(getattr(ctypes.pythonapi, name))


# Places of addresses in native code's table (see `native.loader`): of functions of Python and of MuJoCo, of a Python
# function and a message, of tables.
THREAD_IDENT = place_of("PyThread_get_thread_ident", python_function("PyThread_get_thread_ident"))
THREAD_STATE = place_of("PyGILState_GetThisThreadState", python_function("PyGILState_GetThisThreadState"))
LOCK = place_of("PyGILState_Ensure", python_function("PyGILState_Ensure"))
UNLOCK = place_of("PyGILState_Release", python_function("PyGILState_Release"))
NUMBER = place_of("PyLong_FromSsize_t", python_function("PyLong_FromSsize_t"))
TUPLE = place_of("PyTuple_New", python_function("PyTuple_New"))
PUT = place_of("PyTuple_SetItem", python_function("PyTuple_SetItem"))
INVOKE = place_of("PyObject_CallObject", python_function("PyObject_CallObject"))
FORGET = place_of("Py_DecRef", python_function("Py_DecRef"))
LEAVE, SOLVE = place_of("mju_error"), place_of("mj_solveM")
ASKED, MESSAGE, HEADER_PLACE, ROWS_PLACE = map(place_of, ("asked", "message", "header", "rows"))
