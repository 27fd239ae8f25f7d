"""Pictures: exact shapes, invariance, lights and shadows, materials, smooth edges, bad input."""

import math
import warnings

import numpy as np
import pytest

from fieldsim import launch
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.render.camera import Camera
from fieldsim.render.renderer import Renderer, render
from fieldsim.world.body import Body
from fieldsim.world.light import Background, DirectionalLight, PointLight
from fieldsim.world.material import Material
from fieldsim.world.motion import Keyframes, Pose
from fieldsim.world.world import World

SIZE = (64, 48)
CAMERA = Camera((4, 0, 0), fov=30)


def world_of(skeleton, material=None, *, pose=None, **options):
    world = World(**options)
    world.add_body(Body(skeleton, surface=material or Material(), motion=pose or Pose()))
    return world


def depth_of(world, camera=CAMERA, size=SIZE):
    return Renderer(size).depth_and_normals(world.at(0.0), camera)[0]


def picture(world, camera=CAMERA, size=SIZE, time=0.0, **options):
    return Renderer(size, **options).frame(world.at(time), camera)


@pytest.mark.parametrize("blobbiness", [-0.5, -4, -60, -256])
def test_an_isolated_point_is_a_sphere_whatever_its_blobbiness(blobbiness):
    radius = 0.5
    depth = depth_of(world_of(Point((0, 0, 0)), Material(radius=radius, blobbiness=blobbiness)), size=(65, 65))
    # The central ray, and the silhouette's area: tan of its half angle, in pixels of the plane at distance 1.
    assert depth[32, 32] == pytest.approx(3.5, abs=1e-5)
    pixel = 2 * np.tan(np.radians(15)) / 65
    disc = np.pi * (radius / np.sqrt(16 - radius**2) / pixel) ** 2
    # The pixels within a circle of radius r are its area give or take some r^(2/3).
    assert np.isfinite(depth).sum() == pytest.approx(disc, abs=12)


def test_a_ray_along_a_segment_meets_its_cap():
    # The thesis's bad case: the field along the axis is flat for the whole length.
    depth = depth_of(world_of(Segment((0, 0, 0), (-30, 0, 0)), Material(radius=0.3)), size=(33, 33))
    # On the axis, at u beyond the end, F = e^4 erfc(a u) / 2 = 1 with a = 2 / R.
    beyond = 4.0 - depth[16, 16]
    assert 0.5 * math.exp(4) * math.erfc(2 / 0.3 * beyond) == pytest.approx(1, abs=2e-3)


def test_an_arc_seen_twice_shows_its_near_and_its_far_side_through_the_gap():
    # An arc open towards the eye: rays through the gap pass its volume's hull twice and meet the far side.
    arc = Arc((0, 0, 0), (0, 0, 1), (0.5, np.sqrt(0.75), 0), 1.0, np.radians(240))
    depth = depth_of(world_of(arc, Material(radius=0.1)), size=(65, 65))
    assert depth[32, 32] == pytest.approx(4 + 1 - 0.1, abs=5e-3)
    assert np.nanmin(depth) < 4


def test_more_overlapping_blobs_than_fit_into_local_memory():
    # 100 blobs on one spot are one blob of a hundredfold strength: F = 100 e^(-B) e^(-a^2 r^2) / 100.
    material = Material(radius=0.5, threshold=100.0)
    together = depth_of(world_of([Point((0, 0, 0))] * 100, material))
    alone = depth_of(world_of(Point((0, 0, 0)), Material(radius=0.5)))
    assert (np.isfinite(together) == np.isfinite(alone)).all()
    # Each of 100 is cut at 1e-4, so that the sum may lack 1e-2 where they end; here they end far outside.
    hit = np.isfinite(alone)
    np.testing.assert_allclose(together[hit], alone[hit], atol=2e-4)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scale_changes_nothing(scale):
    def scene(k):
        world = world_of([Point((0, 0.3 * k, 0)), Segment((0, -0.8 * k, 0), (0, 0, 0.5 * k))], Material(radius=0.3 * k))
        world.add_particles(k * np.array([(0.5, 0.5, 0.5)]), np.zeros((1, 3)), radius=0.1 * k)
        return picture(world, Camera((4 * k, 0, k), fov=30))

    difference = np.abs(scene(1.0).astype(int) - scene(scale))
    # Coordinates round differently: silhouette pixels may move by a sample.
    assert np.count_nonzero(difference.max(axis=-1) > 2) <= 6


def test_a_turned_and_moved_world_gives_the_same_depths():
    skeleton = [Point((0, 0.3, 0)), Segment((0, -0.8, 0), (0, 0, 0.5)), Arc((0, 0, 0), (1, 0, 0), (0, 1, 0), 0.7, 2.0)]
    pose = Pose.turned((1, 2, 3), 1.0, (10, -20, 5))
    move = lambda p: tuple(pose.matrix @ np.array(p) + np.array(pose.position))  # noqa: E731
    here = depth_of(world_of(skeleton))
    there = depth_of(
        world_of(skeleton, pose=pose), Camera(move(CAMERA.eye), move((0, 0, 0)), tuple(pose.matrix[:, 2]), 30)
    )
    both = np.isfinite(here) & np.isfinite(there)
    assert np.count_nonzero(np.isfinite(here) != np.isfinite(there)) <= 2
    # At a grazing ray the depth is the root of a rounding error; elsewhere float32.
    assert np.quantile(np.abs(here[both] - there[both]), 0.97) < 1e-5


