"""The Gaussian kernel."""

import dataclasses

from fieldsim.potentials.kernels.base import Kernel


@dataclasses.dataclass(frozen=True)
class Gaussian(Kernel):
    """h(r) = exp(-a^2 r^2) (Blinn 1982)."""

    a: float = 1.0
