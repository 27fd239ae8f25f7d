"""Convolution kernels h(r), one file each, with all that is known of them; `base` says how one is added."""

from fieldsim.potentials.kernels.base import Compact, Kernel, PowerLaw
from fieldsim.potentials.kernels.cauchy import Cauchy
from fieldsim.potentials.kernels.gaussian import Gaussian
from fieldsim.potentials.kernels.inverse_square import InverseSquare
from fieldsim.potentials.kernels.metaball import Metaball
from fieldsim.potentials.kernels.newtonian import Newtonian
from fieldsim.potentials.kernels.polynomial import Polynomial
from fieldsim.potentials.kernels.quartic import Quartic
from fieldsim.potentials.kernels.soft_object import SoftObject

__all__ = [
    "Cauchy",
    "Compact",
    "Gaussian",
    "InverseSquare",
    "Kernel",
    "Metaball",
    "Newtonian",
    "Polynomial",
    "PowerLaw",
    "Quartic",
    "SoftObject",
]
