"""The gate: checks of everything that users give. Each names the object, the value and the remedy.

One function a kind of value, called where the value enters (a constructor, a public function) and nowhere behind. All
raise `InputError`, whatever is given: no value ends in an exception of Python's or NumPy's own.

| file | values |
|---|---|
| scalars | numbers, switches, texts, choices, paths |
| arrays | arrays and vectors of numbers |
| things | instances, lists, functions |
| functions | what users' functions return and raise |
"""

from fieldsim.validate.arrays import (
    FARTHEST,
    MOST_ITEMS,
    MOST_NUMBERS,
    array,
    direction,
    near_vector,
    not_far,
    numbers,
    points,
    reals,
    vector,
)
from fieldsim.validate.functions import answer, at_time
from fieldsim.validate.scalars import choice, flag, number, path, seed, size, text, whole
from fieldsim.validate.things import fields, function, having, instance, instances, iterator, listed, optional
from fieldsim.validate.words import bounded, shown

__all__ = [
    "FARTHEST",
    "MOST_ITEMS",
    "MOST_NUMBERS",
    "answer",
    "array",
    "at_time",
    "bounded",
    "choice",
    "direction",
    "fields",
    "flag",
    "function",
    "having",
    "instance",
    "instances",
    "iterator",
    "listed",
    "near_vector",
    "not_far",
    "number",
    "numbers",
    "optional",
    "path",
    "points",
    "reals",
    "seed",
    "shown",
    "size",
    "text",
    "vector",
    "whole",
]
