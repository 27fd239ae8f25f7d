"""Checks of values that users give. Each names the object, the value and the remedy."""

import numpy as np

from fieldsim.errors import InputError


def number(owner: str, name: str, value, *, above=None, at_least=None) -> float:
    """`value` as a finite float above `above` (or at least `at_least`)."""
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{owner}: {name} is {value!r}; give a number") from None
    if not np.isfinite(result):
        raise InputError(f"{owner}: {name} is {result}; give a finite number")
    if above is not None and not result > above:
        raise InputError(f"{owner}: {name} is {result:g}; give a number above {above:g}")
    if at_least is not None and not result >= at_least:
        raise InputError(f"{owner}: {name} is {result:g}; give a number of at least {at_least:g}")
    return result


def vector(owner: str, name: str, value) -> tuple[float, float, float]:
    """`value` as three finite floats."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{owner}: {name} is {value!r}; give three numbers (x, y, z)") from None
    if array.shape != (3,):
        raise InputError(f"{owner}: {name} has shape {array.shape}; give three numbers (x, y, z)")
    if not np.isfinite(array).all():
        raise InputError(f"{owner}: {name} is {tuple(array.tolist())}; give finite coordinates")
    return tuple(array.tolist())


def direction(owner: str, name: str, value) -> tuple[float, float, float]:
    """`value` as a unit vector."""
    array = np.asarray(vector(owner, name, value))
    size = np.max(np.abs(array))
    if size == 0.0:
        raise InputError(f"{owner}: {name} is (0, 0, 0); give a direction")
    array = array / size
    return tuple((array / np.linalg.norm(array)).tolist())


def points(owner: str, name: str, value) -> np.ndarray:
    """`value` as an (N, 3) float64 array of finite rows."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{owner}: {name} cannot be read as numbers; give an array of shape (N, 3)") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{owner}: {name} has shape {array.shape}; give an array of shape (N, 3)")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        raise InputError(
            f"{owner}: {name}[{bad[0]}] is {tuple(array[bad[0]].tolist())}; "
            f"give finite coordinates ({bad.size} of {len(array)} are not)"
        )
    return array
