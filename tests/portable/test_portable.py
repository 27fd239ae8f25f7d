"""One Python function, the same numbers on every target; what a target lacks is refused by name."""

import math
import os
import sys
import threading
import time
import warnings
from typing import TYPE_CHECKING

import numba
import numpy as np
import pytest
import warp as wp

from fieldsim import launch
from fieldsim.copies import ThreadLock
from fieldsim.errors import PortableError
from fieldsim.numerics.elementary import log1p
from fieldsim.portable import Indices, Portable, Table, hole, portable, real, rules
from fieldsim.portable import function as portable_module

THIRD = 1 / 3
X = np.linspace(0.07, 6.1, 40)


@portable
def literals(x: real):
    return x * real(0.1) - real(-2.623107347133476e-09) + real(3)


@portable
def constants(x: real):
    return x * real(THIRD) + real(math.pi)


@portable
def loops(x: real):
    total = real(0.0)
    for k in range(20):
        if k == 3:
            continue
        total += x / real(k + 1)
        if total > real(9.0):
            break
    n = int(0)  # noqa: UP018, RUF046 - Warp takes a literal for a constant
    while n < 5:
        total = total * real(0.5) + x
        n += 1
    return total


@portable
def early(x: real):
    if real(1.0) < x < real(2.0) or not x < real(5.0):
        return math.sqrt(x)
    if x > real(4.0):
        return -x
    return x if x > real(0.5) else real(7.0)


@portable
def pair(x: real):
    return math.exp(-x), abs(x) ** real(1.5)


@portable
def tuples(x: real):
    a, b = pair(x)
    c = min(a, b)
    return max(a, b) - c * math.atan2(a, b)


@portable
def elsewhere(x: real):
    return log1p(x) / x


@portable
def squared(x: real):
    return x * x


inner = hole("x")
offset = hole()


@portable
def applied(x: real):
    return inner(x) + real(offset)


@portable
def many(x: real):
    u = math.atan(x) / real(2.0)
    a = math.acos(u) + math.asin(u) - math.atan2(x, u) + math.erf(x) * math.erfc(u) + math.copysign(x, -u)
    b = math.sin(x) - math.cos(x) + math.tan(u) + math.sinh(u) + math.cosh(u) - math.tanh(x)
    c = math.exp(-x) + math.log(x) - math.log2(x) + math.log10(x) + math.pow(x, u) - math.sqrt(x)
    d = math.floor(x) - real(2.0) * math.ceil(x) + math.trunc(u) + math.degrees(u) - math.radians(x)
    if math.isnan(x) or math.isinf(x) or not math.isfinite(x):
        return x
    return a + b + c + d


@portable
def cheap_and_dear(x: real):
    return x * x, many(x)


@portable
def looked_up(x: real, rows: Table, kinds: Indices, i: int):
    return rows[kinds[i], 1] * x


PORTABLES = {
    "literals": literals,
    "constants": constants,
    "loops": loops,
    "early": early,
    "tuples": tuples,
    "elsewhere": elsewhere,
    "bound": applied.bind(inner=squared, offset=0.3),
    "bound otherwise": applied.bind(inner=elsewhere, offset=-2.0),
    "many": many,
}


def on_warp(function, scalar, x):
    compiled = function.warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def kernel(start: int, x: wp.array(dtype=scalar), y: wp.array(dtype=scalar)):
        i = start + wp.tid()
        y[i] = compiled(x[i])

    y = wp.full(len(x), math.nan, dtype=scalar, device="cpu")
    launch.launch(kernel, len(x), [wp.array(x, dtype=scalar, device="cpu")], [y], device="cpu")
    return y.numpy()


@pytest.mark.parametrize("function", PORTABLES.values(), ids=PORTABLES)
def test_targets_agree(function):
    python = np.array([function(x) for x in X])
    compiled = function.numba
    # The compilers may contract a product and a sum into one rounding, and their libraries differ by an ulp or so.
    np.testing.assert_allclose([compiled(x) for x in X], python, rtol=2e-15, atol=1e-15)
    np.testing.assert_allclose(on_warp(function, wp.float64, X), python, rtol=2e-15, atol=1e-15)
    single = X.astype(np.float32)
    expected = [function(float(x)) for x in single]
    np.testing.assert_allclose(on_warp(function, wp.float32, single), expected, rtol=1e-6, atol=1e-6)


def test_numba_drops_what_is_left_unused():
    """Who takes the value alone does not pay for the derivatives."""
    twin = cheap_and_dear.numba

    @numba.njit
    def both(x):
        return twin(x)

    @numba.njit
    def cheap(x):
        return twin(x)[0]

    assert cheap(2.0) == both(2.0)[0] == 4.0
    taken, left = ("".join(f.inspect_asm().values()) for f in (both, cheap))
    assert "sinh" in taken
    assert "sinh" not in left


def test_tables_come_from_python_too():
    """Twins count no references to arrays; the caller keeps its own."""
    rows, kinds = np.array([[0.0, 5.0], [0.0, 7.0]]), np.array([1, 0], dtype=np.int32)
    before = sys.getrefcount(rows)
    for _ in range(100):
        assert looked_up.numba(2.0, rows, kinds, 0) == 14.0
    assert sys.getrefcount(rows) == before


