"""Skeletons convolved with kernels. Importing the package registers all formulas, in `formulas.registered`'s order."""

import fieldsim.potentials.formulas.registered  # noqa: F401 - registers the formulas
