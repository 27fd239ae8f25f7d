"""Bad values of every sort, and which of them are right in the place of a right one."""

import datetime
import decimal
import fractions
import os
import pathlib
import types

import numpy as np
from right_values import Or

import fieldsim as fs


class Kilometres(np.ndarray):
    """Numbers with a unit."""

    unit = "km"

    def __float__(self):
        raise TypeError("only dimensionless quantities can be converted")


def _km(values):
    return np.asarray(values, float).view(Kilometres)


class Hostile:
    """Whatever is asked of it fails."""

    def _fail(self, *_):
        raise OSError("no")

    __repr__ = __str__ = __float__ = __int__ = __index__ = __len__ = __iter__ = __array__ = __eq__ = __bool__ = _fail
    __hash__ = object.__hash__


BAD = {
    "None": None,
    "nan": float("nan"),
    "inf": -np.inf,
    "huge whole number": 10**400,
    "-1": -1,
    "0": 0,
    "1e300": 1e300,
    "half": 0.5,
    "empty string": "",
    "'x'": "x",
    "number in a string": "1.5",
    "zero character": "\0",
    "long string": "x" * 300,
    "empty list": [],
    "empty dict": {},
    "dict": {"x": 1},
    "object": object(),
    "hostile object": Hostile(),
    "function of nothing": lambda: None,
    "function that fails": lambda *_: 1 / 0,
    "complex number": 1j,
    "complex vector": [1j, 0, 1],
    "truth": True,
    "truths": [True, False, True],
    "masked number": np.ma.masked,
    "masked vector": np.ma.masked_array([0.0, 0.0, 1.0], mask=[0, 0, 1]),
    "date": np.datetime64("2020-01-01"),
    "dates": np.ones((1, 3), "datetime64[s]"),
    "python's date": datetime.date(2020, 1, 1),
    "span of time": np.timedelta64(1, "s"),
    "number with a unit": _km(7.0),
    "vector with a unit": _km([0, 0, 7]),
    "points with a unit": _km([[0, 0, 7]]),
    "list of numbers with units": [_km(0.0), _km(0.0), _km(7.0)],
    "matrix (2, 2)": np.ones((2, 2)),
    "four numbers": (1.0, 2.0, 3.0, 4.0),
    "zero vector": (0.0, 0.0, 0.0),
    "vector with nan": (0.0, float("nan"), 0.0),
    "array without rows": np.zeros((0, 3)),
    "bytes": b"x",
    "class": int,
    "class of fieldsim": fs.Point,
    "fog": fs.Fog(),
    "list of fogs": [fs.Fog(), None],
    "ragged list": [[1.0], [1.0, 2.0]],
    "Nones": [None, None, None],
    "strings": ["a", "b", "c"],
    "set": {1.0, 2.0},
    "numpy string": np.str_("x"),
    "numpy record": np.zeros(1, [("a", int)])[0],
    "numpy half": np.float16(1.5),
    "numpy byte": np.int8(3),
    "fraction": fractions.Fraction(1, 3),
    "decimal nan": decimal.Decimal("nan"),
    "module": os,
}


def means(bad, right) -> bool:
    """Whether `bad` is what could be meant where `right` is right."""
    if isinstance(right, Or):
        return any(means(bad, one) for one in (right.first, *right.others))
    if right is None or bad is None or isinstance(bad, Hostile):
        return bad is right
    if isinstance(right, bool):
        return isinstance(bad, bool | np.bool_)
    if isinstance(right, int | float):
        return _is_numbers(bad, 0)
    if isinstance(right, str | pathlib.Path):
        return isinstance(bad, str | os.PathLike)
    if isinstance(right, type | types.FunctionType | types.BuiltinFunctionType):
        return callable(bad)
    if isinstance(right, np.ndarray) or (isinstance(right, tuple | list) and right and _is_numbers(right[0])):
        return _is_numbers(bad, np.ndim(right))
    if isinstance(right, dict):
        return isinstance(bad, dict)
    if isinstance(right, tuple | list):
        return isinstance(bad, tuple | list | set) and all(right and means(one, right[0]) for one in bad)
    return isinstance(bad, [c for c in type(right).__mro__ if c.__module__.startswith("fieldsim")][-1])


def _is_numbers(value, ndim=None):
    """Whether `value` is real finite numbers and nothing else."""
    if isinstance(value, np.ma.MaskedArray | Kilometres | dict | set | type | types.ModuleType):
        return False
    if isinstance(value, list | tuple) and any(isinstance(one, Kilometres) for one in value):
        return False
    try:
        array = np.asarray(value)
        if array.dtype.kind == "O":
            array = np.asarray([float(x) for x in array.flat if not isinstance(x, str)]).reshape(array.shape)
        return array.dtype.kind in "iuf" and np.isfinite(array).all() and ndim in (None, array.ndim)
    except (TypeError, ValueError, OverflowError):
        return False
