"""Reflection and refraction: secondary rays of mirrors and glass, Fresnel's and Snell's laws.

At a hit the light towards the eye has three parts: reflected, transmitted, and the surface's own shading by lights and
sky. The transmitted part is tinted on entry and refracted by Snell's law; Fresnel's law reflects a share of it, all of
it beyond the critical angle. Whitted 1980; Born & Wolf 1999, 1.5.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a branch change

import functools

import warp as wp

from fieldsim.render.scene.hits import Balls, Hits, above, origin_of
from fieldsim.render.scene.intervals import FULL, REFLECTED, ball_ahead, collect_intervals
from fieldsim.render.scene.tables import NO_HIT, SceneTables
from fieldsim.render.solvers import hermite
from fieldsim.render.solvers.primary import OVERFLOW, recorder

DEEPEST = 12  # reflections and refractions of a ray
_FAINT = wp.constant(1.0 / 512.0)  # share of white below which a ray is not followed
_ROOM = wp.constant(64)  # intervals of a ray in local memory


@wp.func
def fresnel(cosine: float, eta: float):
    """Fresnel reflectance of unpolarised light at an angle of incidence; eta: index of refraction ahead by behind."""
    root = eta * eta - 1.0 + cosine * cosine
    if root <= 0.0:
        return 1.0
    g = wp.sqrt(root)
    across = (cosine - g) / (cosine + g)
    # The same with each cosine by the other medium's index.
    along = (eta * eta * cosine - g) / (eta * eta * cosine + g)
    return 0.5 * (across * across + along * along)


@wp.func
def refracted(d: wp.vec3, n: wp.vec3, eta: float):
    """Direction of the refracted ray (Snell's law); n: normal, facing d. Not beyond the critical angle."""
    cosine = -wp.dot(d, n)
    root = wp.sqrt(wp.max(eta * eta - 1.0 + cosine * cosine, 0.0))
    return wp.normalize((d + (cosine - root) * n) / eta)


@wp.func
def _ratio(optics: wp.vec4):
    """Index of refraction ahead by behind."""
    return wp.where(optics[3] > 0.0, 1.0 / optics[2], optics[2])


@wp.kernel(enable_backward=False)
def part(start: int, hits: Hits, mirrored: wp.array(dtype=wp.vec3), let_in: wp.array(dtype=wp.vec3)):
    """Split the light: weights of reflected and transmitted rays; reduces ambient and diffuse factors by the rest."""
    i = start + wp.tid()
    mirrored[i] = wp.vec3(0.0, 0.0, 0.0)
    let_in[i] = wp.vec3(0.0, 0.0, 0.0)
    if hits.thing[i] < 0:
        return
    optics = hits.optics[i]
    if optics[0] <= 0.0 and optics[1] <= 0.0:
        return
    share = fresnel(-wp.dot(hits.direction[i], hits.normal[i]), _ratio(optics))
    clear = (1.0 - optics[0]) * optics[1]
    mirror = optics[0] + clear * share
    mirrored[i] = wp.vec3(mirror, mirror, mirror)
    tint = hits.color[i]
    if optics[3] > 0.0:
        # Light is tinted once, on its way in.
        tint = wp.vec3(1.0, 1.0, 1.0)
    let_in[i] = clear * (1.0 - share) * tint
    light = hits.light[i]
    own = (1.0 - optics[0]) * (1.0 - optics[1])
    hits.light[i] = wp.vec4(own * light[0], own * light[1], light[2], light[3])


@wp.kernel(enable_backward=False)
def worth(start: int, share: wp.array(dtype=wp.vec3), weight: wp.array(dtype=float), follow: wp.array(dtype=int)):
    """Whether a secondary ray has enough weight in the picture."""
    i = start + wp.tid()
    follow[i] = wp.where(weight[i] * wp.max(share[i]) > _FAINT, 1, 0)


@wp.func
def _slot_of(i: int, slots: wp.array(dtype=int)):
    """The slot of the ray that hit i sends on, -1 for none; slots: how many the hits up to each one send."""
    before = int(0)
    if i > 0:
        before = slots[i - 1]
    return wp.where(slots[i] > before, before, -1)


@wp.kernel(enable_backward=False)
def send(
    start: int,
    ray: int,
    slot: wp.array(dtype=int),
    share: wp.array(dtype=wp.vec3),
    weight: wp.array(dtype=float),
    hits: Hits,
    onward: Hits,
    onward_weight: wp.array(dtype=float),
):
    """Start the rays that have enough weight, each in its slot."""
    i = start + wp.tid()
    k = _slot_of(i, slot)
    if k < 0:
        return
    d = hits.direction[i]
    n = hits.normal[i]
    if ray == REFLECTED:
        onward.origin[k] = above(i, hits)
        onward.direction[k] = wp.normalize(d - 2.0 * wp.dot(d, n) * n)
    else:
        onward.origin[k] = origin_of(i, hits) + hits.depth[i] * d - hits.lift[i] * n
        onward.direction[k] = refracted(d, n, _ratio(hits.optics[i]))
    onward_weight[k] = weight[i] * wp.max(share[i])


@wp.kernel(enable_backward=False)
def bring_back(
    start: int,
    slot: wp.array(dtype=int),
    share: wp.array(dtype=wp.vec3),
    found: wp.array(dtype=wp.vec3),
    color: wp.array(dtype=wp.vec3),
):
    """Add the colours of secondary rays, each times its share."""
    i = start + wp.tid()
    k = _slot_of(i, slot)
    if k >= 0:
        color[i] = color[i] + wp.cw_mul(share[i], found[k])


@functools.cache
def ray_kernel(kinds_used, in_scratch=False):
    """The kernel that traces rays from `Hits.origin`. in_scratch: see `lights.kernel_around`."""
    sweep = hermite.first_hit(kinds_used)
    record = recorder(kinds_used)

    @wp.func
    def trace(
        i: int,
        ray: int,
        scene: SceneTables,
        tree: wp.uint64,
        balls: Balls,
        hits: Hits,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        room: int,
    ):
        o = hits.origin[i]
        d = hits.direction[i]
        far, ball = ball_ahead(o, d, balls)
        count = collect_intervals(scene, tree, o, d, far, ray, False, ids, t0s, t1s, room)
        hit = float(NO_HIT)
        side = float(0.0)
        if count == FULL:
            hit = float(OVERFLOW)
        elif count > 0:
            hit, side = sweep(scene, o, d, 0.0, far, 0.0, ids, t0s, t1s, count)
        record(i, d, wp.vec3d(d), hit, side, far, ball, scene, balls, hits, ids, t1s, count)

    if in_scratch:

        @wp.kernel(module="unique", enable_backward=False)
        def trace_in_scratch(
            start: int,
            ray: int,
            scene: SceneTables,
            tree: wp.uint64,
            balls: Balls,
            which: wp.array(dtype=int),
            hits: Hits,
            ids: wp.array2d(dtype=int),
            t0s: wp.array2d(dtype=float),
            t1s: wp.array2d(dtype=float),
        ):
            k = start + wp.tid()
            trace(which[k], ray, scene, tree, balls, hits, ids[k], t0s[k], t1s[k], ids.shape[1])

        return trace_in_scratch

    @wp.kernel(module="unique", enable_backward=False)
    def trace_rays(start: int, ray: int, scene: SceneTables, tree: wp.uint64, balls: Balls, hits: Hits):
        i = start + wp.tid()
        ids = wp.zeros(shape=_ROOM, dtype=int)
        t0s = wp.zeros(shape=_ROOM, dtype=float)
        t1s = wp.zeros(shape=_ROOM, dtype=float)
        trace(i, ray, scene, tree, balls, hits, ids, t0s, t1s, _ROOM)

    return trace_rays
