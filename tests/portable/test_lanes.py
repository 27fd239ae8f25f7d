"""Portable functions in lanes: the same numbers as Python, numba and Warp give, from readable C++, over any array."""

import ctypes
import importlib.util
import math
import mmap
import os
import subprocess
import sys

import numpy as np
import portable_fuzz
import pytest
import warp as wp
from lanes_on_arrays import on_lanes
from test_portable import PORTABLES, REFUSED, X

import fieldsim as fs
from fieldsim import launch
from fieldsim.errors import PortableError
from fieldsim.portable import Indices, Table, hole, portable, real
from fieldsim.portable.lanes.kernels import items_of, lanes_kernel
from fieldsim.potentials import registry

FUNCTIONS = {name: f for name, f in PORTABLES.items() if name.isidentifier()}
PRECISIONS = pytest.mark.parametrize("scalar", [wp.float64, wp.float32], ids=["double", "single"])
COUNT = 75


literals, constants, loops, early, tuples, elsewhere, bound, many = (hole("x") for _ in range(8))


@portable
def all_of(x: real):
    return literals(x), constants(x), loops(x), early(x), tuples(x), elsewhere(x), bound(x), many(x)


@PRECISIONS
def test_lanes_agree_with_python(scalar):
    given = X.astype(np.float32).astype(float) if scalar is wp.float32 else X
    tolerance = {"rtol": 2e-15, "atol": 2e-15} if scalar is wp.float64 else {"rtol": 1e-6, "atol": 1e-6}
    results = on_lanes(all_of.bind(**FUNCTIONS), scalar, given)
    for got, function in zip(results, FUNCTIONS.values(), strict=True):
        np.testing.assert_allclose(got, [function(x) for x in given], **tolerance)


@portable
def ordered(x: real, y: real):
    """What depends on NaN, infinities, ties and signs of zeros."""
    flags = real(0.0)
    if x < y:
        flags += real(1.0)
    if x <= y or x != x:
        flags += real(2.0)
    if not x >= y:
        flags += real(4.0)
    same = x == y and not y != x
    if same:
        flags += real(8.0)
    if real(-1.0) < x < y:
        flags += real(16.0)
    return flags + min(x, y), max(x, y), math.copysign(real(1.0), min(x, y)), math.copysign(real(1.0), max(x, y))


def test_nan_infinity_and_ties_are_those_of_warp():
    values = np.array([0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan, 5e-324, 2.5])
    x, y = (a.ravel() for a in np.meshgrid(values, values))

    scalar_code = ordered.warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def kernel(
        start: int,
        x: wp.array(dtype=wp.float64),
        y: wp.array(dtype=wp.float64),
        out: wp.array(dtype=wp.float64, ndim=2),
    ):
        i = start + wp.tid()
        a, b, c, d = scalar_code(x[i], y[i])
        out[0, i] = a
        out[1, i] = b
        out[2, i] = c
        out[3, i] = d

    out = wp.full((4, len(x)), math.nan, dtype=wp.float64, device="cpu")
    launch.launch(kernel, len(x), [wp.array(a, dtype=wp.float64, device="cpu") for a in (x, y)], [out], device="cpu")
    np.testing.assert_array_equal(on_lanes(ordered, wp.float64, x, y), out.numpy())


def fuzz_module(seeds, folder):
    """A module of random functions, imported from a file."""
    path = folder / f"fuzz_{seeds[0]}.py"
    path.write_text(portable_fuzz.module(seeds))
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def check_random_functions(seeds, scalar, folder, compile_numba=False):
    module = fuzz_module(seeds, folder)
    rng = np.random.default_rng(seeds[0])
    rows, kinds = rng.integers(-8, 9, (4, 4)) / 4.0, rng.integers(0, 4, 4).astype(np.int32)
    x, y = rng.integers(-6, 7, (2, COUNT)) / 2.0
    n, m = rng.integers(0, 4, (2, COUNT)).astype(np.int32)
    inputs = ("reals", "reals", "integers", "integers", "table", "indices")
    kernel = lanes_kernel(module.all_of, scalar, inputs, tuple((k,) for k in range(len(seeds))))
    out = [wp.full(COUNT, math.nan, dtype=scalar, device="cpu") for _ in seeds]
    given = [
        wp.array(a, dtype=scalar if a.dtype == float else wp.int32, device="cpu") for a in (x, y, n, m, rows, kinds)
    ]
    launch.launch(kernel, items_of(COUNT, scalar), given, out, device="cpu")
    for seed, got in zip(seeds, out, strict=True):
        function = getattr(module, f"g{seed}")
        twins = [function, function.numba] if compile_numba else [function]
        for twin in twins:
            places = zip(x.tolist(), y.tolist(), n.tolist(), m.tolist(), strict=True)
            expected = [twin(*place, rows, kinds) for place in places]
            np.testing.assert_array_equal(got.numpy(), expected, err_msg=f"seed {seed}")


