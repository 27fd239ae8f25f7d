"""The Quartic kernel."""

import dataclasses

from fieldsim.potentials.kernels.base import Kernel


@dataclasses.dataclass(frozen=True)
class Quartic(Kernel):
    """h(r) = (1 - u^2)^2 for u <= 1, then 0, with u = r / radius."""

    radius: float = 1.0
