"""Fields prepared for single points, against the exact sums."""

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.potentials.fast_summation.local_field import local_field


def threads(count, kernel, seed=0):
    rng = np.random.default_rng(seed)
    starts = rng.uniform(-1.0, 1.0, (count, 3))
    skeleton = [fs.Segment(start, start + 0.1 * rng.normal(size=3)) for start in starts]
    return fs.Field(skeleton, kernel, strength=rng.uniform(0.5, 1.0, count))


@pytest.mark.parametrize("kernel", [fs.Newtonian(), fs.Cauchy(3.0), fs.Gaussian(4.0)], ids=repr)
def test_a_prepared_field_is_that_of_its_elements(kernel):
    field = threads(300, kernel)
    prepared = local_field(field.elements, (-1, -1, -1), (1, 1, 1), 1e-5)
    rng = np.random.default_rng(1)
    points = np.concatenate([rng.uniform(-1.0, 1.0, (60, 3)), rng.normal(size=(3, 3)) + 3.0])
    read = prepared.read.numba
    found = np.array([read(*point, *prepared.tables) for point in points])
    value, gradient = field.value_and_gradient(points)
    assert np.abs(found[:, 0] - value).max() <= 1e-5 * value.max()
    assert np.abs(found[:, 1:] - gradient).max() <= 1e-3 * np.abs(gradient).max()
    outside = slice(60, None)
    np.testing.assert_allclose(found[outside, 0], value[outside], rtol=1e-12)


def test_few_of_the_elements_are_summed_at_a_point():
    field = threads(1000, fs.Newtonian())
    prepared = local_field(field.elements, (-1, -1, -1), (1, 1, 1), 1e-4)
    _box, _cells, _local, begin, ranges, rows, _kinds = prepared.tables
    summed = np.add.reduceat(np.diff(ranges.reshape(-1, 2), axis=1)[:, 0], begin[:-1])
    assert summed.mean() < 0.25 * len(rows)
    assert prepared.order > 4


def test_a_small_field_of_several_kernels_in_plain_python():
    field = (
        threads(40, fs.Newtonian())
        + threads(40, fs.Cauchy(2.0), 1)
        + fs.Field(fs.Plane((0, 0, -2), (0, 0, 1)), fs.Gaussian())
    )
    prepared = local_field(field.elements, (-1, -1, -1), (1, 1, 1), 1e-4)
    point = (0.3, -0.2, 0.1)
    value, *gradient = prepared.read(*point, *prepared.tables)
    assert value == pytest.approx(field.value(point), rel=1e-4)
    np.testing.assert_allclose(gradient, field.gradient(point), atol=1e-2 * np.abs(field.gradient(point)).max())


def test_elements_beyond_the_box_pull_within_it():
    far = fs.Field(fs.Point((40.0, 3.0, 0.0)), fs.Newtonian(), strength=100.0)
    field = threads(200, fs.Newtonian()) + far
    prepared = local_field(field.elements, (-1, -1, -1), (1, 1, 1), 1e-5)
    point = (0.3, -0.2, 0.1)
    assert prepared.read(*point, *prepared.tables)[0] == pytest.approx(field.value(point), rel=1e-5)
