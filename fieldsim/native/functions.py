"""C functions made of Python ones: from the cache on disk, or compiled."""

import json
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numba

from fieldsim import launch
from fieldsim.native import cache, fingerprint, loader
from fieldsim.portable import Portable


def inner(function: Callable) -> Any:
    """The numba function that only native functions call, and others like it."""
    return numba.njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)(function)


class NativeFunction(NamedTuple):
    """A C function that stays as long as the process: its name and its address."""

    name: str
    address: int


# Names of what this process has compiled, for tests.
compiled: list[str] = []


def native_function(
    name: str,
    make: Callable[[], Callable],
    signature,
    *,
    folders: tuple[str, ...],
    portables: Sequence[Portable] = (),
    takes: tuple = (),
) -> NativeFunction:
    """The C function of a Python function that numba can compile.

    name: of the function and of all that `make` makes it of, for a file's name; make: gives the Python function where
    it must be compiled; signature: of numba's types. The code is kept until what it depends on changes: the text of
    modules in `folders` of the package (see `fingerprint.sources`), `portables` with all they call, and numbers that it
    `takes`.
    """
    parts = fingerprint.machine(), fingerprint.sources(folders), fingerprint.portables(portables)
    key = fingerprint.digest(name, str(signature), parts, takes)

    def compile_now():
        from fieldsim.native.compiler import object_code

        with launch.loading():
            compiled.append(name)
            code, needs, variables = object_code(make(), signature)
            return json.dumps({"needs": needs, "variables": variables}).encode() + b"\n" + code

    found = cache.kept(name, key, compile_now, lambda content: all(map(loader.is_there, _parts(content)[0]["needs"])))
    head, code = _parts(found)
    return NativeFunction(name, loader.load(code, head["variables"]))


def _parts(content):
    head, _, code = content.partition(b"\n")
    return json.loads(head), code
