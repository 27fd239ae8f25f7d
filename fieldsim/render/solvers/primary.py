"""Primary rays: the first hit of each sample of the picture among its tile's candidates, and its description."""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools

import warp as wp

from fieldsim.potentials import registry
from fieldsim.render.materials.table import factors
from fieldsim.render.materials.textures import color_at
from fieldsim.render.scene.candidates import TILE, Candidates, View, exact_direction, ray_direction
from fieldsim.render.scene.hits import BALLS, Balls, Hits, origin_of, write_rest
from fieldsim.render.scene.intervals import insert, keep_after
from fieldsim.render.scene.tables import FOREVER, NO_HIT, SceneTables
from fieldsim.render.scene.volumes import pierce, pierce_sphere
from fieldsim.render.solvers import hermite

_ROOM = wp.constant(32)  # intervals of a ray in local memory
_POLISH = wp.constant(3)  # greatest number of Newton steps in float64
_SMALL = wp.constant(wp.float64(1e-2))  # in units of the longest step: a step shorter than this is the last
_GRAZING = wp.constant(wp.float64(0.002))  # sine of the angle at which a ray grazes
OVERFLOW = wp.constant(-2)  # a `thing`: the intervals that overlap did not fit


@wp.func
def nearest_ball(d: wp.vec3, tile: int, lists: Candidates, balls: Balls):
    """(t, index) of the first particle that a ray from the eye hits; t = FOREVER for none."""
    best = float(FOREVER)
    which = int(-1)
    zero = wp.vec3(0.0, 0.0, 0.0)
    for k in range(lists.first[tile], lists.first[tile + 1]):
        i = lists.ids[k]
        if lists.near[i] > best:
            break
        t0, t1 = pierce_sphere(zero, d, balls.center[i], balls.radius[i])
        # A ray that starts in a particle hits its far side.
        t = wp.where(t0 > 0.0, t0, t1)
        if t > 0.0 and t < best:
            best = t
            which = i
    return best, which


@wp.func
def record_ball(i: int, t: float, ball: int, balls: Balls, hits: Hits):
    """Record that sample i hits a particle at t."""
    hits.depth[i] = t
    hits.thing[i] = BALLS + ball
    hits.normal[i] = wp.normalize(origin_of(i, hits) + t * hits.direction[i] - balls.center[ball])
    hits.color[i] = balls.color[ball]
    hits.light[i] = wp.vec4(1.0, 0.9, 0.25, 40.0)
    hits.lift[i] = 1.0e-3 * balls.radius[ball]
    if hits.optics.shape[0] > 0:
        hits.optics[i] = wp.vec4(0.0, 0.0, 1.0, 0.0)


@wp.func
def _ray_alone(scene: SceneTables, hits: Hits, i: int):
    return scene


@wp.func
def _ray_counted(scene: SceneTables, hits: Hits, i: int):
    scene.work = hits.work[i]
    return scene


@wp.func
def _unweighed(hits: Hits, i: int, material: int, weight: float):
    pass


@wp.func
def _weighed(hits: Hits, i: int, material: int, weight: float):
    hits.weights[i, material] = hits.weights[i, material] + weight


@functools.cache
def recorder(kinds_used, layered=False, polish=0.01):
    """The Warp function that records a hit on the surface.

    layered: adds to `Hits.weights`; polish: how far a last Newton step may move a hit, in widths of its kernel.
    """
    element = registry.element_field(kinds_used).warp(wp.float64)
    weigh = _weighed if layered else _unweighed

    @wp.func
    def describe(
        i: int,
        found: float,
        side: float,
        d: wp.vec3d,
        scene: SceneTables,
        hits: Hits,
        ids: wp.array(dtype=int),
        t1s: wp.array(dtype=float),
        count: int,
    ):
        """Record depth, normal and material at a hit: sums gradients and mixes materials by their elements' fields.

        The last steps to the root are Newton's, in float64.
        """
        o = wp.vec3d(origin_of(i, hits))
        t = wp.float64(found)
        slope = wp.vec3d()
        width = float(0.0)
        for step in range(_POLISH):
            f = wp.float64(0.0)
            slope = wp.vec3d()
            color = wp.vec3(0.0, 0.0, 0.0)
            light = wp.vec4(0.0, 0.0, 0.0, 0.0)
            optics = wp.vec4(0.0, 0.0, 0.0, 0.0)
            most = wp.float64(-1.0)
            p = o + t * d
            here = wp.vec3(p)
            for k in range(count):
                if t1s[k] >= found:
                    j = ids[k]
                    f_j, x, y, z = element(p[0], p[1], p[2], scene.exact, scene.kinds, j)
                    m = scene.owner[j]
                    f += f_j
                    slope += wp.vec3d(x, y, z)
                    share = float(f_j)
                    if step == 0:
                        weigh(hits, i, m, share)
                    color += share * color_at(scene, m, j, here)
                    light += share * factors(scene.materials, m)
                    optics += share * scene.optics[m]
                    if f_j > most:
                        most = f_j
                        hits.thing[i] = m
                        width = scene.width[j]
            hits.color[i] = color / float(f)
            hits.light[i] = light / float(f)
            if hits.optics.shape[0] > 0:
                hits.optics[i] = optics / float(f) + wp.vec4(0.0, 0.0, 0.0, wp.max(side, 0.0))
            # At a grazing ray the slope is too small for a Newton step.
            along = wp.dot(slope, d) * wp.float64(side)
            if along > -_GRAZING * wp.length(slope):
                break
            limit = wp.float64(polish * width)
            move = wp.clamp(wp.float64(side) * (wp.float64(1.0) - f) / along, -limit, limit)
            t += move
            if wp.abs(move) <= _SMALL * limit:
                break
        hits.depth[i] = float(t)
        write_rest(i, float(t - wp.float64(hits.depth[i])), hits)
        hits.normal[i] = side * wp.vec3(wp.normalize(slope))
        hits.lift[i] = 2.0e-3 * width

    @wp.func
    def record(
        i: int,
        d: wp.vec3,
        exact: wp.vec3d,
        hit: float,
        side: float,
        far: float,
        ball: int,
        scene: SceneTables,
        balls: Balls,
        hits: Hits,
        ids: wp.array(dtype=int),
        t1s: wp.array(dtype=float),
        count: int,
    ):
        hits.direction[i] = d
        hits.depth[i] = hit
        hits.thing[i] = -1
        hits.normal[i] = wp.vec3(0.0, 0.0, 0.0)
        if hit == OVERFLOW:
            hits.thing[i] = OVERFLOW
        elif hit >= 0.0:
            describe(i, hit, side, exact, scene, hits, ids, t1s, count)
        elif ball >= 0:
            record_ball(i, far, ball, balls, hits)

    return record


