"""Mirrors, glass, coloured and soft shadows, fog, lenses, exposure: against closed forms and against other pictures."""

import dataclasses

import numpy as np
import pytest
from PIL import Image
from test_render import rays

import fieldsim as fs
from fieldsim.render import renderer
from fieldsim.render.renderer import Renderer
from fieldsim.world.color import color_rgb

SKY = fs.Background(top="#ff2040", bottom="#2040ff", stars=0.0)
PLAIN = fs.Background(top="black", bottom="black", stars=0.0)
# Flat light: what a surface sends is its colour.
FLAT = {"ambient": 0.0, "diffuse": 1.0, "specular": 0.0}
DARK = (fs.DirectionalLight(direction=(0, 0, -1), intensity=0.0, shadows=False),)
# White from everywhere, even under a black sky.
SHINING = {"ambient": 1000.0, "diffuse": 0.0, "specular": 0.0}


def linear(picture):
    """Linear light of an sRGB picture."""
    srgb = picture / 255.0
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def sky(d):
    """Colour of SKY in directions (..., 3)."""
    top, bottom = (np.array(color_rgb("", c)) for c in (SKY.top, SKY.bottom))
    return bottom + (0.5 + 0.5 * d[..., 2:]) * (top - bottom)


def glass_ball(d, center, radius, ior, tint, bounces=12):
    """What rays from the origin see of a ball of glass before SKY, with reflections within; NaN for a miss."""
    along = d @ center
    root = radius**2 - (center @ center - along**2)
    hit = root > 0
    entry = (along - np.sqrt(np.where(hit, root, 0.0)))[..., None] * d
    n = (entry - center) / radius
    cosine = -np.sum(d * n, axis=-1, keepdims=True)
    inner = np.sqrt(1 - (1 - cosine**2) / ior**2)
    share = 0.5 * (
        ((cosine - ior * inner) / (cosine + ior * inner)) ** 2 + ((ior * cosine - inner) / (ior * cosine + inner)) ** 2
    )
    color = share * sky(d + 2 * cosine * n)
    inside = d / ior + (cosine / ior - inner) * n
    left = (1 - share) * tint
    for _ in range(bounces):
        # Every chord of a ball meets its surface at the same angle.
        n = n + 2 * inner * inside
        outside = ior * inside + (cosine - ior * inner) * n
        color = color + left * (1 - share) * sky(outside)
        left = left * share
        inside = inside - 2 * inner * n
    return np.where(hit[..., None], color, np.nan)


@pytest.mark.parametrize("soft", [True, False])
def test_a_glass_ball_bends_light_as_snell_and_fresnel_say(soft):
    world = fs.World(lights=DARK, background=SKY)
    glass = fs.Material(color="#80c0ff", radius=0.5, blobbiness=-2, transmission=1.0, ior=1.5)
    if soft:
        world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=glass))
    else:
        world.add_shape(fs.Ball((0, 0, 0), 0.5), glass)
    camera = fs.Camera(eye=(0, -2, 0.6), fov=30)
    seen = linear(Renderer((64, 64), samples=1).frame(world.at(0.0), camera))
    expected = glass_ball(rays(camera, (64, 64)), -np.array(camera.eye), 0.5, 1.5, color_rgb("", "#80c0ff"))
    hit = np.isfinite(expected[..., 0])
    assert hit.sum() > 1000
    # A byte holds steps of up to 0.009 of linear light; beside the silhouette every angle changes too fast to compare.
    off = np.abs(seen - expected).max(axis=2)[hit]
    assert np.quantile(off, 0.97) < 0.012
    assert np.median(off) < 0.006
    np.testing.assert_allclose(seen[~hit], sky(rays(camera, (64, 64)))[~hit], atol=0.01)


def test_beyond_the_critical_angle_glass_is_a_mirror():
    # From within a column, steeply up: the sides, met at 60 degrees, mirror it all; the ends, at 30, let most out.
    world = fs.World(lights=DARK, background=SKY)
    world.add_shape(fs.Box((2, 2, 8)), fs.Material("white", transmission=1.0, ior=1.5))
    camera = fs.Camera(eye=(0, 0, 0), look_at=(0.5, 0, np.sqrt(0.75)), fov=1)
    seen = linear(Renderer((1, 1), samples=1).frame(world.at(0.0), camera))[0, 0]
    inner, outer = np.sqrt(0.75), np.sqrt(1 - 0.75**2)
    share = 0.5 * (
        ((1.5 * inner - outer) / (1.5 * inner + outer)) ** 2 + ((inner - 1.5 * outer) / (inner + 1.5 * outer)) ** 2
    )
    ends = [sky(np.array([0.0, 0.0, side * outer])) for side in (1, -1)]
    expected = sum((1 - share) * share**k * ends[k % 2] for k in range(6))
    np.testing.assert_allclose(seen, expected, atol=0.01)


