"""Kernels of compact support on points."""

from fieldsim.potentials.formulas.point import register_points
from fieldsim.potentials.kernels import Metaball, Quartic, SoftObject

for _kernel in (SoftObject, Quartic, Metaball):
    register_points(_kernel)
