"""Shadows of hard shapes, on each other and on soft surfaces, against their distances."""

import numpy as np
import pytest
import shape_oracle as oracle
from test_render import rays
from test_render_solids import CAMERA, POSE, SHAPES, SIZE, check, look

from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.point import Point
from fieldsim.render.camera import Camera
from fieldsim.render.renderer import Renderer
from fieldsim.world.body import Body
from fieldsim.world.light import DirectionalLight, PointLight
from fieldsim.world.material import Material
from fieldsim.world.shapes import Ball, Capsule, Ground
from fieldsim.world.world import World


def shadow_mask(world, camera=CAMERA, size=SIZE):
    """Pixels that shadows darken."""
    lit, dark = (Renderer(size, samples=1, shadows=s).frame(world.at(0.0), camera).astype(int) for s in (False, True))
    assert (dark <= lit).all()
    return (lit - dark).sum(axis=-1) > 0


def hidden(p, toward, distance, far=4.0):
    """Whether a ray from p (..., 3) comes within a shape on its way."""
    return np.min([distance(p + s * toward) for s in np.linspace(0.02, far, 300)], axis=0) < 0


SUN = np.array((0.4, 0.5, 0.9)) / np.linalg.norm((0.4, 0.5, 0.9))
SUNNY = {"lights": (DirectionalLight(direction=tuple(-SUN)),)}


def agree(mask, expected):
    """Alike but for pixels on a shadow's edge, which lie within the samples' step of it."""
    assert expected.any()
    assert np.count_nonzero(mask != expected) <= 0.02 * expected.size


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_cast_their_shadows_on_the_ground_and_none_on_their_lit_sides(name):
    shape, distance = SHAPES[name]
    distance = oracle.placed(distance, POSE)
    world = World(**SUNNY)
    world.add_shape(shape, motion=POSE)
    world.add_shape(Ground(-0.9))
    depth, normals = look(world)
    hit = np.isfinite(depth)
    p = np.array(CAMERA.eye) + np.where(hit, depth, 0)[..., None] * rays(CAMERA, SIZE) + 1e-3 * normals
    # All of these are convex: what faces the sun is in light.
    agree(shadow_mask(world), hit & (normals @ SUN > 0) & (np.abs(p[..., 2] + 0.9) < 0.01) & hidden(p, SUN, distance))


def test_a_long_rod_does_not_speckle_itself():
    """Its middle is so far away that float32 places its side no better than shadow rays start above it."""
    world = World(**SUNNY)
    world.add_shape(Capsule((-9, -7, -5), (1800, 1400, 1000), 0.05))
    camera = Camera((0, 0, 1.0), (0, 0, 0), up=(0, 1, 0), fov=20)
    assert np.isfinite(look(world, camera)[0]).sum() > 100
    assert not shadow_mask(world, camera).any()


def test_an_arc_tube_shadows_itself():
    world = World(**SUNNY)
    # Nearly across the sun, so that one side stands over the other.
    axis = np.array((1, 0.3, -0.5)) / np.linalg.norm((1, 0.3, -0.5))
    world.add_body(Body(Circle((0, 0, 0), tuple(axis), 0.8), surface=Material(radius=0.2)))

    def distance(p):
        height = p @ axis
        rho = np.linalg.norm(p - height[..., None] * axis, axis=-1)
        return np.hypot(rho - 0.8, height) - 0.2

    check(world, distance, mode="hard")
    lit, dark = (Renderer(SIZE, samples=1, shadows=s, mode="hard").frame(world.at(0.0), CAMERA) for s in (False, True))
    depth, normals = look(world, mode="hard")
    hit = np.isfinite(depth)
    p = np.array(CAMERA.eye) + np.where(hit, depth, 0)[..., None] * rays(CAMERA, SIZE) + 1e-3 * normals
    expected = hit & (normals @ SUN > 0) & hidden(p, SUN, distance)
    agree((lit != dark).any(axis=-1), expected)


@pytest.mark.parametrize("above", ["soft", "hard", "particle"])
@pytest.mark.parametrize("below", ["soft", "hard"])
def test_soft_and_hard_shadow_each_other(above, below):
    """Two balls of each sort, one between the other and a lamp."""
    lamp = np.array((2.0, 0.0, 3.0))
    world = World(lights=(PointLight(position=tuple(lamp)),))
    middle = 0.4 * lamp
    for kind, center, radius in ((below, np.zeros(3), 0.6), (above, middle, 0.2)):
        if kind == "soft":
            world.add_body(Body(Point(tuple(center)), surface=Material(radius=radius, blobbiness=-8)))
        elif kind == "hard":
            world.add_shape(Ball(tuple(center), radius))
        else:
            world.add_particles(center[None], np.zeros((1, 3)), radius=radius)
    mask = shadow_mask(world)
    depth, normals = look(world)
    p = np.array(CAMERA.eye) + np.where(np.isfinite(depth), depth, 0)[..., None] * rays(CAMERA, SIZE)
    to = lamp - p
    along = np.clip(np.einsum("ijk,ijk->ij", middle - p, to) / np.einsum("ijk,ijk->ij", to, to), 0, 1)
    near = np.linalg.norm(p + along[..., None] * to - middle, axis=-1) < 0.2
    on_lower = np.isfinite(depth) & (np.abs(np.linalg.norm(p, axis=-1) - 0.6) < 0.01)
    agree(mask, on_lower & near & (np.einsum("ijk,ijk->ij", normals, to) > 0))


def test_nearer_things_hide_farther_ones():
    world = World()
    world.add_body(Body(Point((0, 0, 0)), surface=Material(radius=0.5)))
    world.add_shape(Ball((1.0, 0.15, 0.2), 0.3))
    world.add_particles([(2.0, 0.3, 0.5)], [(0, 0, 0)], radius=0.1)
    distance = lambda p: np.minimum.reduce(  # noqa: E731
        [oracle.ball(p - c, r) for c, r in (((0, 0, 0), 0.5), ((1.0, 0.15, 0.2), 0.3), ((2.0, 0.3, 0.5), 0.1))]
    )
    check(world, distance)