def test_a_mirror_shows_what_a_mirrored_camera_sees():
    def world_with(*, mirror):
        world = fs.World(lights=(fs.DirectionalLight(direction=(0, 0, -1), shadows=False),), background=SKY)
        clay = fs.Material(color="terracotta", radius=0.3, visible_to="reflected" if mirror else "camera", **FLAT)
        world.add_body(fs.Body([fs.Point((0, 0, 0.8)), fs.Segment((0.5, 0, 0.5), (0.9, 0.4, 0.9))], surface=clay))
        world.add_particles([(-0.6, 0.0, 0.6)], [(0, 0, 0)], radius=0.2, color="moss")
        if mirror:
            world.add_shape(fs.Ground(), fs.Material(color="black", reflection=1.0, specular=0.0))
        return world

    size = (64, 48)
    down = fs.Camera(eye=(0, -3, 1.5), look_at=(0, 0, -0.9), fov=35)
    up = fs.Camera(eye=(0, -3, -1.5), look_at=(0, 0, 0.9), fov=35)
    mirrored = Renderer(size, samples=1).frame(world_with(mirror=True).at(0.0), down)
    direct = Renderer(size, samples=1).frame(world_with(mirror=False).at(0.0), up)[::-1]
    behind = rays(down, size)[..., 2] < -1e-3
    off = np.abs(mirrored.astype(int) - direct).max(axis=2)[behind]
    # Rays start a little above the mirror: a silhouette's pixel may fall either way.
    assert np.count_nonzero(off > 2) <= 6
    assert len(np.unique(mirrored[behind].reshape(-1, 3), axis=0)) > 100


def test_a_mirror_among_mirrors_ends():
    world = fs.World(background=SKY)
    silver = fs.Material(color="white", reflection=1.0, specular=0.0)
    world.add_shape([fs.Ground((0, 1, 0), (0, 1, 0)), fs.Ground((0, -1, 0), (0, 1, 0))], silver)
    picture = Renderer((16, 16), samples=1).frame(world.at(0.0), fs.Camera(eye=(0, 0, 0), look_at=(0.3, 1, 0)))
    assert picture.shape == (16, 16, 3)


def shadow_world(*, light, blocker=None, **shape):
    world = fs.World(lights=(light,), background=PLAIN)
    world.add_shape(fs.Ground(), fs.Material(color="white", **FLAT))
    if blocker is not None:
        world.add_body(fs.Body(fs.Point((0, 0, 1)), surface=blocker))
    if shape:
        world.add_shape(**shape)
    return world


def from_above(fov=30.0):
    return fs.Camera(eye=(0, 0, 8), look_at=(0, 0, 0), up=(0, 1, 0), fov=fov)


@pytest.mark.parametrize("soft", [True, False])
def test_shadows_of_glass_are_coloured(soft):
    slanted = fs.DirectionalLight(direction=(1, 0, -1))
    glass = fs.Material(color="#ff8000", radius=0.4, transmission=0.5)
    if soft:
        world = shadow_world(light=slanted, blocker=glass)
    else:
        world = shadow_world(light=slanted, shape=fs.Ball((0, 0, 1), 0.4), material=glass)
    picture = linear(Renderer((65, 65), samples=1).frame(world.at(0.0), from_above()))
    # The shadow lies at x = 1; 8 tan 15 degrees = 2.1436 fills half the picture.
    column = round(32 + 32.5 / 2.1436)
    np.testing.assert_allclose(picture[32, column], np.sqrt(0.5) * 0.5 * np.array(color_rgb("", "#ff8000")), atol=0.01)
    np.testing.assert_allclose(picture[32, 5], np.sqrt(0.5), atol=0.01)


def test_shadows_of_glass_behind_glass_multiply():
    world = shadow_world(light=fs.DirectionalLight(direction=(1, 0, -1)))
    for height, color in ((1, "#ff8000"), (2, "#80ff00")):
        glass = fs.Material(color=color, radius=0.3, transmission=0.9)
        world.add_body(fs.Body(fs.Point((1 - height, 0, height)), surface=glass))
    picture = linear(Renderer((65, 65), samples=1).frame(world.at(0.0), from_above()))
    tints = [0.9 * np.array(color_rgb("", color)) for color in ("#ff8000", "#80ff00")]
    shade = picture[32, round(32 + 32.5 / 2.1436)]
    np.testing.assert_allclose(shade, np.sqrt(0.5) * tints[0] * tints[1], atol=0.01)


