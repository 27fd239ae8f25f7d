"""The sky, seen by rays that miss: a gradient and stars, or a picture; also the source of ambient light."""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import math

import numpy as np
import warp as wp

from fieldsim.numerics.constants import TAU
from fieldsim.render.materials.mipmaps import looked_up, uploaded_pictures
from fieldsim.world.color import color_rgb

AMBIENT = 0.55  # ambient light: share of the sky's colour
FILL = 0.045  # ambient light: share of white, so that shapes stay visible under a black sky

_CELLS = wp.constant(48.0)  # grid cells of stars along a side of the sky's cube


@wp.struct
class Sky:
    """Linear colours straight up and straight down; share of the grid's cells with a star; radius of a star [rad].

    texels, width, height: a picture instead, of width 0 for none; turn: of the picture, in full turns; covered: texels
    of a side that a pixel covers; intensity: factor on all but what is ambient.
    """

    top: wp.vec3
    bottom: wp.vec3
    ambient_top: wp.vec3
    ambient_bottom: wp.vec3
    stars: float
    star_radius: float
    texels: wp.array(dtype=wp.vec3)
    width: int
    height: int
    turn: float
    covered: float
    intensity: float


@wp.func
def _star(d: wp.vec3, sky: Sky):
    """Brightness of the star nearest to d: one per grid cell on the faces of a cube, with a soft edge."""
    size = wp.abs(d)
    face = int(0)
    u = d[1]
    v = d[2]
    w = d[0]
    if size[1] >= size[0] and size[1] >= size[2]:
        face = 1
        u = d[2]
        v = d[0]
        w = d[1]
    elif size[2] >= size[0]:
        face = 2
        u = d[0]
        v = d[1]
        w = d[2]
    if w < 0.0:
        face += 3
    x = (u / wp.abs(w) * 0.5 + 0.5) * _CELLS
    y = (v / wp.abs(w) * 0.5 + 0.5) * _CELLS
    state = wp.rand_init(face, int(x) + 4096 * int(y))
    if wp.randf(state) > 0.35 * sky.stars:
        return 0.0
    # Stars stay away from the borders of their cells, so that no neighbouring cell need be tested.
    dx = (x - wp.floor(x) - 0.2 - 0.6 * wp.randf(state)) / _CELLS * 2.0
    dy = (y - wp.floor(y) - 0.2 - 0.6 * wp.randf(state)) / _CELLS * 2.0
    # The cube's plane stretches angles by 1/|w|^2 at most: good enough for a dot.
    spread = (dx * dx + dy * dy) * w * w / (sky.star_radius * sky.star_radius)
    if spread > 9.0:
        return 0.0
    bright = wp.randf(state)
    return (0.06 + 0.9 * wp.pow(bright, 6.0)) * wp.exp(-spread)


@wp.func
def background(d: wp.vec3, sky: Sky):
    """Linear colour of the sky in direction d."""
    if sky.width > 0:
        # From within, longitudes run to the left.
        u = 0.5 + sky.turn - wp.atan2(d[1], d[0]) / TAU
        v = 2.0 * wp.atan2(wp.sqrt(d[0] * d[0] + d[1] * d[1]), d[2]) / TAU
        ends = wp.vec2(0.0, 1.0)
        return sky.intensity * looked_up(sky.texels, 0, sky.width, sky.height, wp.vec2(u, v), ends, sky.covered)
    u = 0.5 + 0.5 * d[2]
    color = sky.bottom + u * (sky.top - sky.bottom)
    if sky.stars > 0.0:
        color += _star(d, sky) * wp.vec3(0.95, 0.97, 1.0)
    return sky.intensity * color


def sky_of(background, pixel, device) -> Sky:
    """The sky of a `Background` on a device; pixel: angular size of a pixel."""
    sky = Sky()
    top, bottom = (np.array(color_rgb("Background", c)) for c in (background.top, background.bottom))
    sky.top, sky.bottom = wp.vec3(*top), wp.vec3(*bottom)
    sky.ambient_top = wp.vec3(*(AMBIENT * background.rgb_above + FILL))
    sky.ambient_bottom = wp.vec3(*(AMBIENT * background.rgb_below + 0.4 * FILL))
    sky.stars = float(background.stars)
    sky.star_radius = max(0.75 * pixel, 7e-4)
    sky.intensity = background.intensity
    pictures = [] if background.pixels is None else [background.pixels]
    sky.texels, _firsts = uploaded_pictures(pictures, device)
    for picture in pictures:
        sky.height, sky.width = picture.linear.shape[:2]
        sky.turn = background.turn / math.tau
        sky.covered = pixel * sky.width / math.tau
    return sky
