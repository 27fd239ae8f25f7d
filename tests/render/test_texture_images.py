"""Pictures on surfaces and on hard shapes: where each pixel of them is seen."""

import math

import numpy as np
import pytest
import warp as wp
from test_render import rays

import fieldsim as fs
from fieldsim.launch import launch
from fieldsim.potentials.skeletons.shapes import box as box_triangles
from fieldsim.render.materials.textures import beside
from fieldsim.render.shading.sky import AMBIENT, FILL
from fieldsim.world.color import linear_of
from fieldsim.world.shapes import frame_along

SIZE = (120, 120)
POSE = fs.Pose.turned((1, 2, -1), 1.1, (0.2, -0.15, 0.1))
TAU = 2 * math.pi


def srgb(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def ramp(width=64, height=32):
    """A picture whose red is u, green is v and blue is a half."""
    v, u = (np.mgrid[:height, :width] + 0.5) / np.array([height, width])[:, None, None]
    return srgb(np.stack([u, v, np.full_like(u, 0.5)], axis=-1))


RAMP = ramp()
DARK = (fs.DirectionalLight(direction=(0, 0, 1), intensity=0.0, shadows=False),)
BRIGHT = fs.Background(top="white", bottom="white", stars=0)


def skin(color, **options):
    """A material of which nothing but the ambient light is seen, about as bright as its colour."""
    return fs.Material(color, ambient=1.6, specular=0.0, **options)


def seen(world, camera, time=0.0, **options):
    """Colours (N, 3), linear, without their lighting, and places (N, 3) of pixels that see something well."""
    renderer = fs.Renderer(SIZE, samples=1, **options)
    depth, normals = renderer.depth_and_normals(world.at(time), camera)
    linear = linear_of(renderer.frame(world.at(time), camera) / 255.0)
    d = rays(camera, SIZE)
    hit = np.isfinite(depth) & (np.abs(np.sum(normals * d, axis=-1)) > 0.35)
    up = 0.5 + 0.5 * normals[hit][:, 2]
    ambient = AMBIENT + FILL * (0.4 + up * 0.6)
    places = np.array(camera.eye) + depth[hit][:, None] * d[hit]
    return linear[hit] / (1.6 * ambient)[:, None], places


def fraction(x):
    return x - np.floor(x)


def check(found, u, v, repeat=(1.0, 1.0)):
    """Colours of the ramp are those at u, v: away from its borders, where it jumps."""
    wanted = fraction(np.stack([u * repeat[0], v * repeat[1]], axis=-1))
    # Near a border smaller copies of the picture mix both sides of it.
    clear = (np.abs(wanted - 0.5) < 0.44).all(axis=1)
    assert clear.mean() > 0.25
    # A step of the 8 bits is 0.009 at the brightest; half of it.
    np.testing.assert_allclose(found[clear][:, :2], wanted[clear], atol=0.006)
    np.testing.assert_allclose(found[clear][:, 2], 0.5, atol=0.006)


def on_ball(p):
    return 0.5 + np.arctan2(p[:, 1], p[:, 0]) / TAU, np.arccos(p[:, 2] / np.linalg.norm(p, axis=1)) / math.pi


# On surfaces


def on_segment(p):
    """On the segment from (0, 0, 0) to (0, 1, 0)."""
    return np.clip(p[:, 1], 0, 1), 0.75 + np.arctan2(-p[:, 2], p[:, 0]) / TAU


def on_arc(angle):
    """On an arc of radius 1 about z, from x."""

    def coordinates(p):
        along = fraction((np.arctan2(p[:, 1], p[:, 0]) - 0.5 * angle) / TAU + 0.5) - 0.5
        u = np.clip(0.5 + along * TAU / angle, 0, 1)
        return u, 0.5 - np.arctan2(p[:, 2], np.hypot(p[:, 0], p[:, 1]) - 1.0) / TAU

    return coordinates


def in_plane(p):
    return p[:, 0], -p[:, 1]


# A primitive in its body's frame, coordinates there and the picture's repetitions.
PRIMITIVES = {
    "point": (fs.Point((0, 0, 0)), on_ball, (1, 1)),
    "segment": (fs.Segment((0, 0, 0), (0, 1, 0)), on_segment, (1, 1)),
    "arc": (fs.Arc((0, 0, 0), (0, 0, 1), (1, 0, 0), 1.0, 4.0), on_arc(4.0), (2, 1)),
    # Circles begin wherever is simple across their normal: at y for z.
    "circle": (fs.Circle((0, 0, 0), (0, 0, 1), 1.0), lambda p: (on_arc(TAU)(p)[0] - 0.25, on_arc(TAU)(p)[1]), (4, 2)),
    "triangle": (fs.Triangle((0, 0, 0), (1, 0.5, 0), (-1, 0.5, 0)), in_plane, (1, 2)),
    "plane": (fs.Plane((0, 0, 0), (0, 0, 1)), in_plane, (0.5, 0.7)),
}
APART = 40.0


def place(number):
    """Where body `number` is: far from all others."""
    return fs.Pose((APART * number, 0, 0), POSE.rotation)


def gallery():
    """The primitives one by one, turned; then a point that moves within its body, and two points that melt."""
    world = fs.World(lights=DARK, background=BRIGHT)
    # Another picture comes before theirs.
    other = skin(fs.ImageTexture(np.zeros((50, 70, 3))), radius=0.4, blobbiness=-2)
    world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=other, motion=place(-1)))
    bodies = [(primitive, repeat) for primitive, _, repeat in PRIMITIVES.values()]
    bodies += [(fs.Point(lambda t: (0, 0.5 * t, t)), (1, 1)), (PAIR, (1, 1))]
    for number, (skeleton, repeat) in enumerate(bodies):
        material = skin(fs.ImageTexture(RAMP, repeat), radius=0.4, blobbiness=-2)
        world.add_body(fs.Body(skeleton, surface=material, motion=place(number)))
    return world


