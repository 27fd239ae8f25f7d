"""The elementary functions of lanes: each to 2 ulp of the exact value, and what they give where that is none."""

import math

import mpmath
import numpy as np
import pytest
import warp as wp
from lanes_on_arrays import on_lanes

from fieldsim.portable import portable, real, rules

mpmath.mp.dps = 40
# Not measured here, as they are the processor's own, or tests without rounding.
PLAIN = {"ceil", "copysign", "floor", "isfinite", "isinf", "isnan", "sqrt", "trunc", "degrees", "radians"}
ULPS = 2.0
RNG = np.random.default_rng(7)


@portable
def elementary(x: real):
    return (
        math.exp(x),
        math.log(x),
        math.log2(x),
        math.log10(x),
        math.sin(x),
        math.cos(x),
        math.tan(x),
        math.asin(x),
        math.acos(x),
        math.atan(x),
        math.sinh(x),
        math.cosh(x),
        math.tanh(x),
        math.erf(x),
        math.erfc(x),
    )


@portable
def powers(x: real, y: real):
    return math.pow(x, y), math.atan2(x, y)


@portable
def plain(x: real, y: real):
    finite = real(0.0)
    if math.isfinite(x):
        finite = real(1.0)
    if math.isinf(x):
        finite = real(2.0)
    if math.isnan(x):
        finite = real(3.0)
    return (
        math.floor(x),
        math.ceil(x),
        math.trunc(x),
        math.sqrt(x),
        abs(x),
        math.degrees(x),
        math.radians(x),
        math.copysign(x, y),
        min(x, y),
        max(x, y),
        finite,
    )


NAMES = (
    "exp",
    "log",
    "log2",
    "log10",
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "sinh",
    "cosh",
    "tanh",
    "erf",
    "erfc",
)
EXACT = {name: getattr(mpmath, name) for name in NAMES if name != "log2"}
EXACT["log2"] = lambda x: mpmath.log(x, 2)
SPECIAL = np.array([0.0, -0.0, math.inf, -math.inf, math.nan, 1.0, -1.0])


def evaluated(function, scalar, *arguments):
    """Results (count, N) in float64 of a function at arguments (N,) each."""
    return np.array(on_lanes(function, scalar, *arguments), dtype=float)


def near_quarters(count):
    """Numbers close to multiples of pi / 2, the last of them among the closest that there are below 1e5."""
    multiples = np.concatenate([np.arange(1, count), RNG.integers(1, 60000, count)])
    nearest = np.array([float(n * mpmath.pi / 2) for n in multiples])
    return np.concatenate([nearest, np.nextafter(nearest, 0), -nearest])


