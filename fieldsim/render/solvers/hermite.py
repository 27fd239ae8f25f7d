"""First hit of a ray with the surface F = 1: bounded steps (leaps) to a bracket, cubic Hermite pieces for the root.

Along a ray the function g is 2 (sqrt F - 1) outside and log F inside: both vanish at the surface with dg/dF = 1; the
square root is smooth where compact kernels end, and the logarithm stays bounded where F does not. For elements of
positive strength g'' >= -K where F < 1 (see `scene.bounds`), so that g + K t^2 / 2 is convex and lies below its chords.
A *leap* from a node with g < 0 has the length h = sqrt(-2 g / K). If F < 1 at its end, then F < 1 all along it; if
F >= 1, the root between is the first one, because the chord up to it lies below 0. Leaps are long far from a surface,
and on the way past one they shrink no faster than its distance: the result does not depend on a number of samples. (1/r
and 1/r^2 have no finite K next to their skeleton; as K = order / D^2 at the distance D, their leap is h = D s / (1 + s)
with s = sqrt(-2 g / order).) A ray that leads away from the surface tries a longer leap and keeps it if the chord of
its ends still excludes a root.

In the bracket, the roots of ever shorter cubics converge to the true one. The field is evaluated in one place of the
loop; what follows depends on the mode. Neglected: contributions beyond an element's reach, and maxima that rise above
the level by less than the tolerance. Inside a body, on the way out, no bound K is known; `INWARD` times K is used. With
strengths of both signs K is no bound either, and is multiplied by a factor (see `scene.bounds`).

Sherstyuk 1999, chapter 4; Nishimura et al. 1985. Sphere tracing (Hart 1996) leaps by a bound of the slope.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools

import warp as wp

from fieldsim.numerics.roots import cubic_root
from fieldsim.portable import Table, portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.primitives.base import Volume
from fieldsim.potentials.row import KERNEL_WIDTH, NORMAL_X
from fieldsim.render.scene import bounds
from fieldsim.render.scene.tables import NO_HIT, SceneTables

CEILING = wp.constant(1.0e30)  # F is clamped to this, with slope 0: Blinn's exp(256) is beyond float32
NOTHING = wp.constant(1.0e-30)  # F below this counts as 0
CLOSE = wp.constant(1.0e-3)  # of g; from here one Newton step leaves an error far below float32's
ON_SURFACE = wp.constant(1.0e-4)  # of g
EMPTY = wp.constant(-1.9)  # g is below where elements end
INWARD = wp.constant(8.0)
STRETCH = wp.constant(1.8)  # factor of a leap that leads away; must be below 2
PATIENCE = wp.constant(200)  # number of leaps after which a ray takes the longer ones of GRAZING
GRAZING = wp.constant(1.0e-3)  # of g

# Modes of an evaluation: the first one, the end of a leap, an iterate of the root.
_LOOK, _LEAP, _LAND, _ROOT = (wp.constant(k) for k in range(4))
_SLAB = wp.constant(int(Volume.SLAB))
TRIES = wp.constant(12)
_ENDS = wp.constant(bounds.ENDS)


@wp.func
def surface_function(f: float):
    """(g, dg/dF) of the field; see above."""
    if f >= 1.0:
        f = wp.min(f, CEILING)
        return wp.log(f), 1.0 / f
    if f <= NOTHING:
        return -2.0, 0.0
    root = wp.sqrt(f)
    return 2.0 * (root - 1.0), 1.0 / root


@wp.func
def _summit(g0: float, g1: float, drop: float):
    """The greatest value of the chord from g0 to g1 plus a parabola with drop / 4 in its middle."""
    rise = g1 - g0
    if wp.abs(rise) >= drop:
        return wp.max(g0, g1)
    return 0.5 * (g0 + g1) + 0.25 * drop + 0.25 * rise * rise / drop


@wp.func
def _steepness(scene: SceneTables, i: int, d: wp.vec3):
    """An element's bend along a ray relative to its greatest: a plane's field changes along its normal only."""
    if scene.shape[i] != _SLAB:
        return 1.0
    across = d[0] * scene.rows[i, NORMAL_X] + d[1] * scene.rows[i, NORMAL_X + 1] + d[2] * scene.rows[i, NORMAL_X + 2]
    return across * across


def _bends_by_distance(kinds_used):
    return any(formula.kernel.power for formula in registry.formulas_of(kinds_used).values())


@portable
def _width(x: real, y: real, z: real, rows: Table, i: int):
    return rows[i, KERNEL_WIDTH]


@portable
def _reciprocal(x: real, y: real, z: real, rows: Table, i: int):
    return real(1.0) / rows[i, KERNEL_WIDTH]


@functools.cache
def _nearness(kinds_used):
    """Warp function (scene, point, i) -> order / D^2 for elements with that bound, else 0."""
    if not _bends_by_distance(kinds_used):

        @wp.func
        def nothing(scene: SceneTables, p: wp.vec3, d: wp.vec3, i: int):
            return 0.0

        return nothing
    formulas = registry.formulas_of(kinds_used)
    distance = registry.by_kind({kind: known.primitive.distance for kind, known in formulas.items()}).warp(wp.float32)
    softenings = {kind: _reciprocal if known.kernel.reciprocal else _width for kind, known in formulas.items()}
    softening_of = registry.by_kind(softenings).warp(wp.float32)

    @wp.func
    def nearness(scene: SceneTables, p: wp.vec3, d: wp.vec3, i: int):
        if scene.order[i] <= 0:
            return 0.0
        near = distance(p[0], p[1], p[2], scene.rows, scene.kinds, i)
        softening = softening_of(p[0], p[1], p[2], scene.rows, scene.kinds, i)
        steepness = float(scene.order[i]) * _steepness(scene, i, d)
        return steepness / wp.max(near * near + softening * softening, NOTHING)

    return nearness


@wp.func
def _bends(bends: wp.vec2, scene: SceneTables, i: int, d: wp.vec3):
    """(greatest bend, sum of squares of compact kernels' bends) with one more element."""
    bend = scene.bend[i] * _steepness(scene, i, d)
    if scene.order[i] == _ENDS:
        return wp.vec2(bends[0], bends[1] + bend * bend)
    return wp.vec2(wp.max(bends[0], bend), bends[1])


@wp.func
def _together(bends: wp.vec2):
    return bends[0] + wp.sqrt(bends[1])


@wp.func
def _leap(g: float, bend: float, nearness: float, stretch: float):
    """Length of the leap from a node with g < 0."""
    s = wp.sqrt(2.0 * wp.min(-g, 2.0))
    return wp.min(stretch * s / wp.sqrt(wp.max(bend, NOTHING)), s / (wp.sqrt(wp.max(nearness, NOTHING)) * (1.0 + s)))


@wp.func
def _uncounted(scene: SceneTables, elements: int):
    pass


@wp.func
def _counted(scene: SceneTables, elements: int):
    scene.work[0] = scene.work[0] + 1
    scene.work[1] = scene.work[1] + elements


@functools.cache
def first_hit(kinds_used, counted=False):
    """The Warp function that sweeps a ray through sorted intervals, for the given formulas.

    counted: it adds its evaluations to `SceneTables.work`.
    """
    count_work = _counted if counted else _uncounted
    element = registry.element_field(kinds_used).warp(wp.float32)
    nearness_of = _nearness(kinds_used)
    endless = wp.constant(int(_bends_by_distance(kinds_used)))

    @wp.func
    def total(
        scene: SceneTables,
        o: wp.vec3,
        d: wp.vec3,
        t: float,
        since: float,
        head: int,
        ids: wp.array(dtype=int),
        t1s: wp.array(dtype=float),
    ):
        """(g, dg/dt, nearness) at t, of the elements before `head` that have not ended at `since`."""
        p = o + t * d
        f = float(0.0)
        slope = float(0.0)
        active = int(0)
        nearness = float(0.0)
        for k in range(head):
            if t1s[k] > since:
                active += 1
                f_i, x, y, z = element(p[0], p[1], p[2], scene.rows, scene.kinds, ids[k])
                f += f_i
                slope += x * d[0] + y * d[1] + z * d[2]
                nearness = wp.max(nearness, nearness_of(scene, p, d, ids[k]))
        count_work(scene, active)
        if not (f < CEILING):
            return wp.log(CEILING), 0.0, nearness
        g, rise = surface_function(f)
        return g, slope * rise, nearness

    @wp.func
    def plan(
        scene: SceneTables,
        d: wp.vec3,
        t: float,
        g: float,
        nearness: float,
        stretch: float,
        entered: int,
        count: int,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
    ):
        """(end of the leap from t, bend on the way, elements entered by then, where all of those have ended)."""
        head = int(entered)
        bends = wp.vec2(0.0, 0.0)
        leave = float(t)
        for k in range(head):
            if t1s[k] > t:
                bends = _bends(bends, scene, ids[k], d)
                leave = wp.max(leave, t1s[k])
        node = t + _leap(g, _together(bends), nearness, stretch)
        # An element entered on the way may be sharper; then its bend limits the leap, but not before its entry.
        while head < count and t0s[wp.min(head, count - 1)] < node:
            sharper = _bends(bends, scene, ids[head], d)
            if sharper[0] > bends[0] or sharper[1] > bends[1]:
                node = wp.min(node, wp.max(t0s[head], t + _leap(g, _together(sharper), nearness, stretch)))
                if t0s[head] >= node:
                    break
                bends = sharper
            leave = wp.max(leave, t1s[head])
            head += 1
        # Far away float32 may not resolve a leap.
        return wp.max(node, t + 1.0e-6 * wp.abs(t)), _together(bends), head, leave

    @wp.func
    def sweep(
        scene: SceneTables,
        o: wp.vec3,
        d: wp.vec3,
        begin: float,
        end: float,
        known_side: float,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        count: int,
    ):
        """(t of the first hit in begin..end or NO_HIT, side).

        known_side: -1 outside, looking for an entry; 1 inside, looking for the exit; 0 unknown, decided by the field.
        """
        hit = float(NO_HIT)
        side = float(known_side)
        sharpness = float(1.0)
        t = float(begin)
        t_e = float(begin)
        node = float(begin)
        leave = float(begin)
        bend = float(0.0)
        near = float(0.0)
        stretch = float(1.0)
        g = float(0.0)
        s = float(0.0)
        right = float(0.0)
        g_right = float(0.0)
        s_right = float(0.0)
        head = int(0)
        tries = int(0)
        leaps = int(0)
        mode = int(_LOOK)
        while True:
            if mode == _LOOK:
                leave = t
                while head < count and t0s[wp.min(head, count - 1)] <= t:
                    head += 1
                for k in range(head):
                    leave = wp.max(leave, t1s[k])
                if leave <= t:
                    # A gap without elements: go on to the next entry; compact kernels need no evaluation there.
                    if head >= count or t0s[wp.min(head, count - 1)] >= end:
                        break
                    t = t0s[head]
                    side = wp.where(side == 0.0, -1.0, side)
                    if endless == 0:
                        head += 1
                        g = EMPTY
                        s = 0.0
                        stretch = 1.0
                        mode = _LEAP
                    continue
                t_e = t
            if mode == _LEAP:
                sharpness = wp.where(side > 0.0, INWARD, 1.0)
                least = wp.where(leaps < PATIENCE, scene.tolerance, GRAZING)
                leaps += 1
                look = wp.min(g, -least) / sharpness
                node, bend, head, leave = plan(scene, d, t, look, near, stretch, head, count, ids, t0s, t1s)
                if node >= leave and leave < end and side < 0.0:
                    # The leap passes the end of all its elements: F < 1 up to there, without an evaluation.
                    t = leave
                    mode = _LOOK
                    continue
                node = wp.min(node, end)
                t_e = node
                mode = _LAND
            g_e, s_e, near_e = total(scene, o, d, t_e, t, head, ids, t1s)
            if side == 0.0:
                side = wp.where(g_e < 0.0, -1.0, 1.0)
            g_e *= -side
            s_e *= -side
            if mode == _LOOK:
                # A ray that starts on the surface counts as on its own side of it.
                g = wp.min(g_e, -ON_SURFACE)
                s = s_e
                near = near_e
                mode = _LEAP
                continue
            if mode == _LAND:
                if stretch > 1.0:
                    h = node - t
                    close = 1.0 - h * wp.sqrt(near)
                    sharp = sharpness * wp.max(bend, near / (close * close))
                    if g_e >= 0.0 or _summit(g, g_e, 0.5 * sharp * h * h) >= 0.0:
                        stretch = 1.0
                        mode = _LEAP
                        continue
                right = t_e
                g_right = g_e
                s_right = s_e
                if g_e < 0.0:
                    t = right
                    g = g_right
                    s = s_right
                    near = near_e
                    stretch = wp.where(s <= 0.0, STRETCH, 1.0)
                    if t >= end:
                        break
                    mode = _LEAP
                    continue
                mode = _ROOT
                tries = 0
            else:
                tries += 1
                if wp.abs(g_e) < CLOSE or tries == TRIES:
                    hit = t_e
                    if s_e > 0.0:
                        hit = wp.clamp(t_e - g_e / s_e, t, right)
                    break
                if g_e < 0.0:
                    t = t_e
                    g = g_e
                    s = s_e
                else:
                    right = t_e
                    g_right = g_e
                    s_right = s_e
            h = right - t
            t_e = t + h * cubic_root(g, s * h, g_right, s_right * h)
        return hit, side

    return sweep
