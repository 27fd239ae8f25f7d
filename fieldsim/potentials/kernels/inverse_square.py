"""The InverseSquare kernel."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim.portable import portable, real
from fieldsim.potentials.kernels.base import Diverges, PowerLaw, Whole, distance, half_maximum
from fieldsim.types import RealLike


@portable
def law(r2: real, softening: real, fold: real, times: real):
    """h, dh/d(r^2) and times d2h/d(r^2)^2. At an unsoftened source: +inf and slopes 0."""
    d2 = r2 + softening * softening
    if d2 == real(0.0):
        return real(math.inf), real(0.0), real(0.0)
    h = real(1.0) / d2
    return h, -h * h, real(2.0) * (times / d2) * h * h


def _beside_line(ratio, softening):
    """Where pi / sqrt(rho^2 + softening^2) falls to a ratio of pi."""
    return distance(ratio**-2.0 - softening**2)


@dataclasses.dataclass(frozen=True)
class InverseSquare(PowerLaw):
    """h(r) = 1 / (r^2 + softening^2) (electrostatics of lines; Wyvill & van Overveld 1996)."""

    softening: float = 0.0

    if TYPE_CHECKING:

        def __init__(self, softening: RealLike = ...) -> None: ...

    law = law
    power = 2
    line = Whole(lambda softening: np.full_like(softening, math.pi), _beside_line)
    plane = Diverges(slope=lambda strength, softening: math.pi * strength / softening)

    @staticmethod
    def inverse(level: np.ndarray, softening: float) -> np.ndarray:
        """Where h falls to a level."""
        return distance(1.0 / level - softening**2)

    @staticmethod
    def width_of(radius: float, b: float) -> float:
        """Half maximum where the Gaussian has it."""
        return half_maximum(radius, b)
