"""The Newtonian kernel."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim.portable import portable, real
from fieldsim.potentials.kernels.base import Diverges, PowerLaw, distance, half_maximum
from fieldsim.types import RealLike


@portable
def law(r2: real, softening: real, fold: real, times: real):
    """h, dh/d(r^2) and times d2h/d(r^2)^2. At an unsoftened source: +inf and slopes 0."""
    d2 = r2 + softening * softening
    if d2 == real(0.0):
        return real(math.inf), real(0.0), real(0.0)
    h = real(1.0) / math.sqrt(d2)
    slope = -real(0.5) * h / d2
    return h, slope, -real(1.5) * slope * (times / d2)


@dataclasses.dataclass(frozen=True)
class Newtonian(PowerLaw):
    """h(r) = 1 / sqrt(r^2 + softening^2): gravity."""

    softening: float = 0.0

    if TYPE_CHECKING:

        def __init__(self, softening: RealLike = ...) -> None: ...

    law = law
    power = 1
    line = Diverges()
    plane = Diverges(slope=lambda strength, softening: math.tau * strength)

    @staticmethod
    def inverse(level: np.ndarray, softening: float) -> np.ndarray:
        """Where h falls to a level."""
        return distance(level**-2.0 - softening**2)

    @staticmethod
    def width_of(radius: float, b: float) -> float:
        """Half maximum where the Gaussian has it."""
        return half_maximum(radius, b) / math.sqrt(3.0)