def test_random_functions_give_what_python_and_numba_give(tmp_path):
    check_random_functions(range(100, 112), wp.float64, tmp_path)
    check_random_functions(range(4), wp.float64, tmp_path, compile_numba=True)


def test_random_functions_in_single_precision(tmp_path):
    check_random_functions(range(50, 56), wp.float32, tmp_path)


@pytest.mark.full
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("first", range(1000, 1480, 12))
@PRECISIONS
def test_many_random_functions(first, scalar, tmp_path):
    check_random_functions(range(first, first + 12), scalar, tmp_path)


def divides(n: int):
    return n / 2


def mixes(x: real, n: int):
    return x + n


def changes(x: real):
    n = int(0)  # noqa: UP018, RUF046 - a variable to Warp
    n = x
    return n


def disagrees(x: real):
    if x > real(0.0):
        return x
    return 3


def writes(x: real, rows: Table):
    rows[0, 0] = x
    return x


def deep(x: real, rows: Table):
    return rows[0]


def otherwise(x: real):
    for k in range(3):
        if x > real(k):
            break
    else:
        x = real(1.0)
    return x


def unset(x: real):
    if x < later:  # noqa: F821
        later = x  # noqa: F841
    return x


def unbalanced(x: real):
    a, b = x, x, x
    return a + b


def no_number(x: real):
    return x and x


def strides(x: real, n: int):
    for _k in range(0, 10, n):
        x += real(1.0)
    return x


LACKING = [
    (divides, r"divides integers in 'n / 2': write real\(a\) / real\(b\)"),
    (mixes, "mixes int and real in 'x . n': convert"),
    (changes, "assigns real to 'n', which is int"),
    (disagrees, r"line \d+, returns int where it returns real elsewhere"),
    (writes, r"assigns to 'rows\[0, 0\]': only names can be assigned"),
    (deep, "give a Table two indices"),
    (otherwise, "loop with else"),
    (unset, "reads 'later' before it is assigned"),
    (unbalanced, "assigns 3 values to 2 names"),
    (no_number, "'x', which is real, as bool"),
    (strides, "steps by 'n': give a whole number, not 0"),
]


@pytest.mark.parametrize(("function", "message"), [*REFUSED, *LACKING], ids=lambda v: getattr(v, "__name__", ""))
def test_what_lanes_lack_is_refused(function, message):
    with pytest.raises(PortableError, match=message):
        portable(function).lanes(wp.float64)


def test_arguments_that_are_not_there_cannot_be_uniform():
    with pytest.raises(PortableError, match="has no argument 'z'; its arguments are"):
        ordered.lanes(wp.float64, uniform=("z",))


def test_the_source_is_readable():
    lanes = registry.field_sum(_elements().kinds_used).lanes(wp.float64)
    assert "// fieldsim/potentials/formulas/segment/frame.py, line " in lanes.source
    # Each function once for the way in which it is called, with the names that it has in Python.
    for name in ("segment_jet", "beside_line", "axial_hessian"):
        assert lanes.source.count(f" {name}(Real ") == 1
    # What all lanes share stays a number.
    assert "scalar length = rows(i, 2);" in lanes.source
    assert "for (int i = first;" in lanes.source
    assert "//" not in lanes.code


def _elements():
    return fs.Field(fs.Segment((0, 0, 0), (1, 0, 0)), fs.Newtonian(0.1)).elements


def field_kernel(elements, scalar):
    inputs = ("points", "table", "indices", "int", "int")
    return lanes_kernel(registry.field_sum(elements.kinds_used), scalar, inputs, ((0,), (1, 2, 3)))


def field_at(points, value, gradient, threads=None, grain=1):
    elements = _elements()
    tables = [wp.array(elements.rows, dtype=wp.float64, device="cpu"), wp.array(elements.kinds, device="cpu"), 0, 1]
    kernel = field_kernel(elements, wp.float64)
    items = items_of(len(points), wp.float64)
    launch.launch(kernel, items, [points, *tables], [value, gradient], device="cpu", threads=threads, grain=grain)
    return np.column_stack([value.numpy(), gradient.numpy()])


def results(points, **options):
    count = len(points)
    arrays = wp.full(count, math.nan, dtype=wp.float64, device="cpu"), wp.empty(count, dtype=wp.vec3d, device="cpu")
    return field_at(wp.array(points, dtype=wp.vec3d, device="cpu"), *arrays, **options)


