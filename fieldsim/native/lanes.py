"""C functions of portable functions in lanes: from the cache on disk, or compiled by Warp's compiler."""

import json

import numpy as np
import warp as wp

from fieldsim import kernel_cache, launch
from fieldsim.native import cache, fingerprint, loader
from fieldsim.native.functions import NativeFunction, compiled
from fieldsim.portable import Portable
from fieldsim.portable.lanes.words import words_kernel

# How Warp is told of a launch of one item: its shape, the number of items, the threads that share a place.
_ONE = np.ones(3, dtype=np.int64)
ONE_ITEM = loader.place_of("one item", _ONE.ctypes.data)
# The modules that turn a portable function into C++.
_FOLDERS = "portable", "native/lanes.py"
# What C++ over vectors may leave to the C library.
_NEEDS = "memcpy", "memset", "memmove", "floor", "ceil", "trunc"


def lanes_function_at(
    name: str, portable: Portable, inputs: tuple[str, ...], outputs: tuple[int, ...]
) -> NativeFunction:
    """The C function (what ONE_ITEM leads to, address of the address of words) of a portable function in lanes.

    name: of a file; inputs, outputs, words: see `portable.lanes.words`. The code is kept as `native_function` keeps it.
    """
    parts = fingerprint.machine(), fingerprint.sources(_FOLDERS), fingerprint.portables([portable])
    key = fingerprint.digest(name, inputs, outputs, parts, wp.config.version)

    def compile_now():
        with launch.loading():
            compiled.append(name)
            kernel = words_kernel(portable, inputs, outputs)
            code = kernel_cache.object_of(kernel.module)
            return json.dumps({"entry": f"{kernel.get_mangled_name()}_cpu_forward"}).encode() + b"\n" + code

    found = cache.kept(name, key, compile_now, lambda content: all(map(loader.is_there, _NEEDS)))
    head, _, code = found.partition(b"\n")
    return NativeFunction(name, loader.load(code, (), json.loads(head)["entry"]))
