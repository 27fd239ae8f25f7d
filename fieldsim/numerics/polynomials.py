"""Polynomials of many terms, portable, in Estrin's order (1960): short chains keep the processor's pipes full."""

from fieldsim.portable import portable, real


@portable
def degree_11(
    x: real,
    c0: real,
    c1: real,
    c2: real,
    c3: real,
    c4: real,
    c5: real,
    c6: real,
    c7: real,
    c8: real,
    c9: real,
    c10: real,
    c11: real,
):
    """Polynomial c0 + c1 x + ..., in Estrin's order: short chains keep the processor's pipes full."""
    x2 = x * x
    x4 = x2 * x2
    low = (c0 + c1 * x) + (c2 + c3 * x) * x2
    middle = (c4 + c5 * x) + (c6 + c7 * x) * x2
    high = (c8 + c9 * x) + (c10 + c11 * x) * x2
    return low + (middle + high * x4) * x4


@portable
def degree_13(
    x: real,
    c0: real,
    c1: real,
    c2: real,
    c3: real,
    c4: real,
    c5: real,
    c6: real,
    c7: real,
    c8: real,
    c9: real,
    c10: real,
    c11: real,
    c12: real,
    c13: real,
):
    """Polynomial of degree 13, as `degree_11`."""
    x4 = (x * x) * (x * x)
    return degree_11(x, c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11) + (x4 * x4) * x4 * (c12 + c13 * x)


@portable
def degree_20(
    x: real,
    c0: real,
    c1: real,
    c2: real,
    c3: real,
    c4: real,
    c5: real,
    c6: real,
    c7: real,
    c8: real,
    c9: real,
    c10: real,
    c11: real,
    c12: real,
    c13: real,
    c14: real,
    c15: real,
    c16: real,
    c17: real,
    c18: real,
    c19: real,
    c20: real,
):
    """Polynomial of degree 20, as `degree_11`."""
    x4 = (x * x) * (x * x)
    return degree_11(x, c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11) + (x4 * x4) * x4 * (
        ((c12 + c13 * x) + (c14 + c15 * x) * (x * x)) + (((c16 + c17 * x) + (c18 + c19 * x) * (x * x)) + c20 * x4) * x4
    )