def test_penumbras_are_as_wide_as_the_light():
    # An edge 1 above the ground, a light 20 degrees across: the penumbra reaches from -tan 10 to tan 10 degrees.
    sun = fs.DirectionalLight(direction=(0, 0, -1), angle=20.0, samples=256)
    world = shadow_world(light=sun, shape=fs.Box((4, 8, 0.001), (2, 0, 1)), material=fs.Material(visible_to="shadow"))
    row = linear(Renderer((129, 9), samples=1).frame(world.at(0.0), from_above(0.5)))[..., 0].mean(axis=0)
    x = (np.arange(129) - 64) / 4.5 * 8 * np.tan(np.radians(0.25))
    u = np.clip(x / np.tan(np.radians(10)), -1, 1)
    # The share of a disc on one side of a line.
    expected = (np.arccos(u) - u * np.sqrt(1 - u * u)) / np.pi
    # Oblique parts of the light give their cosine; of 256 points a few are on the wrong side.
    np.testing.assert_allclose(row, expected, atol=0.03)


def test_a_point_light_with_a_radius_softens_too():
    lamp = fs.PointLight(position=(0, 0, 4), radius=0.4, samples=128)
    ball = fs.Material(color="black", radius=0.3, visible_to="shadow")
    hard = shadow_world(light=fs.PointLight(position=(0, 0, 4)), blocker=ball)
    rows = [
        linear(Renderer((129, 9), samples=1).frame(w.at(0.0), from_above(0.8)))
        for w in (hard, shadow_world(light=lamp, blocker=ball))
    ]
    sharp, soft = (row[..., 0].mean(axis=0) for row in rows)
    x = np.abs(np.arange(129) - 64) / 4.5 * 8 * np.tan(np.radians(0.4))
    # Tangents of the ball from the lamp's middle, and of both on either side.
    edge, inner, outer = 0.3 / 3 * 4, (0.3 - 0.4) / 3 * 4 + 0.4, (0.3 + 0.4) / 3 * 4 - 0.4
    assert (sharp[x < 0.97 * edge] == 0).all()
    assert (sharp[x > 1.05 * edge] > 0.8).all()
    assert (soft[x < 0.9 * inner] < 0.02).all()
    between = soft[(x > inner + 0.1) & (x < outer - 0.1)]
    assert ((between > 0.05) & (between < 0.9)).all()
    assert (soft[x > 1.05 * outer] > 0.8).all()


def test_light_wide_or_not_lights_alike_without_shadows():
    pictures = []
    for angle in (0.0, 2.0):
        sun = fs.DirectionalLight(direction=(0.3, 0.2, -1), angle=angle)
        world = shadow_world(light=sun, blocker=fs.Material(radius=0.4))
        pictures.append(Renderer((48, 48), samples=1).frame(world.at(0.0), from_above()))
    # Penumbras are one or two pixels here.
    off = np.abs(pictures[0].astype(int) - pictures[1]).max(axis=2)
    assert np.quantile(off, 0.93) <= 4


@pytest.mark.parametrize("soft", [True, False])
def test_kinds_of_rays_meet_what_they_should(soft):
    def shown(visible_to):
        world = shadow_world(light=fs.DirectionalLight(direction=(1, 0, -1)))
        material = fs.Material(color="red", radius=0.4, visible_to=visible_to, **FLAT)
        if soft:
            world.add_body(fs.Body(fs.Point((0, 0, 1)), surface=material))
        else:
            world.add_shape(fs.Ball((0, 0, 1), 0.4), material)
        picture = linear(Renderer((65, 65), samples=1).frame(world.at(0.0), from_above()))
        shade = picture[32, round(32 + 32.5 / 2.1436)]
        return picture[32, 32, 1] < 0.3, shade[1] < 0.3

    assert shown(("camera", "shadow")) == (True, True)
    assert shown("camera") == (True, False)
    assert shown("shadow") == (False, True)
    assert shown(()) == (False, False)


