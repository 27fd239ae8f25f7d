"""Special functions that Warp lacks or that need their cancellation taken out, as portable scalar functions."""

import math

from fieldsim.portable import portable, real


@portable
def log1p(x: real):
    """log(1 + x) for x >= -1 (-inf at -1, inf at inf). Relative error < 4 ulp.

    W. Kahan's form: log(u) x / (u - 1) with u = 1 + x as rounded, in which the rounding of u cancels (Goldberg 1991).
    """
    u = real(1.0) + x
    rounded = u - real(1.0)
    if rounded == real(0.0):
        return x
    if rounded == x:
        return math.log(u)
    return math.log(u) * (x / rounded)