def test_materials_mix_by_weight():
    dark = DirectionalLight(direction=(0, 0, -1), intensity=0.0, shadows=False)
    world = World(lights=[dark], background=Background("white", "white", stars=0))
    for y, color in ((-0.3, (1.0, 0, 0)), (0.3, (0, 0, 1.0))):
        world.add_body(Body(Point((0, y, 0)), surface=Material(color=color, radius=0.4, blobbiness=-2)))
    image = picture(world, size=(65, 65), samples=1).astype(int)
    # By symmetry each weighs half in the middle; further out each has its own colour.
    assert image[32, 32, 0] == pytest.approx(image[32, 32, 2], abs=2)
    left, right = image[32, 25], image[32, 39]
    assert left[0] != left[2]
    assert (left == right[::-1]).all()


def test_camera_inside_a_body_sees_it_from_within():
    depth, normals = Renderer((33, 33)).depth_and_normals(
        world_of(Point((0, 0, 0)), Material(radius=1.0)).at(0.0), Camera((0.5, 0, 0), (0, 0, 0))
    )
    assert depth[16, 16] == pytest.approx(1.5, abs=1e-5)
    assert normals[16, 16] == pytest.approx((1, 0, 0), abs=1e-5)


LIGHT = PointLight(position=(4, 0, 4))


def test_a_particle_and_a_body_cast_shadows():
    for blocker in ("particle", "body"):
        lit = world_of(Point((0, 0, 0)), Material(radius=0.5), lights=(LIGHT,))
        shaded = world_of(Point((0, 0, 0)), Material(radius=0.5), lights=(LIGHT,))
        if blocker == "particle":
            shaded.add_particles(np.array([(2.0, 0, 2.0)]), np.zeros((1, 3)), radius=0.3)
        else:
            shaded.add_body(Body(Point((2, 0, 2)), surface=Material(radius=0.3)))
        plain, dark = (picture(w, size=(33, 33), samples=1).astype(int)[16, 16] for w in (lit, shaded))
        assert dark.sum() < 0.4 * plain.sum()
        unshadowed = picture(shaded, size=(33, 33), samples=1, shadows=False).astype(int)[16, 16]
        assert (unshadowed == plain).all()


def test_a_sphere_has_no_shadow_on_its_lit_side():
    world = world_of(Point((0, 0, 0)), Material(radius=0.5), lights=(DirectionalLight(direction=(-1, -1, 0)),))
    assert (picture(world, samples=1) == picture(world, samples=1, shadows=False)).all()


def test_anti_aliasing_smooths_silhouettes_only():
    world = world_of(Point((0, 0, 0)), Material(radius=0.7), background=Background("black", "black", stars=0))
    rough, smooth = (picture(world, samples=n).astype(int) for n in (1, 16))
    seen = rough.any(axis=-1)
    assert (smooth[~seen].any(axis=-1)).sum() > 10
    changed = (rough != smooth).any(axis=-1)
    assert changed.sum() < 0.5 * seen.sum()


def test_the_same_frame_twice_and_on_one_thread(monkeypatch):
    world = world_of([Point((0, 0, 0)), Point((0, 0.5, 0))])
    world.add_particles(np.random.default_rng(0).normal(size=(50, 3)), np.zeros((50, 3)), radius=0.05)
    renderer = Renderer(SIZE)
    first = renderer.frame(world.at(0.0), CAMERA)
    rays = renderer.rays
    assert (renderer.frame(world.at(0.0), CAMERA) == first).all()
    assert renderer.rays == 2 * rays
    monkeypatch.setattr(launch, "THREADS", 1)
    assert (picture(world) == first).all()


@pytest.mark.parametrize("size", [(1, 1), (7, 13), (33, 18)])
def test_odd_sizes_and_an_empty_world(size):
    assert render(World().at(0.0), CAMERA, size=size).shape == (size[1], size[0], 3)


def test_particles_alone():
    world = World()
    world.add_particles(np.zeros((1, 3)), np.zeros((1, 3)), radius=0.5)
    depth = depth_of(world, size=(33, 33))
    assert depth[16, 16] == pytest.approx(3.5, abs=1e-5)


def test_moving_cameras_and_skeletons_move_the_picture():
    point = Point(Keyframes([0, 1], [(0, -0.5, 0), (0, 0.5, 0)]))
    world = world_of(point, Material(radius=0.3))
    renderer = Renderer((33, 33))
    start, end = (renderer.depth_and_normals(world.at(t), CAMERA)[0] for t in (0.0, 1.0))
    assert (np.isfinite(start) == np.isfinite(end)[:, ::-1]).all()
    assert not np.isfinite(start)[:, 16].any()


def test_bad_sizes_and_qualities():
    for size in ((0, 10), (10, -1), (10,), "big", (10.5, 3)):
        with pytest.raises(InputError, match="size"):
            Renderer(size)
    with pytest.raises(InputError, match="'draft' or 'final'"):
        Renderer(quality="best")
    with pytest.raises(InputError, match="samples"):
        Renderer(samples=3)


def test_a_surface_that_is_nowhere_is_warned_of():
    with pytest.warns(FieldsimWarning, match="nothing to see"):
        picture(world_of(Point((0, 0, 0)), Material(threshold=1e3)))
    # Out of the picture is not out of the world.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        picture(world_of(Point((9, 0, 0))))
