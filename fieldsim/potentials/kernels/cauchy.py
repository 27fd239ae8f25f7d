"""The Cauchy kernel."""

import dataclasses

from fieldsim.potentials.kernels.base import Kernel


@dataclasses.dataclass(frozen=True)
class Cauchy(Kernel):
    """h(r) = 1 / (1 + s^2 r^2)^2 (Sherstyuk 1999, 2.3.1)."""

    s: float = 1.0
