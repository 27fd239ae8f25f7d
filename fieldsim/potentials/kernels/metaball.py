"""The Metaball kernel."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim.portable import portable, real
from fieldsim.potentials.kernels.base import Compact
from fieldsim.types import RealLike


@portable
def law(r2: real, radius: real, fold: real, times: real):
    """h, dh/d(r^2) and times d2h/d(r^2)^2."""
    u = math.sqrt(r2) / radius
    v = real(1.0) - u
    if v <= real(0.0):
        return real(0.0), real(0.0), real(0.0)
    scale = real(3.0) / radius / radius
    if real(3.0) * u <= real(1.0):
        return real(1.0) - real(3.0) * u * u, -scale, real(0.0)
    return real(1.5) * v * v, -real(0.5) * scale * v / u, real(0.25) * scale / u * (times / r2)


@dataclasses.dataclass(frozen=True)
class Metaball(Compact):
    """h(r) = 1 - 3 u^2 for u <= 1/3, 3/2 (1 - u)^2 for u <= 1, then 0, with u = r / radius (Nishimura et al. 1985)."""

    radius: float = 1.0

    if TYPE_CHECKING:

        def __init__(self, radius: RealLike = ...) -> None: ...

    law = law
    steepest = math.sqrt(1.5)
    sharpest = 6.0
    root_bend = 5.52  # of sqrt(1 - 3 u^2) at u = 1/3: 5.5114

    @staticmethod
    def inverse(level: np.ndarray, radius: float) -> np.ndarray:
        """Where h falls to a level."""
        inner = np.sqrt(np.maximum(1.0 - level, 0.0) / 3.0)
        return radius * np.where(level > 2.0 / 3.0, inner, 1.0 - np.sqrt(level / 1.5))

    @staticmethod
    def width_of(radius: float, b: float) -> float:
        """Slope of log h at R that of the Gaussian, -2 b / R.

        It is -2 u / (1 - u) / R outside a third of the radius, and -6 u^2 / (1 - 3 u^2) / R within.
        """
        return radius / (b / (1.0 + b) if b >= 0.5 else math.sqrt(b / (3.0 * (1.0 + b))))
