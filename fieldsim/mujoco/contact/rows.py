"""Rows of the table `balls`: ellipsoids that stand for a body's geoms in contact.

| columns | names | content |
|---|---|---|
| 0-2 | CENTER | of the ellipsoid, in the body's inertial frame |
| 3-11 | SHAPE | matrix S, by rows: the ellipsoid is CENTER + S u with u within the unit ball; 0 for a point |
| 12 | RADIUS | its greatest radius |
| 13 | STIFFNESS | of the stored energy, stiffness depth^3 / 3 |
| 14 | LARGE | whether the search for its deepest point starts from many directions |
"""

from fieldsim.potentials.row import Layout

BALL = Layout()
CENTER = BALL.vector("CENTER", "of the ellipsoid, in the body's inertial frame")
SHAPE = BALL.numbers(
    "SHAPE", 9, "matrix S, by rows: the ellipsoid is CENTER + S u with u within the unit ball; 0 for a point"
)
RADIUS = BALL.number("RADIUS", "its greatest radius")
STIFFNESS = BALL.number("STIFFNESS", "of the stored energy, stiffness depth^3 / 3")
LARGE = BALL.number("LARGE", "whether the search for its deepest point starts from many directions")
CENTER_X = CENTER.start
SHAPE_XX = SHAPE.start
