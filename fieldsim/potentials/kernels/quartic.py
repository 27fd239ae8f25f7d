"""The Quartic kernel."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim.potentials.kernels.polynomial import Polynomial
from fieldsim.types import RealLike


@dataclasses.dataclass(frozen=True)
class Quartic(Polynomial):
    """h(r) = (1 - u^2)^2 for u <= 1, then 0, with u = r / radius."""

    radius: float = 1.0

    if TYPE_CHECKING:

        def __init__(self, radius: RealLike = ...) -> None: ...

    square, cube, over = 1, 0, 1
    steepest = 2.0
    sharpest = 8.0
    root_bend = 2.0

    @staticmethod
    def inverse(level: np.ndarray, radius: float) -> np.ndarray:
        """Where h falls to a level."""
        return radius * np.sqrt(1.0 - np.sqrt(np.minimum(level, 1.0)))

    @staticmethod
    def width_of(radius: float, b: float) -> float:
        """Slope of log h at R that of the Gaussian, -2 b / R."""
        return radius * math.sqrt(1.0 + 2.0 / b)
