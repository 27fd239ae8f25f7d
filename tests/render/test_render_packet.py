"""The packet tracer: its mathematics, one lane against sixteen, and both against the kernels for all fields."""

import math

import numpy as np
import pytest
import warp as wp
from referee_scenes import scenes

import fieldsim as fs
from fieldsim.render.device_scene import stage_of
from fieldsim.render.scene.compaction import picked
from fieldsim.render.shading import packet_shadows
from fieldsim.render.solvers.packet import gaussian_elements
from fieldsim.render.solvers.packet.packet_kernel import packet_kernel
from fieldsim.render.solvers.packet.simd import CPU_WIDTH, OPTIONS, cpp
from fieldsim.sources.elements import surface_of

SIZE = (65, 50)  # tiles and groups that are not full
CAMERA = fs.Camera((2.3, -2.6, 1.6), fov=24)
LIGHT = (4.0, -3.0, 6.0)


def world_of(light=None, texture=None):
    """Points, segments and a circle of several widths that melt together, and particles before and behind them."""
    rng = np.random.default_rng(4)
    points = [fs.Point(p) for p in rng.uniform(-0.7, 0.7, (30, 3))]
    lines = [fs.Segment(p, p + q) for p, q in rng.uniform(-0.6, 0.6, (12, 2, 3))]
    light = light or fs.DirectionalLight(direction=tuple(-x for x in LIGHT))
    world = fs.World(lights=(light,), background=fs.Background("black", "black", stars=0))
    world.add_body(fs.Body(points, surface=fs.Material(radius=0.12, blobbiness=-3.0, color=texture or "terracotta")))
    world.add_body(fs.Body(lines, surface=fs.Material(radius=0.05, blobbiness=-6.0, color="white")))
    ring = fs.Circle((0.1, 0, 0), (0.2, 0.1, 1), 0.8)
    world.add_body(fs.Body(ring, surface=fs.Material(radius=0.1, blobbiness=-2.0, color="gold")))
    world.add_particles(rng.uniform(-0.9, 0.9, (20, 3)), np.zeros((20, 3)), radius=0.08)
    return world.at(0.0)


def renderer(lanes=CPU_WIDTH, **options):
    result = fs.Renderer(SIZE, device="cpu", **options)
    result._tracer._simd_width = lanes
    return result


@pytest.mark.parametrize("width", [1, CPU_WIDTH])
def test_functions_in_lanes(width):
    body = """
    const V x = load(given.data, 0);
    V i0, difference;
    bessel(size(x), i0, difference);
    store(result.data, 0, exp(x)); store(result.data, 1, log(size(x))); store(result.data, 2, erfc(x));
    store(result.data, 3, i0); store(result.data, 4, difference); store(result.data, 5, narrow(wide(x) * wide(x)));
    """

    @wp.func_native(cpp(width, gaussian_elements.BESSEL + body))
    def functions(given: wp.array(dtype=float), result: wp.array(dtype=float)): ...

    @wp.kernel(module="unique", enable_backward=False, module_options=OPTIONS)
    def evaluate(given: wp.array2d(dtype=float), result: wp.array2d(dtype=float)):
        functions(given[wp.tid()], result[wp.tid()])

    x = np.random.default_rng(0).uniform(-9.0, 9.0, (64, width)).astype(np.float32)
    result = wp.full((64, 6 * width), math.nan, dtype=float, device="cpu")
    wp.launch(evaluate, 64, [wp.array(x, dtype=float, device="cpu"), result], device="cpu")
    found = result.numpy().reshape(64, 6, width).transpose(1, 0, 2).reshape(6, -1)
    x = x.ravel().astype(float)
    # exp(x) inherits x's rounding, up to 9 ulp of 6e-8; log has an error of float32's absolute near 0.
    np.testing.assert_allclose(found[0], np.exp(x), rtol=6e-7)
    np.testing.assert_allclose(found[1], np.log(np.abs(x)), rtol=3e-7, atol=1e-7)
    # The exponent is down to -81, rounded when it is summed and when it is scaled, to 5e-6 each; what is below
    # float32's normal numbers is nobody's concern.
    np.testing.assert_allclose(found[2], [math.erfc(v) for v in x], rtol=1e-5, atol=1e-35)
    # The defining integral; the midpoint rule is exact for periodic functions.
    angle = (np.arange(64) + 0.5) * math.pi / 64
    waves = np.exp(np.abs(x)[:, None] * (np.cos(angle) - 1.0))
    np.testing.assert_allclose(found[3], waves.mean(axis=1), rtol=8e-7)
    np.testing.assert_allclose(found[4], (waves * (1.0 - np.cos(angle))).mean(axis=1), rtol=2e-5)
    np.testing.assert_allclose(found[5], x * x, rtol=1e-7)


