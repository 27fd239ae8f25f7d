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


def defined(name: str, text: str, scope: dict):
    """What Python source `text` defines under a name, with `wp` and the names of `scope` at hand."""
    # Warp reads a function's source, which it finds as it does that of a file.
    file = f"<{name} {hashlib.sha256(text.encode()).hexdigest()[:12]} {next(_numbers)}>"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    scope = {"wp": wp, "__name__": __name__, **scope}
    exec(compile(text, file, "exec"), scope)
    return scope[name]
