"""Rows of the callback's tables: `groups` and `motions`, elements that move together, and how; laws, what is found.

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

Of a group now, `turned`, what sums over groups read:

| columns | names | content |
|---|---|---|
| 0-8 | GROUP_TURN | its rotation, by rows, where it spins |
| 9-11 | GROUP_CENTER | about which it spins |
| 12 | GROUP_FIRST | its first element |
| 13 | GROUP_COUNT | how many elements there are |
| 14 | GROUP_SPINS | whether it spins |

Of a body now, `frames`, what the pull at its centre of mass reads:

| columns | names | content |
|---|---|---|
| 0-8 | BODY_MATRIX | from its inertial frame to the world's, by rows |
| 9-11 | BODY_INERTIA | what of its principal moments feels the field |

Of a point now, `placed` (a row for each column):

| columns | names | content |
|---|---|---|
| 0-2 | ARM | from the body's centre of mass |
| 3-5 | PLACE_NOW | where it is |
| 6 | MASS | what of its mass feels the field |

Of a pull, on a point or a body:

| columns | names | content |
|---|---|---|
| 0-2 | PULL_FORCE | on it |
| 3-5 | PULL_TORQUE | about the body's centre of mass |
| 6 | PULL_ENERGY | in the fields |

Of rows of surfaces, after the columns of elements (see `potentials.row`):

| columns | names | content |
|---|---|---|
| 35 | REACH | as in `sources.rows`, for all who ask for margins |
| 36 | RADIUS | of its body's surface |
| 37 | WEIGHT | 1 / RADIUS^3 |
| 38 | FEET | how many feet its primitive has |
| 39 | STARTS | how many places inside it are known where searches begin that find no field at a foot |
| 40-48 | INSIDE | these places, see `mujoco.contact.starts` |

Of `law`:

| columns | names | content |
|---|---|---|
| 0 | LIGHTEST | the least WEIGHT of all elements |
| 1 | HEAVIEST | the greatest |
| 2 | DAMPING | of contacts |
| 3 | FRICTION | of contacts |
| 4 | COMPENSATED | whether gravcomp counts |

Of what is `found` of a body:

| columns | names | content |
|---|---|---|
| 0-2 | FORCE | of fields and contacts |
| 3-5 | TORQUE | about its centre of mass |
| 6 | FIELD_ENERGY | in the fields |
| 7 | CONTACT_ENERGY | of its contacts |
| 8 | DEEPEST | GEOM of the geom whose contact is the deepest for its size; meaningless without one |
| 9 | DEEP | how deep it is |
| 10 | SHARE_OF_SIZE | over the size |

Of `Watch.rows`, integers, one for an array of the model:

| columns | names | content |
|---|---|---|
| 0 | PLACE | where mjModel keeps the pointer to the array |
| 1 | COPY | address of a copy of it |
| 2 | BYTES | their size |
| 3 | OWN | whether copies of the model may have other numbers, as tables are not made of these |
"""

from fieldsim.potentials.row import ROW, Layout

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

TURNED = Layout()
GROUP_TURN = TURNED.numbers("GROUP_TURN", 9, "its rotation, by rows, where it spins")
GROUP_CENTER = TURNED.vector("GROUP_CENTER", "about which it spins")
GROUP_FIRST = TURNED.number("GROUP_FIRST", "its first element")
GROUP_COUNT = TURNED.number("GROUP_COUNT", "how many elements there are")
GROUP_SPINS = TURNED.number("GROUP_SPINS", "whether it spins")

BODY = Layout()
BODY_MATRIX = BODY.numbers("BODY_MATRIX", 9, "from its inertial frame to the world's, by rows")
BODY_INERTIAS = BODY.vector("BODY_INERTIA", "what of its principal moments feels the field")

PLACED = Layout()
ARM = PLACED.vector("ARM", "from the body's centre of mass")
PLACE_NOW = PLACED.vector("PLACE_NOW", "where it is")
MASS = PLACED.number("MASS", "what of its mass feels the field")

PULL = Layout()
PULL_FORCE = PULL.vector("PULL_FORCE", "on it")
PULL_TORQUE = PULL.vector("PULL_TORQUE", "about the body's centre of mass")
PULL_ENERGY = PULL.number("PULL_ENERGY", "in the fields")

TOUCHED = Layout(extends=ROW)
REACH = TOUCHED.number("REACH", "as in `sources.rows`, for all who ask for margins")
RADIUS = TOUCHED.number("RADIUS", "of its body's surface")
WEIGHT = TOUCHED.number("WEIGHT", "1 / RADIUS^3")
FEET = TOUCHED.number("FEET", "how many feet its primitive has")
STARTS = TOUCHED.number(
    "STARTS", "how many places inside it are known where searches begin that find no field at a foot"
)
INSIDE = TOUCHED.numbers("INSIDE", 9, "these places, see `mujoco.contact.starts`")

LAW = Layout()
LIGHTEST = LAW.number("LIGHTEST", "the least WEIGHT of all elements")
HEAVIEST = LAW.number("HEAVIEST", "the greatest")
DAMPING = LAW.number("DAMPING", "of contacts")
FRICTION = LAW.number("FRICTION", "of contacts")
COMPENSATED = LAW.number("COMPENSATED", "whether gravcomp counts")

FOUND = Layout()
FORCE = FOUND.vector("FORCE", "of fields and contacts")
TORQUE = FOUND.vector("TORQUE", "about its centre of mass")
FIELD_ENERGY = FOUND.number("FIELD_ENERGY", "in the fields")
CONTACT_ENERGY = FOUND.number("CONTACT_ENERGY", "of its contacts")
DEEPEST = FOUND.number("DEEPEST", "GEOM of the geom whose contact is the deepest for its size; meaningless without one")
DEEP = FOUND.number("DEEP", "how deep it is")
SHARE_OF_SIZE = FOUND.number("SHARE_OF_SIZE", "over the size")

WATCHED = Layout()
PLACE = WATCHED.number("PLACE", "where mjModel keeps the pointer to the array")
COPY = WATCHED.number("COPY", "address of a copy of it")
BYTES = WATCHED.number("BYTES", "their size")
OWN = WATCHED.number("OWN", "whether copies of the model may have other numbers, as tables are not made of these")

WATCHED_WIDTH = WATCHED.width
AXIS_X = AXIS.start
CENTER_X = CENTER.start
TURN_X = TURN.start
INSIDE_X = INSIDE.start
SHIFT_X = SHIFT.start
TURNED_WIDTH, BODY_WIDTH, PLACED_WIDTH, PULL_WIDTH = TURNED.width, BODY.width, PLACED.width, PULL.width
GROUP_TURN_X, GROUP_CENTER_X = GROUP_TURN.start, GROUP_CENTER.start
BODY_MATRIX_X, BODY_INERTIA = BODY_MATRIX.start, BODY_INERTIAS.start
ARM_X, PLACE_NOW_X = ARM.start, PLACE_NOW.start
PULL_TORQUE_X = PULL_TORQUE.start
FOUND_WIDTH = FOUND.width
FORCE_X, TORQUE_X = FORCE.start, TORQUE.start
