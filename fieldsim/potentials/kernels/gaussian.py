"""The Gaussian kernel."""

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from fieldsim.portable import portable, real
from fieldsim.potentials.kernels.base import Kernel, Whole, distance
from fieldsim.types import RealLike

# Exponents are clamped here: exp(60) fits float32 with room for sums, and only a surface drawn with a fold above 60 (a
# blobbiness below -60) has such exponents at all, deep inside, where nothing but "well above T" matters.
EXPONENT_LIMIT = 60.0


@portable
def law(r2: real, a: real, fold: real, times: real):
    """exp(fold - a^2 r^2), its exponent clamped at EXPONENT_LIMIT, d/d(r^2) of it, and times its second."""
    h = math.exp(min(fold - a * a * r2, real(EXPONENT_LIMIT)))
    slope = -a * a * h
    return h, slope, -slope * (a * a * times)


def _inverse(level: np.ndarray, a: float) -> np.ndarray:
    return distance(-np.log(level)) / a


@dataclasses.dataclass(frozen=True)
class Gaussian(Kernel):
    """h(r) = exp(-a^2 r^2) (Blinn 1982)."""

    a: float = 1.0

    if TYPE_CHECKING:

        def __init__(self, a: RealLike = ...) -> None: ...

    law = law
    inverse = staticmethod(_inverse)
    folds = True
    reciprocal = True
    line = Whole(lambda a: math.sqrt(math.pi) / a, _inverse)
    plane = Whole(lambda a: math.pi / a**2, _inverse)

    @staticmethod
    def width_of(radius: float, b: float) -> float:
        """Blinn's own."""
        return math.sqrt(b) / radius

    @staticmethod
    def log_bend(a: float) -> float:
        """-(log h)'' is 2 a^2 along any ray."""
        return 2.0 * a**2

    @staticmethod
    def scale_of(a: float) -> float:
        """1 / a."""
        return 1.0 / a

    def calibrated(self, radius: float, dimension: int) -> tuple[float, float] | None:
        """The fields of a whole line and plane are sqrt(pi)/a and pi/a^2 times h: what h lacks at R is folded."""
        return (self.a / math.sqrt(math.pi)) ** dimension, (self.a * radius) ** 2

    @property
    def short_reach(self) -> float:
        """See `Kernel.short_reach`."""
        return 1.0 / self.a
