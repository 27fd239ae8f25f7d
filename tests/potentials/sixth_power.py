"""A power law that fieldsim does not have, all of it: 1 / (1 + s^2 r^2)^3 on points."""

import contextlib
import dataclasses
import math

from fieldsim.portable import portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.formulas.point import register_points
from fieldsim.potentials.kernels import PowerLaw
from fieldsim.potentials.kernels.base import Whole, distance


@portable
def law(r2: real, s: real, fold: real, times: real):
    """h, dh/d(r^2) and times d2h/d(r^2)^2."""
    h = real(1.0) / (real(1.0) + s * s * r2)
    slope = -real(3.0) * s * s * h * h * h * h
    return h * h * h, slope, -real(4.0) * slope * (s * s * times * h)


def inverse_of(power):
    """Where (1 + s^2 r^2)^-power falls to a level."""
    return lambda level, s: distance(level ** (-1.0 / power) - 1.0) / s


@dataclasses.dataclass(frozen=True)
class SixthPower(PowerLaw):
    """h(r) = 1 / (1 + s^2 r^2)^3."""

    s: float = 1.0

    law = law
    inverse = staticmethod(inverse_of(3.0))
    power = 6
    reciprocal = True
    line = Whole(lambda s: 0.375 * math.pi / s, inverse_of(2.5))
    plane = Whole(lambda s: 0.5 * math.pi / s**2, inverse_of(2.0))

    @staticmethod
    def width_of(radius, b):
        """Half maximum where the Gaussian has it."""
        return math.sqrt((2.0 ** (1.0 / 3.0) - 1.0) * b / math.log(2.0)) / radius


@contextlib.contextmanager
def registered():
    """Fieldsim knows the kernel meanwhile."""
    register_points(SixthPower)
    try:
        yield SixthPower
    finally:
        registry.unregister(SixthPower)
