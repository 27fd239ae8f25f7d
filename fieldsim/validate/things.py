"""Checks of objects: instances of classes, lists of them, functions, and fields of dataclasses."""

import itertools

import numpy as np

from fieldsim.errors import InputError
from fieldsim.validate import arrays
from fieldsim.validate.words import shown


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
    """The items of an iterable `value`, which may have no end, as a tuple of `arrays.MOST_ITEMS` at most."""
    try:
        if isinstance(value, str | bytes | dict):
            raise TypeError  # whose items are something else
        items = tuple(itertools.islice(value, arrays.MOST_ITEMS + 1))
    except Exception:
        raise InputError(f"{owner}: {name} is {shown(value)}; {remedy}") from None
    if len(items) > arrays.MOST_ITEMS:
        raise InputError(f"{owner}: {name} is {shown(value)}, of more than {arrays.MOST_ITEMS:,} items; {remedy}")
    return items


def iterator(owner: str, name: str, value, remedy: str = "give a list"):
    """An iterator over the numbers `value`, maybe one without end, whose items are still to be checked."""
    if isinstance(value, np.ndarray | list | tuple):
        arrays.numbers(owner, name, value, shape=(None,), remedy=remedy)
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
