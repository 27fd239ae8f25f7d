"""What rays that hit nothing see: a vertical gradient and stars. Its colour also fills the shadows."""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import numpy as np
import warp as wp

from fieldsim.world.color import color_rgb

AMBIENT = 0.55  # share of the sky's colour that fills shadows
FILL = 0.045  # and of a neutral light, so that black skies leave shapes visible

_CELLS = wp.constant(48.0)  # grid cells of stars along a side of the sky's cube


@wp.struct
class Sky:
    """Linear colours straight up and straight down; share of the grid's cells with a star; radius of a star [rad]."""

    top: wp.vec3
    bottom: wp.vec3
    ambient_top: wp.vec3
    ambient_bottom: wp.vec3
    stars: float
    star_radius: float


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
    # Stars keep away from the borders of their cells, so that no neighbour needs a look.
    dx = (x - wp.floor(x) - 0.2 - 0.6 * wp.randf(state)) / _CELLS * 2.0
    dy = (y - wp.floor(y) - 0.2 - 0.6 * wp.randf(state)) / _CELLS * 2.0
    # The cube's plane stretches angles by 1/|w|^2 at most; close enough for a dot of light.
    spread = (dx * dx + dy * dy) * w * w / (sky.star_radius * sky.star_radius)
    if spread > 9.0:
        return 0.0
    bright = wp.randf(state)
    return (0.06 + 0.9 * wp.pow(bright, 6.0)) * wp.exp(-spread)


@wp.func
def background(d: wp.vec3, sky: Sky):
    """Linear colour of the sky in direction d."""
    u = 0.5 + 0.5 * d[2]
    color = sky.bottom + u * (sky.top - sky.bottom)
    if sky.stars > 0.0:
        color += _star(d, sky) * wp.vec3(0.95, 0.97, 1.0)
    return color


def sky_of(background, pixel) -> Sky:
    """The sky of a `Background`; pixel: angular size of a pixel."""
    sky = Sky()
    top, bottom = (np.array(color_rgb("Background", c)) for c in (background.top, background.bottom))
    sky.top, sky.bottom = wp.vec3(*top), wp.vec3(*bottom)
    sky.ambient_top = wp.vec3(*(AMBIENT * top + FILL))
    sky.ambient_bottom = wp.vec3(*(AMBIENT * bottom + 0.4 * FILL))
    sky.stars = float(background.stars)
    sky.star_radius = max(0.75 * pixel, 7e-4)
    return sky
