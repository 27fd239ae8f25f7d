"""The Metaball kernel."""

import dataclasses

from fieldsim.potentials.kernels.base import Kernel


@dataclasses.dataclass(frozen=True)
class Metaball(Kernel):
    """h(r) = 1 - 3 u^2 for u <= 1/3, 3/2 (1 - u)^2 for u <= 1, then 0, with u = r / radius (Nishimura et al. 1985)."""

    radius: float = 1.0
