"""What a support cuts out of an edge, and the angles of the pieces."""

import math

from fieldsim.portable import portable, real


@portable
def chord(lo: real, hi: real, square: real):
    """The part of lo..hi where t^2 < square; an empty one lies at lo."""
    half = math.sqrt(max(square, real(0.0)))
    start = max(lo, -half)
    end = min(hi, half)
    if end <= start:
        start = lo
        end = lo
    return start, end


@portable
def angle_between(d: real, start: real, end: real):
    """A vector of the angle under which start..end on a line at distance d is seen, with the sign of d."""
    return d * d + start * end, d * (end - start)


@portable
def angles_between(d: real, start: real, end: real, again: real, last: real):
    """A vector of the sum of two such angles."""
    x, y = angle_between(d, start, end)
    u, v = angle_between(d, again, last)
    return x * u - y * v, x * v + y * u


@portable
def compact_gone(away: real, size: real, radius: real):
    """Whether all of the triangle lies beyond the support."""
    return math.sqrt(away) > radius + size
