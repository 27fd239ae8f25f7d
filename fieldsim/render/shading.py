"""Lights and shadows: from hits to linear colours."""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools

import numpy as np
import warp as wp

from fieldsim.render import hermite
from fieldsim.render.sky import Sky, background
from fieldsim.render.volumes import pierce, pierce_sphere
from fieldsim.world.light import DirectionalLight

_ROOM = wp.constant(64)  # intervals of a shadow ray in local memory


@wp.struct
class Lights:
    """Lights. color: linear; shadows: 0 or 1.

    where: a position relative to the eye (w = 1) or a direction towards the light (w = 0).
    """

    where: wp.array(dtype=wp.vec4)
    color: wp.array(dtype=wp.vec3)
    shadows: wp.array(dtype=int)


@wp.struct
class Balls:
    """Particles: centres relative to the eye, radii, linear colours; tree: a wp.Bvh of them, for shadows."""

    center: wp.array(dtype=wp.vec3)
    radius: wp.array(dtype=float)
    color: wp.array(dtype=wp.vec3)
    tree: wp.uint64


@wp.struct
class Hits:
    """What each sample sees.

    depth: distance, negative for a miss; thing: -1 nothing, 0.. a material, from BALLS on a particle, from SOLIDS on a
    hard shape; color: linear; light: factors of ambient, diffuse and specular light, and the shininess; lift: how far
    above the hit shadow rays start; blocked (samples, lights): 1 where a hard shape hides a light, empty without any.
    For layers alone: work (samples, 2): see `hermite.Scene`; weights (samples, materials): the materials' fields there.
    """

    direction: wp.array(dtype=wp.vec3)
    depth: wp.array(dtype=float)
    thing: wp.array(dtype=int)
    normal: wp.array(dtype=wp.vec3)
    color: wp.array(dtype=wp.vec3)
    light: wp.array(dtype=wp.vec4)
    lift: wp.array(dtype=float)
    blocked: wp.array2d(dtype=wp.uint8)
    work: wp.array2d(dtype=int)
    weights: wp.array2d(dtype=float)


BALLS = wp.constant(1 << 20)
SOLIDS = wp.constant(1 << 30)


@wp.func
def behind_shape(i: int, light: int, hits: Hits):
    """Whether a hard shape hides a light from a sample."""
    if hits.blocked.shape[0] == 0:
        return False
    return hits.blocked[i, light] == wp.uint8(1)


@wp.func
def ball_shadow(o: wp.vec3, d: wp.vec3, far: float, balls: Balls):
    """Whether a particle other than one that o lies on stands in the way."""
    if balls.radius.shape[0] == 0:
        return False
    query = wp.bvh_query_ray(balls.tree, o, d)
    i = int(0)
    while wp.bvh_query_next(query, i, far):
        t0, t1 = pierce_sphere(o, d, balls.center[i], balls.radius[i])
        if t0 > 0.0 and t0 < far and t0 < t1:
            return True
    return False


@wp.func
def unlit(i: int, hits: Hits, sky: Sky):
    """The colour of a sample without lights: the sky, or what it throws on a surface."""
    if hits.thing[i] == -1:
        return background(hits.direction[i], sky)
    u = 0.5 + 0.5 * hits.normal[i][2]
    ambient = sky.ambient_bottom + u * (sky.ambient_top - sky.ambient_bottom)
    return hits.light[i][0] * wp.cw_mul(hits.color[i], ambient)


@wp.func
def towards(p: wp.vec3, where: wp.vec4):
    """(unit direction, distance) of a light from p."""
    to = wp.vec3(where[0], where[1], where[2]) - where[3] * p
    distance = wp.length(to)
    return to / distance, wp.where(where[3] > 0.0, distance, hermite.FOREVER)


@wp.func
def lit(i: int, toward: wp.vec3, light: wp.vec3, hits: Hits):
    """What a light adds to the colour of a sample on a surface that faces it."""
    n = hits.normal[i]
    factors = hits.light[i]
    half = wp.normalize(toward - hits.direction[i])
    gloss = factors[2] * wp.pow(wp.max(wp.dot(n, half), 0.0), factors[3])
    return wp.dot(n, toward) * wp.cw_mul(light, factors[1] * hits.color[i] + wp.vec3(gloss, gloss, gloss))


