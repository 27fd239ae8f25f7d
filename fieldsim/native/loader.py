"""Object code brought into this process, and the table by which it finds what is of the process.

Code that is kept on disk cannot have addresses in it. It reads them from a table of whole numbers, by their places; the
table's own address is a variable of each object, which is written when the object is loaded.
"""

import ctypes
import hashlib

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from fieldsim.errors import FieldsimError
from fieldsim.native.compiler import ENTRY

_VARIABLE = "fieldsim_table"
# Addresses by their places, and which name has which place.
_TABLE = np.zeros(4096, dtype=np.int64)
_names: dict[int, str] = {}
# Engines, which own the code.
_loaded = []


def place_of(name: str, address: int = 0) -> int:
    """The place in the table that has a name, the same in all processes; address: what stands there, if not 0.

    Raises FieldsimError for two names that have the same place.
    """
    place = int.from_bytes(hashlib.sha256(name.encode()).digest()[:2], "big") % len(_TABLE)
    if _names.setdefault(place, name) != name:
        raise FieldsimError(f"{name!r} and {_names[place]!r} have the same place in native code's table; rename one")
    if address:
        _TABLE[place] = address
    return place


@intrinsic
def known(typing_context, place):
    """What stands at a place of the table, for numba."""

    def generate(context, builder, signature, arguments):
        word = context.get_value_type(types.intp)
        variable = builder.module.globals.get(_VARIABLE)
        if variable is None:
            variable = ir.GlobalVariable(builder.module, word, _VARIABLE)
            variable.linkage, variable.initializer = "common", ir.Constant(word, 0)
        table = builder.inttoptr(builder.load(variable), word.as_pointer())
        return builder.load(builder.gep(table, [arguments[0]]))

    return types.intp(types.intp), generate


def is_there(name: str) -> bool:
    """Whether this process has a C function of that name, such as "sqrt"; LLVM knows it from then on."""
    if llvm.address_of_symbol(name):
        return True
    found = getattr(ctypes.pythonapi, name, None)
    if found is None:
        return False
    llvm.add_symbol(name, ctypes.cast(found, ctypes.c_void_p).value)
    return True


def load(code: bytes, variables, entry: str = ENTRY) -> int:
    """The address of a function in an object's code; all functions that the object needs must be there."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True, codemodel="jitdefault")
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    if _VARIABLE in variables:
        ctypes.c_int64.from_address(engine.get_global_value_address(_VARIABLE)).value = _TABLE.ctypes.data
    _loaded.append(engine)
    return engine.get_function_address(entry)
