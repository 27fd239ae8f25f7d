"""Lights and shadows: from hits to linear colours."""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools
import math

import numpy as np
import warp as wp

from fieldsim.render.scene.hits import Balls, Hits, Lights, above, behind_shape, towards
from fieldsim.render.scene.intervals import BLOCKED, FULL, SHADOW, collect_intervals
from fieldsim.render.scene.tables import SceneTables
from fieldsim.render.scene.volumes import pierce_sphere
from fieldsim.render.shading.sky import Sky, background
from fieldsim.render.solids.overlay import Shapes
from fieldsim.render.solvers import hermite
from fieldsim.world.light import DirectionalLight

_ROOM = wp.constant(64)  # intervals of a shadow ray in local memory


@wp.func
def ball_shadow(o: wp.vec3, d: wp.vec3, far: float, balls: Balls):
    """Whether a particle, other than one on which o lies, blocks a ray."""
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
    """The colour of a sample without lights: the sky, or its ambient light on a surface."""
    if hits.thing[i] == -1:
        return background(hits.direction[i], sky)
    u = 0.5 + 0.5 * hits.normal[i][2]
    ambient = sky.ambient_bottom + u * (sky.ambient_top - sky.ambient_bottom)
    return hits.light[i][0] * wp.cw_mul(hits.color[i], ambient)


@wp.func
def lit(i: int, toward: wp.vec3, light: wp.vec3, hits: Hits):
    """Diffuse and specular light of one light source on a surface that faces it."""
    n = hits.normal[i]
    factors = hits.light[i]
    half = wp.normalize(toward - hits.direction[i])
    gloss = factors[2] * wp.pow(wp.max(wp.dot(n, half), 0.0), factors[3])
    return wp.dot(n, toward) * wp.cw_mul(light, factors[1] * hits.color[i] + wp.vec3(gloss, gloss, gloss))


def lights_of(lights, eye, unit, shadows, device) -> Lights:
    """Lights on a device, relative to the eye."""
    where, size = np.zeros((len(lights), 4)), np.zeros(len(lights))
    for k, light in enumerate(lights):
        if isinstance(light, DirectionalLight):
            where[k, :3] = -np.array(light.direction)
            size[k] = math.tan(math.radians(0.5 * light.angle))
        else:
            where[k, :3] = (np.array(light.position) - eye) / unit
            where[k, 3], size[k] = 1.0, light.radius / unit
    samples = [light.samples if wide else 1 for light, wide in zip(lights, size > 0.0, strict=True)]
    result = Lights()
    result.where = wp.array(where, dtype=wp.vec4, device=device)
    result.color = wp.array(np.array([light.rgb for light in lights]).reshape(-1, 3), dtype=wp.vec3, device=device)
    result.shadows = wp.array([int(shadows and light.shadows) for light in lights], dtype=int, device=device)
    result.size = wp.array(size, dtype=float, device=device)
    result.samples = wp.array(samples, dtype=int, device=device)
    result.share, result.seed = 1, 0
    return result


def kernel_around(shade, in_scratch):
    """The kernel of a function that shades a sample.

    in_scratch: intervals live in global memory, with room for all elements, and only some samples are shaded.
    """
    if in_scratch:

        @wp.kernel(module="unique", enable_backward=False)
        def shade_in_scratch(
            start: int,
            scene: SceneTables,
            tree: wp.uint64,
            balls: Balls,
            shapes: Shapes,
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
            shade(i, scene, tree, balls, shapes, lights, sky, hits, color, rays, ids[k], t0s[k], t1s[k], ids.shape[1])

        return shade_in_scratch

    @wp.kernel(module="unique", enable_backward=False)
    def shade_hits(
        start: int,
        scene: SceneTables,
        tree: wp.uint64,
        balls: Balls,
        shapes: Shapes,
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
        shade(i, scene, tree, balls, shapes, lights, sky, hits, color, rays, ids, t0s, t1s, _ROOM)

    return shade_hits


@functools.cache
def shade_kernel(kinds_used, in_scratch=False):
    """The kernel that shades hits; in_scratch: see `kernel_around`."""
    sweep = hermite.first_hit(kinds_used)

    @wp.func
    def surface_shadow(
        scene: SceneTables,
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
        count = collect_intervals(scene, tree, o, d, far, SHADOW, True, ids, t0s, t1s, room)
        if count == FULL:
            return -1
        if count <= 0:
            return wp.where(count == BLOCKED, 1, 0)
        hit, _side = sweep(scene, o, d, 0.0, far, -1.0, ids, t0s, t1s, count)
        return wp.where(hit >= 0.0, 1, 0)

    @wp.func
    def shade(
        i: int,
        scene: SceneTables,
        tree: wp.uint64,
        balls: Balls,
        _shapes: Shapes,
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
            p = above(i, hits)
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

    return kernel_around(shade, in_scratch)
