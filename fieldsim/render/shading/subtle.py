"""Shading with soft and coloured shadows: lights with an extent, transparent bodies, bodies that cast no shadow.

Shadow rays go to points spread evenly over a light, rotated at random from sample to sample; if the first few agree, no
more are sent. Light through a transparent body is reduced by reflection and tinted; it is not refracted.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools

import warp as wp

from fieldsim.numerics.constants import TAU
from fieldsim.potentials import registry
from fieldsim.render.materials.textures import color_at
from fieldsim.render.scene.hits import Balls, Hits, Lights, above, towards
from fieldsim.render.scene.intervals import FULL, SHADOW, collect_intervals
from fieldsim.render.scene.tables import SceneTables
from fieldsim.render.shading.lights import ball_shadow, kernel_around, lit, unlit
from fieldsim.render.shading.sky import Sky
from fieldsim.render.solids.overlay import Shapes, shape_light
from fieldsim.render.solvers import hermite

_ROOM = wp.constant(64)  # intervals of a shadow ray in local memory
_CROSSINGS = wp.constant(64)  # greatest number of surfaces that light crosses
_DARK = wp.constant(1.0 / 512.0)
# Fractions of the plastic number: points that fill a square evenly, however many (Roberts 2018).
_ACROSS, _ROUND = wp.constant(0.7548776662466927), wp.constant(0.5698402909980532)


@wp.func
def aimed(p: wp.vec3, light: int, k: int, i: int, lights: Lights):
    """(unit direction, distance) from p to the k-th point of a light, for sample i."""
    where = lights.where[light]
    size = lights.size[light]
    if size > 0.0:
        state = wp.rand_init(lights.seed * 4099 + light, i)
        turn = float(k) * _ROUND + wp.randf(state)
        share = float(k) * _ACROSS + wp.randf(state)
        out = size * wp.sqrt(share - wp.floor(share))
        axis, _distance = towards(p, where)
        other = wp.where(wp.abs(axis[0]) < 0.6, wp.vec3(1.0, 0.0, 0.0), wp.vec3(0.0, 1.0, 0.0))
        right = wp.normalize(wp.cross(axis, other))
        aside = out * (wp.cos(TAU * turn) * right + wp.sin(TAU * turn) * wp.cross(axis, right))
        where = where + wp.vec4(aside[0], aside[1], aside[2], 0.0)
    return towards(p, where)


@functools.cache
def shade_kernel(kinds_used, in_scratch=False):
    """The kernel that shades hits; in_scratch: see `lights.kernel_around`."""
    sweep = hermite.first_hit(kinds_used)
    element = registry.element_field(kinds_used).warp(wp.float32)

    @wp.func
    def let_in(
        p: wp.vec3,
        t: float,
        scene: SceneTables,
        ids: wp.array(dtype=int),
        t1s: wp.array(dtype=float),
        count: int,
    ):
        """Share of white light, by colour, that a surface at p transmits; materials mixed by weight."""
        f = float(0.0)
        light = wp.vec3(0.0, 0.0, 0.0)
        for k in range(count):
            if t1s[k] >= t:
                j = ids[k]
                f_j, _x, _y, _z = element(p[0], p[1], p[2], scene.rows, scene.kinds, j)
                optics = scene.optics[scene.owner[j]]
                f += f_j
                light += f_j * (1.0 - optics[0]) * optics[1] * color_at(scene, scene.owner[j], j, p)
        return light / wp.max(f, 1.0e-30)

    @wp.func
    def through(
        scene: SceneTables,
        tree: wp.uint64,
        o: wp.vec3,
        d: wp.vec3,
        far: float,
        lift: float,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        room: int,
    ):
        """Share of white light that convolution surfaces transmit along a ray; negative if the intervals do not fit."""
        count = collect_intervals(scene, tree, o, d, far, SHADOW, False, ids, t0s, t1s, room)
        light = wp.vec3(1.0, 1.0, 1.0)
        if count == FULL:
            return -light
        begin = float(0.0)
        for _crossing in range(_CROSSINGS):
            if count == 0:
                break
            hit, side = sweep(scene, o, d, begin, far, 0.0, ids, t0s, t1s, count)
            if hit < 0.0:
                break
            if side < 0.0:
                light = wp.cw_mul(light, let_in(o + hit * d, hit, scene, ids, t1s, count))
                if wp.max(light) < _DARK:
                    return wp.vec3(0.0, 0.0, 0.0)
            begin = hit + lift
        return light

    @wp.func
    def arriving(
        i: int,
        p: wp.vec3,
        toward: wp.vec3,
        far: float,
        scene: SceneTables,
        tree: wp.uint64,
        balls: Balls,
        shapes: Shapes,
        hits: Hits,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        room: int,
    ):
        """Share of white light that arrives from a light; negative if the intervals do not fit."""
        if ball_shadow(p, toward, far, balls):
            return wp.vec3(0.0, 0.0, 0.0)
        light = shape_light(p, toward, far, shapes)
        if wp.max(light) > _DARK:
            rest = through(scene, tree, p, toward, far, hits.lift[i], ids, t0s, t1s, room)
            light = wp.cw_mul(light, rest)
        return light

    @wp.func
    def shade(
        i: int,
        scene: SceneTables,
        tree: wp.uint64,
        balls: Balls,
        shapes: Shapes,
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
        color[i] = unlit(i, hits, sky)
        rays[i] = 0
        if hits.thing[i] == -1:
            return
        p = above(i, hits)
        cast = int(0)
        result = color[i]
        for k in range(lights.where.shape[0]):
            sent = int(0)
            dark = int(0)
            clear = int(0)
            most = (lights.samples[k] + lights.share - 1) / lights.share
            # After so many shadow rays that agree (all lit or all dark), no more are sent to a light.
            enough = most / 4 + 2
            sum = wp.vec3(0.0, 0.0, 0.0)
            while sent < most:
                toward, far = aimed(p, k, sent, i, lights)
                sent += 1
                if wp.dot(hits.normal[i], toward) <= 0.0:
                    dark += 1
                else:
                    light = wp.vec3(1.0, 1.0, 1.0)
                    if lights.shadows[k] == 1:
                        cast += 1
                        light = arriving(i, p, toward, far, scene, tree, balls, shapes, hits, ids, t0s, t1s, room)
                        if light[0] < 0.0:
                            rays[i] = -1
                            return
                    sum += wp.cw_mul(light, lit(i, toward, lights.color[k], hits))
                    dark += wp.where(wp.max(light) < _DARK, 1, 0)
                    clear += wp.where(wp.min(light) > 1.0 - _DARK, 1, 0)
                if sent == enough and (dark == sent or clear == sent):
                    break
            result += sum / float(sent)
        color[i] = result
        rays[i] = cast

    return kernel_around(shade, in_scratch)
