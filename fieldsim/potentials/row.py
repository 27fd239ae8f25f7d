"""The row of an element: which number of a primitive and its kernel stands in which column.

An element is one primitive with its kernel, packed as a row of `ROW_WIDTH` reals in the frame of its body:

| columns | names | content |
|---|---|---|
| 0 | STRENGTH | factor on the integral |
| 1 | KERNEL_WIDTH | the kernel's parameter: s, a, softening or radius |
| 2 | SIZE, LENGTH, RADIUS | a segment's length; an arc's radius; a triangle's longest edge |
| 3 | ANGLE, AREA, SOLID_REACH | an arc's angle; a triangle's area; the reach of a face's solid |
| 4 | FOLD | a Gaussian's folded exponent: h = exp(FOLD - a^2 r^2), so that exp(256) never stands alone |
| 5-7 | POINT, START, CENTER, CORNER_A | a point, of a plane too; a segment's start; an arc's centre; corner a |
| 8-10 | END, CORNER_B | a segment's end; corner b |
| 11-13 | CORNER_C, PEAK | corner c of a triangle or face; where a profile is greatest |
| 14-16 | AXIS, FIRST, EDGE, TO_CENTER | unit: a segment's axis; an arc's first point from its centre; \
a triangle's edge from a to b. A face: from a to the solid's centre |
| 17-19 | NORMAL | unit: normal of an arc's plane, of a plane or of a triangle |
| 20 | PROFILE_SHAPE, START_DENSITY | index of a profile's shape; a tapered segment's density at its start |
| 21 | PROFILE_DEGREE, END_DENSITY | degree of a profile's polynomial; a tapered segment's density at its end |
| 22-34 | COEFFICIENTS | a profile's coefficients from degree 0 on |

Every name is declared once, below, and has three readers:

- a number's name is its column, an int: `rows[i, STRENGTH]` in portable functions and kernels, `rows[..., SIZE]` in
  NumPy;
- a vector's name is the slice of its columns: `rows[..., AXIS]` is a NumPy view (..., 3);
- `axis_of(rows, i)`, with the vector's name in lower case, is the portable function that returns its x, y and z, and
  `from_center(x, y, z, rows, i)` that of the offset of a point from it; `AXIS_X` is its first column, for code that
  takes a vector's column as an argument or counts from it;
  `vector_reader(AXIS, wp.vec3)` makes the Warp function that returns them as one vector.

Who adds columns of its own to rows (contact, the referee) declares them in a `Layout` that extends `ROW`.
"""

import dataclasses
import functools

from fieldsim.portable import Portable, Table, hole, portable, real


@dataclasses.dataclass(frozen=True)
class Column:
    """Columns first .. first + count - 1, their names and what they hold."""

    names: tuple[str, ...]
    first: int
    count: int
    content: str


class Layout:
    """Named columns of a table, in the order in which they are declared. extends: the layout that it goes on from."""

    def __init__(self, extends: "Layout | None" = None):
        self.columns: list[Column] = list(extends.columns) if extends else []

    @property
    def width(self) -> int:
        """How many columns there are."""
        return sum(column.count for column in self.columns)

    def number(self, names: str, content: str) -> int:
        """Declare one column under one or more names; returns it."""
        return self._add(names, 1, content)

    def numbers(self, names: str, count: int, content: str) -> slice:
        """Declare several columns under one or more names; returns their slice."""
        first = self._add(names, count, content)
        return slice(first, first + count)

    def vector(self, names: str, content: str) -> slice:
        """Declare the three columns of a vector under one or more names; returns their slice."""
        return self.numbers(names, 3, content)

    def _add(self, names, count, content):
        first = self.width
        self.columns.append(Column(tuple(names.split()), first, count, content))
        return first

    def of(self, name: str) -> Column:
        """The column of a name."""
        return next(column for column in self.columns if name in column.names)

    def table(self) -> str:
        """The layout as a Markdown table, as it stands in docstrings."""
        lines = ["| columns | names | content |", "|---|---|---|"]
        for column in self.columns:
            last = column.first + column.count - 1
            where = f"{column.first}" if column.count == 1 else f"{column.first}-{last}"
            lines.append(f"| {where} | {', '.join(column.names)} | {column.content} |")
        return "\n".join(lines)


