"""Checks of arrays and vectors of real numbers.

What NumPy would convert by dropping a meaning is refused: the imaginary part of complex numbers, what a mask hides,
dates, truths, strings, and units (`unit` or `units` of astropy, pint and unyt).
"""

import numpy as np

from fieldsim.errors import InputError
from fieldsim.validate.words import bounded, shown

# What lists may hold, and how deep lists may lie in each other: more have no end, or were never meant.
MOST_ITEMS = 10_000_000
MOST_NUMBERS = 1 << 30
_DEEPEST = 32

# Lengths and speeds whose powers, and those of their products with masses, are numbers.
FARTHEST = 1e60

# Words for arrays of numbers that would lose a meaning as real ones, by NumPy's kind of dtype.
_MEANINGS = {
    "b": "truths",
    "c": "complex numbers",
    "M": "dates",
    "m": "spans of time",
    "U": "strings",
    "S": "strings",
    "V": "records",
}


def numbers(owner: str, name: str, value, *, shape=None, remedy: str | None = None) -> np.ndarray:
    """`value` as a float64 array of finite numbers, a copy where it was none.

    shape: what it must be, None in it for any length: (None, 3). remedy: words for one that fits, "give ...".
    """
    if remedy is None:
        remedy = "give numbers" if shape is None else f"give an array of shape {_shape_words(shape)}"
    array = reals(owner, name, value, remedy)
    if shape is not None and not _fits(array.shape, shape):
        found = f"is {shown(value)}" if array.ndim == 0 else f"has shape {array.shape}"
        raise InputError(f"{owner}: {name} {found}; {remedy}")
    if not np.isfinite(array).all():
        if array.size <= 4:
            raise InputError(f"{owner}: {name} is {shown(array.tolist())}; give finite numbers")
        where = np.argwhere(~np.isfinite(array))[0]
        words = ", ".join(map(str, where))
        raise InputError(f"{owner}: {name}[{words}] is {array[tuple(where)]}; give finite numbers")
    return array


def _fits(shape, wanted):
    return len(shape) == len(wanted) and all(n in (None, m) for m, n in zip(shape, wanted, strict=True))


def _shape_words(shape):
    letters = iter("NMKL")
    parts = [next(letters) if n is None else str(n) for n in shape]
    return f"({parts[0]},)" if len(parts) == 1 else f"({', '.join(parts)})"


def vector(owner: str, name: str, value) -> tuple[float, float, float]:
    """`value` as three finite floats."""
    array = reals(owner, name, value, "give three numbers (x, y, z)")
    if array.shape != (3,):
        raise InputError(f"{owner}: {name} has shape {array.shape}; give three numbers (x, y, z)")
    if not np.isfinite(array).all():
        raise InputError(f"{owner}: {name} is {tuple(array.tolist())}; give finite coordinates")
    return tuple(array.tolist())


def not_far(owner: str, name: str, array: np.ndarray) -> np.ndarray:
    """`array` of finite numbers, none of a size beyond FARTHEST."""
    if array.size and np.abs(array).max() > FARTHEST:
        where = np.unravel_index(np.abs(array).argmax(), array.shape)
        index = f"[{', '.join(map(str, where))}]" if where else ""
        raise InputError(
            f"{owner}: {name}{index} is {array[where]:g}, and powers of such numbers overflow; give numbers of at most "
            f"{FARTHEST:g}, in another unit"
        )
    return array


def near_vector(owner: str, name: str, value) -> tuple[float, float, float]:
    """`value` as three floats of at most FARTHEST."""
    return tuple(not_far(owner, name, np.array(vector(owner, name, value))).tolist())


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
    array = reals(owner, name, value, "give an array of shape (N, 3)")
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{owner}: {name} has shape {array.shape}; give an array of shape (N, 3)")
    finite = np.isfinite(array)
    if not finite.all():
        bad = np.flatnonzero(~finite.all(axis=1))
        raise InputError(
            f"{owner}: {name}[{bad[0]}] is {tuple(array[bad[0]].tolist())}; "
            f"give finite coordinates ({bad.size} of {len(array)} are not)"
        )
    return array


