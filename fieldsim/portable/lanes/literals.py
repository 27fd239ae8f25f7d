"""Numbers as literals of C++."""

import math

import numpy as np


def literal(number: float, single: bool) -> str:
    """A real as a literal, rounded to float32 where `single`."""
    value = np.float32(number) if single else float(number)
    if math.isnan(value):
        return '__builtin_nanf("")' if single else '__builtin_nan("")'
    if math.isinf(value):
        text = "__builtin_inff()" if single else "__builtin_inf()"
        return text if value > 0 else f"-{text}"
    return f"{value!s}f" if single else repr(value)
