"""Pictures: how colours are looked up in them, as skies, and what is refused."""

import math

import imageio.v3 as imageio
import numpy as np
import pytest
import warp as wp
from test_render import rays
from test_texture_images import DARK, RAMP, SIZE, TAU, check

import fieldsim as fs
from fieldsim.errors import InputError
from fieldsim.launch import launch
from fieldsim.render.materials.mipmaps import looked_up, pyramid, uploaded_pictures
from fieldsim.render.shading.sky import AMBIENT, FILL
from fieldsim.world.color import color_rgb, linear_of
from fieldsim.world.pixels import Pixels

# Looking up


@wp.kernel(enable_backward=False)
def _look(
    start: int,
    texels: wp.array(dtype=wp.vec3),
    size: wp.vec2i,
    ends: wp.vec2,
    covered: float,
    places: wp.array(dtype=wp.vec2),
    colors: wp.array(dtype=wp.vec3),
):
    i = start + wp.tid()
    colors[i] = looked_up(texels, 0, size[0], size[1], places[i], ends, covered)


def look(image, places, ends=(0.0, 0.0), covered=1.0):
    texels = wp.array(pyramid(np.asarray(image, dtype=np.float32)), dtype=wp.vec3, device="cpu")
    places = wp.array(np.asarray(places, dtype=np.float32), dtype=wp.vec2, device="cpu")
    colors = wp.full(len(places), wp.vec3(np.nan), dtype=wp.vec3, device="cpu")
    size = wp.vec2i(image.shape[1], image.shape[0])
    launch(_look, len(places), [texels, size, wp.vec2(*ends), covered, places], [colors], device="cpu")
    return colors.numpy()


def noise(width, height):
    return np.random.default_rng(1).uniform(size=(height, width, 3)).astype(np.float32)


def test_texels_have_their_colours_and_mix_between():
    image = noise(5, 3)
    places = [((x + 0.5) / 5 + turns, (y + 0.5) / 3) for y in range(3) for x in range(5) for turns in (0, 2, -3)]
    np.testing.assert_allclose(look(image, places), np.repeat(image.reshape(-1, 3), 3, axis=0), atol=1e-5)
    between = look(image, [(2 / 5, 1.5 / 3), (1.5 / 5, 1 / 3)])
    np.testing.assert_allclose(between, [image[1, 1:3].mean(axis=0), image[:2, 1].mean(axis=0)], atol=1e-5)


def test_borders_close_or_end():
    image = noise(5, 3)
    borders = [(0.0, 0.5 / 3), (1.0, 0.5 / 3), (0.5, 0.0)]
    closed = [image[0, [0, 4]].mean(axis=0)] * 2 + [image[[0, 2], 2].mean(axis=0)]
    np.testing.assert_allclose(look(image, borders), closed, atol=1e-5)
    ended = [image[0, 0], image[0, 4], image[0, 2]]
    np.testing.assert_allclose(look(image, borders, ends=(1.0, 1.0)), ended, atol=1e-5)
    # Between the first and the second of two pictures a border is none.
    np.testing.assert_allclose(look(image, borders[1:2], ends=(2.0, 1.0)), closed[:1], atol=1e-5)


