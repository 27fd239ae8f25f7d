"""How values stand in messages, and requests that are too large to be meant."""

import reprlib

import numpy as np

from fieldsim.errors import InputError

_short = reprlib.Repr()
_short.maxstring = _short.maxother = 100


def shown(value) -> str:
    """`value` as it stands in a message: its repr, shortened."""
    if isinstance(value, np.number):
        value = value.item()
    try:
        return _short.repr(value)
    except Exception:
        return f"an object of {type(value).__name__} without a repr"


def bounded(owner: str, what: str, count, most: int, remedy: str) -> None:
    """Refuse a request by its size, before it takes memory or time: `count` of `what`, `most` at most."""
    if not count <= most:
        number = f"{count:,.0f}" if count < 1e15 else f"{count:.0e}" if count < 1e300 else "more than 1e300"
        raise InputError(f"{owner}: this takes {number} {what}, more than {most:,}; {remedy}")
