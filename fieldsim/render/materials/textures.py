"""Textures as Warp functions; see `world.texture`.

A place on a picture is a *spot* (u, v, length of the surface along u, length along v) with *ends*: for u and v, 1 if
the picture has an end there, 0 if it repeats or closes.
"""

import math

import warp as wp

from fieldsim.numerics.constants import TAU
from fieldsim.potentials.primitives.base import Volume
from fieldsim.potentials.row import ANGLE, LENGTH, RADIUS
from fieldsim.render.materials.mipmaps import looked_up
from fieldsim.render.materials.table import (
    ACROSS,
    DOWN,
    FIRST,
    KIND,
    OTHER,
    REPEAT,
    RGB,
    SCALE,
    SEED,
    TURBULENCE,
    triple,
)
from fieldsim.render.scene.rows import first_of, normal_of, point_of
from fieldsim.render.scene.tables import SceneTables
from fieldsim.world import texture

OCTAVES = 4
_PLAIN = wp.constant(0)
_CHECKER, _CLOUDS, _MARBLE, _PICTURE = (
    wp.constant(kind.kind) for kind in (texture.Checker, texture.Clouds, texture.Marble, texture.ImageTexture)
)
_BALL, _CAPSULE, _TUBE = (wp.constant(int(volume)) for volume in (Volume.BALL, Volume.CAPSULE, Volume.TUBE))
_WHOLE = wp.constant(math.tau - 1e-5)  # an angle from which an arc is a circle
_TINY = wp.constant(1.0e-12)


@wp.func
def turbulent(p: wp.vec3, seed: int):
    """Fractal noise, four octaves, each of half the size and strength; about -1 to 1."""
    state = wp.rand_init(seed)
    total = 0.0
    strength = 0.5
    for _ in range(OCTAVES):
        total += strength * wp.noise(state, p)
        p = 2.0 * p + wp.vec3(17.3, 5.1, 11.7)  # or all octaves would vanish at the same lattice points
        strength = 0.5 * strength
    return total


@wp.func
def blend_at(kind: int, p: wp.vec3, turbulence: float, seed: int):
    """Share of the other colour, 0 to 1, of a texture of scale 1 at p."""
    if kind == _CHECKER:
        parity = int(wp.floor(p[0])) + int(wp.floor(p[1])) + int(wp.floor(p[2]))
        return float(parity & 1)
    noise = turbulent(p, seed)
    if kind == _CLOUDS:
        return wp.clamp(0.5 + noise, 0.0, 1.0)
    if kind == _MARBLE:
        return 0.5 + 0.5 * wp.sin(TAU * (p[0] + turbulence * noise))
    rings = wp.sqrt(p[0] * p[0] + p[1] * p[1]) + turbulence * noise
    grown = rings - wp.floor(rings)
    # A growth ring darkens slowly and ends sharply.
    return grown * grown


@wp.func
def is_picture(rows: wp.array2d(dtype=float), m: int):
    """Whether material m has a picture."""
    return int(rows[m, KIND]) == _PICTURE


@wp.func
def beneath(rows: wp.array2d(dtype=float), m: int):
    """A depth beneath a surface at which a solid texture looks as it does on it."""
    return 1.0e-3 * rows[m, SCALE]


@wp.func
def carved(rows: wp.array2d(dtype=float), m: int, p: wp.vec3):
    """Linear colour of a material that is plain or has a solid texture, at p in the frame of its body."""
    plain = triple(rows, m, RGB)
    kind = int(rows[m, KIND])
    if kind == _PLAIN:
        return plain
    share = blend_at(kind, p / rows[m, SCALE], rows[m, TURBULENCE], int(rows[m, SEED]))
    return wp.lerp(plain, triple(rows, m, OTHER), share)


@wp.func
def pictured(
    rows: wp.array2d(dtype=float), texels: wp.array(dtype=wp.vec3), m: int, spot: wp.vec4, ends: wp.vec2, pixel: float
):
    """Linear colour of a material with a picture at a spot, where a pixel is `pixel` wide."""
    repeat = wp.vec2(rows[m, REPEAT], rows[m, REPEAT + 1])
    width = int(rows[m, ACROSS])
    height = int(rows[m, DOWN])
    # Texels of a side, on the mean of the two directions.
    area = float(width * height) * repeat[0] * repeat[1] / wp.max(spot[2] * spot[3], _TINY)
    place = wp.cw_mul(repeat, wp.vec2(spot[0], spot[1]))
    first = int(rows[m, FIRST])
    return looked_up(texels, first, width, height, place, wp.cw_mul(repeat, ends), pixel * wp.sqrt(area))


