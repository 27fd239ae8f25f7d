"""Steps to the nearest point of a surface, and how it bends there, against closed forms and what a nearest point is."""

import itertools
import math

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics.contact.nearest import curvatures, nearest_step, normal_turn

RING = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)


def surface(skeleton, **material):
    return fs.Body(skeleton, surface=fs.Material(**material)).surface_field()


SURFACES = {
    "point": surface(fs.Point((0, 0, 0)), radius=0.5),
    "tube": surface(fs.Segment((-1, 0, 0), (1, 0, 0)), radius=0.3),
    "ring": surface(RING, radius=0.25, kernel=fs.Cauchy),
    "plate": surface(fs.Triangle((-1, -1, 0), (1, -1, 0), (0, 1, 0)), radius=0.2),
    "pair": surface([fs.Point((-0.5, 0, 0)), fs.Point((0.5, 0, 0))], radius=0.45, kernel=fs.Quartic),
}


def jet(field, q):
    h = field.hessian(q)
    return field.value(q), *field.gradient(q), h[0, 0], h[1, 1], h[2, 2], h[0, 1], h[0, 2], h[1, 2]


def step(field, center, q):
    found = np.array(nearest_step(*(center - q), *jet(field, q), 0.1))
    return found[:3], found[3:6], found[6], found[7:10], found[10]


def on_surface(field, q):
    for _ in range(50):
        f, g = field.value(q), field.gradient(q)
        q = q - np.clip(math.log(f) * f / (g @ g), -0.05, 0.05) * g
    return q


@pytest.mark.parametrize("name", SURFACES)
def test_steps_converge_to_a_nearest_point_quadratically(name):
    """From outside and from within; the last steps square."""
    field, rng = SURFACES[name], np.random.default_rng(1)
    start = np.array([0.6, 0.3, 0.25]) if name != "ring" else np.array([0.9, 0.6, 0.3])
    for height in (-0.05, 0.02, 1.5):
        at = on_surface(field, start)
        normal = -field.gradient(at) / np.linalg.norm(field.gradient(at))
        center = at + height * normal
        q, sizes = on_surface(field, at + 0.03 * rng.normal(size=3)), []
        for _ in range(12):
            d, towards, least, _, _ = step(field, center, q)
            q = q + d
            sizes.append(np.linalg.norm(d))
        assert least > 0.0
        assert sizes[-1] < 1e-14
        offset, normal = center - q, -field.gradient(q) / np.linalg.norm(field.gradient(q))
        assert abs(math.log(field.value(q))) < 1e-12
        np.testing.assert_allclose(offset, (offset @ normal) * normal, atol=1e-13)
        np.testing.assert_allclose(towards, normal, atol=1e-12)
        late = [(a, b) for a, b in itertools.pairwise(sizes) if 1e-7 < a < 1e-2]
        assert late
        assert all(b < 30.0 * a * a for a, b in late)


def test_how_a_sphere_and_a_tube_bend():
    for name, radius, other in (("point", 0.5, 2.0), ("tube", 0.3, 0.0)):
        q = on_surface(SURFACES[name], np.array([0.0, 0.1, 0.4]))
        found = curvatures(*jet(SURFACES[name], q))
        normal = q / np.linalg.norm(q)
        np.testing.assert_allclose(found[:3], normal, atol=1e-12)
        # Of the tube, its ends bend it a little along.
        np.testing.assert_allclose(found[9:11], [1.0 / np.linalg.norm(q), other], atol=1e-9 if other else 2e-2)
        a, b = np.array(found[3:6]), np.array(found[6:9])
        np.testing.assert_allclose([a @ b, a @ normal, b @ normal, a @ a, b @ b], [0, 0, 0, 1, 1], atol=1e-12)
        assert np.linalg.norm(q) == pytest.approx(radius, abs=2e-3)


def test_the_farthest_point_along_a_ring_is_known_and_left():
    """Of a centre beside the axis, the tube's inner side across the hole is the farthest point around the ring."""
    ring = SURFACES["ring"]
    center, across = np.array([0.3, 0.0, 0.0]), on_surface(ring, np.array([-0.75, 0.0, 0.0]))
    d, _, least, direction, radius = step(ring, center, across)
    assert least == pytest.approx(1.0 - (0.3 - across[0]) / -across[0], abs=1e-6)
    assert least < 0.0
    np.testing.assert_allclose(np.abs(direction), [0, 1, 0], atol=1e-9)
    assert np.linalg.norm(d) < 1e-12
    assert 0.0 < radius <= 0.26
    # Beside it a step goes away from it.
    beside = on_surface(ring, across + np.array([0, 0.05, 0]))
    assert step(ring, center, beside)[0][1] > 0.0


def nearest(field, center, q):
    for _ in range(12):
        q = q + step(field, center, q)[0]
    return q


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("height", [-0.05, 0.02, 1.5])
def test_how_the_nearest_point_and_its_normal_follow_the_centre(name, height):
    """Against differences between nearest points of centres on both sides."""
    field = SURFACES[name]
    start = np.array([0.6, 0.3, 0.25]) if name != "ring" else np.array([0.9, 0.6, 0.3])
    q = nearest(field, start, on_surface(field, start))
    n = -field.gradient(q) / np.linalg.norm(field.gradient(q))
    center = q + height * n
    xx, yy, zz, xy, xz, yz = normal_turn(*(center - q), *jet(field, q))
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    np.testing.assert_allclose(matrix @ n, 0.0, atol=1e-12)
    for d in 1e-4 * np.random.default_rng(3).normal(size=(3, 3)):
        ends = [nearest(field, center + side * d, q) for side in (1, -1)]
        normals = [-field.gradient(end) / np.linalg.norm(field.gradient(end)) for end in ends]
        size = np.linalg.norm(d)
        np.testing.assert_allclose(matrix @ d, 0.5 * (normals[0] - normals[1]), atol=3e-6 * size)
        np.testing.assert_allclose(d - (n @ d) * n - height * matrix @ d, 0.5 * (ends[0] - ends[1]), atol=3e-6 * size)
