"""The Cauchy kernel."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim.portable import portable, real
from fieldsim.potentials.kernels.base import PowerLaw, Whole, distance
from fieldsim.types import RealLike

# Half width of (1 + s^2 r^2)^-2 equals that of exp(-a^2 r^2) when s = PER_GAUSSIAN a.
PER_GAUSSIAN = math.sqrt((math.sqrt(2.0) - 1.0) / math.log(2.0))


@portable
def law(r2: real, s: real, fold: real, times: real):
    """h, dh/d(r^2) and times d2h/d(r^2)^2."""
    h = real(1.0) / (real(1.0) + s * s * r2)
    slope = -real(2.0) * s * s * h * h * h
    return h * h, slope, -real(3.0) * slope * (s * s * times * h)


def _inverse(power):
    """Where (1 + s^2 r^2)^-power falls to a level."""

    def inverse(level: np.ndarray, s: float) -> np.ndarray:
        return distance(level ** (-1.0 / power) - 1.0) / s

    return inverse


@dataclasses.dataclass(frozen=True)
class Cauchy(PowerLaw):
    """h(r) = 1 / (1 + s^2 r^2)^2 (Sherstyuk 1999, 2.3.1)."""

    s: float = 1.0

    if TYPE_CHECKING:

        def __init__(self, s: RealLike = ...) -> None: ...

    law = law
    inverse = staticmethod(_inverse(2.0))
    power = 4
    reciprocal = True
    line = Whole(lambda s: 0.5 * math.pi / s, _inverse(1.5))
    plane = Whole(lambda s: math.pi / s**2, _inverse(1.0))

    @staticmethod
    def width_of(radius: float, b: float) -> float:
        """Half maximum where the Gaussian has it."""
        return PER_GAUSSIAN * math.sqrt(b) / radius