def test_far_away_a_picture_is_its_mean():
    image = noise(8, 4)
    places = np.random.default_rng(2).uniform(size=(20, 2))
    np.testing.assert_allclose(look(image, places, covered=1e9), np.tile(image.mean(axis=(0, 1)), (20, 1)), atol=1e-6)
    halves = image.reshape(2, 2, 4, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(look(image, places, covered=2.0), look(halves, places), atol=1e-5)
    both = 0.5 * (look(image, places) + look(halves, places))
    np.testing.assert_allclose(look(image, places, covered=math.sqrt(2.0)), both, atol=1e-5)
    odd = noise(7, 5)
    assert len(pyramid(odd)) == 35 + 6 + 1
    np.testing.assert_allclose(pyramid(np.full((5, 7, 3), 0.25)), 0.25)


def test_pictures_are_uploaded_once():
    one, two = Pixels("it", noise(4, 2)), Pixels("it", noise(6, 3))
    texels, firsts = uploaded_pictures([one, two, one], wp.get_device("cpu"))
    assert uploaded_pictures([one, two], wp.get_device("cpu"))[0] is texels
    for picture in (one, two):
        flat = picture.linear.reshape(-1, 3)
        np.testing.assert_array_equal(texels.numpy()[firsts[picture]][: len(flat)], flat[0])
        np.testing.assert_array_equal(texels.numpy()[firsts[picture] :][: len(flat)], flat)


# All around


def sky_seen(camera, **options):
    world = fs.World(lights=DARK, background=fs.Background(**options))
    return linear_of(fs.Renderer(SIZE, samples=1).frame(world.at(0.0), camera) / 255.0).reshape(-1, 3)


@pytest.mark.parametrize("turn", [0.0, 1.3])
def test_a_sky_is_seen_where_it_is(turn):
    for look_at in [(0, 1, 0.2), (-1, -1, -0.6), (0.2, -0.3, 1)]:
        camera = fs.Camera((0, 0, 0), look_at, fov=70)
        d = rays(camera, SIZE).reshape(-1, 3)
        u = 0.5 - (np.arctan2(d[:, 1], d[:, 0]) - turn) / TAU
        check(2.0 * sky_seen(camera, image=RAMP, turn=turn, intensity=0.5), u, np.arccos(d[:, 2]) / math.pi)


def test_a_sky_lights_from_above_and_below():
    image = np.zeros((8, 16, 3))
    image[:4, :, 0] = 1.0
    image[4:, :4, 2] = 1.0
    background = fs.Background(image=image, intensity=0.8)
    np.testing.assert_allclose(background.rgb_above, (0.8, 0, 0), atol=1e-6)
    np.testing.assert_allclose(background.rgb_below, (0, 0, 0.2), atol=1e-6)
    # Of the sphere, not of the picture: rows near the poles count less.
    ring = np.zeros((90, 4, 3))
    ring[:15] = 1.0
    cap = 1 - math.cos(math.pi / 6)
    np.testing.assert_allclose(fs.Background(image=ring).rgb_above, cap, rtol=1e-3)
    world = fs.World(lights=DARK, background=background)
    world.add_shape(fs.Ground(extent=(1, 1)), fs.Material("white"))
    camera = fs.Camera((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=10)
    color = linear_of(fs.Renderer(SIZE, samples=1).frame(world.at(0.0), camera)[60, 60] / 255.0)
    np.testing.assert_allclose(color, (AMBIENT * 0.8 + FILL, FILL, FILL), atol=0.003)


def test_a_gradient_takes_the_intensity_too():
    camera = fs.Camera((0, 0, 0), (0, 0, 1), up=(0, 1, 0), fov=1)
    found = sky_seen(camera, top="tomato", stars=0, intensity=0.5)
    np.testing.assert_allclose(found, np.tile(np.array(color_rgb("", "tomato")) * 0.5, (len(found), 1)), atol=0.003)


# Files and errors


def test_files_hold_what_arrays_hold(tmp_path):
    image = (255 * noise(6, 4)).astype(np.uint8)
    imageio.imwrite(tmp_path / "picture.png", image)
    for given in (tmp_path / "picture.png", str(tmp_path / "picture.png"), image, image / 255.0):
        np.testing.assert_allclose(Pixels("it", given).linear, linear_of(image / 255.0), atol=1e-6)
    np.testing.assert_allclose(Pixels("it", image[..., 0]).linear, linear_of(image[..., :1] / 255.0).repeat(3, 2))
    seen_through = np.concatenate([image, image[..., :1]], axis=2)
    np.testing.assert_array_equal(Pixels("it", seen_through).linear, Pixels("it", image).linear)
    deep = image.astype(np.uint16) * 257
    np.testing.assert_allclose(Pixels("it", deep).linear, Pixels("it", image).linear, atol=1e-6)


@pytest.mark.parametrize("make", [fs.ImageTexture, lambda image: fs.Background(image=image)])
@pytest.mark.parametrize(
    ("image", "words"),
    [
        ("no/such.png", r": there is no image 'no/such\.png'; give a path or an array"),
        (np.zeros((4, 4, 2)), r": image has shape \(4, 4, 2\)"),
        (np.zeros((0, 4, 3)), r": image has shape \(0, 4, 3\)"),
        (np.full((4, 4, 3), np.nan), ": image has 16 pixels that are not finite"),
        (np.full((4, 4, 3), 255.0), ": image has values from 255 to 255"),
        (np.full((4, 4, 3), 7), ": image is of type int64"),
        ([[1, 2], [3]], ": image has rows of different lengths"),
    ],
)
def test_bad_pictures_are_refused(make, image, words):
    name = "ImageTexture" if make is fs.ImageTexture else "Background"
    with pytest.raises(InputError, match=name + words):
        make(image)


def test_files_that_are_no_pictures_are_refused_at_once(tmp_path):
    path = tmp_path / "text.png"
    path.write_text("no picture")
    with pytest.raises(InputError, match=r"Background: image '.*text\.png' is no picture"):
        fs.Background(image=path)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fs.ImageTexture(RAMP, 2), r"ImageTexture: repeat is 2; give two numbers"),
        (lambda: fs.ImageTexture(RAMP, (1, 0)), "ImageTexture: repeat is .*; give two numbers .* above 0"),
        (lambda: fs.Background(intensity=-1), "Background: intensity is -1"),
        (lambda: fs.Background(turn=math.nan), "Background: turn is nan"),
    ],
)
def test_bad_numbers_are_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
