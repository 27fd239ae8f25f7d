"""One source of field mathematics: scalar Python functions, compiled for Warp in both precisions, numba and lanes."""

from fieldsim.portable.function import Portable, portable
from fieldsim.portable.holes import hole
from fieldsim.portable.marks import Indices, Table, real

__all__ = ["Indices", "Portable", "Table", "hole", "portable", "real"]