def places(name, count, single):
    """Arguments (N,) at which a function is measured: dense ones, tiny ones, those next to its ends and its seams."""
    top, tiny = (88.7, 1e-44) if single else (709.7, 5e-324)
    spread = 10.0 ** RNG.uniform(-38 if single else -308, 38 if single else 308, count)
    signed = RNG.normal(size=count) * 10.0 ** RNG.uniform(-6, 1, count)
    if name in ("exp", "sinh", "cosh", "tanh"):
        low = -103 if single else -745
        found = [RNG.uniform(low if name == "exp" else -top, top, count), signed, [tiny, -tiny, top, low, 0.6, 1.0]]
    elif name.startswith("log"):
        found = [spread, 1 + RNG.normal(size=count) * 10.0 ** RNG.uniform(-16, -1, count), [tiny, 3 * tiny, 1e-310]]
    elif name in ("sin", "cos", "tan"):
        found = [signed, RNG.uniform(-1e5, 1e5, count), near_quarters(count // 4), spread[spread < 1e30], [tiny, 1e5]]
    elif name in ("asin", "acos"):
        found = [
            RNG.uniform(-1, 1, count),
            1 - 10.0 ** RNG.uniform(-16, 0, count),
            signed[abs(signed) < 1],
            [tiny, 0.5, -0.5],
        ]
    elif name in ("erf", "erfc"):
        found = [RNG.uniform(-6, 10 if single else 27.3, count), signed, [tiny, 0.84375, 1.25, 1 / 0.35, 2.857, 5.9]]
    else:
        found = [spread, -spread, signed, [tiny, 1.0, math.tan(math.pi / 8)]]
    x = np.concatenate(found)
    return x.astype(np.float32).astype(float) if single else x


def ulps(got, exact, single):
    """The errors (N,) in units of the last place of the exact values, as numbers of mpmath."""
    dtype = np.float32 if single else np.float64
    # Where they overflow nothing is measured; a subnormal's last place is that of all subnormals.
    with np.errstate(over="ignore"):
        nearest = np.array([float(e) for e in exact]).astype(dtype)
    last = np.spacing(np.abs(nearest)).astype(float)
    return np.array(
        [
            float(abs(mpmath.mpf(float(g)) - e) / mpmath.mpf(float(s))) if math.isfinite(n) else float(g != n)
            for g, e, s, n in zip(got, exact, last, nearest, strict=True)
        ]
    )


def errors(name, scalar, count):
    """(arguments, errors in ulp) of one elementary function."""
    single = scalar is wp.float32
    x = places(name, count, single)
    got = evaluated(elementary, scalar, x)[NAMES.index(name)]
    return x, ulps(got, [mpmath.mpf(EXACT[name](mpmath.mpf(float(v)))) for v in x], single)


@pytest.mark.parametrize("scalar", [wp.float64, wp.float32], ids=["double", "single"])
@pytest.mark.parametrize("name", NAMES)
def test_an_elementary_function_is_exact_to_two_ulp(name, scalar):
    x, error = errors(name, scalar, 300)
    worst = error.argmax()
    assert error[worst] <= ULPS, f"{name}({x[worst]!r}) is {error[worst]:.2f} ulp off"


@pytest.mark.full
@pytest.mark.parametrize("scalar", [wp.float64, wp.float32], ids=["double", "single"])
@pytest.mark.parametrize("name", NAMES)
def test_an_elementary_function_is_exact_to_two_ulp_at_many_places(name, scalar):
    x, error = errors(name, scalar, 20_000)
    worst = error.argmax()
    assert error[worst] <= ULPS, f"{name}({x[worst]!r}) is {error[worst]:.2f} ulp off"


@pytest.mark.parametrize("scalar", [wp.float64, wp.float32], ids=["double", "single"])
def test_powers_and_angles_are_exact_to_two_ulp(scalar):
    single, count = scalar is wp.float32, 2000
    x = 10.0 ** RNG.uniform(-30, 30, count)
    y = RNG.normal(size=count) * 10.0 ** RNG.uniform(-3, 1, count)
    x[: count // 2] = 1 + RNG.normal(size=count // 2) * 0.1
    y[: count // 4] *= 100
    if single:
        x, y = (a.astype(np.float32).astype(float) for a in (x, y))
    pow_, atan2 = evaluated(powers, scalar, x, y)
    for got, exact in ((pow_, mpmath.power), (atan2, mpmath.atan2)):
        error = ulps(
            got, [exact(mpmath.mpf(float(a)), mpmath.mpf(float(b))) for a, b in zip(x, y, strict=True)], single
        )
        worst = error.argmax()
        assert error[worst] <= ULPS, f"{exact.__name__} of {x[worst]!r}, {y[worst]!r} is {error[worst]:.2f} ulp off"


@pytest.mark.parametrize("scalar", [wp.float64, wp.float32], ids=["double", "single"])
def test_ends_are_those_of_the_c_library(scalar):
    """Zeros with their signs, infinities, and what is no number."""
    import scipy.special

    dtype = np.float32 if scalar is wp.float32 else np.float64
    named = {
        "asin": np.arcsin,
        "acos": np.arccos,
        "atan": np.arctan,
        "erf": scipy.special.erf,
        "erfc": scipy.special.erfc,
    }
    x = np.concatenate([SPECIAL, [2.0, -2.0, 1e30, -1e30]])
    with np.errstate(all="ignore"):
        for name, got in zip(NAMES, evaluated(elementary, scalar, x), strict=True):
            if name in ("sin", "cos", "tan"):
                continue
            expected = (named.get(name) or getattr(np, name))(x.astype(dtype)).astype(float)
            np.testing.assert_allclose(got, expected, rtol=3e-7, err_msg=name)
            assert (np.signbit(got) == np.signbit(expected))[~np.isnan(expected)].all(), name
        x, y = (
            a.ravel() for a in np.meshgrid([*SPECIAL, 0.5, -0.5, 3.0, -3.0, 2.0], [*SPECIAL, 0.5, -0.5, 3.0, -3.0, 2.0])
        )
        for got, expected in zip(evaluated(powers, scalar, x, y), (np.power(x, y), np.arctan2(x, y)), strict=True):
            np.testing.assert_allclose(got, expected, rtol=3e-7)
            assert (np.signbit(got) == np.signbit(expected))[~np.isnan(expected)].all()
    sines = evaluated(elementary, scalar, SPECIAL)[[NAMES.index(n) for n in ("sin", "cos", "tan")]]
    assert np.isnan(sines[:, 2:5]).all()
    assert (sines[[0, 2], :2] == 0.0).all()
    assert np.signbit(sines[[0, 2], 1]).all()


@pytest.mark.parametrize("scalar", [wp.float64, wp.float32], ids=["double", "single"])
def test_what_the_processor_does_itself(scalar):
    values = np.array([*SPECIAL, 2.5, -2.5, 0.49999999, 1e10, -7.0, 1.5])
    x, y = (a.ravel() for a in np.meshgrid(values, values))
    got = evaluated(plain, scalar, x, y)
    x, y = (a.astype(np.float32 if scalar is wp.float32 else np.float64) for a in (x, y))
    # min and max pass over what is no number, and of two equal ones give the first.
    least = np.where(np.isnan(x), y, np.where(y < x, y, x))
    most = np.where(np.isnan(x), y, np.where(y > x, y, x))
    finite = np.where(np.isfinite(x), 1.0, np.where(np.isnan(x), 3.0, 2.0))
    with np.errstate(all="ignore"):
        expected = [np.floor(x), np.ceil(x), np.trunc(x), np.sqrt(x), abs(x), np.degrees(x), np.radians(x)]
    expected += [np.copysign(x, y), least, most, finite]
    for a, b in zip(got, expected, strict=True):
        np.testing.assert_allclose(a, np.asarray(b, dtype=float), rtol=2e-7)
        assert (np.signbit(a) == np.signbit(b))[~np.isnan(b)].all()


def test_every_function_of_math_is_measured():
    assert set(NAMES) | {"pow", "atan2"} | PLAIN == rules.MATH
