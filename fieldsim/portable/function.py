"""Field mathematics written once, compiled for Warp float32, Warp float64, numba and lanes.

A portable function is a plain scalar Python function under `@portable`. In its annotations `real` stands for the scalar
type, `Table` for a two-dimensional array of reals and `Indices` for a one-dimensional array of int32. In its body:

- literals are `real(0.5)`; a constant that float32 cannot hold exactly is a module constant, `THIRD = 1 / 3`, used as
  `real(THIRD)` (Warp rounds the value of an expression such as `real(1.0 / 3.0)` through float32);
- mathematics is spelled `math.sqrt`; what a target lacks (log1p, elliptic integrals, ...) is a portable function of
  `fieldsim.numerics`;
- it may call other portable functions, also of other modules;
- it may use names declared with `hole`, which `bind` fills: `kernel = hole("r2, width, fold")`, `COUNT = hole()`.

Whatever else a target lacks, or takes differently, is refused with a PortableError (see `rules`).

`f.warp(wp.float64)` is a Warp function, `f.numba` a numba one, `f.lanes(wp.float64)` C++ over vectors, and `f(...)`
runs as plain Python.
"""

import dis
import functools
import threading
import types
from typing import TYPE_CHECKING, Any

from fieldsim.copies import ThreadLock
from fieldsim.errors import PortableError
from fieldsim.portable import rules
from fieldsim.portable.holes import Hole
from fieldsim.portable.marks import MARKS, Indices, Table, real

if TYPE_CHECKING:
    from fieldsim.portable.lanes import Lanes

# One thread makes twins at a time: neither what is half made nor Warp's and numba's tables are for others.
_compiling = ThreadLock()


class Portable:
    """A scalar function and its compiled twins. Made by `portable`; see the module's text."""

    __qualname__: str

    def __init__(self, function, bindings=None):
        self.function = function
        self.bindings = dict(bindings or {})
        self._twins: dict[tuple, Any] = {}
        self._maker = None
        self._is_checked = False
        functools.update_wrapper(self, function)

    def __call__(self, *args):
        """Run as plain Python in float64 (slow; for tests and small work on the host)."""
        return self._python(*args)

    def bind(self, **names: Any) -> "Portable":
        """The same function with the given global names (portable functions or numbers) bound to other values.

        Raises PortableError for a name that the function does not use, or a value that does not fit its hole.
        """
        for name, value in names.items():
            if name not in _global_names(self.function.__code__):
                raise PortableError(f"{self.__qualname__} uses no global name {name!r}, so it cannot be bound")
            declared = self.function.__globals__.get(name)
            if isinstance(declared, Hole):
                declared.check(name, value, f"{self.__module__}.{self.__qualname__}")
        return Portable(self.function, {**self.bindings, **names})

    def warp(self, scalar):
        """The Warp function in `scalar` (wp.float32 or wp.float64), compiled once."""
        return self._twin("warp", scalar)

    @property
    def numba(self):
        """The numba function in float64, compiled once."""
        return self._twin("numba", float)

    @property
    def native(self):
        """The numba function in float64 for object code (see `fieldsim.native`): Python cannot call it."""
        return self._twin("native", float)

    def lanes(self, scalar, *, uniform: tuple[str, ...] | None = None, width: int | None = None) -> "Lanes":
        """The function in C++ for vectors of `scalar` (wp.float32 or wp.float64), with all that it calls.

        uniform: names of arguments that are the same in all lanes; default all that are not real. width: how many
        lanes; default 8, in float32 16.
        """
        from fieldsim.portable.lanes import lanes_of

        return lanes_of(self, scalar.__name__ == "float32", uniform, width)

    def checked(self) -> "Portable":
        """Itself; raises PortableError where it breaks a rule."""
        if not self._is_checked:
            rules.check(self.function, self._globals(), lambda value: isinstance(value, Portable), MARKS)
            self._is_checked = True
        return self

    @functools.cached_property
    def key(self) -> tuple:
        """What tells the function with its bindings from others; equal for two that mean the same."""
        bound = [
            (name, value.key if isinstance(value, Portable) else (type(value), value))
            for name, value in sorted(self.bindings.items())
        ]
        return self.function, tuple(bound)

    @functools.cached_property
    def _python(self):
        return types.FunctionType(self.function.__code__, self._globals(), self.function.__name__)

    def _globals(self):
        """The function's global names with those bound; raises PortableError for a hole that is not filled."""
        names = {**self.function.__globals__, **self.bindings}
        for name in _global_names(self.function.__code__):
            if isinstance(names.get(name), Hole):
                raise PortableError(
                    f"portable function {self.__module__}.{self.__qualname__} has {name!r}, a {names[name]}, not "
                    f"filled; use bind({name}=...)"
                )
        return names

    def _twin(self, target, scalar):
        key = target, scalar
        if key not in self._twins:
            with _compiling:
                if key not in self._twins:
                    self._twins[key] = self._made(target, scalar)
        return self._twins[key]

    def _made(self, target, scalar):
        me = threading.get_ident()
        if self._maker == me:
            raise PortableError(f"portable function {self.__module__}.{self.__qualname__} calls itself; write a loop")
        self._maker = me
        try:
            return _compile(self._source(target, scalar), target)
        finally:
            self._maker = None

    def _source(self, target, scalar):
        """The function with the target's scalar and the target's twins of the functions it calls."""
        source = self.function
        names = self._globals()
        self.checked()
        names["real"] = scalar
        for name in _global_names(source.__code__):
            if isinstance(names.get(name), Portable):
                names[name] = names[name]._twin(target, scalar)
        twin = types.FunctionType(source.__code__, names, source.__name__)
        twin.__annotations__ = _annotations(source, target, scalar)
        twin.__module__ = source.__module__
        twin.__qualname__ = f"{source.__qualname__}_{scalar.__name__}"
        return twin


def portable(function) -> Portable:
    """Make a scalar Python function available to Warp (float32, float64) and numba."""
    return Portable(function)


def _compile(twin, target):
    if target == "warp":
        import warp as wp

        return wp.func(twin)
    import numba

    # Inlined, so that LLVM drops what a caller leaves unused (a Hessian, a gradient). Portable functions own no memory,
    # and without numba's counting of references to the tables passed down they run twice as fast.
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True} if target == "native" else {}
    return numba.njit(error_model="numpy", forceinline=True, _nrt=False, **options)(twin)


def _annotations(source, target, scalar):
    """The source's annotations with the markers replaced by the target's types."""
    import warp as wp

    types_of: dict[Any, Any] = {real: scalar}
    if target == "warp":
        types_of.update({Table: wp.array(dtype=scalar, ndim=2), Indices: wp.array(dtype=wp.int32)})
    return {name: types_of.get(mark, mark) for name, mark in source.__annotations__.items()}


@functools.cache
def _global_names(code):
    """The global names that a function's code reads, each once, in order; kept, because `bind` asks often."""
    read = [i.argval for i in dis.get_instructions(code) if i.opname in ("LOAD_GLOBAL", "LOAD_NAME")]
    return tuple(dict.fromkeys(read))
