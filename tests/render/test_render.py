"""The ray tracer against a slow, independent finder of roots in float64, and the promises of its pictures."""

import numpy as np
import pytest

from fieldsim.potentials.field import Field, Term
from fieldsim.potentials.kernels import Cauchy
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.render.camera import Camera
from fieldsim.render.renderer import Renderer
from fieldsim.world.body import Body
from fieldsim.world.material import Material
from fieldsim.world.world import World

SIZE = (96, 96)


def world_of(*bodies, **options):
    world = World(**options)
    for skeleton, material in bodies:
        world.add_body(Body(skeleton, surface=material))
    return world


def rays(camera, size):
    """Unit directions through the pixels' centres, (H, W, 3), from the camera's definition."""
    width, height = size
    right, up, forward = camera.axes()
    half = np.tan(np.radians(camera.fov) / 2)
    x = (np.arange(width) + 0.5 - width / 2) / (height / 2) * half
    y = -(np.arange(height) + 0.5 - height / 2) / (height / 2) * half
    d = forward + x[None, :, None] * right + y[:, None, None] * up
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def field_of(world):
    """The surface's field as a `Field`; blobbiness moderate enough for folded exponents to be unfolded."""
    terms = []
    for body in world.bodies:
        kernel = body.surface.surface_kernel
        for primitive in body.skeleton:
            strength, fold = body.surface.surface_strength(primitive.dimension)
            terms.append(Term(primitive, kernel, strength * np.exp(fold)))
    return Field.of_terms(terms)


def oracle(world, camera, size, near, far, samples=400):
    """Depths (H, W) of the first sign change among dense samples in near..far, bisected, or inf; and the field."""
    field = field_of(world)
    d = rays(camera, size).reshape(-1, 3)
    eye = np.array(camera.eye)
    before = np.full(len(d), near)
    depth = np.full(len(d), np.inf)
    looking = np.arange(len(d))
    for t in np.linspace(near, far, samples)[1:]:
        inside = field.value(eye + t * d[looking]) >= 1
        depth[looking[inside]] = t
        looking = looking[~inside]
        before[looking] = t
        if not len(looking):
            break
    hit = np.isfinite(depth)
    low, high = before[hit], depth[hit]
    for _ in range(40):
        middle = 0.5 * (low + high)
        inside = field.value(eye + middle[:, None] * d[hit]) >= 1
        low, high = np.where(inside, low, middle), np.where(inside, middle, high)
    depth[hit] = high
    return depth.reshape(size[1], size[0]), field


def check(world, camera, near, far, radius, size=SIZE):
    """The tracer sees what the oracle sees."""
    depth, normals = Renderer(size).depth_and_normals(world.at(0.0), camera)
    expected, field = oracle(world, camera, size, near, far)
    # Rays that only graze may fall either way within the cut and the oracle's own step.
    assert np.count_nonzero(np.isfinite(depth) != np.isfinite(expected)) <= 2
    d = rays(camera, size)
    hit = np.isfinite(depth)
    value, gradient = field.value_and_gradient(np.array(camera.eye) + depth[hit][:, None] * d[hit])
    slope = np.linalg.norm(gradient, axis=1)
    # Each of a handful of elements is cut at 1e-4 of the level, where the slope is 2 |B| / R >= 4 / R: 1e-4 R leaves
    # room for four.
    assert (np.abs(value - 1) / slope).max() < 1e-4 * radius
    # The first root, not another one: save for grazing, where the oracle's samples step over a crossing.
    assert np.count_nonzero(np.abs(depth[hit] - expected[hit]) > 1e-2 * radius) <= 2
    # A cut of 1e-4 in F leaves out a gradient of up to 1e-4 * 2 a^2 reach, some 5e-4 of the slope at the surface.
    expected_normal = -gradient / slope[:, None]
    assert np.einsum("ij,ij->i", normals[hit], expected_normal).min() > 1 - 1e-5


def blobs(rng, count, radius, kernel, blobbiness):
    material = Material(radius=radius, blobbiness=blobbiness, kernel=kernel)
    return world_of(([Point(p) for p in rng.uniform(-0.8, 0.8, (count, 3))], material))


@pytest.mark.parametrize("seed", range(4))
def test_points_as_the_oracle_sees_them(seed):
    rng = np.random.default_rng(seed)
    world = blobs(rng, 12, 0.3, Material.kernel, rng.uniform(-6, -2))
    eye = rng.normal(size=3)
    camera = Camera(tuple(4 * eye / np.linalg.norm(eye)), fov=36)
    check(world, camera, 2.0, 6.0, 0.3)


def test_cauchy_points_as_the_oracle_sees_them():
    world = blobs(np.random.default_rng(5), 8, 0.3, Cauchy, -4)
    check(world, Camera((3, 2, 1), fov=40), 1.5, 6.0, 0.3)


SKELETON = [
    Segment((-0.7, 0, 0), (0.7, 0.1, 0.2)),
    Segment((0, -0.6, 0.1), (0.1, 0.6, 0)),
    Arc((0, 0, 0.2), (0.2, 0, 1), (1, 0, 0), 0.8, 4.0),
    Point((0, 0, 0.7)),
]


@pytest.mark.parametrize("eye", [(3, 2, 1.5), (-1, 0.4, 3.4), (4, 0.1, 0.2)])
def test_segments_arcs_and_points_as_the_oracle_sees_them(eye):
    check(world_of((SKELETON, Material(radius=0.2, blobbiness=-3))), Camera(eye, fov=36), 1.5, 6.0, 0.2)