def test_a_point_has_the_same_value_among_any_others():
    """To the last bit: alone, at any place of a vector, and however a launch is cut over threads."""
    points = np.random.default_rng(2).normal(size=(1003, 3))
    points[::7] *= 1e-3
    all_at_once = results(points, threads=1)
    np.testing.assert_array_equal(results(points, threads=3), all_at_once)
    for start, stop in ((5, 6), (3, 20), (64, 129), (1002, 1003)):
        np.testing.assert_array_equal(results(points[start:stop]), all_at_once[start:stop])


@pytest.mark.skipif(sys.platform != "linux", reason="pages are protected otherwise elsewhere")
@pytest.mark.parametrize("count", [1, 7, 8, 13])
def test_nothing_beyond_the_arrays_is_read_or_written(count):
    """The arrays end where memory ends."""
    libc = ctypes.CDLL(None, use_errno=True)
    page, kept = mmap.PAGESIZE, []

    def at_the_end(dtype):
        memory = mmap.mmap(-1, 2 * page)
        kept.append(memory)
        address = ctypes.addressof(ctypes.c_char.from_buffer(memory))
        assert libc.mprotect(ctypes.c_void_p(address + page), page, 0) == 0
        size = count * wp.types.type_size_in_bytes(dtype)
        return wp.array(ptr=address + page - size, shape=count, dtype=dtype, device="cpu")

    points, value, gradient = at_the_end(wp.vec3d), at_the_end(wp.float64), at_the_end(wp.vec3d)
    places = np.random.default_rng(3).normal(size=(count, 3))
    points.assign(places)
    np.testing.assert_array_equal(field_at(points, value, gradient), results(places))
    for memory in kept:
        address = ctypes.addressof(ctypes.c_char.from_buffer(memory))
        assert libc.mprotect(ctypes.c_void_p(address), 2 * page, mmap.PROT_READ | mmap.PROT_WRITE) == 0


def test_arrays_with_gaps():
    """Every other element of larger arrays; what lies between stays."""
    places = np.random.default_rng(4).normal(size=(21, 3))
    points = wp.array(np.repeat(places, 2, axis=0), dtype=wp.vec3d, device="cpu")[::2]
    value = wp.full(42, -7.0, dtype=wp.float64, device="cpu")
    gradient = wp.full(42, wp.vec3d(-7.0), dtype=wp.vec3d, device="cpu")
    np.testing.assert_array_equal(field_at(points, value[::2], gradient[::2]), results(places))
    assert (value.numpy()[1::2] == -7.0).all()
    assert (gradient.numpy()[1::2] == -7.0).all()


SCRIPT = """
import sys
import fieldsim as fs, warp as wp
from fieldsim.portable.lanes.kernels import lanes_kernel
from fieldsim.potentials import registry
def made(kernel):
    kinds = fs.Field(fs.Segment((0, 0, 0), (1, 0, 0)), kernel).elements.kinds_used
    return lanes_kernel(registry.field_sum(kinds), wp.float64, ("points", "table", "indices", "int", "int"), ((0,),))
if len(sys.argv) > 1:
    made(fs.Cauchy(2.0))
print(made(fs.Newtonian()).module.get_module_identifier(1), made(fs.Gaussian(1.0)).module.get_module_identifier(1))
"""


def test_kernels_are_found_in_the_cache_by_another_process():
    """Their names there depend on what was translated, and on nothing else that a process did."""
    names = []
    for arguments, seed in (([], "1"), (["other"], "2")):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        command = [sys.executable, "-c", SCRIPT, *arguments]
        names.append(
            subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout.split()
        )
    assert names[0] == names[1]
    assert names[0][0] != names[0][1]


@portable
def looked_up(x: real, n: int, rows: Table, kinds: Indices):
    total = x
    for k in range(kinds[n]):
        total += rows[kinds[k], n]
    return total


def test_what_varies_is_gathered_and_what_does_not_is_read_once():
    assert "gather" in looked_up.lanes(wp.float64, uniform=("rows", "kinds")).source.split("looked_up")[-1]
    assert "gather" not in looked_up.lanes(wp.float64).source.split("looked_up")[-1]


@portable
def walked(x: real, rows: Table):
    """Lanes leave at the table's last row; what follows it is asked by none."""
    k = int(0)  # noqa: UP018, RUF046 - a variable to Warp
    while rows[k, 0] < x:
        k += 1
        if k == 3:
            break
    return real(k)


def test_lanes_that_left_a_loop_read_nothing_more():
    rows = np.array([[0.0], [1.0], [2.0]])
    source = walked.lanes(wp.float64).source
    assert "gather(rows, k, Int(0), loop_1)" in source
    assert [walked(x, rows) for x in (-1.0, 0.5, 9.0)] == [0.0, 1.0, 3.0]