def array(owner: str, name: str, value, remedy: str) -> np.ndarray:
    """`value` as an array of the type that it has, which is for the caller to check."""
    _refuse_meaning(owner, name, value, remedy)
    _refuse_endless(owner, name, value, remedy)
    try:
        return np.asarray(value)
    except ValueError:
        raise InputError(f"{owner}: {name} has rows of different lengths; {remedy}") from None
    except Exception:
        raise InputError(f"{owner}: {name} is {shown(value)} and cannot be read as numbers; {remedy}") from None


def reals(owner: str, name: str, value, remedy: str) -> np.ndarray:
    """`value` as a float64 array, maybe not finite, where nothing of its meaning is lost by that."""
    _refuse_meaning(owner, name, value, remedy)
    _refuse_endless(owner, name, value, remedy)
    try:
        array = np.asarray(value)
    except Exception:
        raise InputError(f"{owner}: {name} is {shown(value)} and cannot be read as numbers; {remedy}") from None
    if array.dtype.kind in _MEANINGS:
        what = _MEANINGS[array.dtype.kind]
        if array.ndim:
            raise InputError(f"{owner}: {name} is an array of {what} ({array.dtype}); {remedy} of real numbers")
        raise InputError(f"{owner}: {name} is {shown(value)}; {remedy}")
    # More is no array in memory, but one number seen again and again.
    bounded(f"{owner}: {name}", "numbers", array.size, MOST_NUMBERS, remedy)
    try:
        if array.dtype.kind == "O" and any(x is None or isinstance(x, bool | str | bytes) for x in array.flat):
            raise TypeError  # which NumPy takes for nan, 1 or a number
        # Not a subclass: its operators may mean something else. What is too long for a float is inf.
        with np.errstate(over="ignore"):
            return np.asarray(array, dtype=np.float64)
    except Exception:
        raise InputError(f"{owner}: {name} is {shown(value)}; {remedy}") from None


def _refuse_meaning(owner, name, value, remedy, depth=0):
    """Refuse what says that it is more than numbers, or that some of them do not count; looks into sequences."""
    if isinstance(value, np.ma.MaskedArray):
        raise InputError(f"{owner}: {name} is a masked array; give plain numbers, such as masked.compressed()")
    unit = _unit(value)
    if unit is not None and not callable(unit):
        raise InputError(
            f"{owner}: {name} has the unit {shown(str(unit))}; fieldsim has scene units only: give plain numbers, "
            "such as quantity.to_value(unit)"
        )
    # Beside numbers NumPy takes truths and dates for numbers, too.
    if depth and isinstance(value, bool | np.bool_ | np.datetime64 | np.timedelta64):
        raise InputError(f"{owner}: {name} holds {shown(value)}; {remedy}")
    if depth > _DEEPEST:
        raise InputError(f"{owner}: {name} is lists within lists, more than {_DEEPEST} deep; {remedy}")
    if isinstance(value, list | tuple):
        # By its own items, whatever a subclass makes of them.
        for item in list.__iter__(value) if isinstance(value, list) else tuple.__iter__(value):
            if isinstance(item, bool) or not isinstance(item, float | int):
                _refuse_meaning(owner, name, item, remedy, depth + 1)


def _refuse_endless(owner, name, value, remedy):
    """Refuse what NumPy would turn into numbers one by one, and far too many, such as range(10**12)."""
    try:
        if hasattr(value, "__array__") or isinstance(value, memoryview):
            return
        count = len(value)
    except Exception:  # a single one, or what NumPy will refuse
        return
    bounded(f"{owner}: {name}", "items", count, MOST_ITEMS, f"{remedy}, or an array of NumPy's")


def _unit(value):
    """The unit that a value says it has, or None."""
    try:
        return None if isinstance(value, type) else getattr(value, "unit", None) or getattr(value, "units", None)
    except Exception:  # it cannot say
        return None
