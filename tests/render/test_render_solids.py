"""Hard shapes: against signed distances in float64; poses, shadows both ways, arrays, skeletons drawn hard."""

import dataclasses

import numpy as np
import pytest
import shape_oracle as oracle
from test_render import rays

from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.meshes.mesh import mesh
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.base import Volume
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.potentials.skeletons.shapes import box as box_triangles
from fieldsim.render.camera import Camera
from fieldsim.render.renderer import Renderer
from fieldsim.render.solids.packing import solids_of
from fieldsim.world.body import Body
from fieldsim.world.light import DirectionalLight
from fieldsim.world.material import Material
from fieldsim.world.motion import Keyframes, Pose, Spin
from fieldsim.world.shapes import Ball, Box, Capsule, Cylinder, Ellipsoid, Ground, TriangleSurface
from fieldsim.world.world import World

SIZE = (48, 40)
CAMERA = Camera((4, 0.6, 1.1), fov=34)
POSE = Pose.turned((1, 2, -1), 1.1, (0.2, -0.15, 0.1))
CUBE = mesh(box_triangles((0.3, 0, 0), (0.8, 0.6, 1.0)))

SHAPES = {
    "ball": (Ball((0.3, 0, 0), 0.8), lambda p: oracle.ball(p - (0.3, 0, 0), 0.8)),
    "ellipsoid": (Ellipsoid((0.9, 0.3, 0.6)), lambda p: oracle.ellipsoid(p, (0.9, 0.3, 0.6))),
    "box": (Box((0.8, 0.6, 1.0), (0.3, 0, 0)), lambda p: oracle.box(p - (0.3, 0, 0), np.array((0.4, 0.3, 0.5)))),
    "cylinder": (Cylinder((0, 0, -0.4), (0, 0, 0.4), 0.5), lambda p: oracle.cylinder(p, 0.5, 0.4)),
    "capsule": (
        Capsule((-0.5, 0.1, 0), (0.4, 0, 0.3), 0.3),
        lambda p: oracle.segment(p, (-0.5, 0.1, 0), (0.4, 0, 0.3), 0.3),
    ),
    "mesh": (TriangleSurface(CUBE), lambda p: oracle.box(p - (0.3, 0, 0), np.array((0.4, 0.3, 0.5)))),
}


def look(world, camera=CAMERA, size=SIZE, **options):
    return Renderer(size, **options).depth_and_normals(world.at(0.0), camera)


def check(world, distance, camera=CAMERA, size=SIZE, scale=1.0, reach=8.0, **options):
    """The tracer's hits lie on the surface distance(p) = 0, the first that a ray crosses, with its normals."""
    depth, normals = look(world, camera, size, **options)
    d, eye = rays(camera, size), np.array(camera.eye)
    # The distance along each ray, densely; inside counts as outside where the eye is within.
    t = np.linspace(0.0, reach * scale, 600)
    side = np.sign(distance(eye[None])[0])
    along = side * np.stack([distance(eye + step * d) for step in t], axis=-1)
    hit = np.isfinite(depth)
    # Rays that graze within float32's error of the distance may fall either way.
    sure = (np.abs(along.min(axis=-1)) > 1e-2 * scale) & ~(hit & (depth > reach * scale))
    assert (hit == (along.min(axis=-1) < 0))[sure].all()
    p = eye + np.where(hit, depth, 0.0)[..., None] * d
    # float32 carries the depth to some 1e-7 of the distance from the eye, a handful of operations deep.
    assert np.abs(distance(p))[hit].max() < 4e-6 * scale
    # What is hit is met first: before it the ray is on the eye's side.
    before = np.where(t < depth[..., None] - 1e-3 * scale, along, np.inf).min(axis=-1)
    assert before[hit].min() > -1e-6 * scale
    expected = side * oracle.gradient(distance, p, 1e-5 * scale)
    # Within the step of an edge the difference quotient is no normal.
    right = np.einsum("ijk,ijk->ij", normals, expected)[hit] > 1 - 1e-4
    assert np.count_nonzero(~right) <= 0.03 * np.count_nonzero(hit)
    assert np.einsum("ijk,ijk->ij", normals, d)[hit].max() < 1e-3
    return hit


@pytest.mark.parametrize("name", SHAPES)
def test_shapes_are_where_their_distances_say(name):
    shape, distance = SHAPES[name]
    for pose in (Pose(), POSE):
        world = World()
        world.add_shape(shape, motion=pose)
        hit = check(world, oracle.placed(distance, pose))
        assert 0.02 < hit.mean() < 0.6


