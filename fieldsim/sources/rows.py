"""Rows of surface elements, with their reach and their twist.

They have the columns of elements (see `potentials.row`) and then these:

| columns | names | content |
|---|---|---|
| 35 | REACH | distance from the primitive beyond which its field is below its share of the level |
| 36 | ALONE | about the distance from the primitive at which its field alone comes to the level; 0 where it does not |
| 37-39 | TURN | of elements that move: rotation vector of the body's twist per step |
| 40-42 | SHIFT | of elements that move: translation of that twist per step |
| 43 | DEFORMS | of elements that move: 1 if the body deforms as well, so that its twist is not all of its motion |
"""

import warp as wp

from fieldsim.potentials.row import ROW, Layout, vector_reader

SURFACE = Layout(extends=ROW)
REACH = SURFACE.number("REACH", "distance from the primitive beyond which its field is below its share of the level")
ALONE = SURFACE.number(
    "ALONE", "about the distance from the primitive at which its field alone comes to the level; 0 where it does not"
)
# The columns of surface elements that do not move.
STILL_WIDTH = SURFACE.width
TURN = SURFACE.vector("TURN", "of elements that move: rotation vector of the body's twist per step")
SHIFT = SURFACE.vector("SHIFT", "of elements that move: translation of that twist per step")
DEFORMS = SURFACE.number(
    "DEFORMS", "of elements that move: 1 if the body deforms as well, so that its twist is not all of its motion"
)

turn_of = vector_reader(TURN, wp.vec3d)
shift_of = vector_reader(SHIFT, wp.vec3d)
