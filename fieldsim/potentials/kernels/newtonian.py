"""The Newtonian kernel."""

import dataclasses

from fieldsim.potentials.kernels.base import Kernel


@dataclasses.dataclass(frozen=True)
class Newtonian(Kernel):
    """h(r) = 1 / sqrt(r^2 + softening^2): gravity."""

    softening: float = 0.0