def test_which_scenes_are_traced_by_packets():
    def kind_of(*primitives, **look):
        world = fs.World()
        world.add_body(fs.Body(list(primitives), surface=fs.Material(**look)))
        return stage_of(world.at(0.0), CAMERA, renderer()).elements.packet_kind

    point, line = fs.Point((0, 0, 0)), fs.Segment((0, 0, 0), (1, 0, 0))
    ring = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
    assert kind_of(point) == "points"
    assert kind_of(point, line) == "segments"
    assert kind_of(ring, point) == "rings"
    assert kind_of(point, fs.Triangle((0, 0, 0), (1, 0, 0), (0, 1, 0))) == ""
    assert kind_of(point, kernel=fs.Cauchy) == ""
    # Too short for a difference of error functions, too high for float32.
    assert kind_of(fs.Segment((0, 0, 0), (1e-3, 0, 0)), radius=0.2) == ""
    assert kind_of(point, blobbiness=-256.0) == ""


@pytest.mark.parametrize("lanes", [1, CPU_WIDTH])
def test_hits_are_those_of_the_general_kernel(lanes):
    snapshot = world_of()
    depth, normal = renderer(lanes).depth_and_normals(snapshot, CAMERA)
    layers = renderer().layers(snapshot, CAMERA)
    np.testing.assert_array_equal(np.isfinite(depth), np.isfinite(layers["depth"]))
    hit = np.isfinite(depth)
    assert 0.3 < hit.mean() < 0.9
    # Both polish in float64, to a rounding of the depth, where rays do not graze.
    facing = np.abs(np.einsum("ijk,ijk->ij", normal, rays())) > 0.02
    np.testing.assert_allclose(depth[hit & facing], layers["depth"][hit & facing], rtol=3e-7)
    np.testing.assert_allclose(normal[hit & facing], layers["normal"][hit & facing], atol=2e-4)


def test_equal_shares():
    """Equal Gaussians at one place: a bracket that begins where one exceeds more than 1/n would miss the surface."""
    world = fs.World()
    points = [fs.Point((0, 0, 0))] * 6
    ring = fs.Circle((0, 0, -50), (0, 0, 1), 1.0)  # of the kinds compiled for the test above
    world.add_body(fs.Body([*points, ring], surface=fs.Material(radius=0.5, threshold=6.0)))
    depth, _normal = renderer().depth_and_normals(world.at(0.0), CAMERA)
    layers = renderer().layers(world.at(0.0), CAMERA)
    assert np.isfinite(depth).any()
    np.testing.assert_allclose(depth, layers["depth"], rtol=3e-7)


def rays():
    """Unit directions (H, W, 3) through the pixels' centres."""
    right, up, forward = CAMERA.axes()
    half = math.tan(math.radians(CAMERA.fov) / 2)
    x = (np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) / (SIZE[1] / 2) * half
    y = -(np.arange(SIZE[1]) + 0.5 - SIZE[1] / 2) / (SIZE[1] / 2) * half
    d = forward + x[None, :, None] * right + y[:, None, None] * up
    return d / np.linalg.norm(d, axis=2, keepdims=True)