def test_every_function_of_math_is_tried():
    assert {name for name in many.function.__code__.co_names if hasattr(math, name)} == rules.MATH


def test_bindings_make_separate_functions():
    first, second = PORTABLES["bound"], PORTABLES["bound otherwise"]
    assert first(2.0) == 4.3
    assert second(2.0) == elsewhere(2.0) - 2.0
    assert first.numba is first.numba
    assert first.warp(wp.float32) is first.warp(wp.float32)


def test_tables_and_indices():
    rows = np.array([[0.0, 5.0], [0.0, 7.0]])
    kinds = np.array([1, 0], dtype=np.int32)
    compiled = looked_up.numba

    @numba.njit
    def call(rows, kinds):
        return compiled(2.0, rows, kinds, 0), compiled(2.0, rows, kinds, 1)

    assert call(rows, kinds) == (14.0, 10.0)
    assert looked_up(2.0, rows, kinds, 0) == 14.0


def lacks_function(x: real):
    return math.expm1(x)


def comprehension(x: real):
    return max([x, x])


def array_library(x: real):
    return np.sqrt(x)


if TYPE_CHECKING:
    nowhere = abs  # so that tools take the name for defined


def undefined(x: real):
    return nowhere(x)


def plain(x):
    return x


def not_portable(x: real):
    return plain(x)


def bare_literal(x: real):
    return 0.5 * x


def bare_constant(x: real):
    return THIRD * x


def bare_pi(x: real):
    return x * math.pi


def rounded_by_warp(x: real):
    return x * real(1.0 / 3.0)


def single_in_warp(x: real):
    return float(x)


def remainder(x: real):
    return x % real(2.0)


def text(x: real):
    print("x")
    return x


def unannotated(x):
    return x


def defaulted(x: real, y: real = 1.0):
    return x + y


def by_name(x: real):
    return max(x, y=x)


def raises(x: real):
    raise ValueError


def itself(x: real):
    return recursive(x)


recursive = portable(itself)


def capturing(power):
    def inside(x: real):
        return x**power

    return inside


REFUSED = [
    (lacks_function, r"lacks_function, line \d+, uses math.expm1, which not every target has: .*numerics"),
    (comprehension, r"comprehension, line \d+, uses List '\[x, x\]'"),
    (array_library, "'np.sqrt': of all modules only math is portable"),
    (undefined, "'nowhere', which is not defined"),
    (not_portable, r"'plain' \(function\): .* mark it @portable"),
    (bare_literal, r"bare literal 0.5: write real\(0.5\)"),
    (bare_constant, r"constant THIRD bare: write real\(THIRD\)"),
    (bare_pi, r"write real\(math.pi\)"),
    (rounded_by_warp, "rounds to single precision"),
    (single_in_warp, "'float', which is a builtin that the targets lack"),
    (remainder, "disagree about negative numbers"),
    (text, "'print', which is a builtin that the targets lack"),
    (unannotated, "argument 'x' has no usable type; give one of: real, int"),
    (defaulted, "plain positional arguments"),
    (by_name, "pass arguments by position"),
    (raises, "return NaN or inf"),
    (itself, "calls itself"),
    (capturing(2), r"captures \['power'\]"),
    (lambda x: x, "not written with def"),
]


@pytest.mark.parametrize(("function", "message"), REFUSED, ids=lambda v: getattr(v, "__name__", ""))
def test_what_a_target_lacks_is_refused(function, message):
    with pytest.raises(PortableError, match=message):
        portable(function).warp(wp.float64)
    with pytest.raises(PortableError, match=message):
        _ = portable(function).numba


def test_refusal_names_the_line():
    line = comprehension.__code__.co_firstlineno + 1
    with pytest.raises(PortableError, match=f"test_portable.comprehension, line {line},"):
        portable(comprehension).warp(wp.float32)


called = hole("x")


def test_refusal_of_a_called_function_names_that_function():
    @portable
    def outer(x: real):
        return called(x)

    bad = outer.bind(called=Portable(lacks_function))
    for _ in range(2):
        with pytest.raises(PortableError, match=r"test_portable\.lacks_function"):
            bad.warp(wp.float64)


def test_only_global_names_can_be_bound():
    with pytest.raises(PortableError, match="'nothing'"):
        applied.bind(nothing=1.0)


@pytest.mark.parametrize("target", [lambda f: f.warp(wp.float64), lambda f: f.numba])
def test_threads_that_want_a_twin_at_once_get_one(target, monkeypatch):
    made, compiled = [], portable_module._compile

    def slowly(*arguments):
        made.append(arguments)
        time.sleep(0.1)
        return compiled(*arguments)

    monkeypatch.setattr(portable_module, "_compile", slowly)

    @portable
    def function(x: real):
        return x

    twins = []
    threads = [threading.Thread(target=lambda: twins.append(target(function))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 1
    assert len(twins) == 4
    assert len(set(map(id, twins))) == 1


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_forked_child_has_the_locks_of_its_parents_threads_free():
    lock, held, done = ThreadLock(), threading.Event(), threading.Event()

    def hold():
        with lock:
            held.set()
            done.wait()

    holder = threading.Thread(target=hold)
    holder.start()
    held.wait()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # newer Pythons warn of threads
        child = os.fork()
    if child == 0:
        with lock:
            os._exit(7)
    done.set()
    holder.join()
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
