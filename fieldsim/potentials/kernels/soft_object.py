"""The SoftObject kernel."""

import dataclasses
from typing import TYPE_CHECKING

from fieldsim.potentials.kernels.polynomial import Polynomial
from fieldsim.types import RealLike


@dataclasses.dataclass(frozen=True)
class SoftObject(Polynomial):
    """h(r) = 1 - 22/9 u^2 + 17/9 u^4 - 4/9 u^6 for u <= 1, then 0, with u = r / radius (Wyvill et al. 1986).

    That is w^2 (5 + 4 w) / 9, w = 1 - u^2.
    """

    radius: float = 1.0

    if TYPE_CHECKING:

        def __init__(self, radius: RealLike = ...) -> None: ...

    square, cube, over = 5, 4, 9
    steepest = 1.5351  # of (1 - u^2) sqrt(9 - 4 u^2) / 3: 1.53508
    sharpest = 44.0 / 9.0
    root_bend = 22.0 / 9.0
