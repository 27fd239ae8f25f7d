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
from fieldsim.world.texture import ImageTexture

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
    rows = np.zeros((len(materials), COLUMNS))
    for row, m in zip(rows, materials, strict=True):
        row[RGB : RGB + 3] = m.rgb
        row[FACTORS : FACTORS + 4] = m.ambient, m.diffuse, m.specular, m.shininess
        row[KIND:] = m.texture_row
        if isinstance(m.color, ImageTexture):
            row[FIRST] = firsts[m.color.pixels]
    return wp.array(rows, dtype=float, ndim=2, device=device), texels


@wp.func
def triple(rows: wp.array2d(dtype=float), m: int, column: int):
    """Three neighbouring numbers of material m."""
    return wp.vec3(rows[m, column], rows[m, column + 1], rows[m, column + 2])


@wp.func
def factors(rows: wp.array2d(dtype=float), m: int):
    """Factors of ambient, diffuse and specular light, and the shininess, of material m."""
    return wp.vec4(rows[m, FACTORS], rows[m, FACTORS + 1], rows[m, FACTORS + 2], rows[m, FACTORS + 3])
