"""Solid textures: what they blend where, as Warp functions, and what is refused."""

import numpy as np
import pytest
import warp as wp

from fieldsim.errors import InputError
from fieldsim.launch import launch
from fieldsim.render.materials.table import KIND, rows_of
from fieldsim.render.materials.textures import blend_at
from fieldsim.world.color import color_rgb
from fieldsim.world.material import Material
from fieldsim.world.texture import Checker, Clouds, Marble, Wood


@wp.kernel(enable_backward=False)
def _blend(
    start: int,
    kind: int,
    turbulence: float,
    seed: int,
    points: wp.array(dtype=wp.vec3),
    shares: wp.array(dtype=float),
):
    i = start + wp.tid()
    shares[i] = blend_at(kind, points[i], turbulence, seed)


def shares(texture, points):
    kind, *_, turbulence, seed = rows_of([Material(texture)])[0, KIND:]
    points = wp.array(np.asarray(points, dtype=np.float32), dtype=wp.vec3, device="cpu")
    found = wp.full(len(points), np.nan, dtype=float, device="cpu")
    launch(_blend, len(points), [int(kind), turbulence, int(seed), points], [found], device="cpu")
    return found.numpy()


def cloud(count=2000):
    return np.random.default_rng(0).uniform(-5, 5, (count, 3))


def test_checkers_alternate_across_every_face():
    points = cloud()
    here = shares(Checker(), points)
    assert set(here) == {0.0, 1.0}
    for step in np.eye(3):
        np.testing.assert_array_equal(shares(Checker(), points + step), 1.0 - here)
        np.testing.assert_array_equal(shares(Checker(), points + 2 * step), here)


def test_still_marble_and_wood_are_layers_and_rings():
    points = cloud()
    np.testing.assert_allclose(
        shares(Marble(turbulence=0.0), points), 0.5 + 0.5 * np.sin(2 * np.pi * points[:, 0]), atol=1e-5
    )
    rings = np.hypot(points[:, 0], points[:, 1])
    wanted = (rings - np.floor(rings)) ** 2
    close = np.abs(rings - np.round(rings)) < 1e-4  # single precision may fall on either side of a ring's end
    np.testing.assert_allclose(shares(Wood(turbulence=0.0), points)[~close], wanted[~close], atol=1e-5)


@pytest.mark.parametrize("texture", [Clouds, Marble, Wood])
def test_noise_is_smooth_bounded_and_of_its_seed(texture):
    points = cloud()
    here = shares(texture(seed=1), points)
    assert ((here >= 0) & (here <= 1)).all()
    assert here.std() > 0.1
    np.testing.assert_array_equal(shares(texture(seed=1), points), here)
    assert np.abs(shares(texture(seed=2), points) - here).mean() > 0.05
    nearby = np.abs(shares(texture(seed=1), points + 1e-3) - here)
    assert np.quantile(nearby, 0.95) < 0.05


def test_rows_hold_the_other_colour():
    row = rows_of([Material(Wood("sand", "clay", 0.1, 0.5, 7))])[0, KIND:]
    assert tuple(row) == (4.0, *color_rgb("Wood", "clay"), 0.1, 0.5, 7.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Checker("whit"), "Checker: color is 'whit', an unknown color; did you mean 'white'"),
        (lambda: Wood(other="sandy"), "Wood: other is 'sandy'"),
        (lambda: Marble(scale=0.0), "Marble: scale is 0"),
        (lambda: Marble(turbulence=-1.0), "Marble: turbulence is -1"),
        (lambda: Clouds(seed=1.5), "Clouds: seed is 1.5"),
        (lambda: Material("mable"), "Material: color is 'mable', an unknown color; did you mean 'marble'"),
        (lambda: Material("terracota"), "Material: color is 'terracota', an unknown color; did you mean 'terracotta'"),
        (lambda: Material("xq"), "give a CSS name, '#rrggbb' or .*, 'checker', 'clouds', 'marble', 'wood'"),
    ],
)
def test_bad_textures_are_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_names_stand_for_textures():
    assert Material("Marble") == Material(Marble())
    assert Material(lambda t: "wood").at(1.0).color == Wood()


def test_textures_turn_with_their_bodies_and_melt_with_them():
    """A checker of half spaces on a ball: the colour seen at the pole follows the ball's turn; a neighbour mixes in."""
    import fieldsim as fs

    def middle(angle, neighbour=False):
        world = fs.World(lights=(fs.DirectionalLight(direction=(0, 0, -1)),), background=fs.Background(stars=0))
        skin = fs.Material(fs.Checker("white", "black", 100.0), radius=0.5, blobbiness=-1, specular=0.0)
        turned = fs.Pose.turned((1, 0, 0), angle, (0.0, 0.0, 0.0))
        world.add_body(fs.Body(fs.Point((0.1, 0.1, 0.1)), surface=skin, motion=turned))
        if neighbour:
            red = fs.Material((1.0, 0.0, 0.0), radius=0.5, blobbiness=-1, specular=0.0)
            world.add_body(fs.Body(fs.Point((0.1, 0.4, 0.1)), surface=red))
        camera = fs.Camera(eye=(0.1, 0.1, 6), look_at=(0.1, 0.1, 0), up=(0, 1, 0), fov=30)
        return fs.render(world.at(0.0), camera, size=(33, 33), quality="draft")[16, 16].astype(int)

    white, black = middle(0.0), middle(np.pi / 2)
    assert white.min() > 150
    assert black.max() < 60
    mixed = middle(np.pi / 2, neighbour=True)
    assert mixed[0] > black[0] + 40
    assert mixed[1] < 60
