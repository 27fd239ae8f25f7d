"""How much an element's field can change within a given distance: what makes a step along a ray safe.

With r >= d the distance from x to a point of the primitive and x' at most delta away, r' >= r - delta. Hence, for a
density that is nowhere negative:

- powers, h = (r^2 + e^2)^(-m/2) up to a factor (Cauchy: m = 4, e = 1/s; inverse square: 2; Newtonian: 1):
  F(x') <= F(x) (D / (D - delta))^m with D^2 = d^2 + e^2, since sqrt(r^2 + e^2) falls by at most delta.
- Gaussians on convex primitives: a convolution of log-concave functions is log-concave (Prekopa 1971), so that log F
  stays below its tangent; and log F + a^2 |x|^2 is convex (Hoelder), so that on any primitive log F stays above its
  tangent by no more than -a^2 delta^2.
- Gaussians on arcs: what lies within c of x grows by at most exp(2 a^2 c delta - a^2 delta^2); c is chosen such that
  all that lies beyond stays below TAIL_SHARE.
- compact kernels: sqrt(h) has a greatest slope, hence (Minkowski) sqrt(F) one of sqrt(length or area in reach) times
  that.
- planes under kernels without a finite integral: the slope of F itself is bounded.

Besides, |d2F/dt2| along any ray is at most `bend`, the primitive's measure times the kernel's greatest curvature, so
that F follows its tangent within bend delta^2 / 2.
"""

import math

import numpy as np

from fieldsim.errors import InputError
from fieldsim.portable import Table, portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.elements import Elements
from fieldsim.potentials.kernels.base import Diverges
from fieldsim.potentials.row import FOLD, KERNEL_WIDTH, ROW, ROW_WIDTH, STRENGTH, Layout

BOUNDED = Layout(extends=ROW)
FAMILY = BOUNDED.number("FAMILY", "which bound holds: POWERS, GAUSSIANS, COMPACT or SLOPED")
SOFTENING = BOUNDED.number("SOFTENING", "e of a power")
POWER = BOUNDED.number("POWER", "m of a power")
AMOUNT = BOUNDED.number("AMOUNT", "the greatest field, per h")
CORE = BOUNDED.number("CORE", "c - delta of an arc under a Gaussian")
SLOPE = BOUNDED.number("SLOPE", "greatest slope of sqrt(F) of a compact kernel, of F of a plane")

POWERS, GAUSSIANS, COMPACT, SLOPED = 0.0, 1.0, 2.0, 3.0
TAIL_SHARE = 1e-13  # of the level
TRUSTED = 1e-9  # a Gaussian's field below this may lack the digits that its logarithm's slope needs
_LIMIT = 700.0  # exp of more is infinite


def with_bounds(elements: Elements) -> tuple[np.ndarray, float]:
    """Rows (N, BOUNDED.width) with what bounds each element's growth, and the bend of all.

    Raises InputError for a formula that safe steps do not know.
    """
    rows = np.concatenate([elements.rows, np.zeros((len(elements), BOUNDED.width - ROW_WIDTH))], axis=1)
    bend = 0.0
    for kind, formula in registry.formulas_of(elements.kinds_used).items():
        where = elements.kinds == kind
        check(formula)
        rows[where], bends = _bounded(formula, rows[where])
        bend += bends.sum()
    return rows, bend


def check(formula: registry.Formula) -> None:
    """Raise InputError for a formula whose field's growth has no known bound."""
    kernel, primitive = formula.kernel, formula.primitive
    known = primitive.distance is not None and primitive.uniform and not primitive.profiled
    if not known or not (kernel.power or kernel.folds or kernel.compact):
        raise InputError(
            f"the solver 'referee' knows no safe step beside {kernel.__name__} on {primitive.__name__}; "
            "give solver='hermite'"
        )


def _bounded(formula, rows):
    """Rows of one formula with their bounds, and the bend of each."""
    kernel, primitive = formula.kernel, formula.primitive
    width, strength = rows[:, KERNEL_WIDTH], np.abs(rows[:, STRENGTH])
    measure = primitive.row_measure(rows)
    if primitive.endless and isinstance(kernel.plane, Diverges):
        return _plane_without_integral(kernel, rows, width, strength)
    if kernel.power:
        family, softening = POWERS, kernel.softening_of(width)
        rows[:, SOFTENING], rows[:, POWER] = softening, kernel.power
        amount = strength * measure * (softening**kernel.power if kernel.reciprocal else 1.0)
        with np.errstate(divide="ignore"):  # unsoftened: no bound
            sharpest = kernel.power * softening ** -(kernel.power + 2.0)
        bend = amount * sharpest
    elif kernel.folds:
        family = GAUSSIANS
        whole = kernel.line.factor(width) ** primitive.dimension
        amount = strength * (measure if primitive.round else np.minimum(measure, whole))
        peak = np.exp(np.minimum(rows[:, FOLD], _LIMIT))
        bend = strength * measure * peak * kernel.log_bend(width)
        if primitive.round:
            height = rows[:, FOLD] + np.log(np.maximum(amount / TAIL_SHARE, 1.0))
            rows[:, CORE] = np.sqrt(np.maximum(height, 1e-12)) / width
    else:
        family = COMPACT
        nearby = np.minimum(measure, primitive.nearby * width**primitive.dimension)
        amount = strength * nearby
        # What x and what x' reach, together.
        rows[:, SLOPE] = kernel.steepest / width * np.sqrt(strength * np.minimum(measure, 2.0 * nearby))
        bend = amount * kernel.sharpest / width**2
    rows[:, FAMILY], rows[:, AMOUNT] = family, amount
    if primitive.endless:
        # F'' = -2 pi (z h)', and |(z h)'| is nowhere above h(0).
        bend = math.tau * strength * np.exp(np.minimum(rows[:, FOLD], _LIMIT))
    return rows, bend


