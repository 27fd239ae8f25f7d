"""A kernel that fieldsim does not have, all of it: (1 - u^2)^4, on points and, by quadrature, on segments."""

import contextlib
import dataclasses
import math

import numpy as np

from fieldsim.portable import portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.formulas.point import register_points
from fieldsim.potentials.formulas.segment.quadrature import register_segments
from fieldsim.potentials.kernels import Compact


@portable
def law(r2: real, radius: real, fold: real, times: real):
    """h, dh/d(r^2) and times d2h/d(r^2)^2."""
    w = real(1.0) - r2 / radius / radius
    if w <= real(0.0):
        return real(0.0), real(0.0), real(0.0)
    cube = w * w * w
    slope = -real(4.0) * cube / radius / radius
    return cube * w, slope, real(12.0) * w * w * (times / radius / radius) / radius / radius


@dataclasses.dataclass(frozen=True)
class GeneralisedWyvill(Compact):
    """h(r) = (1 - u^2)^4 for u <= 1, then 0, with u = r / radius."""

    radius: float = 1.0

    law = law
    steepest = 8.0 / math.sqrt(27.0)  # of (1 - u^2)^2, at u^2 = 1/3
    sharpest = 8.0
    root_bend = 4.0

    @staticmethod
    def inverse(level, radius):
        """Where h falls to a level."""
        return radius * np.sqrt(1.0 - np.sqrt(np.sqrt(np.minimum(level, 1.0))))

    @staticmethod
    def width_of(radius, b):
        """Slope of log h at R that of the Gaussian, -2 b / R."""
        return radius * math.sqrt(1.0 + 4.0 / b)


@contextlib.contextmanager
def registered():
    """Fieldsim knows the kernel meanwhile."""
    register_points(GeneralisedWyvill)
    register_segments(GeneralisedWyvill)
    try:
        yield GeneralisedWyvill
    finally:
        registry.unregister(GeneralisedWyvill)
