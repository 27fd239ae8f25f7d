"""Types of values that users give, as annotations name them.

What is *given* may be wider than what is *kept*: a constructor takes a list, an array or a NumPy scalar and its
attribute is a tuple or a float. Names ending in `Like` are of values given; `validate` checks and converts them.
"""

import os
from collections.abc import Callable, Sequence
from typing import TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

T = TypeVar("T")

# A value, or a function of time that gives one.
Timed: TypeAlias = T | Callable[[float], T]

# One real number: Python's or NumPy's. An int is a float to type checkers.
RealLike: TypeAlias = float | np.floating | np.integer

# One whole number.
WholeLike: TypeAlias = int | np.integer

# Three numbers (x, y, z), kept as a tuple of floats, and four, a quaternion (w, x, y, z).
Vector: TypeAlias = tuple[float, float, float]
VectorLike: TypeAlias = Sequence[RealLike] | np.ndarray
Quaternion: TypeAlias = tuple[float, float, float, float]

# Numbers that become a float64 array, such as points (N, 3).
ArrayLike: TypeAlias = npt.ArrayLike | Sequence[RealLike] | Sequence[VectorLike]

# A colour: a name, "#rrggbb", or linear (r, g, b).
ColorLike: TypeAlias = str | VectorLike

# (width, height) in pixels.
SizeLike: TypeAlias = Sequence[WholeLike] | np.ndarray

# A file's or folder's path.
PathLike: TypeAlias = str | os.PathLike[str]
