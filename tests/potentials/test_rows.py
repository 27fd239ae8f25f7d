"""Rows by name: the layout, its readers on every target, and that nobody reads a column by number."""

import ast
import importlib
import pathlib
import re

import numba
import numpy as np
import pytest
import warp as wp

import fieldsim
from fieldsim import launch
from fieldsim.portable import Table, portable, real
from fieldsim.potentials import row
from fieldsim.potentials.row import (
    AXIS,
    COEFFICIENTS,
    FOLD,
    NORMAL,
    ROW,
    ROW_WIDTH,
    STRENGTH,
    Layout,
    axis_of,
    from_center,
    normal_of,
)

ROWS = np.arange(2.0 * ROW_WIDTH).reshape(2, ROW_WIDTH)
PACKAGE = pathlib.Path(fieldsim.__file__).parent
VECTORS = [name for column in ROW.columns if column.count == 3 for name in column.names]


@portable
def named(rows: Table, i: int):
    """Numbers and vectors by their names."""
    x, y, z = axis_of(rows, i)
    u, v, w = normal_of(rows, i)
    dx, dy, dz = from_center(x, y, z, rows, i)
    far = real(100.0) * rows[i, STRENGTH] + real(10.0) * rows[i, FOLD]
    return far + x - real(3.0) * y + real(7.0) * z + u * v * w + dx * dy * dz


@portable
def numbered(rows: Table, i: int):
    """As `named`, by their columns."""
    x = rows[i, 14]
    y = rows[i, 15]
    z = rows[i, 16]
    u = rows[i, 17]
    v = rows[i, 18]
    w = rows[i, 19]
    dx = x - rows[i, 5]
    dy = y - rows[i, 6]
    dz = z - rows[i, 7]
    far = real(100.0) * rows[i, 0] + real(10.0) * rows[i, 4]
    return far + x - real(3.0) * y + real(7.0) * z + u * v * w + dx * dy * dz


def test_the_table_in_the_docstring_is_the_layouts():
    assert ROW.table() in row.__doc__
    assert ROW.width == ROW_WIDTH == 35


@pytest.mark.parametrize("column", ROW.columns, ids=lambda column: column.names[0])
def test_names_are_their_columns(column):
    for name in column.names:
        found = getattr(row, name)
        expected = range(column.first, column.first + column.count)
        assert (range(found, found + 1) if isinstance(found, int) else range(found.start, found.stop)) == expected
        assert ROW.of(name) is column


@pytest.mark.parametrize("name", VECTORS)
def test_vectors_read_their_columns(name):
    expected = ROWS[1, getattr(row, name)]
    reader = getattr(row, f"{name.lower()}_of")
    np.testing.assert_array_equal(reader(ROWS, 1), expected)
    np.testing.assert_array_equal(reader.numba(ROWS, 1), expected)


def test_offsets_are_taken_from_positions():
    point = 1.0, 2.0, 4.0
    expected = np.array(point) - ROWS[1, row.CENTER]
    np.testing.assert_array_equal(row.from_center(*point, ROWS, 1), expected)
    np.testing.assert_array_equal(row.from_center.numba(*point, ROWS, 1), expected)


def on_warp(function, scalar):
    compiled = function.warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def kernel(start: int, rows: wp.array(dtype=scalar, ndim=2), found: wp.array(dtype=scalar)):
        i = start + wp.tid()
        found[i] = compiled(rows, i)

    found = wp.full(len(ROWS), np.nan, dtype=scalar, device="cpu")
    launch.launch(kernel, len(ROWS), [wp.array(ROWS, dtype=scalar, device="cpu")], [found], device="cpu")
    return found.numpy(), kernel


@pytest.mark.parametrize("scalar", [wp.float32, wp.float64])
def test_names_read_as_numbers_do_in_warp(scalar):
    by_name, _ = on_warp(named, scalar)
    by_number, _ = on_warp(numbered, scalar)
    np.testing.assert_array_equal(by_name, by_number)
    assert by_name[0] == 40.0 + 14.0 - 3 * 15.0 + 7 * 16.0 + 17.0 * 18.0 * 19.0 + 9.0**3


def test_names_read_as_numbers_do_in_numba():
    """And the compiled code has as many loads: the columns are constants in it."""

    def compiled(function):
        twin = function.numba

        @numba.njit(error_model="numpy")
        def call(rows, i):
            return twin(rows, i)

        values = [call(ROWS, i) for i in range(2)]
        code = next(iter(call.inspect_asm().values()))
        return values, sorted(line.split()[0] for line in code.splitlines() if line.startswith("\tv") or "sd" in line)

    assert compiled(named) == compiled(numbered)