def _plane_without_integral(kernel, rows, softening, strength):
    """F' is -2 pi z / w^power, w^2 = z^2 + softening^2."""
    if kernel.power > 1 and (softening == 0.0).any():
        raise InputError(
            f"the solver 'referee' knows no safe step beside an unsoftened {kernel.__name__} on Plane; give a softening"
        )
    with np.errstate(divide="ignore"):
        steepest = kernel.plane.slope(strength, softening)
        bend = math.tau * strength / softening**kernel.power
    rows[:, FAMILY], rows[:, AMOUNT], rows[:, SLOPE] = SLOPED, math.inf, steepest
    return rows, bend


@portable
def _raised(u: real, power: real):
    """A power of u, a whole number."""
    if power == real(1.0):
        return u
    if power == real(2.0):
        return u * u
    if power == real(4.0):
        return u * u * u * u
    return math.pow(u, power)


@portable
def ceiling(d: real, rows: Table, i: int):
    """No less than the field (for a strength of its own size, but positive) at the distance d from the primitive."""
    family = rows[i, FAMILY]
    amount = rows[i, AMOUNT]
    if family == real(POWERS):
        away = math.sqrt(d * d + rows[i, SOFTENING] * rows[i, SOFTENING])
        return amount / _raised(away, rows[i, POWER])
    if family == real(GAUSSIANS):
        u = rows[i, KERNEL_WIDTH] * d
        return amount * math.exp(min(rows[i, FOLD] - u * u, real(_LIMIT)))
    if family == real(COMPACT) and d >= rows[i, KERNEL_WIDTH]:
        return real(0.0)
    return amount


@portable
def rise(f: real, slope: real, d: real, delta: real, rows: Table, i: int):
    """No less than an element's field `delta` further along a ray.

    f, slope: its field, and its derivative along the ray, for a positive strength; d: the distance to its primitive, or
    less.
    """
    family = rows[i, FAMILY]
    if family == real(POWERS):
        share = real(1.0) - delta / math.sqrt(d * d + rows[i, SOFTENING] * rows[i, SOFTENING])
        if share <= real(0.0):
            return real(math.inf)
        return f / _raised(share, rows[i, POWER])
    if family == real(GAUSSIANS):
        most = ceiling(max(d - delta, real(0.0)), rows, i)
        if f < real(TRUSTED):
            return most
        growth = slope / f * delta
        rest = real(0.0)
        if rows[i, CORE] > real(0.0):
            a2 = rows[i, KERNEL_WIDTH] * rows[i, KERNEL_WIDTH]
            growth = a2 * delta * (real(2.0) * rows[i, CORE] + delta)
            rest = real(TAIL_SHARE)
        return min(most, f * math.exp(min(growth, real(_LIMIT))) + rest)
    if family == real(COMPACT):
        if d - delta >= rows[i, KERNEL_WIDTH]:
            return real(0.0)
        root = math.sqrt(max(f, real(0.0))) + rows[i, SLOPE] * delta
        return root * root
    return f + rows[i, SLOPE] * delta


@portable
def fall(f: real, slope: real, d: real, delta: real, rows: Table, i: int):
    """No more than an element's field `delta` further along a ray; arguments as for `rise`."""
    family = rows[i, FAMILY]
    if family == real(POWERS):
        # Of all points, the nearest loses most.
        share = real(1.0) + delta / math.sqrt(d * d + rows[i, SOFTENING] * rows[i, SOFTENING])
        return f / _raised(share, rows[i, POWER])
    if family == real(GAUSSIANS):
        if f < real(TRUSTED):
            return real(0.0)
        u = rows[i, KERNEL_WIDTH] * delta
        return f * math.exp(max(slope / f * delta - u * u, -real(_LIMIT)))
    if family == real(COMPACT):
        root = max(math.sqrt(max(f, real(0.0))) - rows[i, SLOPE] * delta, real(0.0))
        return root * root
    return f - rows[i, SLOPE] * delta


def reach(rows: np.ndarray) -> float:
    """A distance from all primitives, none a plane, beyond which their fields together stay below the level."""
    distance = 1e-6
    while sum(ceiling(distance, rows, i) for i in range(len(rows))) >= 1.0:
        distance *= 1.25
    return distance
