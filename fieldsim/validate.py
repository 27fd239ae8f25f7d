"""The gate: checks of everything that users give. Each names the object, the value and the remedy.

One function a kind of value, called where the value enters (a constructor, a public function) and nowhere behind. All
raise `InputError`, whatever is given: no value ends in an exception of Python's or NumPy's own.

Numbers are real numbers. What NumPy would convert by dropping a meaning is refused: the imaginary part of complex
numbers, what a mask hides, dates, truths, strings, and units (`unit` or `units` of astropy, pint and unyt).
"""

import itertools
import math
import os
import pathlib
import reprlib
import traceback

import numpy as np

from fieldsim.errors import FieldsimError, InputError
from fieldsim.types import RealLike

_PACKAGE = os.path.dirname(os.path.abspath(__file__)) + os.sep

# What lists may hold, and how deep lists may lie in each other: more have no end, or were never meant.
MOST_ITEMS = 10_000_000
MOST_NUMBERS = 1 << 30
_DEEPEST = 32

_short = reprlib.Repr()
_short.maxstring = _short.maxother = 100

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


def shown(value) -> str:
    """`value` as it stands in a message: its repr, shortened."""
    if isinstance(value, np.number):
        value = value.item()
    try:
        return _short.repr(value)
    except Exception:
        return f"an object of {type(value).__name__} without a repr"


def number(owner: str, name: str, value, *, above=None, at_least=None, below=None, at_most=None) -> float:
    """`value` as a finite float within the limits given."""
    if type(value) is float:
        result = value
    else:
        array = reals(owner, name, value, "give a number")
        if array.ndim:
            raise InputError(f"{owner}: {name} is {shown(value)}; give a number")
        result = float(array)
    if not math.isfinite(result):
        raise InputError(f"{owner}: {name} is {result}; give a finite number")
    _within(owner, name, result, "number", above, at_least, below, at_most)
    return result


def whole(owner: str, name: str, value, *, at_least=None, at_most=None) -> int:
    """`value` as an int within the limits given; a float with nothing after its point is one, too."""
    result = number(owner, name, value)
    if result != int(result):
        raise InputError(f"{owner}: {name} is {shown(value)}; give a whole number")
    _within(owner, name, int(result), "whole number", None, at_least, None, at_most)
    # A whole number beyond 2^53 keeps its last digits.
    return int(value) if isinstance(value, int | np.integer) else int(result)


def seed(owner: str, value) -> int:
    """`value` as a seed of random numbers."""
    return whole(owner, "seed", value, at_least=0, at_most=2**63)


def size(owner: str, value, name: str = "size") -> tuple[int, int]:
    """`value` as (width, height) in pixels, whole numbers from 1 to 16384."""
    remedy = "give (width, height) in pixels, two whole numbers from 1 to 16384"
    try:
        width, height = (whole(owner, name, n, at_least=1, at_most=16384) for n in listed(owner, name, value))
        if isinstance(value, set):
            raise TypeError  # which has no order
    except (TypeError, ValueError):
        raise InputError(f"{owner}: {name} is {shown(value)}; {remedy}") from None
    return width, height


def _within(owner, name, result, noun, above, at_least, below, at_most):
    if above is not None and not result > above:
        raise InputError(f"{owner}: {name} is {result:g}; give a {noun} above {above:g}")
    if at_least is not None and not result >= at_least:
        raise InputError(f"{owner}: {name} is {result:g}; give a {noun} of at least {at_least:g}")
    if below is not None and not result < below:
        raise InputError(f"{owner}: {name} is {result:g}; give a {noun} below {below:g}")
    if at_most is not None and not result <= at_most:
        raise InputError(f"{owner}: {name} is {result:g}; give a {noun} of at most {at_most:g}")


def bounded(owner: str, what: str, count, most: int, remedy: str) -> None:
    """Refuse a request by its size, before it takes memory or time: `count` of `what`, `most` at most."""
    if not count <= most:
        number = f"{count:,.0f}" if count < 1e15 else f"{count:.0e}" if count < 1e300 else "more than 1e300"
        raise InputError(f"{owner}: this takes {number} {what}, more than {most:,}; {remedy}")


