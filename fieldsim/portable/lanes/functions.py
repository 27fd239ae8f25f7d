"""Warp functions for CPUs that run a portable function in lanes, for one group of points.

    pull = group_function(field_sum, wp.float64, ("rows 3", "table", "indices", "int", "int"), (1, 2, 3), width)

is a Warp function (points (3, width), rows, kinds, first, count) -> (3, width): one column for each point.
"""

import functools
import hashlib

import warp as wp

from fieldsim.errors import PortableError
from fieldsim.portable.lanes.defining import PRAGMAS, called, defined, result_at, shared_argument
from fieldsim.portable.lanes.kernels import INPUTS
from fieldsim.portable.lanes.source import lanes_of
from fieldsim.portable.lanes.translator import result_count

# A table for each point, (width, rows, columns); on CPUs the points' numbers lie side by side in memory.
TABLES = "tables"


def _rows_of(kind):
    """How many rows a matrix of an input has; 0 for what is no matrix."""
    return int(kind.split()[1]) if kind.startswith("rows") else 0


def _type_of(kind, scalar, width):
    if _rows_of(kind):
        return wp.types.matrix((_rows_of(kind), width), scalar)
    return wp.array(dtype=scalar, ndim=3) if kind == TABLES else INPUTS[kind][0](scalar)


def _types_of(inputs, scalar, width):
    return {f"type_{k}": _type_of(kind, scalar, width) for k, kind in enumerate(inputs)}


def _shared(portable, inputs):
    """The names of a function's arguments that are the same for all points: all but matrices and tables of each."""
    code = portable.function.__code__
    varying = [bool(_rows_of(kind)) or kind == TABLES for kind in inputs for _ in range(_rows_of(kind) or 1)]
    if len(varying) != code.co_argcount:
        raise PortableError(f"{portable.__qualname__} has {code.co_argcount} arguments; inputs gives {len(varying)}")
    return tuple(name for name, varies in zip(code.co_varnames, varying, strict=False) if not varies)


@functools.cache
def lanes_function(portable, scalar, inputs: tuple[str, ...], outputs: tuple[int, ...], width: int):
    """The Warp function (*inputs) of a group of points that returns results, a matrix (outputs, width), row by row.

    inputs: "rows N" for a matrix (N, width), which stands for N reals of the function, TABLES for a table of each
    point, else one of `kernels.INPUTS` that is the same for all points. outputs: which results of the portable
    function. width: points of a group; two vectors' worth keep a processor busy where one would wait for itself.
    """
    single, shared = scalar is wp.float32, _shared(portable, inputs)
    lanes, types = lanes_of(portable, single, shared, width, frozenset(outputs)), _types_of(inputs, scalar, width)
    held = wp.types.matrix((len(outputs), width), scalar)
    body = _body(lanes, inputs, outputs, held)
    name = f"lanes_{lanes.entry}_{hashlib.sha256(body.encode()).hexdigest()[:12]}"
    listed = ", ".join(f"in_{k}: type_{k}" for k in range(len(inputs)))
    text = f"@wp.func_native(body)\ndef {name}({listed}) -> held: ...\n"
    return defined(name, text, {"body": body, "held": held, **types})


def _body(lanes, inputs, outputs, held):
    """The C++ of the function."""
    loads, arguments = [], []
    for k, kind in enumerate(inputs):
        if rows := _rows_of(kind):
            for row in range(rows):
                name = f"in_{k}_{row}"
                loads.append(f"lanes::Real {name}; __builtin_memcpy(&{name}, in_{k}.data[{row}], sizeof {name});")
                arguments.append(name)
        else:
            arguments.append(shared_argument(kind, f"in_{k}"))
    stores = []
    for row, place in enumerate(outputs):
        stores.append(f"const lanes::Real out_{row} = {result_at(lanes, place)};")
        stores.append(f"__builtin_memcpy(held.data[{row}], &out_{row}, sizeof out_{row});")
    rows, width = held._shape_
    return "\n".join(
        [
            PRAGMAS,
            lanes.code,
            *loads,
            called(lanes, arguments),
            f"wp::mat_t<{rows}, {width}, lanes::scalar> held;",
            *stores,
            "return held;",
        ]
    )


@functools.cache
def group_function(portable, scalar, inputs: tuple[str, ...], outputs: tuple[int, ...], width: int, lanes=None):
    """`lanes_function` for groups of `width` points, `lanes` at a time: all of them (default), or one after the other.

    The latter is for GPUs, which run the function's Warp twin.
    """
    if width > 1 and lanes != 1:
        return lanes_function(portable, scalar, inputs, outputs, width)
    _shared(portable, inputs)  # which refuses what does not fit
    twin = portable.warp(scalar)
    types = _types_of(inputs, scalar, width)
    held = wp.types.matrix((len(outputs), width), scalar)
    given = ", ".join(_of_one(kind, f"in_{k}") for k, kind in enumerate(inputs))
    results = result_count(portable)
    listed = ", ".join(f"in_{k}: type_{k}" for k in range(len(inputs)))
    kept = "".join(f"        held[{row}, lane] = r_{place}\n" for row, place in enumerate(outputs))
    # A constant count, of which Warp would write the loop out, is wanted for one point alone.
    count = "1" if width == 1 else f"wp.int32({width})"
    text = (
        f"@wp.func\ndef one_lane({listed}):\n"
        f"    held = held_type()\n"
        f"    for lane in range({count}):\n"
        f"        {', '.join(f'r_{k}' for k in range(results))} = twin({given})\n"
        f"{kept}    return held\n"
    )
    return defined("one_lane", text, {"twin": twin, "held_type": held, **types})


def _of_one(kind, name):
    """An input's part that belongs to one lane, as arguments."""
    if rows := _rows_of(kind):
        return ", ".join(f"{name}[{row}, lane]" for row in range(rows))
    return f"{name}[lane]" if kind == TABLES else name
