"""Fog: what is far away fades."""

import warp as wp

from fieldsim.render.scene.hits import Hits
from fieldsim.render.shading.sky import Sky, background
from fieldsim.world.color import color_rgb


@wp.kernel(enable_backward=False)
def fog_kernel(
    start: int,
    density: float,
    tinted: int,
    tint: wp.vec3,
    sky: Sky,
    hits: Hits,
    color: wp.array(dtype=wp.vec3),
):
    """Fade colours into a tint, or into the sky behind them, by the length of their rays."""
    i = start + wp.tid()
    if tinted == 0 and hits.thing[i] == -1:
        return
    behind = tint
    if tinted == 0:
        behind = background(hits.direction[i], sky)
    left = 0.0
    if hits.thing[i] != -1:
        left = wp.exp(-density * hits.depth[i])
    color[i] = left * color[i] + (1.0 - left) * behind


def fog_of(fog, unit: float):
    """The first arguments of `fog_kernel` for a `Fog`, None for none; unit: the stage's length."""
    if fog is None or fog.density == 0.0:
        return None
    tint = color_rgb("Fog", fog.color) if fog.color is not None else (0.0, 0.0, 0.0)
    return [fog.density * unit, int(fog.color is not None), wp.vec3(*tint)]