PAIR = [fs.Point((0, 0, 0)), fs.Point((0, 0.5, 0.2))]
GALLERY = gallery()


def gallery_seen(number, beside=(0, 0, 0), look_from=(2.2, -1.5, 1.4)):
    """Colours (N, 3) and places (N, 3) in its body's frame of what is seen of body `number` after a while."""
    pose = place(number)
    camera = fs.Camera(tuple(pose.apply(look_from)), tuple(pose.apply(beside)), fov=50)
    found, p = seen(GALLERY, camera, time=1.0)
    p = (p - pose.position) @ pose.matrix
    near = np.linalg.norm(p, axis=1) < 2.5  # no plane behind
    assert near.sum() > 500
    return found[near], p[near]


@pytest.mark.parametrize("name", PRIMITIVES)
def test_a_picture_lies_on_each_primitive_in_its_own_way(name):
    _, coordinates, repeat = PRIMITIVES[name]
    found, p = gallery_seen(list(PRIMITIVES).index(name))
    check(found, *coordinates(p), repeat)


def test_a_primitive_that_moves_carries_its_picture():
    found, p = gallery_seen(len(PRIMITIVES), beside=(0, 0.5, 1))
    check(found, *on_ball(p - (0, 0.5, 1)))


def test_where_primitives_melt_pictures_dissolve_by_weight():
    found, p = gallery_seen(len(PRIMITIVES) + 1, beside=(0, 0.25, 0.1))
    from_each = [p - np.array(point.position) for point in PAIR]
    fields = np.exp([-2 / 0.4**2 * np.sum(q * q, axis=1) for q in from_each])
    coordinates = np.array([on_ball(q) for q in from_each])
    shares = fields / fields.sum(axis=0)
    wanted = np.einsum("kn,kcn->nc", shares, coordinates)
    clear = (np.abs(coordinates - 0.5) < 0.44).all(axis=(0, 1))
    assert (clear & (shares.min(axis=0) > 0.3)).sum() > 100
    np.testing.assert_allclose(found[clear][:, :2], wanted[clear], atol=0.006)


# On hard shapes

CUBE = fs.mesh(box_triangles((0.3, 0, 0), (0.8, 0.6, 1.0)))
HALF = np.array((0.4, 0.3, 0.5))


def on_box(p):
    """On a box of half sizes HALF."""
    x, y, z = (p / HALF).T
    face = np.argmax(np.abs(p / HALF), axis=1)
    ahead = np.sign(np.take_along_axis(p, face[:, None], axis=1)[:, 0])
    right = np.select([face == 0, face == 1], [y * ahead, -x * ahead], x)
    return 0.5 + 0.5 * right, 0.5 - 0.5 * np.where(face == 2, y * ahead, z)


def on_upright(low, length):
    """On a rod that stands on z = low."""
    return lambda p: (np.clip((p[:, 2] - low) / length, 0, 1), 0.75 + np.arctan2(p[:, 1], p[:, 0]) / TAU)


SHAPES = {
    "ball": (fs.Ball((0, 0.2, 0), 0.8), lambda p: on_ball(p - (0, 0.2, 0)), (1, 1)),
    "ellipsoid": (fs.Ellipsoid((0.9, 0.4, 0.6)), lambda p: on_ball(p / (0.9, 0.4, 0.6)), (1, 1)),
    "box": (fs.Box(tuple(2 * HALF)), on_box, (1, 1)),
    "cylinder": (fs.Cylinder((0, 0, -0.5), (0, 0, 0.5), 0.6), on_upright(-0.5, 1.0), (2, 1)),
    "capsule": (fs.Capsule((0, 0, -0.5), (0, 0, 0.5), 0.4), on_upright(-0.5, 1.0), (1, 1)),
    "ground": (fs.Ground(extent=(1, 1)), in_plane, (0.5, 0.7)),
    "mesh": (fs.TriangleSurface(CUBE), lambda p: on_ball(p - (0.3, 0, 0)), (1, 1)),
}