@pytest.mark.parametrize("name", SHAPES)
def test_from_within_the_far_side_is_seen(name):
    shape, distance = SHAPES[name]
    world = World()
    world.add_shape(shape, motion=POSE)
    inside = Camera(tuple(POSE.apply((0.1, 0.02, 0.05))), (1, 1, 1), fov=100)
    hit = check(world, oracle.placed(distance, POSE), inside)
    assert hit.all()


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_shapes_at_any_scale(scale):
    world = World()
    for shape in (Ball((0, 0.5 * scale, 0), 0.3 * scale), Box((0.2 * scale,) * 3, (0, -0.5 * scale, 0))):
        world.add_shape(shape)
    distance = lambda p: np.minimum(  # noqa: E731
        oracle.ball(p - (0, 0.5 * scale, 0), 0.3 * scale), oracle.box(p - (0, -0.5 * scale, 0), np.full(3, 0.1 * scale))
    )
    check(world, distance, Camera(tuple(scale * np.array(CAMERA.eye)), fov=34), scale=scale)


def test_planes_have_an_end_only_where_told():
    world = World()
    world.add_shape(Ground(-0.5))
    depth, normals = look(world)
    d = rays(CAMERA, SIZE)
    expected = np.where(d[..., 2] < 0, -1.6 / np.where(d[..., 2] < 0, d[..., 2], -1.0), np.inf)
    np.testing.assert_allclose(depth, expected, rtol=2e-6)
    np.testing.assert_allclose(normals[np.isfinite(depth)], np.broadcast_to((0, 0, 1.0), (np.isfinite(depth).sum(), 3)))
    ended = World()
    ended.add_shape(Ground(-0.5, extent=(0.6, 0.3)))
    p = np.array(CAMERA.eye) + np.where(np.isfinite(expected), expected, 0.0)[..., None] * d
    on = np.isfinite(expected) & (np.abs(p[..., 0]) < 0.6) & (np.abs(p[..., 1]) < 0.3)
    assert (np.isfinite(look(ended)[0]) == on).all()
    # From below the other side is seen.
    assert look(world, Camera((4, 0.6, -2.0), (0, 0, 0), fov=34))[1][0, 24] == pytest.approx((0, 0, -1))


def test_planes_lie_across_any_normal_through_any_point():
    world = World()
    normal = np.array((1, 2, 3)) / np.sqrt(14)
    world.add_shape(Ground((0.1, 0.2, 0.3), tuple(normal)), motion=POSE)
    depth = look(world)[0]
    p = np.array(CAMERA.eye) + np.where(np.isfinite(depth), depth, 0)[..., None] * rays(CAMERA, SIZE)
    offset = ((p - POSE.position) @ POSE.matrix - (0.1, 0.2, 0.3)) @ normal
    hit = np.isfinite(depth)
    assert (np.abs(offset[hit]) < 2e-6 * depth[hit]).all()


