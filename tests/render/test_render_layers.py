"""Layers: depth, normals, whose surface, weights, steps of rays; their pictures and films."""

import numpy as np
import pytest
from test_render import rays

import fieldsim as fs
from fieldsim.errors import InputError
from fieldsim.render import layers as of
from fieldsim.render.layers import LAYERS, LayerPictures
from fieldsim.render.renderer import Renderer

SIZE = (65, 49)
CAMERA = fs.Camera((4, 0, 0.5), fov=34)


def world_of_all():
    """Two bodies that melt together, one without a surface before them, a particle, a ground and a box."""
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 3)), name="unseen"))
    for y, radius in ((-0.3, 0.4), (0.3, 0.3)):
        world.add_body(fs.Body(fs.Point((0, y, 0)), surface=fs.Material(radius=radius, blobbiness=-2)))
    world.add_particles([(2.0, 0, 0.5)], [(0, 0, 0)], radius=0.05)
    world.add_shape(fs.Ground(-0.6))
    world.add_shape(fs.Box((0.2, 0.2, 0.2)), motion=fs.Pose((0.5, 0.9, -0.5)))
    return world


@pytest.fixture(scope="module")
def soft():
    renderer = Renderer(SIZE)
    snapshot = world_of_all().at(0.0)
    return renderer, snapshot, renderer.layers(snapshot, CAMERA)


def test_depth_and_normals_are_those_of_the_picture(soft):
    renderer, snapshot, layers = soft
    depth, normals = renderer.depth_and_normals(snapshot, CAMERA)
    # Pictures of Gaussian blobs take their closed forms along the ray, layers the sweep that can be counted.
    np.testing.assert_allclose(layers["depth"], depth, rtol=3e-6)
    # Where two bodies meet the normal tells what either leaves out of the other.
    np.testing.assert_allclose(layers["normal"], normals, atol=3e-4)
    miss = layers["thing"] == of.NOTHING
    assert miss.any()
    assert (miss == np.isinf(depth)).all()
    assert (layers["owner"][miss] == -1).all()
    assert not layers["normal"][miss].any()


def test_everything_seen_has_its_owner(soft):
    layers = soft[2]
    thing, owner = layers["thing"], layers["owner"]
    # The particle floats half its depth in front of the bodies, above the middle.
    assert (thing[:20, 30:35] == of.PARTICLE).any()
    assert set(owner[thing == of.PARTICLE]) == {0}
    assert set(owner[thing == of.BODY]) == {1, 2}
    assert set(owner[thing == of.SHAPE]) == {0, 1}
    # The ground fills the lowest row; the box stands right of the bodies.
    assert (owner[-1] == 0).all()
    assert np.median(np.nonzero((thing == of.SHAPE) & (owner == 1))[1]) > 45


def test_weights_are_the_bodies_shares_of_the_field(soft):
    _, snapshot, layers = soft
    weights = layers["weights"]
    assert weights.shape == (SIZE[1], SIZE[0], 3)
    bodies = layers["thing"] == of.BODY
    assert not weights[~bodies].any()
    p = np.array(CAMERA.eye) + layers["depth"][bodies][:, None] * rays(CAMERA, SIZE)[bodies]
    fields = np.stack([body.surface_field().value(p) for body in snapshot.world.bodies[1:]], axis=1)
    # Elements are cut at 1e-4 of the level.
    np.testing.assert_allclose(weights[bodies][:, 1:], fields / fields.sum(axis=1, keepdims=True), atol=3e-4)
    assert (layers["owner"][bodies] == weights[bodies].argmax(axis=1)).all()


def test_steps_are_spent_where_fields_are(soft):
    layers = soft[2]
    steps = layers["steps"]
    bodies = layers["thing"] == of.BODY
    assert (steps[bodies] >= 2).all()
    assert (layers["evaluations"] >= steps).all()
    # Where both bodies reach, each step takes two evaluations.
    assert (layers["evaluations"] > steps).any()
    # Beyond the reach of all elements nothing is evaluated; rays that pass by within it pay without a hit.
    assert not steps[-1].any()
    assert (steps[~bodies] > 0).any()


