"""Running sums that keep what rounding leaves out, as Warp functions: of numbers, of vectors and of rows of them.

A sum is kept as a rounded total and a rest, what rounding has left out of it so far.
"""

from typing import Any

import warp as wp

from fieldsim.numerics.compensated import two_product
from fieldsim.portable import portable, real

_two_product = two_product.warp(wp.float64)


@portable
def compensated(total: real, rest: real, step: real):
    """`added` for one number, portable."""
    step = step + rest
    result = total + step
    return result, step - (result - total)


@wp.func
def added(total: Any, rest: Any, step: Any):
    """`total + step` and its new rest, for steps that are small beside the total.

    Kahan's summation (1965): after n steps the error is that of one rounding, and n u^2 of the sum of sizes.
    """
    step = step + rest
    result = total + step
    return result, step - (result - total)


@wp.func
def exactly_added(total: Any, rest: Any, step: Any):
    """`total + step` and its new rest, exact for steps of any size but for the rounding of `step + rest`.

    Knuth's two-sum (1969).
    """
    step = step + rest
    result = total + step
    part = result - total
    return result, (total - (result - part)) + (step - part)


@wp.func
def product_rest(factor: wp.float64, vector: wp.vec3d):
    """What the product has beside its rounded value, exactly (Dekker 1971)."""
    rest = wp.vec3d()
    for k in range(3):
        _product, low = _two_product(factor, vector[k])
        rest[k] = low
    return rest