@functools.cache
def trace_kernel(kinds_used, in_scratch=False, layered=False, first_hit=hermite.first_hit, polish=0.01):
    """The kernel that traces samples.

    in_scratch: intervals live in global memory, with room for all elements; layered: adds to `Hits.work` and
    `Hits.weights`. first_hit: makes the sweep; polish: see `recorder`.
    """
    sweep = first_hit(kinds_used, True) if layered else first_hit(kinds_used)
    of_ray = _ray_counted if layered else _ray_alone
    record = recorder(kinds_used, layered, polish)

    @wp.func
    def first_surface(
        d: wp.vec3,
        far: float,
        tile: int,
        scene: SceneTables,
        lists: Candidates,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        room: int,
    ):
        """(t, side, count) of the first hit before `far`; t is NO_HIT for none and OVERFLOW where intervals do not fit.

        The tile's candidates are processed in windows: as many as fit, up to the near distance of the next one.
        """
        o = wp.vec3(0.0, 0.0, 0.0)
        cursor = int(lists.first[tile])
        last = lists.first[tile + 1]
        hit = float(NO_HIT)
        side = float(0.0)
        begin = float(0.0)
        count = int(0)
        while begin < far:
            count = keep_after(ids, t0s, t1s, count, begin)
            while cursor < last and count < room:
                i = lists.ids[cursor]
                if lists.near[i] >= far:
                    cursor = last
                    break
                t0, t1 = pierce(o, d, scene.shape[i], scene.rows, i, scene.reach[i])
                if t1 > begin and t0 < t1 and t0 < far:
                    count = insert(ids, t0s, t1s, count, i, t0, t1)
                cursor += 1
            end = float(far)
            if cursor < last:
                end = wp.min(far, lists.near[lists.ids[cursor]])
            if end <= begin:
                hit = float(OVERFLOW)
                break
            if count > 0:
                hit, side = sweep(scene, o, d, begin, end, side, ids, t0s, t1s, count)
            if hit >= 0.0:
                break
            begin = float(end)
        return hit, side, count

    @wp.func
    def trace(
        i: int,
        view: View,
        scene: SceneTables,
        lists: Candidates,
        balls: Balls,
        ball_lists: Candidates,
        samples: wp.array(dtype=wp.vec2),
        hits: Hits,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        room: int,
    ):
        s = samples[i]
        d = ray_direction(view, s[0], s[1])
        tile = int(s[1]) // TILE * view.tiles + int(s[0]) // TILE
        far, ball = nearest_ball(d, tile, ball_lists, balls)
        hit, side, count = first_surface(d, far, tile, of_ray(scene, hits, i), lists, ids, t0s, t1s, room)
        exact = exact_direction(view, s[0], s[1])
        record(i, d, exact, hit, side, far, ball, scene, balls, hits, ids, t1s, count)

    if in_scratch:

        @wp.kernel(module="unique", enable_backward=False)
        def trace_in_scratch(
            start: int,
            view: View,
            scene: SceneTables,
            lists: Candidates,
            balls: Balls,
            ball_lists: Candidates,
            which: wp.array(dtype=int),
            samples: wp.array(dtype=wp.vec2),
            hits: Hits,
            ids: wp.array2d(dtype=int),
            t0s: wp.array2d(dtype=float),
            t1s: wp.array2d(dtype=float),
        ):
            k = start + wp.tid()
            i = which[k]
            trace(i, view, scene, lists, balls, ball_lists, samples, hits, ids[k], t0s[k], t1s[k], ids.shape[1])

        return trace_in_scratch

    @wp.kernel(module="unique", enable_backward=False)
    def trace_samples(
        start: int,
        view: View,
        scene: SceneTables,
        lists: Candidates,
        balls: Balls,
        ball_lists: Candidates,
        samples: wp.array(dtype=wp.vec2),
        hits: Hits,
    ):
        i = start + wp.tid()
        ids = wp.zeros(shape=_ROOM, dtype=int)
        t0s = wp.zeros(shape=_ROOM, dtype=float)
        t1s = wp.zeros(shape=_ROOM, dtype=float)
        trace(i, view, scene, lists, balls, ball_lists, samples, hits, ids, t0s, t1s, _ROOM)

    return trace_samples