@pytest.mark.parametrize("vector", [wp.vec3, wp.vec3d])
def test_warp_reads_vectors(vector):
    axis, normal = (row.vector_reader(columns, vector) for columns in (AXIS, NORMAL))
    scalar = vector._wp_scalar_type_

    @wp.kernel(module="unique", enable_backward=False)
    def kernel(start: int, rows: wp.array(dtype=scalar, ndim=2), found: wp.array(dtype=vector)):
        i = start + wp.tid()
        found[i] = wp.cross(axis(rows, i), normal(rows, i))

    found = wp.full(len(ROWS), np.nan, dtype=vector, device="cpu")
    launch.launch(kernel, len(ROWS), [wp.array(ROWS, dtype=scalar, device="cpu")], [found], device="cpu")
    np.testing.assert_array_equal(found.numpy(), np.cross(ROWS[:, AXIS], ROWS[:, NORMAL]))


def test_a_layout_goes_on_where_another_ends():
    longer = Layout(extends=ROW)
    assert longer.number("REACH", "how far") == ROW_WIDTH
    assert longer.vector("TURN", "how fast") == slice(ROW_WIDTH + 1, ROW_WIDTH + 4)
    assert longer.width == ROW_WIDTH + 4
    assert ROW.width == ROW_WIDTH
    assert longer.table().startswith(ROW.table())


def test_a_profiles_coefficients_have_room():
    from fieldsim.potentials.primitives.profile import DEGREE

    assert COEFFICIENTS.stop - COEFFICIENTS.start == DEGREE + 1


# Nobody reads a column by number.

# Names of arrays whose last axis is that of a layout, in whatever object they stand.
TABLES = {"row", "rows", "part", "balls", "motions", "motion", "groups", "fixed_rows", "moving_rows"}
# Rows of other things, which have two or three columns of their own or are no arrays.
OTHERS = ("mujoco/models.py", "potentials/meshes/readers/", "recording/recording.py")


def literal_columns(source: str):
    """(line, text) of subscripts that name a column of a table by a number of 2 or more, or by a slice of numbers."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Subscript):
            name = node.value.attr if isinstance(node.value, ast.Attribute) else getattr(node.value, "id", None)
            parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            # Of several indices, the last one is the column's; alone, it is one where the table is a single row.
            if name in TABLES and (len(parts) > 1 or name in ("row", "motion")) and _counted(parts[-1]):
                yield node.lineno, ast.unparse(node)
        # C++ in strings.
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and re.search(r"\brow\[\d", node.value):
            yield node.lineno, re.search(r"\brow\[\d+\]?", node.value)[0]


def _counted(index):
    """Whether an index is a number, or counts from one; from a name in capitals, that of a column, it may count."""
    if isinstance(index, ast.Slice):
        return any(_counted(bound) for bound in (index.lower, index.upper) if bound is not None)
    if isinstance(index, ast.BinOp):
        names = [x.id for x in ast.walk(index) if isinstance(x, ast.Name)]
        numbers = [x.value for x in ast.walk(index) if isinstance(x, ast.Constant)]
        return not any(name.isupper() for name in names) and any(number > 2 for number in numbers)
    return isinstance(index, ast.Constant) and isinstance(index.value, int) and not isinstance(index.value, bool)


def test_literal_columns_are_seen():
    seen = "rows[i, 14]", "rows[:, 5:8]", "rows[..., 20]", "row[14:17]", "row[2]", "scene.rows[i, 0]", "rows[i, 5 + k]"
    for text in (*seen, "x = 'D x = ex - row[5]'"):
        assert list(literal_columns(text)), text
    for text in (
        "rows[i, AXIS]",
        "rows[:, CENTER]",
        "rows[i, CENTER_X + 1]",
        "row[RGB : RGB + 3]",
        "rows[3]",
        "rows[2:5]",
        "points[i, 2]",
    ):
        assert not list(literal_columns(text)), text


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_columns_have_names(path):
    if path.relative_to(PACKAGE).as_posix().startswith(OTHERS):
        return
    assert not list(literal_columns(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("path", ["sources/rows.py", "mujoco/contact/rows.py", "mujoco/callback/rows.py"])
def test_tables_of_other_rows_are_their_layouts(path):
    module = importlib.import_module("fieldsim." + path.removesuffix(".py").replace("/", "."))
    layouts = [value for value in vars(module).values() if isinstance(value, Layout) and value is not ROW]
    assert layouts
    for layout in layouts:
        own = [line for line in layout.table().splitlines() if not line.startswith("|--") and line not in ROW.table()]
        assert own
        assert all(line in module.__doc__ for line in own)
