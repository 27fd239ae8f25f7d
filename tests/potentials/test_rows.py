"""Rows by name: the layout, its readers on every target, and that nobody reads a column by number."""

import numba
import numpy as np
import pytest
import warp as wp

from fieldsim import launch
from fieldsim.portable import Table, portable, real
from fieldsim.potentials import row
from fieldsim.potentials.row import AXIS, COEFFICIENTS, FOLD, NORMAL, ROW, ROW_WIDTH, STRENGTH, Layout, axis_of

ROWS = np.arange(2.0 * ROW_WIDTH).reshape(2, ROW_WIDTH)
VECTORS = [name for column in ROW.columns if column.count == 3 for name in column.names]


@portable
def named(rows: Table, i: int):
    """Numbers and a vector by their names."""
    x, y, z = axis_of(rows, i)
    return real(100.0) * rows[i, STRENGTH] + real(10.0) * rows[i, FOLD] + x - real(3.0) * y + real(7.0) * z


@portable
def numbered(rows: Table, i: int):
    """As `named`, by their columns."""
    return (
        real(100.0) * rows[i, 0]
        + real(10.0) * rows[i, 4]
        + rows[i, 14]
        - real(3.0) * rows[i, 15]
        + real(7.0) * rows[i, 16]
    )


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
    assert by_name[0] == 14 * 1.0 + 40.0 - 3 * 15.0 + 7 * 16.0


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


@pytest.mark.parametrize(("vector", "columns"), [(wp.vec3, AXIS), (wp.vec3d, NORMAL)])
def test_warp_reads_vectors(vector, columns):
    reader = row.vector_reader(columns, vector)
    scalar = vector._wp_scalar_type_

    @wp.kernel(module="unique", enable_backward=False)
    def kernel(start: int, rows: wp.array(dtype=scalar, ndim=2), found: wp.array(dtype=vector)):
        i = start + wp.tid()
        found[i] = reader(rows, i)

    found = wp.full(len(ROWS), np.nan, dtype=vector, device="cpu")
    launch.launch(kernel, len(ROWS), [wp.array(ROWS, dtype=scalar, device="cpu")], [found], device="cpu")
    np.testing.assert_array_equal(found.numpy(), ROWS[:, columns])


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