def hard_seen(shape, color, side=1.0):
    """Colours (N, 3) and places (N, 3) in its own frame of what is seen of a shape turned as POSE."""
    world = fs.World(lights=DARK, background=BRIGHT)
    world.add_shape(shape, skin(color), motion=POSE)
    camera = fs.Camera(tuple(POSE.apply(side * np.array((2.2, -1.5, 1.4)))), POSE.position, fov=50)
    found, p = seen(world, camera)
    return found, (p - POSE.position) @ POSE.matrix


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("name", SHAPES)
def test_a_picture_lies_on_each_hard_shape_in_its_own_way(name, side):
    shape, coordinates, repeat = SHAPES[name]
    found, p = hard_seen(shape, fs.ImageTexture(RAMP, repeat), side)
    u, v = coordinates(p)
    # Where the first or the last column goes on it is no ramp.
    inside = (u > 0.01) & (u < 0.99) if name in ("cylinder", "capsule") else np.full(len(u), True)
    check(found[inside], u[inside], v[inside], repeat)


def test_solid_textures_fill_hard_shapes_from_face_to_face():
    """Also where faces lie between two layers of a checker: there the inner one is seen."""
    found, p = hard_seen(fs.Box(tuple(2 * HALF)), fs.Checker("white", "black", 0.1))
    cells = np.clip(p, 1e-3 - HALF, HALF - 1e-3) / 0.1
    clear = (np.abs(cells - np.round(cells)) > 5e-3).all(axis=1)
    assert clear.mean() > 0.9
    white = np.floor(cells).sum(axis=1) % 2 == 0
    assert 0.3 < white.mean() < 0.7
    np.testing.assert_allclose(found[clear], np.where(white, 1.0, 0.0)[clear][:, None] * np.ones(3), atol=0.01)
    flat, p = hard_seen(fs.Ground(extent=(0.9, 0.9)), fs.Checker("white", "black", 0.3))
    cells = p[:, :2] / 0.3
    clear = (np.abs(cells - np.round(cells)) > 1e-3).all(axis=1)
    black = np.floor(cells).sum(axis=1) % 2 == 0  # the layer beneath the plane is an odd one
    np.testing.assert_allclose(flat[clear][:, 0], np.where(black, 0.0, 1.0)[clear], atol=0.01)


@pytest.mark.parametrize("options", [{"mode": "hard"}, {"solver": "referee"}], ids=["hard", "referee"])
@pytest.mark.parametrize("color", [fs.ImageTexture(RAMP), fs.Checker("white", "black", 0.2)])
def test_bodies_have_their_textures_however_they_are_drawn(color, options):
    world = fs.World(lights=DARK, background=BRIGHT)
    world.add_body(fs.Body(fs.Point((0.1, 0, 0)), surface=skin(color, radius=0.6), motion=POSE))
    camera = fs.Camera(tuple(POSE.apply((2.2, -1.5, 1.4))), POSE.position, fov=40)
    plain, _ = seen(world, camera)
    other, _ = seen(world, camera, **options)
    assert len(plain) == len(other)
    # Pixels on the borders of squares may fall on either side.
    assert (np.abs(plain - other).max(axis=1) > 0.01).mean() < 0.02


def test_arcs_drawn_hard_keep_their_pictures():
    world = fs.World(lights=DARK, background=BRIGHT)
    arc, coordinates, repeat = PRIMITIVES["arc"]
    world.add_body(fs.Body(arc, surface=skin(fs.ImageTexture(RAMP, repeat), radius=0.3), motion=POSE))
    found, p = seen(world, fs.Camera(tuple(POSE.apply((2.2, -1.5, 1.4))), POSE.position, fov=50), mode="hard")
    check(found, *coordinates((p - POSE.position) @ POSE.matrix), repeat)


@wp.kernel(enable_backward=False)
def _beside(start: int, normals: wp.array(dtype=wp.vec3), sides: wp.array(dtype=wp.vec3)):
    i = start + wp.tid()
    sides[i] = beside(normals[i])


def test_soft_and_hard_ones_agree_on_axes_across_a_direction():
    z = np.random.default_rng(3).normal(size=(200, 3))
    z = np.concatenate([z / np.linalg.norm(z, axis=1, keepdims=True), [(0, 0, 1), (0, 0, -1)]])
    axes = frame_along(z)
    np.testing.assert_allclose(axes @ np.swapaxes(axes, 1, 2), np.tile(np.eye(3), (len(z), 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(axes), 1.0)
    np.testing.assert_array_equal(axes[..., 2], z)
    sides = wp.full(len(z), wp.vec3(np.nan), dtype=wp.vec3, device="cpu")
    launch(_beside, len(z), [wp.array(z, dtype=wp.vec3, device="cpu")], [sides], device="cpu")
    # Next to straight down, within 0.05 here, it is worth so many digits less.
    np.testing.assert_allclose(sides.numpy(), axes[..., 0], atol=1e-4)
    # The turn is the shortest: about an axis across z, and so by the angle between the two.
    np.testing.assert_allclose(np.trace(axes, axis1=1, axis2=2), 1 + 2 * z[:, 2], atol=1e-9)