def test_one_lane_draws_what_sixteen_draw():
    for texture in (None, fs.Checker("white", "ink", scale=0.2)):
        snapshot = world_of(texture=texture)
        one, many = (renderer(lanes, samples=1).frame(snapshot, CAMERA).astype(int) for lanes in (1, CPU_WIDTH))
        assert many.any()
        # A shadow's edge may fall to the other side of a pixel's centre, and so may a texture's.
        assert (np.abs(one - many).max(axis=2) > 2).mean() < 1e-3


def test_a_far_lamp_draws_what_the_sun_draws():
    """Shadows from a tree, a ray at a time, against those from the cells of a grid."""
    far = tuple(1e4 * x for x in LIGHT)
    lamp = fs.PointLight(position=far)
    sun, lamp = (renderer(samples=1).frame(world_of(light), CAMERA).astype(int) for light in (None, lamp))
    unshadowed = renderer(samples=1, shadows=False).frame(world_of(), CAMERA).astype(int)
    assert (np.abs(sun - unshadowed).max(axis=2) > 16).mean() > 0.02
    assert (np.abs(sun - lamp).max(axis=2) > 2).mean() < 2e-3


def test_smoothing_comes_close_to_many_samples():
    snapshot = world_of()
    many = fs.Renderer((8 * SIZE[0], 8 * SIZE[1]), samples=1, device="cpu").frame(snapshot, CAMERA)
    linear = np.where(many <= 10, many / 255 / 12.92, ((many / 255 + 0.055) / 1.055) ** 2.4)
    mean = linear.reshape(SIZE[1], 8, SIZE[0], 8, 3).mean(axis=(1, 3))
    mean = 255 * np.where(mean <= 0.0031308, 12.92 * mean, 1.055 * mean ** (1 / 2.4) - 0.055)
    errors = {}
    for samples in (1, 4, 16):
        picture = renderer(samples=samples).frame(snapshot, CAMERA)
        errors[samples] = np.sqrt(((picture - mean) ** 2).mean())
    # What is left is mostly in pixels that look like their neighbours, which get no more samples.
    assert errors[4] < 0.5 * errors[1]
    assert errors[16] < 0.9 * errors[4]


def test_picked():
    values = np.array([-1, 4, -3, 0, 7, -1], dtype=np.int32)
    found, places, total = picked(wp.array(values, dtype=int, device="cpu"))
    assert total == 3
    assert found.numpy()[:3].tolist() == [4, 0, 7]
    assert places.numpy()[:3].tolist() == [1, 3, 4]
    assert picked(wp.array([-1, -1], dtype=int, device="cpu"))[2] == 0


@pytest.mark.parametrize("kind", ["points", "rings"])
def test_one_lane_compiles_for_cuda(kind, compiles_for_cuda):
    shadows = packet_shadows.shade_kernel(kind, 1, True), packet_shadows.cells_kernel(kind, 1)
    for kernel in (packet_kernel(kind, 1), *shadows):
        compiles_for_cuda(kernel.module)


@pytest.mark.parametrize("name", ["blobs, Gaussian", "soft blobs"])
def test_rays_through_a_hump_and_out_again_stop_at_the_first(name, monkeypatch):
    """Rays graze many humps of soft surfaces, a quarter of a million rays in all; the certified leaps know where."""
    scene = scenes()[name]()
    snapshot, size = scene.snapshot(), (512, 512)
    seen, _ = fs.Renderer(size).depth_and_normals(snapshot, scene.camera)
    monkeypatch.setattr(gaussian_elements, "kind_of", lambda bounded: "")
    true, _ = fs.Renderer(size).depth_and_normals(snapshot, scene.camera)
    both = np.isfinite(seen) & np.isfinite(true)
    assert both.sum() > 50_000
    assert np.count_nonzero(np.isfinite(seen) != np.isfinite(true)) <= 2
    radius = min(material.radius for material in surface_of(snapshot).materials)
    # What either cuts off moves the surface by 1e-4 of a radius where a ray only grazes; a hump missed, by a tenth.
    assert np.abs(seen[both] - true[both]).max() < 0.02 * radius
