"""C functions made of Python ones, by numba or in lanes, kept on disk as object code: a second process loads them."""

from fieldsim.native.functions import NativeFunction, inner, native_function
from fieldsim.native.lanes import ONE_ITEM, lanes_function_at
from fieldsim.native.loader import known, place_of

__all__ = ["ONE_ITEM", "NativeFunction", "inner", "known", "lanes_function_at", "native_function", "place_of"]
