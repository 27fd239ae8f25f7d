"""Portable functions of reals, in lanes over arrays; each is compiled once, when first asked."""

import numpy as np
import warp as wp

from fieldsim import launch
from fieldsim.portable.lanes.kernels import items_of, lanes_kernel
from fieldsim.portable.lanes.translator import result_count


def on_lanes(function, scalar, *arguments):
    """The results of a function, an array (N,) each, at arguments (N,) of reals or whole numbers."""
    count = result_count(function)
    marks = [function.function.__annotations__[n] for n in function.function.__code__.co_varnames[: len(arguments)]]
    inputs = tuple("integers" if mark is int else "reals" for mark in marks)
    kernel = lanes_kernel(function, scalar, inputs, tuple((k,) for k in range(count)))
    arrays = [
        wp.array(np.asarray(a), dtype=wp.int32 if kind == "integers" else scalar, device="cpu")
        for a, kind in zip(arguments, inputs, strict=True)
    ]
    outputs = [wp.full(len(arrays[0]), np.nan, dtype=scalar, device="cpu") for _ in range(count)]
    launch.launch(kernel, items_of(len(arrays[0]), scalar), arrays, outputs, device="cpu")
    return [out.numpy() for out in outputs]