def test_mirrors_and_glass_meet_only_what_they_may():
    def seen(visible_to, **optics):
        world = fs.World(lights=(fs.DirectionalLight(direction=(0, 1, -1), shadows=False),), background=PLAIN)
        pane = fs.Material(color="white", specular=0.0, ambient=0.0, ior=1.0, **optics)
        world.add_shape(fs.Ground((0, 0, 0), (0, 1, 0)), pane)
        side = -1.5 if "reflection" in optics else 1.5
        red = fs.Material(color="red", radius=0.5, visible_to=visible_to, ambient=1.0)
        world.add_body(fs.Body(fs.Point((0, side, 0)), surface=red))
        eye = (0, -4, 3) if side < 0 else (0, -4, 0)
        look = (0, 0, 3 * 1.5 / 5.5) if side < 0 else (0, 0, 0)
        return Renderer((9, 9), samples=1).frame(world.at(0.0), fs.Camera(eye=eye, look_at=look, fov=5))[4, 4, 0] > 20

    assert seen(("reflected",), reflection=1.0)
    assert not seen(("camera", "shadow", "transmitted"), reflection=1.0)
    assert seen(("transmitted",), transmission=1.0)
    assert not seen(("camera", "shadow", "reflected"), transmission=1.0)


def test_fog_takes_its_share_of_each_length():
    world = fs.World(lights=DARK, background=PLAIN, fog=fs.Fog(0.3, "white"))
    world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(color="black", radius=0.5)))
    camera = fs.Camera(eye=(0, -3, 0), fov=30)
    renderer = Renderer((32, 32), samples=1)
    picture = linear(renderer.frame(world.at(0.0), camera))[..., 0]
    depth, _ = renderer.depth_and_normals(world.at(0.0), camera)
    np.testing.assert_allclose(picture, 1.0 - np.exp(-0.3 * depth), atol=0.006)


def test_clear_fog_fades_into_the_sky():
    world = fs.World(lights=DARK, background=SKY, fog=fs.Fog(50.0))
    world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(color="black", radius=0.5)))
    camera = fs.Camera(eye=(0, -3, 0.5), fov=30)
    picture = linear(Renderer((32, 32), samples=1).frame(world.at(0.0), camera))
    np.testing.assert_allclose(picture, sky(rays(camera, (32, 32))), atol=0.006)


def bead(depth, radius=0.02):
    """A bright bead on the camera's axis."""
    world = fs.World(lights=DARK, background=PLAIN)
    world.add_shape(fs.Ball((0, depth, 0), radius), fs.Material(color="white", **SHINING))
    return world


def test_lenses_blur_what_is_out_of_focus_by_the_circle_of_confusion():
    size, fov, aperture, focus = (81, 81), 20.0, 0.4, 4.0
    renderer = Renderer(size, samples=1, exposures=64)
    camera = fs.Camera(eye=(0, 0, 0), look_at=(0, 1, 0), fov=fov, aperture=aperture, focus=focus)
    at_focus, behind = (renderer.frame(bead(depth).at(0.0), camera)[..., 0] for depth in (4.0, 8.0))
    pixel = 2 * np.tan(np.radians(fov / 2)) / 81
    assert np.ptp(np.argwhere(at_focus)[:, 0]) <= 2 + 2 * 0.02 / 4 / pixel
    # Seen from the lens a point at z moves by aperture (1/z - 1/focus) in the plane at distance 1.
    across = aperture * abs(1 / 8 - 1 / focus) / pixel
    spread = np.ptp(np.argwhere(behind), axis=0)
    np.testing.assert_allclose(spread, across, atol=4)


def test_an_open_shutter_sees_the_mean_of_its_moments():
    world = fs.World(lights=DARK, background=PLAIN)
    material = fs.Material(color="white", radius=0.2, **SHINING)
    world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=material, motion=lambda t: fs.Pose((t, 0.0, 0.0))))
    camera = fs.Camera(eye=(0.5, -4, 0), look_at=(0.5, 0, 0), fov=30)
    renderer = Renderer((96, 48), samples=1, exposures=32)
    times = np.arange(32) / 32
    row = linear(renderer.frame([world.at(t) for t in times], camera))[24, :, 0]
    x = 0.5 + (np.arange(96) + 0.5 - 48) / 24 * np.tan(np.radians(15)) * 4
    # The ball, 0.4 across, covers a place for 0.4 of the time: a trapezoid.
    expected = np.clip(np.minimum(x + 0.2, 1.2 - x), 0.0, 0.4)
    # Two of the 32 moments may fall beside its edges.
    np.testing.assert_allclose(row, expected, atol=0.07)


