"""The SoftObject kernel."""

import dataclasses

from fieldsim.potentials.kernels.base import Kernel


@dataclasses.dataclass(frozen=True)
class SoftObject(Kernel):
    """h(r) = 1 - 22/9 u^2 + 17/9 u^4 - 4/9 u^6 for u <= 1, then 0, with u = r / radius (Wyvill et al. 1986)."""

    radius: float = 1.0
