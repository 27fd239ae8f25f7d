"""Checks of single values: numbers, switches, texts, choices and paths."""

import math
import os
import pathlib

import numpy as np

from fieldsim.errors import InputError
from fieldsim.validate.arrays import reals
from fieldsim.validate.things import listed
from fieldsim.validate.words import shown


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
