"""How far elements reach: the distance from a primitive beyond which its field stays below a level.

No element gives more than strength * measure * h(distance to it), where of a compact kernel only that part of the
measure counts which lies within its support; and a piece of a line or a plane no more than the whole line or plane.
"""

import math

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.kernels.base import Whole
from fieldsim.potentials.row import FOLD, KERNEL_WIDTH, STRENGTH


def reach(rows, kinds, level):
    """Distances (...,) from each primitive beyond which its field is at most `level` in size; 0 where it never is more.

    rows (..., N, ROW_WIDTH), kinds (N,); level: a number, or one per element.
    """
    result = np.zeros(rows.shape[:-1])
    level = np.broadcast_to(level, result.shape)
    for formula, which in registry.parts_of(kinds):
        result[..., which] = _reach(formula, rows[..., which, :], level[..., which])
    return result


def alone(rows, kinds):
    """About how far (...,) from each primitive, beside its middle, its own field comes to 1; 0 where it does not.

    rows (..., N, ROW_WIDTH), kinds (N,). A bent primitive counts as a straight one, so that this is no bound.
    """
    result = np.zeros(rows.shape[:-1])
    for formula, which in registry.parts_of(kinds):
        part = rows[..., which, :]
        result[..., which] = np.where(part[..., STRENGTH] > 0.0, _reach(formula, part, 1.0, bent=True), 0.0)
    return result


def scale(rows, kinds):
    """Lengths (N,) over which elements' fields vary: a kernel's width, or where all of 1/r may come to F = 1."""
    width = rows[..., KERNEL_WIDTH]
    result = np.empty_like(width)
    parts = registry.parts_of(kinds)
    endless = sum(len(width[which]) for formula, which in parts if formula.kernel.unit)
    for formula, which in parts:
        result[which] = formula.kernel.scale_of(width[which])
        if formula.kernel.unit:
            result[which] = np.maximum(_reach(formula, rows[which], 1.0 / endless), result[which])
    return np.where(result > 0.0, result, math.inf)


def _reach(formula, rows, level, *, bent=False):
    """See `reach`; bent: take what is bent for a piece of the whole line or plane, too."""
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
        bounds = [formula.kernel.inverse(ratio / within(formula, rows), width)]
        whole = formula.kernel.whole(dimension)
        if (primitive.straight or bent) and primitive.uniform and isinstance(whole, Whole):
            bounds.append(whole.inverse(ratio / whole.factor(width), width))
    bounds = [np.nan_to_num(bound, nan=np.inf, posinf=np.inf) for bound in bounds]
    return np.where(strength > 0.0, np.minimum.reduce(bounds), 0.0)


def within(formula, rows):
    """No less than the measure of the part of a primitive that gives to any one point, (...,)."""
    whole = formula.primitive.row_measure(rows)
    if not formula.kernel.compact or not formula.primitive.uniform:
        return whole
    width = rows[..., KERNEL_WIDTH]
    return np.minimum(whole, formula.primitive.nearby * width**formula.primitive.dimension)