def test_steps_of_rays_through_more_elements_than_fit():
    """Rays that are traced again with more room count both times; the layers are those of the picture."""
    world = fs.World()
    world.add_body(fs.Body([fs.Point((0, 0, 0))] * 120, surface=fs.Material(radius=0.5, threshold=120.0)))
    renderer = Renderer((33, 25))
    layers = renderer.layers(world.at(0.0), CAMERA)
    assert (layers["evaluations"][layers["thing"] == of.BODY] >= 120).all()
    np.testing.assert_allclose(layers["weights"][layers["thing"] == of.BODY], 1.0)
    np.testing.assert_array_equal(layers["depth"], renderer.depth_and_normals(world.at(0.0), CAMERA)[0])


def test_hard_pieces_belong_to_their_bodies(soft):
    snapshot = soft[1]
    layers = Renderer(SIZE, mode="hard").layers(snapshot, CAMERA)
    bodies = layers["thing"] == of.BODY
    assert set(layers["owner"][bodies]) == {1, 2}
    assert (layers["weights"][bodies].max(axis=1) == 1.0).all()
    assert (layers["weights"][bodies].sum(axis=1) == 1.0).all()
    assert set(layers["owner"][layers["thing"] == of.SHAPE]) == {0, 1}
    assert not layers["steps"].any()
    p = np.array(CAMERA.eye) + layers["depth"][bodies][:, None] * rays(CAMERA, SIZE)[bodies]
    centers = np.array([(0, 0, 3), (0, -0.3, 0), (0, 0.3, 0)])[layers["owner"][bodies]]
    radii = np.array([np.nan, 0.4, 0.3])[layers["owner"][bodies]]
    np.testing.assert_allclose(np.linalg.norm(p - centers, axis=1), radii, atol=2e-6)


@pytest.mark.parametrize("layer", LAYERS)
def test_pictures_of_layers(soft, layer):
    renderer, snapshot, layers = soft
    picture = LayerPictures(renderer, layer).frame(snapshot, CAMERA)
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    assert picture.dtype == np.uint8
    nothing = layers["thing"] == of.NOTHING if layer != "steps" else layers["steps"] == 0
    assert not picture[nothing].any()
    assert picture[~nothing].any(axis=-1).all()
    if layer == "depth":
        order = np.argsort(layers["depth"][~nothing])
        assert (np.diff(picture[~nothing][order, 0].astype(int)) <= 0).all()
    if layer == "normal":
        np.testing.assert_allclose(picture[~nothing] / 127.5 - 1, layers["normal"][~nothing], atol=5e-3)
    if layer == "steps":
        order = np.argsort(layers["steps"][~nothing])
        assert (np.diff(picture[~nothing][order, 0].astype(int)) >= 0).all()


def test_brightness_means_the_same_in_every_frame(soft):
    renderer, snapshot, _ = soft
    for layer in ("depth", "steps"):
        pictures = LayerPictures(renderer, layer)
        first = pictures.frame(snapshot, CAMERA)
        pictures.frame(snapshot, fs.Camera((9, 0, 0.5), fov=34))
        assert (pictures.frame(snapshot, CAMERA) == first).all()


def test_an_empty_picture_of_each_layer():
    world = fs.World()
    for layer in LAYERS:
        assert not LayerPictures(Renderer((8, 8)), layer).frame(world.at(0.0), CAMERA).any()


def test_films_of_layers_and_modes(tmp_path):
    world = world_of_all()
    scenario = fs.Scenario(world, CAMERA, duration=0.1, fps=20)
    for name, options in (("layer", {"layer": "normal"}), ("hard", {"mode": "hard"})):
        report = fs.film(scenario, tmp_path / f"{name}.gif", size=(16, 12), **options)
        assert report.frames == 2
        assert (tmp_path / f"{name}.gif").stat().st_size > 0


def test_unknown_layers_are_refused():
    with pytest.raises(InputError, match="layer is 'albedo'; give one of depth, normal, weights, steps"):
        LayerPictures(Renderer((8, 8)), "albedo")