ROW = Layout()
STRENGTH = ROW.number("STRENGTH", "factor on the integral")
KERNEL_WIDTH = ROW.number("KERNEL_WIDTH", "the kernel's parameter: s, a, softening or radius")
SIZE = LENGTH = RADIUS = ROW.number(
    "SIZE LENGTH RADIUS", "a segment's length; an arc's radius; a triangle's longest edge"
)
ANGLE = AREA = SOLID_REACH = ROW.number(
    "ANGLE AREA SOLID_REACH", "an arc's angle; a triangle's area; the reach of a face's solid"
)
FOLD = ROW.number("FOLD", "a Gaussian's folded exponent: h = exp(FOLD - a^2 r^2), so that exp(256) never stands alone")
POINT = START = CENTER = CORNER_A = ROW.vector(
    "POINT START CENTER CORNER_A",
    "a point, of a plane too; a segment's start; an arc's centre; corner a",
)
END = CORNER_B = ROW.vector("END CORNER_B", "a segment's end; corner b")
CORNER_C = PEAK = ROW.vector("CORNER_C PEAK", "corner c of a triangle or face; where a profile is greatest")
AXIS = FIRST = EDGE = TO_CENTER = ROW.vector(
    "AXIS FIRST EDGE TO_CENTER",
    "unit: a segment's axis; an arc's first point from its centre; a triangle's edge from a to b. "
    "A face: from a to the solid's centre",
)
NORMAL = ROW.vector("NORMAL", "unit: normal of an arc's plane, of a plane or of a triangle")
PROFILE_SHAPE = START_DENSITY = ROW.number(
    "PROFILE_SHAPE START_DENSITY", "index of a profile's shape; a tapered segment's density at its start"
)
PROFILE_DEGREE = END_DENSITY = ROW.number(
    "PROFILE_DEGREE END_DENSITY", "degree of a profile's polynomial; a tapered segment's density at its end"
)
COEFFICIENTS = ROW.numbers("COEFFICIENTS", 13, "a profile's coefficients from degree 0 on")
ROW_WIDTH = ROW.width

# What a motion of the body moves, and what it only turns: three positions and two directions.
POSITIONS = slice(CORNER_A.start, CORNER_C.stop)
DIRECTIONS = slice(AXIS.start, NORMAL.stop)
FIRST_COEFFICIENT = COEFFICIENTS.start
POINT_X = START_X = CENTER_X = CORNER_A_X = POINT.start
END_X = CORNER_B_X = END.start
CORNER_C_X = CORNER_C.start
AXIS_X = FIRST_X = EDGE_X = TO_CENTER_X = AXIS.start
NORMAL_X = NORMAL.start
# What only some primitives have.
OWN = slice(PROFILE_SHAPE, COEFFICIENTS.stop)


x_column = hole()
y_column = hole()
z_column = hole()


@portable
def _vector(rows: Table, i: int):
    return rows[i, x_column], rows[i, y_column], rows[i, z_column]


@portable
def _offset(x: real, y: real, z: real, rows: Table, i: int):
    return x - rows[i, x_column], y - rows[i, y_column], z - rows[i, z_column]


def vector_of(columns: slice) -> Portable:
    """Portable (rows, i) -> the three numbers of row i in the columns of a vector."""
    return _vector.bind(**_named(columns))


def offset_from(columns: slice) -> Portable:
    """Portable (x, y, z, rows, i) -> the offset of (x, y, z) from the position of row i in the columns of a vector."""
    return _offset.bind(**_named(columns))


def _named(columns):
    return dict(zip(("x_column", "y_column", "z_column"), range(columns.start, columns.stop), strict=True))


point_of = start_of = center_of = corner_a_of = vector_of(POINT)
end_of = corner_b_of = vector_of(END)
corner_c_of = vector_of(CORNER_C)
peak_of = vector_of(PEAK)
axis_of = first_of = edge_of = to_center_of = vector_of(AXIS)
normal_of = vector_of(NORMAL)
from_point = from_start = from_center = from_corner_a = offset_from(POINT)


def vector_reader(columns: slice, vector):
    """Warp function (rows, i) -> the vector of row i in `columns`. vector: wp.vec3 or wp.vec3d, as rows."""
    return _vector_reader(columns.start, vector)


@functools.cache
def _vector_reader(start, vector):
    import warp as wp

    @wp.func
    def read(rows: wp.array(dtype=vector._wp_scalar_type_, ndim=2), i: int):
        return vector(rows[i, start], rows[i, start + 1], rows[i, start + 2])

    return read
