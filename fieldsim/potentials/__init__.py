"""Skeletons convolved with kernels. Importing the package fills the chart of cells, always in the same order.

(The order numbers the cells, and the numbers are part of the compiled code.)
"""

from fieldsim.potentials import (  # noqa: F401  # noqa: F401, I001 - made of the cells above
    arc,
    arc_gaussian,
    circle,
    compact,
    compact_arc,
    compact_segment,
    inverse_square,
    metaball_arc,
    plane,
    point,
    profile,
    segment,
    solid,
    tapered,
    triangle,
    triangle_compact,
    triangle_edges,
    triangle_gaussian,
    triangle_rational,
)
