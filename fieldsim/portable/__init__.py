"""One source of field mathematics: scalar Python functions, compiled for Warp float32, Warp float64 and numba."""

from fieldsim.portable.function import Indices, Portable, Table, portable, real
from fieldsim.portable.holes import hole

__all__ = ["Indices", "Portable", "Table", "hole", "portable", "real"]