@wp.func
def around_ball(p: wp.vec3):
    """(spot, ends) on a ball by longitude and latitude; p from its centre."""
    flat = wp.sqrt(p[0] * p[0] + p[1] * p[1])
    u = 0.5 + wp.atan2(p[1], p[0]) / TAU
    v = 2.0 * wp.atan2(flat, p[2]) / TAU
    return wp.vec4(u, v, TAU * flat, 0.5 * TAU * wp.length(p)), wp.vec2(0.0, 1.0)


@wp.func
def along_rod(p: wp.vec3, length: float):
    """(spot, ends) on a rod; p from its start, its axis is z."""
    u = wp.clamp(p[2] / length, 0.0, 1.0)
    v = 0.75 + wp.atan2(p[1], p[0]) / TAU
    return wp.vec4(u, v, length, TAU * wp.sqrt(p[0] * p[0] + p[1] * p[1])), wp.vec2(1.0, 0.0)


@wp.func
def around_tube(p: wp.vec3, radius: float, angle: float):
    """(spot, ends) on a tube about an arc; p from its centre, its middle is on x, its normal is z."""
    rho = wp.sqrt(p[0] * p[0] + p[1] * p[1])
    out = rho - radius
    u = wp.clamp(0.5 + wp.atan2(p[1], p[0]) / angle, 0.0, 1.0)
    v = 0.5 - wp.atan2(p[2], out) / TAU
    around = TAU * wp.sqrt(out * out + p[2] * p[2])
    return wp.vec4(u, v, angle * rho, around), wp.vec2(wp.where(angle < _WHOLE, 1.0, 0.0), 0.0)


@wp.func
def in_plane(x: float, y: float):
    """(spot, ends) in a plane; x to the right and y up."""
    return wp.vec4(x, -y, 1.0, 1.0), wp.vec2(0.0, 0.0)


@wp.func
def beside(n: wp.vec3):
    """A unit vector across the unit vector n: the shortest turn that takes z to n takes x to it."""
    if n[2] < -0.999999:
        return wp.vec3(1.0, 0.0, 0.0)
    k = n[0] / (1.0 + n[2])
    return wp.vec3(1.0 - n[0] * k, -n[1] * k, -n[0])


@wp.func
def on_element(scene: SceneTables, m: int, j: int, here: wp.vec3):
    """(spot, ends) on element j of material m at a place; lengths are in the world's units."""
    turn = scene.turns[m]
    p = turn * (here - point_of(scene.rows, j))
    shape = scene.shape[j]
    if shape == _BALL:
        return around_ball(p)
    first = turn * first_of(scene.rows, j)
    normal = turn * normal_of(scene.rows, j)
    if shape == _TUBE:
        # In the frame of its middle.
        unit = wp.length(normal)
        z = normal / unit
        x = first / unit
        half = 0.5 * scene.rows[j, ANGLE]
        x = wp.cos(half) * x + wp.sin(half) * wp.cross(z, x)
        q = wp.vec3(wp.dot(p, x), wp.dot(p, wp.cross(z, x)), wp.dot(p, z))
        return around_tube(q, unit * scene.rows[j, RADIUS], scene.rows[j, ANGLE])
    z = wp.normalize(wp.where(shape == _CAPSULE, first, normal))
    x = beside(z)
    q = wp.vec3(wp.dot(p, x), wp.dot(p, wp.cross(z, x)), wp.dot(p, z))
    if shape == _CAPSULE:
        return along_rod(q, wp.length(first) * scene.rows[j, LENGTH])
    return in_plane(q[0], q[1])


@wp.func
def color_at(scene: SceneTables, m: int, j: int, here: wp.vec3):
    """Linear colour of material m on element j at a place, relative to the eye."""
    from_eye = scene.turns[m] * here
    if is_picture(scene.materials, m):
        spot, ends = on_element(scene, m, j, here)
        return pictured(scene.materials, scene.texels, m, spot, ends, scene.pixel * wp.length(from_eye))
    return carved(scene.materials, m, from_eye + scene.shifts[m])
