"""Warp functions and kernels made from text, around C++ over lanes."""

import hashlib
import itertools
import linecache

import warp as wp

# What is fused, and which warnings are worth a word, is no matter of the compiler's flags: all kernels share one
# precompiled header.
PRAGMAS = """#pragma clang fp contract(fast)
#pragma clang diagnostic ignored "-Weverything\""""

_numbers = itertools.count()


def shared_argument(kind: str, name: str) -> str:
    """C++: an argument of Warp's that is no vector, a table or one for each lane, indices or a number, for lanes."""
    if kind == "table":
        return f"lanes::Table{{{name}.data, {_stride(name, 0)}}}"
    if kind == "tables":
        return f"lanes::Tables{{{name}.data, {_stride(name, 1)}, {_stride(name, 2)}}}"
    return f"lanes::Indices{{{name}.data}}" if kind == "indices" else name


def _stride(name, axis):
    return f"(int)({name}.strides[{axis}] / sizeof(lanes::scalar))"


def called(lanes, arguments: list[str]) -> str:
    """C++: `result`, what a function (`source.Lanes`) gives for all lanes of a vector."""
    masked = [*arguments, "lanes::Mask(-1)"] if lanes.masked else arguments
    return f"const auto result = lanes::{lanes.entry}({', '.join(masked)});"


def result_at(lanes, place: int) -> str:
    """C++: one of the results of `called`, a vector."""
    value = "result" if len(lanes.results) == 1 else f"result.r{place}"
    kind = lanes.results[place]
    return value if kind and kind.varying else f"lanes::Real({value})"


def defined(name: str, text: str, scope: dict):
    """What Python source `text` defines under a name, with `wp` and the names of `scope` at hand."""
    # Warp reads a function's source, which it finds as it does that of a file.
    file = f"<{name} {hashlib.sha256(text.encode()).hexdigest()[:12]} {next(_numbers)}>"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    scope = {"wp": wp, "__name__": __name__, **scope}
    exec(compile(text, file, "exec"), scope)
    return scope[name]
