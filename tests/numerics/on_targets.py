"""Portable functions of three numbers on every compiled target."""

import math

import numba
import numpy as np
import warp as wp

# The type's rounding: 2 u.
EPS = {"warp64": 2.0**-52, "numba": 2.0**-52, "warp32": 2.0**-23}


def exactly_held(*arguments) -> np.ndarray:
    """Arguments (3, N) as numbers that float32 holds, in float64; what is missing is 0."""
    rows = [np.broadcast_to(a, np.shape(arguments[0])) for a in arguments]
    return np.array([*rows, *[np.zeros_like(rows[0])] * (3 - len(rows))]).astype(np.float32).astype(float)


def computed(target, function, asked) -> np.ndarray:
    """What a portable function (a, b, c) -> eight numbers makes of the columns of `asked` (3, N): (8, N) in float64."""
    if target == "numba":
        run = function.numba
        table = numba.njit(lambda a: [run(a[0, i], a[1, i], a[2, i]) for i in range(a.shape[1])])
        return np.array(table(asked)).T
    scalar = wp.float64 if target == "warp64" else wp.float32
    compiled = function.warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def run_all(asked: wp.array(dtype=scalar, ndim=2), result: wp.array(dtype=scalar, ndim=2)):
        i = wp.tid()
        a, b, c, d, e, f, g, h = compiled(asked[0, i], asked[1, i], asked[2, i])
        result[0, i] = a
        result[1, i] = b
        result[2, i] = c
        result[3, i] = d
        result[4, i] = e
        result[5, i] = f
        result[6, i] = g
        result[7, i] = h

    out = wp.array(np.full((8, asked.shape[1]), np.nan), dtype=scalar, ndim=2, device="cpu")
    inputs = [wp.array(asked, dtype=scalar, ndim=2, device="cpu"), out]
    wp.launch(run_all, asked.shape[1], inputs, device="cpu")
    return out.numpy().astype(float)


def check(target, function, asked, exact, accepted) -> None:
    """Assert that the worst errors are within `accepted`, {name: (in float64, in float32)}, in units of EPS.

    exact: (N, outputs, 2), true values and the sizes that errors are relative to.
    """
    found = computed(target, function, asked)[: len(accepted)].T
    value, size = np.moveaxis(np.array(exact), -1, 0)
    with np.errstate(invalid="ignore"):
        worst = (np.abs(found - value) / size).max(axis=0) / EPS[target]
    bounds = [pair[target == "warp32"] for pair in accepted.values()]
    errors = dict(zip(accepted, worst.tolist(), strict=True))
    assert not any(math.isnan(e) for e in worst), errors
    assert (worst <= bounds).all(), (errors, bounds)


def relative(*values):
    """Pairs of true values and the sizes that their errors are relative to, their own."""
    return [(float(v), abs(float(v))) for v in values]
