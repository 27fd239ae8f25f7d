"""Skeletons convolved with kernels. Importing the package registers all formulas, in the order of `registered`."""

import fieldsim.potentials.formulas.registered  # noqa: F401 - registers the formulas
