"""Warp kernels that run a portable function in lanes over arrays at bare addresses, for native code to call.

Their one argument is the address of whole numbers, the *words*: how many points there are, the address of the results,
and then what each argument of the function takes, as `WORDS` says. Arrays of what differs from point to point are as
long as whole vectors take (`filled`); results stand one row after another, each so long.
"""

import itertools
import re

from fieldsim.errors import PortableError
from fieldsim.portable.lanes.defining import PRAGMAS, called, defined, result_at
from fieldsim.portable.lanes.source import lanes_of, width_of

# The words of an argument: the address of an array of float64, or of int32, with a number for each point; of a table
# and the length of its rows; of int32 for all points; a whole number itself.
WORDS = {"reals": 1, "integers": 1, "table": 2, "indices": 1, "int": 1}
_VARYING = "reals", "integers"
# Words before those of the arguments.
HEAD = 2
WIDTH = width_of(False)


def filled(count: int) -> int:
    """How many numbers an array for `count` points has: as many as whole vectors."""
    return -(-count // WIDTH) * WIDTH


def places(inputs: tuple[str, ...]) -> list[int]:
    """Where each argument's words begin."""
    return list(itertools.accumulate((WORDS[kind] for kind in inputs[:-1]), initial=HEAD))


def length_of(inputs: tuple[str, ...]) -> int:
    """How many words there are."""
    return HEAD + sum(WORDS[kind] for kind in inputs)


def words_kernel(portable, inputs: tuple[str, ...], outputs: tuple[int, ...]):
    """The Warp kernel (address of words) that evaluates a portable function in float64 at all points.

    inputs: for each argument of the function one of WORDS; outputs: which of its results.
    """
    code = portable.function.__code__
    if len(inputs) != code.co_argcount:
        raise PortableError(f"{portable.__qualname__} has {code.co_argcount} arguments; inputs gives {len(inputs)}")
    shared = tuple(n for n, kind in zip(code.co_varnames, inputs, strict=False) if kind not in _VARYING)
    lanes = lanes_of(portable, False, shared, WIDTH, frozenset(outputs))
    stem = re.sub(r"\W", "", f"words_{lanes.entry}")
    text = f"""
@wp.func_native(body)
def {stem}_points(address: wp.uint64): ...


@wp.kernel(module="unique", enable_backward=False)
def {stem}(address: wp.uint64):
    {stem}_points(address)
"""
    return defined(stem, text, {"body": _body(lanes, inputs, outputs)})


def _body(lanes, inputs, outputs):
    loads, arguments = [], []
    for k, (kind, place) in enumerate(zip(inputs, places(inputs), strict=True)):
        word = f"words[{place}]"
        if kind == "reals":
            loads.append(
                f"lanes::Real in_{k}; __builtin_memcpy(&in_{k}, (lanes::scalar*){word} + first, sizeof in_{k});"
            )
            arguments.append(f"in_{k}")
        elif kind == "integers":
            one = f"in_{k}[lane] = ((int*){word})[first + lane]"
            loads.append(f"lanes::Int in_{k}; for (int lane = 0; lane < {WIDTH}; ++lane) {one};")
            arguments.append(f"in_{k}")
        elif kind == "table":
            arguments.append(f"lanes::Table{{(lanes::scalar*){word}, (int)words[{place + 1}]}}")
        elif kind == "indices":
            arguments.append(f"lanes::Indices{{(int*){word}}}")
        else:
            arguments.append(f"(int){word}")
    stores = [
        f"{{ const lanes::Real out = {result_at(lanes, result)}; __builtin_memcpy(results + {row} * length + first, "
        "&out, sizeof out); }"
        for row, result in enumerate(outputs)
    ]
    return "\n".join(
        [
            PRAGMAS,
            lanes.code,
            "const long long* words = (const long long*)address;",
            f"const long long length = (words[0] + {WIDTH - 1}) / {WIDTH} * {WIDTH};",
            "lanes::scalar* results = (lanes::scalar*)words[1];",
            f"for (long long first = 0; first < length; first += {WIDTH}) {{",
            *loads,
            called(lanes, arguments),
            *stores,
            "}",
        ]
    )
