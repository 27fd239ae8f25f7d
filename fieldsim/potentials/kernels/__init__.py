"""Convolution kernels h(r), one file each."""

from fieldsim.potentials.kernels.base import Kernel
from fieldsim.potentials.kernels.cauchy import Cauchy
from fieldsim.potentials.kernels.gaussian import Gaussian
from fieldsim.potentials.kernels.inverse_square import InverseSquare
from fieldsim.potentials.kernels.metaball import Metaball
from fieldsim.potentials.kernels.newtonian import Newtonian
from fieldsim.potentials.kernels.quartic import Quartic
from fieldsim.potentials.kernels.soft_object import SoftObject

# Kernels that end at their radius.
COMPACT = (Metaball, SoftObject, Quartic)

__all__ = ["COMPACT", "Cauchy", "Gaussian", "InverseSquare", "Kernel", "Metaball", "Newtonian", "Quartic", "SoftObject"]
