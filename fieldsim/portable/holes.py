"""Holes: the global names of a portable function that a caller fills with `bind`.

    kernel = hole("r2, width, fold")        a function of three arguments
    SQUARE = hole()                         a number

A hole is declared once, above the functions that use it, so that readers and tools see where the name comes from.
"""

from typing import Any, NoReturn

from fieldsim.errors import PortableError


class Hole:
    """A name without a value. arguments: those of the function it stands for; None for a number."""

    def __init__(self, arguments: tuple[str, ...] | None):
        self.arguments = arguments

    def __call__(self, *_args) -> NoReturn:
        """Raise PortableError: there is nothing to call."""
        raise PortableError(f"{self} is not filled; bind it in the portable function that uses it, and call that")

    def __repr__(self) -> str:
        return (
            "hole for a number" if self.arguments is None else f"hole for a function of ({', '.join(self.arguments)})"
        )

    def check(self, name: str, value: Any, function: str) -> None:
        """Raise PortableError where `value` cannot fill this hole, called `name`, of a portable function.

        It has as many arguments, and those that both name stand in the same place, so that none are swapped.
        """
        given = _arguments(value)
        if self.arguments is None or given is None:
            fits = self.arguments is None and isinstance(value, int | float)
        else:
            fits = len(given) == len(self.arguments) and all(
                ours == theirs or (ours not in given and theirs not in self.arguments)
                for ours, theirs in zip(self.arguments, given, strict=True)
            )
        if not fits:
            what = repr(value) if given is None else f"{value.__qualname__} of ({', '.join(given)})"
            raise PortableError(f"{name} of portable function {function} is a {self}; {what} does not fit it")


def hole(arguments: str | None = None) -> Any:
    """A global name for `bind` to fill: a function of the named arguments ("x, rows, i"), or without them a number."""
    return Hole(None if arguments is None else tuple(name.strip() for name in arguments.split(",")))


def _arguments(value):
    """The names of a portable function's arguments; None for what is none."""
    code = getattr(getattr(value, "function", None), "__code__", None)
    return None if code is None else code.co_varnames[: code.co_argcount]
