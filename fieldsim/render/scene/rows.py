"""Vectors of element rows, read by ray tracing kernels: Warp functions (rows, i) -> vec3 (see `potentials.row`)."""

import warp as wp

from fieldsim.potentials import row

point_of = start_of = center_of = corner_a_of = row.vector_reader(row.POINT, wp.vec3)
end_of = corner_b_of = row.vector_reader(row.END, wp.vec3)
corner_c_of = row.vector_reader(row.CORNER_C, wp.vec3)
axis_of = first_of = row.vector_reader(row.AXIS, wp.vec3)
normal_of = row.vector_reader(row.NORMAL, wp.vec3)