def test_a_checker_has_its_colours_in_squares_and_their_mean_far_away():
    world = World(lights=(DirectionalLight(direction=(0, 0, -1)),))
    world.add_shape(Ground(checker="black", tile=0.5), Material("white", specular=0.0, ambient=0.0))
    camera = Camera((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=30)
    image = Renderer((64, 64), samples=1).frame(world.at(0.0), camera)[..., 0]
    x = (np.arange(64) + 0.5 - 32) / 32 * np.tan(np.radians(15)) * 3
    square = np.floor(x / 0.5)
    even = (np.floor(-x / 0.5)[:, None] + square[None, :]) % 2 == 0
    # Away from the borders of squares, where a pixel is one or the other.
    inner = np.abs(x / 0.5 - np.round(x / 0.5)) > 0.1
    clear = inner[:, None] & inner[None, :]
    assert (image[clear & ~even] == 0).all()
    assert (image[clear & even] > 200).all()
    far = Renderer((32, 32), samples=1).frame(world.at(0.0), Camera((0, 0, 600), (0, 0, 0), up=(0, 1, 0), fov=30))
    # Half of white's linear light, where a pixel covers 20 squares and more.
    assert np.ptp(far.astype(int)) <= 12


# Many shapes


def test_many_shapes_with_a_pose_each():
    rng = np.random.default_rng(2)
    count = 120
    positions = rng.uniform(-0.9, 0.9, (count, 3))
    turns = rng.normal(size=(count, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    shapes = [Box((0.2, 0.1, 0.05)) if k % 2 else Ball(radius=0.06) for k in range(count)]
    world = World()
    group = world.add_shape(shapes, motion=lambda time: (positions + np.array((0, 0, time)), turns))
    poses = [Pose(tuple(p), tuple(q)) for p, q in zip(positions, turns, strict=True)]
    half = np.array((0.1, 0.05, 0.025))
    each = [
        oracle.placed((lambda p: oracle.box(p, half)) if k % 2 else (lambda p: oracle.ball(p, 0.06)), poses[k])
        for k in range(count)
    ]
    distance = lambda p: np.min([one(p) for one in each], axis=0)  # noqa: E731
    check(world, distance, size=(13, 10))
    # A snapshot's own poses count for more than the motion; the order of quaternion or matrix does not matter.
    there = world.at(0.0)
    moved = dataclasses.replace(there, shape_poses=(group.poses_at(0.25),))
    expected = Renderer(SIZE).frame(world.at(0.25), CAMERA)
    assert (Renderer(SIZE).frame(moved, CAMERA) == expected).all()
    assert (Renderer(SIZE).frame(there, CAMERA) != expected).any()
    with pytest.raises(InputError, match="0 shape_poses for 1 groups"):
        _ = dataclasses.replace(there, shape_poses=()).shapes


def test_motions_move_shapes_together():
    world = World()
    world.add_shape([Ball((0.5, 0, 0), 0.2), Ball((-0.5, 0, 0), 0.1)], motion=Spin((0, 0, 1), np.pi))
    world.add_shape(Ball(radius=0.05), motion=Keyframes([0, 1], [(0, 0, 0), (0, 0, 1)]))
    placed = solids_of(world.at(0.5))
    np.testing.assert_allclose(placed.origins, [(0, 0.5, 0), (0, -0.5, 0), (0, 0, 0.5)], atol=1e-12)
    assert placed.lengths.tolist() == [0.2, 0.1, 0.05]


def test_materials_of_shapes():
    world = World(lights=(DirectionalLight(direction=(-1, 0, 0)),))
    plain = {"ambient": 0.0, "specular": 0.0, "diffuse": 1.0}
    world.add_shape(
        [Ball((0, -0.5, 0), 0.3), Ball((0, 0.5, 0), 0.3)],
        [Material((1.0, 0, 0), **plain), Material(lambda t: (0, 0, 1.0), **plain)],
    )
    image = Renderer((64, 32), samples=1).frame(world.at(0.0), Camera((4, 0, 0), fov=20))
    left, right = image[16, 32 - 11], image[16, 32 + 11]
    assert left[0] > 200
    assert right[2] > 200
    assert left[2] == right[0] == 0


def test_a_smooth_mesh_has_the_normals_of_what_it_approximates():
    ball = pytest.importorskip("trimesh").creation.icosphere(subdivisions=3, radius=0.7)
    round_mesh = mesh(np.asarray(ball.vertices), np.asarray(ball.faces))
    worst = []
    assert TriangleSurface(round_mesh) != TriangleSurface(CUBE)
    for smooth in (False, True):
        world = World()
        world.add_shape(TriangleSurface(round_mesh, smooth=smooth), motion=POSE)
        depth, normals = look(world)
        hit = np.isfinite(depth)
        p = np.array(CAMERA.eye) + depth[hit][:, None] * rays(CAMERA, SIZE)[hit] - POSE.position
        radial = p / np.linalg.norm(p, axis=1)[:, None]
        worst.append(np.einsum("ij,ij->i", radial, normals[hit]).min())
    # Edges of some 0.14 radians: facets turn away by half of that, interpolated normals by its square.
    assert worst[0] < 1 - 1e-3
    assert worst[1] > 1 - 1e-4


# Skeletons drawn hard


HARD = {
    "point": (Point((0.1, 0.2, 0)), lambda p: oracle.ball(p - (0.1, 0.2, 0), 0.2)),
    "segment": (
        Segment((-0.6, 0, 0), (0.5, 0.2, 0.3)),
        lambda p: oracle.segment(p, (-0.6, 0, 0), (0.5, 0.2, 0.3), 0.2),
    ),
    "circle": (Circle((0, 0, 0), (0, 0, 1), 0.7), lambda p: oracle.arc(p, 0.7, 2 * np.pi, 0.2)),
    "half": (Arc((0, 0, 0), (0, 0, 1), (1, 0, 0), 0.7, 3.0), lambda p: oracle.arc(p, 0.7, 3.0, 0.2)),
    "horseshoe": (Arc((0, 0, 0), (0, 0, 1), (1, 0, 0), 0.7, 5.9), lambda p: oracle.arc(p, 0.7, 5.9, 0.2)),
    "triangle": (
        Triangle((-0.5, -0.4, 0), (0.6, -0.3, 0.2), (0, 0.6, 0.1)),
        lambda p: oracle.triangle(p, (-0.5, -0.4, 0), (0.6, -0.3, 0.2), (0, 0.6, 0.1), 0.2),
    ),
    "plane": (Plane((0, 0, -0.5), (0, 0, 1)), lambda p: oracle.plane(p - (0, 0, -0.5), 0.2)),
}


@pytest.mark.parametrize("name", HARD)
@pytest.mark.parametrize("pose", [Pose(), POSE], ids=["still", "posed"])
def test_hard_skeletons_are_all_within_the_radius(name, pose):
    primitive, distance = HARD[name]
    world = World()
    world.add_body(Body(primitive, surface=Material(radius=0.2), motion=pose))
    check(world, oracle.placed(distance, pose), mode="hard", reach=30.0 if name == "plane" else 8.0)


def test_a_thin_ring_keeps_its_tube():
    """A tube of 1/100 of the ring: in float32 the quartic would lose it."""
    world = World()
    world.add_body(Body(Circle((0, 0, 0), (0.3, 0.2, 1), 1.0), surface=Material(radius=0.01)))
    depth = look(world, size=(200, 120), mode="hard")[0]
    p = np.array(CAMERA.eye) + depth[..., None] * rays(CAMERA, (200, 120))
    p = p[np.isfinite(depth)]
    axis = np.array((0.3, 0.2, 1)) / np.linalg.norm((0.3, 0.2, 1))
    height = p @ axis
    rho = np.linalg.norm(p - height[:, None] * axis, axis=1)
    assert len(p) > 200
    assert np.abs(np.hypot(rho - 1, height) - 0.01).max() < 4e-6


def test_skeletons_are_lines_of_some_pixels_whatever_their_distance():
    for distance in (4.0, 40.0):
        world = World()
        reach = 0.15 * distance
        world.add_body(
            Body(
                [Segment((0, -reach, 0), (0, reach, 0)), Point((0, 0, reach))], surface=Material(radius=0.08 * distance)
            )
        )
        hit = np.isfinite(look(world, Camera((distance, 0, 0), fov=40), (96, 96), mode="skeleton")[0])
        widths = hit[48 - 10 : 48 + 10, 30:60].sum(axis=0)
        # 2.5 pixels wide.
        assert set(widths.tolist()) <= {2, 3}
        # A disc of radius 3.
        assert 20 <= hit[:38].sum() <= 36


def test_triangles_are_their_edges_as_lines():
    world = World()
    corners = np.array([(0, -0.8, -0.6), (0, 0.8, -0.6), (0, 0, 0.8)])
    world.add_body(Body(Triangle(*map(tuple, corners)), surface=Material(radius=0.3)))
    camera = Camera((4, 0, 0), fov=40)
    hit = np.isfinite(look(world, camera, (96, 96), mode="skeleton")[0])
    assert not hit[48, 48]
    assert hit.any(axis=0).sum() > 50


def test_every_primitive_can_be_drawn_hard():
    assert {formula.primitive.volume for formula in registry.FORMULAS.values()} == set(Volume)


# What cannot be


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Ball(radius=0), "Ball: radius is 0; give a number above 0"),
        (lambda: Ball((0, 0, np.nan)), "Ball: center"),
        (lambda: Box((1, -1, 1)), r"Box: size is \(1.0, -1.0, 1.0\); give numbers above 0"),
        (lambda: Box(1.0), "Box: size has shape"),
        (lambda: Ellipsoid((1, 0, 1)), "Ellipsoid: radii"),
        (lambda: Cylinder((0, 0, 1), (0, 0, 1), 1), "Cylinder: start and end are both"),
        (lambda: Capsule((0, 0, 1), (0, 0, 1), 1), "Capsule: start and end are both"),
        (lambda: Capsule((0, 0, 0), (0, 0, 1), -1), "Capsule: radius"),
        (lambda: Ground(normal=(0, 0, 0)), r"Ground: normal is \(0, 0, 0\); give a direction"),
        (lambda: Ground(checker="whyte"), "Ground: checker is 'whyte', an unknown color; did you mean 'white'"),
        (lambda: Ground(tile=0.0), "Ground: tile"),
        (lambda: Ground(extent=1.0), "Ground: extent is 1.0; give two half sizes"),
        (lambda: Ground(extent=(1.0, 0.0)), "Ground: extent"),
        (lambda: TriangleSurface("cow.stl"), "TriangleSurface: mesh is 'cow.stl'; give fs.mesh"),
        (lambda: World().add_shape(3), "World.add_shape: shapes is 3"),
        (lambda: World().add_shape([]), r"World.add_shape: shapes is empty"),
        (lambda: World().add_shape(["box"]), r"shapes\[0\] is 'box'; give fs.Ball"),
        (lambda: World().add_shape(Ball(), "red"), "materials is 'red'; give fs.Material"),
        (lambda: World().add_shape([Ball()] * 3, [Material()] * 2), "2 materials for 3 shapes"),
        (
            lambda: World().add_shape([Ball()] * 3, motion=lambda t: (np.zeros((2, 3)), np.zeros((2, 4)))),
            "for 3 shapes",
        ),
        (lambda: Renderer(mode="draft"), "Renderer: mode is 'draft'; give 'soft', 'hard' or 'skeleton'"),
    ],
)
def test_what_cannot_be_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