def test_films_blur_while_the_shutter_is_open(tmp_path):
    world = fs.World(lights=DARK, background=PLAIN)
    material = fs.Material(color="white", radius=0.2, **SHINING)
    world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=material, motion=lambda t: fs.Pose((8 * t - 1, 0.0, 0.0))))
    camera = fs.Camera(eye=(0, -4, 0), shutter=0.1)
    scenario = fs.Scenario(world, camera, duration=0.2, fps=10)
    fs.film(scenario, tmp_path / "blur.png", size=(64, 36), quality="draft")
    row = np.asarray(Image.open(tmp_path / "blur.png"))[18, :, 0]
    x = (np.arange(64) - 31.5) / 18 * 4 * np.tan(np.radians(20))
    # From -0.2 to 0.6 in eight moments, the first at the frame's time.
    np.testing.assert_array_equal(row[(x > -0.3) & (x < 0.6)] > 0, True)
    np.testing.assert_array_equal(row[(x < -0.5) | (x > 0.8)], 0)
    with pytest.raises(fs.InputError, match=r"shutter is 0\.2 but a frame lasts 0.1"):
        fs.film(fs.Scenario(world, fs.Camera(eye=(0, -4, 0), shutter=0.2), duration=0.2, fps=10), tmp_path / "b.png")


def test_exposure_doubles_and_film_rolls_off():
    world = fs.World(lights=DARK, background=fs.Background(top="#404040", bottom="#404040", stars=0.0))
    shot = lambda **look: linear(Renderer((4, 4)).frame(world.at(0.0), fs.Camera(eye=(0, -4, 0), **look)))[0, 0, 0]  # noqa: E731
    gray = color_rgb("", "#404040")[0]
    assert abs(shot(exposure=2.0) - 4 * gray) < 0.01
    assert shot(exposure=10.0) == 1.0
    x = 2 * gray
    assert abs(shot(exposure=1.0, tone="filmic") - x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)) < 0.01


def test_pictures_too_large_for_memory_are_the_same_in_bands(monkeypatch):
    world = fs.World()
    world.add_body(fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), surface=fs.Material()))
    world.add_shape(fs.Ground((0, 0, -0.5), checker="white"))
    camera = fs.Camera(eye=(2.5, -2.0, 1.5), aperture=0.0)
    whole = Renderer((90, 50)).frame(world.at(0.0), camera)
    monkeypatch.setattr(renderer, "_MOST_PIXELS", 90 * 7)
    np.testing.assert_array_equal(Renderer((90, 50)).frame(world.at(0.0), camera), whole)


def snapshot_of(place):
    """A moment in which a particle has got to `place`."""
    world = fs.World()
    world.add_particles(np.zeros((2, 3)), np.zeros((2, 3)))
    return dataclasses.replace(world.at(0.0), positions=(np.array([(0.0, 0.0, 0.0), place]),))


def test_a_world_without_lights_is_told():
    with pytest.warns(fs.FieldsimWarning, match="there are no lights"):
        fs.World(lights=())


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: fs.Material(reflection=1.5), "reflection is 1.5; give a number of at most 1"),
        (lambda: fs.Material(transmission=-0.1), "transmission is -0.1"),
        (lambda: fs.Material(ior=0.0), "ior is 0"),
        (lambda: fs.Material(visible_to=("camera", "shadows")), "did you mean 'shadow'"),
        (lambda: fs.Fog(-1.0), "density is -1"),
        (lambda: fs.World(fog=0.1), "give fs.Fog"),
        (lambda: fs.PointLight(position=(0, 0, 1), radius=-1.0), "radius is -1"),
        (lambda: fs.DirectionalLight(direction=(0, 0, 1), angle=180.0), "angle is 180"),
        (lambda: fs.DirectionalLight(direction=(0, 0, 1), samples=0), "samples is 0"),
        (lambda: fs.Camera((0, 0, 1), aperture=-1.0), "aperture is -1"),
        (lambda: fs.Camera((0, 0, 1), focus=0.0), "focus is 0"),
        (lambda: fs.Camera((0, 0, 1), tone="film"), "tone is 'film'"),
        (lambda: Renderer(exposures=0), "exposures is 0"),
        (lambda: Renderer().frame([], fs.Camera((0, 0, 1))), "no snapshots"),
        (lambda: Renderer().frame(snapshot_of((0.0, np.nan, 0.0)), fs.Camera((0, 0, 1))), r"positions\[0\]\[1\] is"),
    ],
)
def test_bad_light_is_refused(make, words):
    with pytest.raises(fs.InputError, match=words):
        make()
