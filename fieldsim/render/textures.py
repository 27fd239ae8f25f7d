"""Solid textures as Warp functions; see `world.texture`."""

import math

import warp as wp

from fieldsim.render.hermite import Scene

TAU = wp.constant(math.tau)
OCTAVES = 4


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
    if kind == 1:
        parity = int(wp.floor(p[0])) + int(wp.floor(p[1])) + int(wp.floor(p[2]))
        return float(parity & 1)
    noise = turbulent(p, seed)
    if kind == 2:
        return wp.clamp(0.5 + noise, 0.0, 1.0)
    if kind == 3:
        return 0.5 + 0.5 * wp.sin(TAU * (p[0] + turbulence * noise))
    rings = wp.sqrt(p[0] * p[0] + p[1] * p[1]) + turbulence * noise
    grown = rings - wp.floor(rings)
    # A year's wood darkens slowly and ends sharply.
    return grown * grown


@wp.func
def color_at(scene: Scene, m: int, p: wp.vec3):
    """Linear colour of material m at p, relative to the eye."""
    plain = wp.vec3(scene.materials[m, 0], scene.materials[m, 1], scene.materials[m, 2])
    kind = int(scene.materials[m, 8])
    if kind == 0:
        return plain
    other = wp.vec3(scene.materials[m, 9], scene.materials[m, 10], scene.materials[m, 11])
    q = (scene.turns[m] * p + scene.shifts[m]) / scene.materials[m, 12]
    share = blend_at(kind, q, scene.materials[m, 13], int(scene.materials[m, 14]))
    return plain + share * (other - plain)