def flag(owner: str, name: str, value) -> bool:
    """`value` as True or False."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{owner}: {name} is {shown(value)}; give True or False")
    return bool(value)


def text(owner: str, name: str, value) -> str:
    """`value`, a string."""
    if not isinstance(value, str):
        raise InputError(f"{owner}: {name} is {shown(value)}; give a string")
    return value


def choice(owner: str, name: str, value, choices) -> str:
    """`value`, one of the strings `choices`."""
    if not isinstance(value, str) or value not in choices:
        *first, last = (repr(choice) for choice in choices)
        raise InputError(
            f"{owner}: {name} is {shown(value)}; give {', '.join(first)} or {last}"
            if first
            else f"{owner}: {name} is {shown(value)}; give {last}"
        )
    return value


def instance(owner: str, name: str, value, kinds, remedy: str):
    """`value`, an instance of `kinds` (a class, a union or a tuple of classes); remedy: "give a fs.Camera"."""
    if not isinstance(value, kinds):
        raise InputError(f"{owner}: {name} is {shown(value)}; {remedy}")
    return value


def having(owner: str, name: str, value, attributes, remedy: str):
    """`value`, an object (no class) with these attributes: where importing its class would turn imports around."""
    try:
        found = all(hasattr(value, attribute) for attribute in attributes)
    except Exception:  # it cannot say
        found = False
    if isinstance(value, type) or not found:
        raise InputError(f"{owner}: {name} is {shown(value)}; {remedy}")
    return value


def instances(owner: str, name: str, value, kinds, remedy: str) -> tuple:
    """`value`, a sequence (no single one) of instances of `kinds`, as a tuple."""
    if isinstance(value, kinds) and not isinstance(value, str):
        raise InputError(f"{owner}: {name} is {shown(value)}; give a list of such, [...]")
    if isinstance(value, np.ndarray):
        raise InputError(f"{owner}: {name} is an array; {remedy}")
    items = listed(owner, name, value, remedy)
    for index, item in enumerate(items):
        instance(owner, f"{name}[{index}]", item, kinds, remedy)
    return items


def listed(owner: str, name: str, value, remedy: str = "give a list") -> tuple:
    """The items of an iterable `value`, which may have no end, as a tuple of `MOST_ITEMS` at most."""
    try:
        if isinstance(value, str | bytes | dict):
            raise TypeError  # whose items are something else
        items = tuple(itertools.islice(value, MOST_ITEMS + 1))
    except Exception:
        raise InputError(f"{owner}: {name} is {shown(value)}; {remedy}") from None
    if len(items) > MOST_ITEMS:
        raise InputError(f"{owner}: {name} is {shown(value)}, of more than {MOST_ITEMS:,} items; {remedy}")
    return items


def iterator(owner: str, name: str, value, remedy: str = "give a list"):
    """An iterator over the numbers `value`, maybe one without end, whose items are still to be checked."""
    if isinstance(value, np.ndarray | list | tuple):
        numbers(owner, name, value, shape=(None,), remedy=remedy)
    try:
        if isinstance(value, str | bytes | dict | set | np.void):
            raise TypeError
        return iter(value)
    except Exception:
        raise InputError(f"{owner}: {name} is {shown(value)}; {remedy}") from None


def optional(check, owner: str, name: str, value, *arguments, **limits):
    """None, or `check(owner, name, value, ...)`."""
    return None if value is None else check(owner, name, value, *arguments, **limits)


def fields(thing, check, *names: str, **limits) -> None:
    """Check fields of a frozen dataclass in place, in the name of its class."""
    for name in names:
        object.__setattr__(thing, name, check(type(thing).__name__, name, getattr(thing, name), **limits))


def function(owner: str, name: str, value, remedy: str = "give a function"):
    """`value`, something that can be called."""
    if not callable(value):
        raise InputError(f"{owner}: {name} is {shown(value)}; {remedy}")
    return value


def path(owner: str, name: str, value) -> pathlib.Path:
    """`value` as the path of a file or folder: a string or an `os.PathLike`, not empty, that files can have."""
    try:
        result = os.fspath(value)
    except Exception:
        raise InputError(f"{owner}: {name} is {shown(value)}; give the path of a file") from None
    if not isinstance(result, str) or not result or "\0" in result or not _encodable(result):
        raise InputError(f"{owner}: {name} is {shown(value)}; give the path of a file as a string")
    return pathlib.Path(result)


def _encodable(path):
    try:
        return bool(os.fsencode(path))
    except UnicodeEncodeError:  # halves of characters
        return False


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


def at_time(owner: str, make, values: dict, time: RealLike):
    """`make(**values)`, where what functions of time among `values` give at `time` stands for them.

    What they raise, and what `make` refuses of theirs, becomes an InputError naming the time and the user's line.
    """
    time = number(owner, "time", time)
    functions = {name: value for name, value in values.items() if callable(value)}
    given = {name: answer(owner, name, function, time) for name, function in functions.items()}
    try:
        for name, value in given.items():
            if callable(value):
                raise InputError(f"{owner}: {name} is {shown(value)}; give a value, no function in its turn")
        return make(**(values | given))
    except InputError as reason:
        if reason.located:
            raise
        blamed = [name for name in functions if f" {name}" in str(reason)] or list(functions)
        if not blamed:
            raise
        givers = ", ".join(_defined(functions[name]) for name in blamed)
        raise _located(f"{reason} (at time {time:g}, from {givers})") from None


def _located(words):
    """An InputError that names the user's line."""
    error = InputError(words)
    error.located = True
    return error


def _defined(function):
    """Where a function was written, or what it is."""
    code = getattr(getattr(function, "func", function), "__code__", None)
    if code is None:
        return shown(function)
    return f"{os.path.basename(code.co_filename)}:{code.co_firstlineno} in {code.co_name}"


def answer(owner: str, name: str, function, *arguments):
    """`function(*arguments)` of a user's own function; what it raises becomes an InputError naming the user's line."""
    try:
        return function(*arguments)
    except (Exception, SystemExit) as error:
        frames = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.startswith(_PACKAGE)]
        ours = isinstance(error, FieldsimError)
        # What a function of fieldsim itself says, or one within another, stays as it is.
        if ours and (not frames or getattr(error, "located", False)):
            raise
        # The innermost line of the user's own file, not of a package that it calls.
        own = [f for f in frames if f.filename == frames[0].filename]
        where = (
            f"{os.path.basename(own[-1].filename)}:{own[-1].lineno} in {own[-1].name}" if own else _defined(function)
        )
        given = ", ".join(f"{a:g}" if isinstance(a, float) else shown(a) for a in arguments)
        kind = "" if ours else f"{type(error).__name__}: "
        raise _located(f"{owner}: {name}, a function, failed at {given}: {kind}{error}; see {where}") from error
