"""Warp kernels that run a portable function over arrays, a point a thread: for GPUs what `lanes_kernel` is for CPUs."""

import functools

from fieldsim.portable.lanes.defining import defined
from fieldsim.portable.lanes.kernels import array_types
from fieldsim.portable.lanes.translator import result_count

# What an input of each sort reads as in an expression, of the kernel's argument `a` and the point's number `i`.
_READ = {"points": "a[i][0], a[i][1], a[i][2]", "reals": "a[i]", "integers": "a[i]"}


@functools.cache
def one_lane_kernel(portable, scalar, inputs: tuple[str, ...], outputs: tuple[tuple[int, ...], ...]):
    """The Warp kernel (start, *inputs, *outputs) of the same arguments as `lanes_kernel`, an item a point.

    `by vector` is not among its inputs: threads have no vectors.
    """
    types = array_types(scalar, inputs, outputs)
    given = [f"in_{k}" for k in range(len(inputs))]
    read = [_READ.get(kind, "a").replace("a", name) for name, kind in zip(given, inputs, strict=True)]
    results = [f"r{k}" for k in range(result_count(portable.checked()))]
    stores = [f"    out_{k}[i] = {_held(f'out_{k}', places)}" for k, places in enumerate(outputs)]
    name = f"one_lane_{portable.__name__}"
    text = "\n".join(
        [
            '@wp.kernel(module="unique", enable_backward=False)',
            f"def {name}(start: int, {', '.join(f'{argument}: type_{argument}' for argument in types)}):",
            "    i = start + wp.tid()",
            f"    {', '.join(results)} = function({', '.join(read)})",
            *stores,
        ]
    )
    held = {f"held_{name}": kind.dtype for name, kind in types.items() if name.startswith("out_")}
    scope = {f"type_{argument}": kind for argument, kind in types.items()}
    return defined(name, text + "\n", {"function": portable.warp(scalar), **scope, **held})


def _held(name, places):
    """An expression: the results that an array holds for a point."""
    values = ", ".join(f"r{place}" for place in places)
    return values if len(places) == 1 else f"held_{name}({values})"
