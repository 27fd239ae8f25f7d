"""Skeletons convolved with kernels. Importing the package registers all formulas, always in the same order.

(The order numbers the formulas, and the numbers are part of the compiled code.)
"""

# ruff: noqa: F401, I001
import fieldsim.potentials.formulas.point
import fieldsim.potentials.formulas.segment.segment
import fieldsim.potentials.formulas.arc.circle
import fieldsim.potentials.formulas.arc.arc
import fieldsim.potentials.formulas.compact
import fieldsim.potentials.formulas.arc.compact
import fieldsim.potentials.formulas.segment.compact
import fieldsim.potentials.formulas.inverse_square
import fieldsim.potentials.formulas.arc.metaball
import fieldsim.potentials.formulas.plane
import fieldsim.potentials.formulas.profile
import fieldsim.potentials.formulas.solid
import fieldsim.potentials.formulas.segment.tapered
import fieldsim.potentials.formulas.triangle.triangle
import fieldsim.potentials.formulas.triangle.compact
import fieldsim.potentials.formulas.triangle.edges
import fieldsim.potentials.formulas.triangle.gaussian
import fieldsim.potentials.formulas.triangle.rational
