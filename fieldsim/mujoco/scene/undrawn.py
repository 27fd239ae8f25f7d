"""Names of what MuJoCo's own pictures show of a model, and ours do not."""

import mujoco
import numpy as np

from fieldsim.mujoco.models import label, named, seen, seen_geoms
from fieldsim.mujoco.scene.geoms import checker_of, shape_of

# A texture whose colours differ by less than this is as well one colour.
EVEN = 0.02


def undrawn(model, drawn) -> list[str]:
    """Words for each thing of the model that is left out, or drawn as less than it is; drawn: numbers of its geoms.

    Things that MuJoCo shows by default: geoms, tendons in space, flexes, skins, the rays of range finders, textures.
    """
    fields = [f"height field of geom {label(model, g)}" for g in seen_geoms(model) if shape_of(model, g) is None]
    tendons = [k for k in seen(model, "tendon") if _in_space(model, k)]
    rays = np.flatnonzero(model.sensor_type == mujoco.mjtSensor.mjSENS_RANGEFINDER).tolist()
    sorts = {"tendon": tendons, "flex": seen(model, "flex"), "skin": seen(model, "skin"), "range finder": rays}
    others = [_named(model, sort, k) for sort, numbers in sorts.items() for k in numbers]
    textures = dict.fromkeys(_texture(model, geom) for geom in drawn if _loses_its_texture(model, geom))
    return [*fields, *others, *(f"texture {named(model, 'texture', k)} (as one colour)" for k in textures)]


def _in_space(model, tendon):
    """Whether a tendon is seen: it runs through sites, not only over joints."""
    kind = model.wrap_type[model.tendon_adr[tendon]]
    return kind != mujoco.mjtWrap.mjWRAP_JOINT and model.tendon_width[tendon] > 0.0


def _named(model, sort, number):
    return f"{sort} {named(model, 'sensor' if sort == 'range finder' else sort, number)}"


def _texture(model, geom):
    """The number of a geom's colour texture, or -1."""
    material = model.geom_matid[geom]
    return int(model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB]) if material >= 0 else -1


def _loses_its_texture(model, geom):
    texture = _texture(model, geom)
    if texture < 0:
        return False
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE and checker_of(model, geom) is not None:
        return False
    count, channels = int(model.tex_height[texture]) * int(model.tex_width[texture]), int(model.tex_nchannel[texture])
    first = model.tex_adr[texture]
    colors = model.tex_data[first : first + count * channels].reshape(count, channels) / 255.0
    # A cube map counts as white.
    shown = colors[0] if model.tex_type[texture] == mujoco.mjtTexture.mjTEXTURE_2D else 1.0
    return bool(np.abs(colors - shown).max() > EVEN)
