"""What stands in the annotations of portable functions."""

from typing import Protocol

real = float


class Table(Protocol):
    """Annotation: two-dimensional array of reals."""

    shape: tuple[int, int]

    def __getitem__(self, place: tuple[int, int], /) -> real: ...


class Indices(Protocol):
    """Annotation: one-dimensional array of int32."""

    shape: tuple[int]

    def __getitem__(self, place: int, /) -> int: ...


MARKS = (real, int, bool, Table, Indices)
