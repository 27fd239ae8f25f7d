"""How far elements reach: the distance from a primitive beyond which its field stays below a level.

No element gives more than strength * measure * h(distance to it), where of a compact kernel only that part of the
measure counts which lies within its support; and a piece of a line or a plane no more than the whole line or plane.
"""

import math

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.kernels import (
    COMPACT,
    Cauchy,
    Gaussian,
    InverseSquare,
    Metaball,
    Newtonian,
    Quartic,
    SoftObject,
)
from fieldsim.potentials.row import FOLD, KERNEL_WIDTH, STRENGTH

# A compact kernel changes over this share of its support as a Gaussian does over 1 / a.
_SHARE = 0.4


def _cauchy(power):
    return lambda ratio, s: np.sqrt(np.maximum(ratio ** (-1.0 / power) - 1.0, 0.0)) / s


def _gaussian(ratio, a):
    return np.sqrt(np.maximum(-np.log(ratio), 0.0)) / a


def _quartic(ratio, radius):
    return radius * np.sqrt(1.0 - np.sqrt(np.minimum(ratio, 1.0)))


def _soft_object(ratio, radius):
    # w^2 (5 + 4 w) / 9 = ratio, w = 1 - u^2, by Newton's method, which from below only overshoots once.
    ratio = np.minimum(ratio, 1.0)
    w = np.sqrt(ratio)
    for _ in range(8):
        w = w - (w * w * (5.0 + 4.0 * w) - 9.0 * ratio) / np.maximum(w * (10.0 + 12.0 * w), 1e-300)
    return radius * np.sqrt(np.clip(1.0 - w, 0.0, 1.0))


def _metaball(ratio, radius):
    inner = np.sqrt(np.maximum(1.0 - ratio, 0.0) / 3.0)
    return radius * np.where(ratio > 2.0 / 3.0, inner, 1.0 - np.sqrt(ratio / 1.5))


# Of h on a point: the distance where h falls to a ratio, by (ratio, width).
_POINT = {
    Gaussian: _gaussian,
    Cauchy: _cauchy(2.0),
    Newtonian: lambda ratio, softening: np.sqrt(np.maximum(ratio**-2.0 - softening**2, 0.0)),
    InverseSquare: lambda ratio, softening: np.sqrt(np.maximum(1.0 / ratio - softening**2, 0.0)),
    Metaball: _metaball,
    SoftObject: _soft_object,
    Quartic: _quartic,
}
# The field of a whole line and of a whole plane, where it has the form factor(width) * profile(distance): the factor,
# and where the profile falls to a ratio.
_WHOLE = {
    (Gaussian, 1): (lambda a: math.sqrt(math.pi) / a, _gaussian),
    (Gaussian, 2): (lambda a: math.pi / a**2, _gaussian),
    (Cauchy, 1): (lambda s: 0.5 * math.pi / s, _cauchy(1.5)),
    (Cauchy, 2): (lambda s: math.pi / s**2, _cauchy(1.0)),
    (InverseSquare, 1): (lambda softening: np.full_like(softening, math.pi), _POINT[Newtonian]),
}


def reach(rows, kinds, level):
    """Distances (...,) from each primitive beyond which its field is at most `level` in size; 0 where it never is more.

    rows (..., N, WIDTH), kinds (N,); level: a number, or one per element.
    """
    result = np.zeros(rows.shape[:-1])
    level = np.broadcast_to(level, result.shape)
    for formula, which in registry.parts_of(kinds):
        result[..., which] = _reach(formula, rows[..., which, :], level[..., which])
    return result


def scale(rows, kinds):
    """Lengths (N,) over which elements' fields vary: a kernel's width, or where all of 1/r may come to F = 1."""
    width = rows[..., KERNEL_WIDTH]
    result = np.empty_like(width)
    parts = registry.parts_of(kinds)
    endless = sum(len(width[which]) for formula, which in parts if formula.kernel in (Newtonian, InverseSquare))
    for formula, which in parts:
        if formula.kernel in (Gaussian, Cauchy):
            result[which] = 1.0 / width[which]
        elif formula.kernel in COMPACT:
            result[which] = _SHARE * width[which]
        else:
            result[which] = np.maximum(_reach(formula, rows[which], 1.0 / endless), width[which])
    return np.where(result > 0.0, result, math.inf)


def _reach(formula, rows, level):
    if formula.primitive.distance is None:
        raise InputError(
            f"a surface of {formula.kernel.__name__} on {formula.primitive.__name__} can neither be drawn nor touched; "
            "leave it out, or give the body another skeleton"
        )
    width = rows[..., KERNEL_WIDTH]
    primitive, dimension = formula.primitive, formula.primitive.dimension
    strength = np.abs(rows[..., STRENGTH]) * primitive.row_factor(rows)
    # A share of 1 in 1e9 for rounding.
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        ratio = level / (1.0 + 1e-9) / strength * np.exp(-rows[..., FOLD])
        bounds = [_POINT[formula.kernel](ratio / within(formula, rows), width)]
        if primitive.straight and primitive.uniform and (formula.kernel, dimension) in _WHOLE:
            factor, inverse = _WHOLE[formula.kernel, dimension]
            bounds.append(inverse(ratio / factor(width), width))
    bounds = [np.nan_to_num(bound, nan=np.inf, posinf=np.inf) for bound in bounds]
    return np.where(strength > 0.0, np.minimum.reduce(bounds), 0.0)


def within(formula, rows):
    """No less than the measure of the part of a primitive that gives to any one point, (...,)."""
    whole = formula.primitive.row_measure(rows)
    if formula.kernel not in COMPACT or not formula.primitive.uniform:
        return whole
    width = rows[..., KERNEL_WIDTH]
    return np.minimum(whole, formula.primitive.nearby * width**formula.primitive.dimension)
