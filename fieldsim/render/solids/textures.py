"""Textures on hard shapes: where a picture lies on each kind, and the checker of planes."""

import warp as wp

from fieldsim.render.materials.textures import along_rod, around_ball, around_tube, in_plane
from fieldsim.world import shapes

_BOX, _CYLINDER, _CAPSULE, _TUBE, _PRISM, _SLAB, _ELLIPSOID = (
    wp.constant(kind)
    for kind in (
        shapes.BOX,
        shapes.CYLINDER,
        shapes.CAPSULE,
        shapes.TUBE,
        shapes.PRISM,
        shapes.SLAB,
        shapes.ELLIPSOID,
    )
)


@wp.func
def _stripes(x: float, w: float):
    """Mean over x - w/2..x + w/2 of the square wave that is 1 on 0..1, -1 on 1..2."""
    # Narrower than this, the difference below would be rounding.
    w = wp.max(w, 1.0e-3 + 1.0e-5 * wp.abs(x))
    low = 0.5 * (x - 0.5 * w)
    high = 0.5 * (x + 0.5 * w)
    a = 0.5 - wp.abs(low - wp.floor(low) - 0.5)
    b = 0.5 - wp.abs(high - wp.floor(high) - 0.5)
    return 2.0 * (b - a) / w


@wp.func
def checkered(p: wp.vec3, e: wp.vec3, t: float, pixel: float, tile: float):
    """Share of the first of two colours of a checker, 0 to 1, averaged over what a pixel covers of the plane z = 0."""
    across = t * pixel
    slant = wp.max(wp.abs(e[2]), 1.0e-3)
    # The pixel's footprint is longer along the view's direction in the plane.
    flat = wp.max(wp.sqrt(e[0] * e[0] + e[1] * e[1]), 1.0e-6)
    wx = wp.length(wp.vec2(e[0] / flat / slant, e[1] / flat)) * across / tile
    wy = wp.length(wp.vec2(e[1] / flat / slant, e[0] / flat)) * across / tile
    return 0.5 + 0.5 * _stripes(p[0] / tile, wx) * _stripes(p[1] / tile, wy)


@wp.func
def _on_face(p: wp.vec3, n: wp.vec3, half: wp.vec3):
    """(spot, ends) on the face of a box with the normal n; those at the sides are upright."""
    x = p[0] * wp.where(n[1] > 0.5, -1.0, 1.0)
    y = p[2]
    wide = half[0]
    high = half[2]
    if wp.abs(n[0]) > 0.5:
        x = p[1] * n[0]
        wide = half[1]
    elif wp.abs(n[2]) > 0.5:
        y = p[1] * n[2]
        high = half[1]
    return wp.vec4(0.5 + 0.5 * x / wide, 0.5 - 0.5 * y / high, 2.0 * wide, 2.0 * high), wp.vec2(1.0, 1.0)


@wp.func
def on_shape(kind: int, p: wp.vec3, n: wp.vec3, s: wp.vec4):
    """(spot, ends) on a shape with the sizes s, at p in its own frame, where its normal is n."""
    if kind == _BOX:
        return _on_face(p, n, wp.vec3(s[0], s[1], s[2]))
    if kind == _CYLINDER or kind == _CAPSULE:
        return along_rod(p + wp.vec3(0.0, 0.0, s[1]), 2.0 * s[1])
    if kind == _TUBE:
        return around_tube(p, s[0], 2.0 * s[2])
    if kind == _SLAB or kind == _PRISM:
        return in_plane(p[0], p[1])
    if kind == _ELLIPSOID:
        return around_ball(wp.cw_div(s[0] * p, wp.vec3(s[0], s[1], s[2])))
    return around_ball(p)
