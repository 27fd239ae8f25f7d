"""Calls of users' own functions: an error in them is reported with the line of the user's file."""

import os
import traceback

from fieldsim.errors import FieldsimError, InputError
from fieldsim.types import RealLike
from fieldsim.validate.scalars import number
from fieldsim.validate.words import shown

_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__))) + os.sep


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
