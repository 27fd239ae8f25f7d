"""Lights and particles on a device, and the hits of rays."""

import numpy as np
import warp as wp

from fieldsim.render.scene.tables import FOREVER


@wp.struct
class Lights:
    """Lights. color: linear; shadows: 0 or 1; samples: greatest number of rays to each, for `share` samples of a pixel.

    where: a position relative to the eye (w = 1) or a direction towards the light (w = 0); size: radius of a luminous
    ball, or of the disc at distance 1 for a direction; seed: of the random directions of rays.
    """

    where: wp.array(dtype=wp.vec4)
    color: wp.array(dtype=wp.vec3)
    shadows: wp.array(dtype=int)
    size: wp.array(dtype=float)
    samples: wp.array(dtype=int)
    share: int
    seed: int


@wp.struct
class Balls:
    """Particles: centres relative to the eye, radii, linear colours; tree: a wp.Bvh of them, for shadows."""

    center: wp.array(dtype=wp.vec3)
    radius: wp.array(dtype=float)
    color: wp.array(dtype=wp.vec3)
    tree: wp.uint64


@wp.struct
class Hits:
    """Hits of samples.

    depth: distance, negative for a miss; rest: its rounding error in float32, or empty; thing: -1 nothing, 0.. a
    material, from BALLS on a particle, from SOLIDS on a hard shape; color: linear; light: factors of ambient, diffuse
    and specular light, and the shininess; lift: how far above the hit shadow rays start; blocked (samples, lights): 1
    where a hard shape hides a light, empty without any; origin: where rays start, empty for those from the eye; optics:
    see `SceneTables`, with 1 in the last place if the ray was inside; empty if nothing reflects or transmits.
    For layers alone: work (samples, 2): see `tables.SceneTables`; weights (samples, materials): the materials' fields
    there.
    """

    direction: wp.array(dtype=wp.vec3)
    depth: wp.array(dtype=float)
    rest: wp.array(dtype=float)
    thing: wp.array(dtype=int)
    normal: wp.array(dtype=wp.vec3)
    color: wp.array(dtype=wp.vec3)
    light: wp.array(dtype=wp.vec4)
    lift: wp.array(dtype=float)
    origin: wp.array(dtype=wp.vec3)
    optics: wp.array(dtype=wp.vec4)
    blocked: wp.array2d(dtype=wp.uint8)
    work: wp.array2d(dtype=int)
    weights: wp.array2d(dtype=float)


BALLS = wp.constant(1 << 20)
SOLIDS = wp.constant(1 << 30)


@wp.func
def origin_of(i: int, hits: Hits):
    """Where the ray of a sample starts."""
    if hits.origin.shape[0] == 0:
        return wp.vec3(0.0, 0.0, 0.0)
    return hits.origin[i]


@wp.func
def above(i: int, hits: Hits):
    """Where shadow rays start: the hit, moved by `lift` off the surface towards the eye."""
    return origin_of(i, hits) + hits.depth[i] * hits.direction[i] + hits.lift[i] * hits.normal[i]


@wp.func
def towards(p: wp.vec3, where: wp.vec4):
    """(unit direction, distance) of a light from p."""
    to = wp.vec3(where[0], where[1], where[2]) - where[3] * p
    distance = wp.length(to)
    return to / distance, wp.where(where[3] > 0.0, distance, FOREVER)


@wp.func
def behind_shape(i: int, light: int, hits: Hits):
    """Whether a hard shape hides a light from a sample."""
    if hits.blocked.shape[0] == 0:
        return False
    return hits.blocked[i, light] == wp.uint8(1)


@wp.func
def write_rest(i: int, rest: float, hits: Hits):
    """Store the rounding error of a depth in float32, if `rest` has room."""
    if hits.rest.shape[0] > 0:
        hits.rest[i] = rest


def exact_depth(hits: Hits, count: int) -> np.ndarray:
    """Distances of the first `count` hits in float64, (count,); the hits must have been traced with `exact`."""
    return hits.depth.numpy()[:count].astype(float) + hits.rest.numpy()[:count]
