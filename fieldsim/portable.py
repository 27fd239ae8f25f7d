"""Field mathematics written once, compiled for Warp float32, Warp float64 and numba.

A portable function is a plain scalar Python function under `@portable`. In its annotations `real` stands for the scalar
type, `Table` for a two-dimensional array of reals and `Indices` for a one-dimensional array of int32. In its body:

- literals are `real(0.5)`; a constant that float32 cannot hold exactly is a module constant, `THIRD = 1 / 3`, used as
  `real(THIRD)` (Warp rounds the value of an expression such as `real(1.0 / 3.0)` through float32);
- mathematics is spelled `math.sqrt`; what a target lacks (log1p, elliptic integrals, ...) is a portable function of
  `fieldsim.potentials.special`;
- it may call other portable functions, also of other modules, and `bind` gives such a name another meaning.

`f.warp(wp.float64)` is a Warp function, `f.numba` a numba one, and `f(...)` runs as plain Python.
"""

import builtins
import dis
import functools
import math
import types
from typing import Any

from fieldsim.errors import PortableError

real = float


class Table:
    """Annotation: two-dimensional array of reals."""


class Indices:
    """Annotation: one-dimensional array of int32."""


# Builtins that Warp and numba both compile.
_BUILTINS = frozenset({"abs", "bool", "float", "int", "max", "min", "range", "round"})


class Portable:
    """A scalar function and its compiled twins. Made by `portable`; see the module's text."""

    def __init__(self, function, bindings=None):
        self.function = function
        self.bindings = dict(bindings or {})
        self._twins: dict[tuple, Any] = {}
        functools.update_wrapper(self, function)

    def __call__(self, *args):
        """Run as plain Python in float64 (slow; for tests and small work on the host)."""
        return self._python(*args)

    def bind(self, **names: Any) -> "Portable":
        """The same function with the given global names (portable functions or numbers) bound to other values."""
        for name in names:
            if name not in _global_names(self.function.__code__):
                raise PortableError(f"{self.__qualname__} uses no global name {name!r}, so it cannot be bound")
        return Portable(self.function, {**self.bindings, **names})

    def warp(self, scalar):
        """The Warp function in `scalar` (wp.float32 or wp.float64), compiled once."""
        return self._twin("warp", scalar)

    @property
    def numba(self):
        """The numba function in float64, compiled once."""
        return self._twin("numba", float)

    @functools.cached_property
    def _python(self):
        return types.FunctionType(self.function.__code__, self._globals(), self.function.__name__)

    def _globals(self):
        return {**self.function.__globals__, **self.bindings}

    def _twin(self, target, scalar):
        key = target, scalar
        if key not in self._twins:
            _refuse_what_is_missing(self, target)
            source = self.function
            names = {**self._globals(), "real": scalar}
            for name in _global_names(source.__code__):
                if isinstance(names.get(name), Portable):
                    names[name] = names[name]._twin(target, scalar)
            twin = types.FunctionType(source.__code__, names, source.__name__, source.__defaults__)
            twin.__annotations__ = _annotations(source, target, scalar)
            twin.__module__ = source.__module__
            twin.__qualname__ = f"{source.__qualname__}_{scalar.__name__}"
            self._twins[key] = _compile(twin, target)
        return self._twins[key]


def portable(function) -> Portable:
    """Make a scalar Python function available to Warp (float32, float64) and numba."""
    return Portable(function)


def _compile(twin, target):
    if target == "warp":
        import warp as wp

        return wp.func(twin)
    import numba

    return numba.njit(error_model="numpy")(twin)


def _annotations(source, target, scalar):
    """The source's annotations with the markers replaced by the target's types."""
    import warp as wp

    types_of = {real: scalar}
    if target == "warp":
        types_of.update({Table: wp.array(dtype=scalar, ndim=2), Indices: wp.array(dtype=wp.int32)})
    return {name: types_of.get(mark, mark) for name, mark in source.__annotations__.items()}


def _global_names(code):
    return [i.argval for i in dis.get_instructions(code) if i.opname in ("LOAD_GLOBAL", "LOAD_NAME")]


def _math_names(code):
    """Attributes read from the module `math`, such as "sqrt"."""
    instructions = list(dis.get_instructions(code))
    for module, attribute in zip(instructions, instructions[1:], strict=False):
        if module.opname == "LOAD_GLOBAL" and module.argval == "math":
            yield attribute.argval


def _refuse_what_is_missing(function, target):
    """Raise PortableError, naming the function, the name and the remedy, before a compiler does it less clearly."""
    code = function.function.__code__
    where = f"portable function {function.__module__}.{function.__qualname__}"
    names = function._globals()
    for name in _global_names(code):
        value = names.get(name)
        known = value is math or value is real or isinstance(value, Portable | int | float)
        if name in names and not known:
            raise PortableError(
                f"{where} uses {name!r} ({type(value).__name__}): only numbers, math, real and portable "
                "functions compile for every target; mark it @portable or pass it as an argument"
            )
        if name not in names and name not in _BUILTINS:
            kind = "a builtin that the targets lack" if hasattr(builtins, name) else "not defined"
            raise PortableError(f"{where} uses {name!r}, which is {kind}; builtins that compile: {sorted(_BUILTINS)}")
    for name in _math_names(code):
        if isinstance(getattr(math, name, None), float):
            continue
        if not hasattr(math, name) or (target == "warp" and name not in _warp_math()):
            raise PortableError(
                f"{where} uses math.{name}, which {target} lacks; "
                "write it as a portable function (see fieldsim.potentials.special)"
            )


@functools.cache
def _warp_math():
    """Names of `math` that Warp compiles."""
    import warp as wp

    return frozenset(name for name in dir(math) if callable(getattr(math, name)) and hasattr(wp, name))
