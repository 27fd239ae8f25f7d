"""Warp kernels for CPUs that run a portable function in lanes, over arrays.

    kernel = lanes_kernel(squared_and_sum, wp.float64, inputs=("reals", "reals"), outputs=((0,), (1,)))
    launch.launch(kernel, items_of(count, wp.float64), [x, y], [square, total], device="cpu")

An item of a launch is a group of points. Every point takes the same steps wherever in an array it stands, so that
results do not depend on how a launch is cut; what the last vector lacks is filled up with its last point.
On CUDA a point is a thread: there `one_lane_kernel` runs the function's Warp twin, one lane of the same source.
"""

import functools
import pathlib
import re

import warp as wp

from fieldsim.errors import PortableError
from fieldsim.portable.lanes.defining import PRAGMAS, called, defined, result_at, shared_argument
from fieldsim.portable.lanes.source import lanes_of, width_of

# Vectors that an item of a launch works through.
VECTORS = 8
# What an argument of a kernel may be: its type in Warp, and the types of the function's arguments that it stands for.
INPUTS = {
    "points": (lambda scalar: wp.array(dtype=wp.types.vector(3, scalar)), ("real",) * 3),
    "reals": (lambda scalar: wp.array(dtype=scalar), ("real",)),
    "integers": (lambda scalar: wp.array(dtype=wp.int32), ("int",)),
    "by vector": (lambda scalar: wp.array(dtype=wp.int32), ("int",)),
    "table": (lambda scalar: wp.array(dtype=scalar, ndim=2), ("table",)),
    "indices": (lambda scalar: wp.array(dtype=wp.int32), ("indices",)),
    "real": (lambda scalar: scalar, ("real",)),
    "int": (lambda scalar: wp.int32, ("int",)),
}
_VARYING = ("points", "reals", "integers")


