"""Materials on a device: a table of rows, and the Warp functions that read it.

| columns | content |
|---|---|
| RGB.. | linear colour; the first colour of a texture |
| FACTORS.. | ambient, diffuse, specular, shininess |
| KIND | of the texture, 0 for a plain colour (see `world.texture`) |
| OTHER.., SCALE, TURBULENCE, SEED | of a solid texture; OTHER is a linear colour |
| FIRST, ACROSS, DOWN, REPEAT.. | of a picture: first texel, width and height [texels], repetitions along u and v |
"""

import numpy as np
import warp as wp

from fieldsim.render.materials.mipmaps import uploaded_pictures
from fieldsim.world.color import color_rgb
from fieldsim.world.material import RAYS, Material
from fieldsim.world.texture import ImageTexture, SolidTexture, Texture

RGB = wp.constant(0)
FACTORS = wp.constant(3)
KIND = wp.constant(8)
OTHER, SCALE, TURBULENCE, SEED = (wp.constant(k) for k in (9, 12, 13, 14))
FIRST, ACROSS, DOWN, REPEAT = (wp.constant(k) for k in (9, 10, 11, 12))
COLUMNS = 15


def table(materials, device) -> tuple[wp.array, wp.array]:
    """Rows (M, COLUMNS) of materials, and the texels of their pictures, on a device."""
    images = [m.color.pixels for m in materials if isinstance(m.color, ImageTexture)]
    texels, firsts = uploaded_pictures(images, device)
    rows = rows_of(materials)
    for row, m in zip(rows, materials, strict=True):
        if isinstance(m.color, ImageTexture):
            row[FIRST] = firsts[m.color.pixels]
    return wp.array(rows, dtype=float, ndim=2, device=device), texels


def rows_of(materials) -> np.ndarray:
    """Rows (M, COLUMNS) of materials; the first texels of pictures, which are known on a device, are 0."""
    rows = np.zeros((len(materials), COLUMNS))
    for row, m in zip(rows, materials, strict=True):
        row[RGB : RGB + 3] = m.rgb
        row[FACTORS : FACTORS + 4] = m.ambient, m.diffuse, m.specular, m.shininess
        if isinstance(m.color, Texture):
            row[KIND] = m.color.kind
        if isinstance(m.color, SolidTexture):
            row[OTHER : OTHER + 3] = color_rgb(type(m.color).__name__, m.color.other)
            row[SCALE], row[TURBULENCE] = m.color.scale, getattr(m.color, "turbulence", 0.0)
            row[SEED] = getattr(m.color, "seed", 0) % 65536
        if isinstance(m.color, ImageTexture):
            height, width = m.color.pixels.linear.shape[:2]
            row[ACROSS], row[DOWN] = width, height
            row[REPEAT : REPEAT + 2] = m.color.repeat
    return rows


def optics(materials) -> np.ndarray:
    """Reflection, transmission, index of refraction and 0 of each material, (M, 4)."""
    return np.array([(m.reflection, m.transmission, m.ior, 0.0) for m in materials]).reshape(-1, 4)


def rays_that_meet(material: Material) -> int:
    """The bits of `visible_to`: 1 << k for RAYS[k]."""
    return sum(1 << RAYS.index(ray) for ray in material.visible_to)


@wp.func
def triple(rows: wp.array2d(dtype=float), m: int, column: int):
    """Three neighbouring numbers of material m."""
    return wp.vec3(rows[m, column], rows[m, column + 1], rows[m, column + 2])


@wp.func
def factors(rows: wp.array2d(dtype=float), m: int):
    """Factors of ambient, diffuse and specular light, and the shininess, of material m."""
    return wp.vec4(rows[m, FACTORS], rows[m, FACTORS + 1], rows[m, FACTORS + 2], rows[m, FACTORS + 3])
