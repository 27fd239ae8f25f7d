"""One source of field mathematics: scalar Python functions, compiled for Warp float32, Warp float64 and numba."""

from fieldsim.portable.function import Indices, Portable, Table, portable, real

__all__ = ["Indices", "Portable", "Table", "portable", "real"]