def lights_of(lights, eye, unit, shadows, device) -> Lights:
    """Lights on a device, relative to the eye."""
    where = np.zeros((max(len(lights), 1), 4))
    for row, light in zip(where, lights, strict=False):
        if isinstance(light, DirectionalLight):
            row[:3] = -np.array(light.direction)
        else:
            row[:3] = (np.array(light.position) - eye) / unit
            row[3] = 1.0
    result = Lights()
    result.where = wp.array(where[: len(lights)], dtype=wp.vec4, device=device)
    result.color = wp.array(np.array([light.rgb for light in lights]).reshape(-1, 3), dtype=wp.vec3, device=device)
    result.shadows = wp.array([int(shadows and light.shadows) for light in lights], dtype=int, device=device)
    return result


@functools.cache
def shade_kernel(kinds_used, in_scratch=False):
    """The kernel that shades hits. in_scratch: intervals live in global memory, with room for all elements."""
    sweep = hermite.first_hit(kinds_used)

    @wp.func
    def surface_shadow(
        scene: hermite.Scene,
        tree: wp.uint64,
        o: wp.vec3,
        d: wp.vec3,
        far: float,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        room: int,
    ):
        """1 in shadow, 0 in light, -1 where the intervals do not fit."""
        if scene.kinds.shape[0] == 0:
            return 0
        count = int(0)
        query = wp.bvh_query_ray(tree, o, d)
        i = int(0)
        while wp.bvh_query_next(query, i, far):
            t0, t1 = pierce(o, d, scene.shape[i], scene.rows, i, scene.reach[i])
            if t1 > 0.0 and t0 < far and t0 < t1:
                # All strengths being positive, where one point alone is opaque nothing needs a sweep.
                center = wp.vec3(scene.rows[i, 5], scene.rows[i, 6], scene.rows[i, 7])
                c0, c1 = pierce_sphere(o, d, center, scene.core[i])
                if c0 > 0.0 and c0 < far and c0 < c1:
                    return 1
                if count == room:
                    return -1
                count = hermite.insert(ids, t0s, t1s, count, i, t0, t1)
        if count == 0:
            return 0
        hit, _side = sweep(scene, o, d, 0.0, far, -1.0, ids, t0s, t1s, count)
        return wp.where(hit >= 0.0, 1, 0)

    @wp.func
    def shade(
        i: int,
        scene: hermite.Scene,
        tree: wp.uint64,
        balls: Balls,
        lights: Lights,
        sky: Sky,
        hits: Hits,
        color: wp.array(dtype=wp.vec3),
        rays: wp.array(dtype=int),
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        room: int,
    ):
        result = unlit(i, hits, sky)
        cast = int(0)
        if hits.thing[i] != -1:
            p = hits.depth[i] * hits.direction[i] + hits.lift[i] * hits.normal[i]
            for k in range(lights.where.shape[0]):
                toward, far = towards(p, lights.where[k])
                if wp.dot(hits.normal[i], toward) <= 0.0:
                    continue
                if lights.shadows[k] == 1:
                    cast += 1
                    if behind_shape(i, k, hits) or ball_shadow(p, toward, far, balls):
                        continue
                    dark = surface_shadow(scene, tree, p, toward, far, ids, t0s, t1s, room)
                    if dark == 1:
                        continue
                    if dark == -1:
                        cast = -1
                        break
                result += lit(i, toward, lights.color[k], hits)
        color[i] = result
        rays[i] = cast

    if in_scratch:

        @wp.kernel(module="unique", enable_backward=False)
        def shade_in_scratch(
            start: int,
            scene: hermite.Scene,
            tree: wp.uint64,
            balls: Balls,
            lights: Lights,
            sky: Sky,
            which: wp.array(dtype=int),
            hits: Hits,
            color: wp.array(dtype=wp.vec3),
            rays: wp.array(dtype=int),
            ids: wp.array2d(dtype=int),
            t0s: wp.array2d(dtype=float),
            t1s: wp.array2d(dtype=float),
        ):
            k = start + wp.tid()
            i = which[k]
            shade(i, scene, tree, balls, lights, sky, hits, color, rays, ids[k], t0s[k], t1s[k], ids.shape[1])

        return shade_in_scratch

    @wp.kernel(module="unique", enable_backward=False)
    def shade_hits(
        start: int,
        scene: hermite.Scene,
        tree: wp.uint64,
        balls: Balls,
        lights: Lights,
        sky: Sky,
        hits: Hits,
        color: wp.array(dtype=wp.vec3),
        rays: wp.array(dtype=int),
    ):
        i = start + wp.tid()
        ids = wp.zeros(shape=_ROOM, dtype=int)
        t0s = wp.zeros(shape=_ROOM, dtype=float)
        t1s = wp.zeros(shape=_ROOM, dtype=float)
        shade(i, scene, tree, balls, lights, sky, hits, color, rays, ids, t0s, t1s, _ROOM)

    return shade_hits
