"""Compensated arithmetic, portable: sums and products with their rounding errors, and numbers as pairs.

A pair is a number and what it lacks: their sum has twice the digits. Compilers may fuse a product with a sum: the
errors of sums stay exact, those of products are then off by less than the last digit of a pair. All in round to
nearest, away from overflow and underflow. (Dekker 1971; Knuth 1969; Ogita, Rump & Oishi 2005.)
"""

from fieldsim.numerics.precision import is_single
from fieldsim.portable import portable, real

# Half the digits of float64 and of float32.
HALF = 2.0**26
HALF_SINGLE = 2.0**11
# Veltkamp's factors: 2^27 + 1 and 2^12 + 1.
VELTKAMP = 2.0**27 + 1.0
VELTKAMP_SINGLE = 2.0**12 + 1.0


@portable
def two_sum(a: real, b: real):
    """The sum a + b as rounded, and what that lacks, exactly. Knuth 1969."""
    s = a + b
    part = s - a
    return s, (a - (s - part)) + (b - part)


@portable
def two_difference(a: real, b: real):
    """The difference a - b as rounded, and what that lacks, exactly."""
    d = a - b
    back = d - a
    return d, (a - (d - back)) - (b + back)


@portable
def fast_two_sum(a: real, b: real):
    """As `two_sum`, for |a| >= |b| or a = 0. Dekker 1971."""
    s = a + b
    return s, b - (s - a)


@portable
def half_digits():
    """2^26, or in float32 2^11: a number of size 1 plus and minus this keeps the upper half of its digits."""
    half = real(HALF)
    if is_single():
        half = real(HALF_SINGLE)
    return half


@portable
def split_at(x: real, grid: real):
    """The number x as a multiple of grid times the type's rounding, and the rest; exact for |x| below grid."""
    high = (x + grid) - grid
    return high, x - high


@portable
def split(x: real):
    """The upper half of a number's digits and the rest, exactly. Veltkamp 1968."""
    factor = real(VELTKAMP)
    if is_single():
        factor = real(VELTKAMP_SINGLE)
    c = factor * x
    high = c - (c - x)
    return high, x - high


@portable
def two_product(a: real, b: real):
    """The product a b as rounded, and what that lacks, exactly. Dekker 1971."""
    p = a * b
    a1, a2 = split(a)
    b1, b2 = split(b)
    return p, (((a1 * b1 - p) + a1 * b2) + a2 * b1) + a2 * b2


@portable
def pair_sum(a: real, a_low: real, b: real, b_low: real):
    """The sum of two pairs, as a pair. Relative error of that of the sizes: 4 u^2, u = 2^-53 (float32: 2^-24)."""
    s, low = two_sum(a, b)
    return fast_two_sum(s, low + (a_low + b_low))


@portable
def pair_product(a: real, a_low: real, b: real, b_low: real):
    """The product of two pairs, as a pair (the second may overlap the first by some digits). Relative error 8 u^2."""
    p, low = two_product(a, b)
    return p, low + (a * b_low + a_low * b)
