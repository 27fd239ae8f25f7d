"""Rows of the tables `groups` and `motions`, elements that move together, and how; and of the numbers watched.

Of `groups`, integers:

| columns | names | content |
|---|---|---|
| 0 | FIRST | the group's first element |
| 1 | COUNT | how many there are |
| 2 | SPINS | whether they spin; if not, their rows are in the world's frame |

Of `motions`:

| columns | names | content |
|---|---|---|
| 0-2 | AXIS | of a Spin: unit |
| 3 | RATE | of a Spin: radians per time |
| 4 | PHASE | of a Spin: angle at time 0 |
| 5-7 | CENTER | of a Spin |
| 8-10 | TURN | angular velocity |
| 11-13 | SHIFT | velocity of what is at the world's origin |

Of `Watch.rows`, integers, one for an array of the model:

| columns | names | content |
|---|---|---|
| 0 | PLACE | where mjModel keeps the pointer to the array |
| 1 | COPY | address of a copy of it |
| 2 | BYTES | their size |
| 3 | OWN | whether copies of the model may have other numbers, as tables are not made of these |
"""

from fieldsim.potentials.row import Layout

GROUP = Layout()
FIRST = GROUP.number("FIRST", "the group's first element")
COUNT = GROUP.number("COUNT", "how many there are")
SPINS = GROUP.number("SPINS", "whether they spin; if not, their rows are in the world's frame")

MOTION = Layout()
AXIS = MOTION.vector("AXIS", "of a Spin: unit")
RATE = MOTION.number("RATE", "of a Spin: radians per time")
PHASE = MOTION.number("PHASE", "of a Spin: angle at time 0")
CENTER = MOTION.vector("CENTER", "of a Spin")
TURN = MOTION.vector("TURN", "angular velocity")
SHIFT = MOTION.vector("SHIFT", "velocity of what is at the world's origin")
WATCHED = Layout()
PLACE = WATCHED.number("PLACE", "where mjModel keeps the pointer to the array")
COPY = WATCHED.number("COPY", "address of a copy of it")
BYTES = WATCHED.number("BYTES", "their size")
OWN = WATCHED.number("OWN", "whether copies of the model may have other numbers, as tables are not made of these")

WATCHED_WIDTH = WATCHED.width
AXIS_X = AXIS.start
CENTER_X = CENTER.start
TURN_X = TURN.start
SHIFT_X = SHIFT.start