def items_of(count: int, scalar) -> int:
    """How many items of a launch `count` points are."""
    return -(-count // (VECTORS * width_of(scalar is wp.float32)))


@functools.cache
def lanes_kernel(portable, scalar, inputs: tuple[str, ...], outputs: tuple[tuple[int, ...], ...]):
    """The Warp kernel (start, *inputs, *outputs) that evaluates a portable function at all points of its arrays.

    inputs: for each argument of the kernel one of INPUTS. `points` (N,) of vectors stand for three reals of the
    function, `reals` and `integers` (N,) for one number; `by vector` for an integer that the `width_of` points of a
    vector share; all others are the same for all points.
    outputs: for each array the results that it holds: one number, three (vectors), nine (matrices), each (N,).
    """
    wanted = frozenset(place for places in outputs for place in places)
    lanes = lanes_of(portable, scalar is wp.float32, _uniform(portable, inputs), wanted=wanted)
    types = array_types(scalar, inputs, outputs)
    listed = ", ".join(f"{name}: type_{name}" for name in types)
    stem = re.sub(r"\W", "", f"lanes_{lanes.entry}")
    text = f"""
@wp.func_native(body)
def {stem}_items(item: int, {listed}): ...


@wp.kernel(module="unique", enable_backward=False)
def {stem}(start: int, {listed}):
    {stem}_items(start + wp.tid(), {", ".join(types)})
"""
    scope = {f"type_{name}": kind for name, kind in types.items()}
    return defined(stem, text, {"body": _body(lanes, inputs, outputs), **scope})


def array_types(scalar, inputs: tuple[str, ...], outputs: tuple[tuple[int, ...], ...]) -> dict:
    """Warp's types of a kernel's arguments by their names, in_0, in_1, ... and out_0, ... (see `lanes_kernel`)."""
    types = {f"in_{k}": INPUTS[kind][0](scalar) for k, kind in enumerate(inputs)}
    types.update({f"out_{k}": wp.array(dtype=_held(scalar, len(places))) for k, places in enumerate(outputs)})
    return types


def _held(scalar, count):
    try:
        return {1: scalar, 3: wp.types.vector(3, scalar), 9: wp.types.matrix((3, 3), scalar)}[count]
    except KeyError:
        raise PortableError(f"an output of a kernel holds 1, 3 or 9 results, not {count}") from None


def _uniform(portable, inputs):
    """The names of a function's arguments that are the same for all points."""
    code = portable.function.__code__
    kinds = [kind for kind in inputs for _ in INPUTS[kind][1]]
    if len(kinds) != code.co_argcount:
        raise PortableError(f"{portable.__qualname__} has {code.co_argcount} arguments; inputs gives {len(kinds)}")
    return tuple(n for n, kind in zip(code.co_varnames, kinds, strict=False) if kind not in _VARYING)


def _body(lanes, inputs, outputs):
    """The C++ that works through an item."""
    loads, arguments = [], []
    for k, kind in enumerate(inputs):
        name = f"in_{k}"
        if kind == "points":
            parts = [f"{name}_{axis}" for axis in "xyz"]
            loads.append(f"lanes::Real {', '.join(parts)};\nmoves::load({name}, first, count, {', '.join(parts)});")
            arguments += parts
        elif kind in ("reals", "integers"):
            loads.append(f"const auto {name}_v = moves::load({name}, first, count);")
            arguments.append(f"{name}_v")
        elif kind == "by vector":
            arguments.append(f"{name}.data[first / {lanes.width}]")
        else:
            arguments.append(shared_argument(kind, name))
    stores = [_store(lanes, f"out_{k}", places) for k, places in enumerate(outputs)]
    length = f"in_{next(k for k, kind in enumerate(inputs) if kind in _VARYING)}.shape[0]"
    return "\n".join(
        [
            PRAGMAS,
            lanes.code,
            _moves(lanes.width),
            f"for (int vector = 0; vector < {VECTORS}; ++vector) {{",
            f"const int first = (item * {VECTORS} + vector) * {lanes.width};",
            f"if (first >= {length}) return;",
            f"const int left = {length} - first, count = left < {lanes.width} ? left : {lanes.width};",
            *loads,
            called(lanes, arguments),
            *stores,
            "}",
        ]
    )


def _store(lanes, name, places):
    """Results, written to an array."""
    values = [result_at(lanes, place) for place in places]
    if len(places) == 9:
        return f"{{ const lanes::Real parts[] = {{{', '.join(values)}}}; moves::store({name}, first, count, parts); }}"
    return f"moves::store({name}, first, count, {', '.join(values)});"


@functools.cache
def _moves(width):
    """C++ that moves vectors between lanes and arrays."""
    text = (pathlib.Path(__file__).parent / "moves.h").read_text()
    text = "\n".join(line for line in text.splitlines() if not line.startswith("//"))
    return text.replace("UNZIPPED", _unzipped(width)).replace("ZIPPED", _zipped(width)).replace("WIDTH", str(width))


def _unzipped(width):
    """C++: x, y and z of points from three vectors a, b and c that hold them one after another."""
    lines = []
    for part, name in enumerate("xyz"):
        wanted = [3 * k + part for k in range(width)]
        low = [w if w < 2 * width else -1 for w in wanted]
        both = [k if w < 2 * width else width + w - 2 * width for k, w in enumerate(wanted)]
        lines.append(f"{name} = {_shuffle(_shuffle('a', 'b', low), 'c', both)};")
    return "\n    ".join(lines)


def _zipped(width):
    """C++: three vectors a, b and c that hold points one after another, from x, y and z."""
    lines = []
    for part, name in enumerate("abc"):
        wanted = [divmod(part * width + k, 3) for k in range(width)]
        low = [point + width * axis if axis < 2 else -1 for point, axis in wanted]
        both = [k if axis < 2 else width + point for k, (point, axis) in enumerate(wanted)]
        lines.append(f"const Real {name} = {_shuffle(_shuffle('x', 'y', low), 'z', both)};")
    return "\n    ".join(lines)


def _shuffle(first, second, places):
    return f"__builtin_shufflevector({first}, {second}, {', '.join(map(str, places))})"
