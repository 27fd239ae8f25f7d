"""What object code depends on, as digests: the code it was made of, the compilers, and the processor it is for."""

import functools
import hashlib
import pathlib
import platform
import sys
import types
from collections.abc import Sequence

import llvmlite
import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core import config
from numba.core.codegen import get_host_cpu_features

from fieldsim.portable import Portable

# Settings of numba's that change the code it makes.
_SETTINGS = (
    *("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "ENABLE_AVX", "USING_SVML", "BOUNDSCHECK", "DEBUGINFO_DEFAULT"),
    *("DISABLE_JIT", "LLVM_REFPRUNE_PASS"),
)


def digest(*parts) -> str:
    """One digest of numbers, texts and tuples of these."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def machine() -> tuple:
    """Compilers and processor: code made for one may not run, or not be the same, on another."""
    return (
        llvm.get_process_triple(),
        config.CPU_NAME or llvm.get_host_cpu_name(),
        get_host_cpu_features() if config.CPU_FEATURES is None else config.CPU_FEATURES,
        numba.__version__,
        llvmlite.__version__,
        np.__version__,
        platform.python_implementation(),
        tuple(sys.version_info),
        tuple(repr(getattr(config, name, None)) for name in _SETTINGS),
    )


@functools.cache
def sources(folders: Sequence[str], root: pathlib.Path = pathlib.Path(__file__).parents[1]) -> str:
    """Of the text of modules of the package: in folders, such as "mujoco/contact", or named as "potentials/row.py"."""
    given = [root / one for one in folders]
    paths = {path for one in given for path in ([one] if one.suffix == ".py" else one.rglob("*.py"))}
    return digest(sorted((str(path.relative_to(root)), path.read_bytes()) for path in paths))


def portables(functions: Sequence[Portable]) -> str:
    """Of portable functions, wherever they were written, and all that they call or read."""
    return digest([_described(function, {}) for function in functions])


def _described(value, known):
    """A tuple that tells a value from any other that compiles to other code."""
    if isinstance(value, Portable):
        if id(value) not in known:
            known[id(value)] = len(known)
            names = {**value.function.__globals__, **value.bindings}
            read = [(name, names[name]) for name in value.function.__code__.co_names if name in names]
            called = [(name, _described(one, known)) for name, one in read]
            return known[id(value)], _code(value.function.__code__), called
        return known[id(value)]
    if isinstance(value, tuple):
        return tuple(_described(one, known) for one in value)
    if isinstance(value, int | float | str | bytes | None):
        return repr(value)
    if isinstance(value, types.ModuleType):
        return value.__name__
    return getattr(value, "__qualname__", type(value).__qualname__)


def _code(code):
    constants = [_code(one) if isinstance(one, types.CodeType) else repr(one) for one in code.co_consts]
    return code.co_code, constants, code.co_names, code.co_varnames, code.co_argcount
