"""Integrators: how a simulation steps. Each is a frozen value with its order and its source."""

import dataclasses
import math

from fieldsim import validate
from fieldsim.errors import InputError


@dataclasses.dataclass(frozen=True)
class Leapfrog:
    """Velocity Verlet, kick-drift-kick: order 2, symplectic, reversible, one force evaluation a step.

    dt: the longest step; a simulation shortens it so that whole steps land on the times it is asked for.
    Verlet 1967; Hairer, Lubich & Wanner 2003.
    """

    dt: float = 1e-3

    order = 2
    kicks = (0.5, 0.5)
    drifts = (1.0,)
    gradients = (0.0, 0.0)

    def __post_init__(self):
        object.__setattr__(self, "dt", validate.number("Leapfrog", "dt", self.dt, above=0.0))

    def steps(self, duration: float) -> tuple[int, float]:
        """Number and length of the equal steps, at most `dt` long, that fill `duration`.

        Raises InputError where a step would be too short to change the time.
        """
        # A quotient that misses a whole number by rounding is that number.
        count = math.ceil(duration / self.dt * (1.0 - 1e-12))
        if count > 2**53:
            raise InputError(f"Leapfrog: dt is {self.dt:g}, too short for a duration of {duration:g}; give a longer dt")
        return count, duration / count if count else 0.0
