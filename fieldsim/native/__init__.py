"""C functions made of Python ones by numba, kept on disk as object code: the second process only loads them."""

from fieldsim.native.functions import NativeFunction, inner, native_function
from fieldsim.native.loader import known, place_of

__all__ = ["NativeFunction", "inner", "known", "native_function", "place_of"]
