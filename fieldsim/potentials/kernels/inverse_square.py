"""The InverseSquare kernel."""

import dataclasses

from fieldsim.potentials.kernels.base import Kernel


@dataclasses.dataclass(frozen=True)
class InverseSquare(Kernel):
    """h(r) = 1 / (r^2 + softening^2) (electrostatics of lines; Wyvill & van Overveld 1996)."""

    softening: float = 0.0
