"""Rows of surface elements, with their reach and their twist.

They have the columns of elements (see `potentials.row`) and then these:

| columns | names | content |
|---|---|---|
| 35 | REACH | distance from the primitive beyond which its field is below its share of the level |
| 36-38 | TURN | of elements that move: rotation vector of the body's twist per step |
| 39-41 | SHIFT | of elements that move: translation of that twist per step |
"""

import warp as wp

from fieldsim.potentials.row import ROW, Layout, vector_reader

SURFACE = Layout(extends=ROW)
REACH = SURFACE.number("REACH", "distance from the primitive beyond which its field is below its share of the level")
TURN = SURFACE.vector("TURN", "of elements that move: rotation vector of the body's twist per step")
SHIFT = SURFACE.vector("SHIFT", "of elements that move: translation of that twist per step")

turn_of = vector_reader(TURN, wp.vec3d)
shift_of = vector_reader(SHIFT, wp.vec3d)
