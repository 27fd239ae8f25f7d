"""Portable functions in lanes as C functions over arrays at addresses: as Python has them, compiled once for all."""

import ctypes
import os
import subprocess
import sys

import numpy as np
import pytest

from fieldsim.errors import PortableError
from fieldsim.native import known, lanes_function_at, loader
from fieldsim.native.lanes import ONE_ITEM
from fieldsim.portable import Indices, Table, portable, real
from fieldsim.portable.lanes.words import WIDTH, filled, words_kernel

INPUTS = "integers", "reals", "table", "indices", "int"


@portable
def mixed(k: int, x: real, table: Table, indices: Indices, shift: int):
    """Of all kinds of arguments: what lanes gather, and what they share."""
    if x > real(1.0):
        return x * table[k, 1], real(indices[k]), x
    return table[k, 0] - x, real(indices[k] + shift), real(0.0)


def called(function, count, arrays, out):
    """Call a C function with words."""
    words = np.array([count, out.ctypes.data, *arrays], dtype=np.int64)
    place = np.array([words.ctypes.data])
    one = int(loader._TABLE[ONE_ITEM])
    ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(function.address)(one, place.ctypes.data)


@pytest.mark.parametrize("count", [1, WIDTH - 1, WIDTH, 3 * WIDTH + 2])
def test_a_function_over_arrays_gives_what_python_gives(count):
    rng = np.random.default_rng(count)
    k = rng.integers(0, 4, filled(count)).astype(np.int32)
    x, table, indices = rng.uniform(0.0, 2.0, filled(count)), rng.normal(size=(4, 2)), np.arange(4, dtype=np.int32)
    out = np.full((2, filled(count) + 1), np.nan)
    function = lanes_function_at("mixed", mixed, INPUTS, (1, 0))
    given = k.ctypes.data, x.ctypes.data, table.ctypes.data, table.shape[1], indices.ctypes.data, 7
    flat = out.ravel()
    called(function, count, given, flat)
    found = flat[: 2 * filled(count)].reshape(2, -1)[:, :count]
    wanted = [mixed(int(k[i]), float(x[i]), table, indices, 7) for i in range(count)]
    np.testing.assert_allclose(found, np.array([[b, a] for a, b, _ in wanted]).T, rtol=1e-15)
    assert np.isnan(flat[2 * filled(count) :]).all(), "nothing is written beyond the last vector"


def test_a_second_process_only_loads_it(tmp_path):
    """In another folder of kernels."""
    script = tmp_path / "script.py"
    script.write_text(
        "from fieldsim.native import functions, lanes_function_at\n"
        "from fieldsim.portable import portable, real\n\n\n"
        "@portable\ndef doubled(x: real):\n    return x + x\n\n\n"
        'print(lanes_function_at("doubled", doubled, ("reals",), (0,)).address != 0, functions.compiled)\n'
    )
    environment = os.environ | {"WARP_CACHE_PATH": str(tmp_path / "kernels")}
    said = [
        subprocess.run([sys.executable, script], env=environment, capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert [done.stdout.split(maxsplit=1)[1].strip() for done in said] == ["['doubled']", "[]"]
    assert not said[0].stderr, "Warp's word on code for this processor alone is spared"


def test_inputs_that_do_not_fit_are_refused():
    with pytest.raises(PortableError, match=r"mixed has 5 arguments; inputs gives 1"):
        words_kernel(mixed, ("reals",), (0,))


def test_the_place_of_one_item_is_known_to_native_code():
    assert known is loader.known
    assert ctypes.c_int64.from_address(int(loader._TABLE[ONE_ITEM])).value == 1
