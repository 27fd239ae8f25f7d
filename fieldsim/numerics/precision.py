"""Properties of the scalar type, for portable functions."""

from fieldsim.portable import portable, real

# Lost beside 1 in float32, but not in float64.
LOST = 1e-10


@portable
def is_single():
    """Whether `real` is float32: a constant to compilers, so that the other precision's branch costs nothing."""
    return real(1.0) + real(LOST) == real(1.0)
