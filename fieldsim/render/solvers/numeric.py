"""Bracketing on the true field: samples along sorted intervals, and regula falsi where the sign changes.

The Illinois variant (Dowell & Jarratt 1971). What the thesis calls numerical root finding: right wherever the surface
is not crossed twice between two samples, at many evaluations of the field.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools

import warp as wp

from fieldsim.potentials import registry
from fieldsim.render.scene.tables import NO_HIT, SceneTables

SAMPLES = wp.constant(6.0)  # per kernel width
_HIGH = wp.constant(3.0)  # F - 1 is clamped to this: the steep inside would only slow regula falsi down
_CLOSE = wp.constant(1.0e-6)
_TRIES = wp.constant(40)


@functools.cache
def first_hit(kinds_used):
    """The Warp function that sweeps a ray through sorted intervals, for the given formulas."""
    element = registry.element_field(kinds_used).warp(wp.float32)

    @wp.func
    def excess(
        scene: SceneTables,
        o: wp.vec3,
        d: wp.vec3,
        t: float,
        since: float,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        count: int,
    ):
        """F - 1 at t, of the elements whose intervals hold `since`."""
        p = o + t * d
        f = float(-1.0)
        for k in range(count):
            if t0s[k] <= since and t1s[k] > since:
                f_i, _x, _y, _z = element(p[0], p[1], p[2], scene.rows, scene.kinds, ids[k])
                f += f_i
        return wp.min(f, _HIGH)

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
        """(t of the first hit in begin..end or NO_HIT, side); see `hermite.first_hit`."""
        side = float(known_side)
        t = float(begin)
        before = float(-1.0)
        while t < end:
            # The next sample, no later than the next entry or exit.
            step = float(end - t)
            active = int(0)
            for k in range(count):
                if t0s[k] > t:
                    step = wp.min(step, t0s[k] - t)
                elif t1s[k] > t:
                    step = wp.min(step, wp.min(t1s[k] - t, scene.width[ids[k]] / SAMPLES))
                    active += 1
            right = wp.min(wp.max(t + step, t + 1.0e-6 * wp.abs(t)), end)
            if active > 0 or side == 0.0:
                value = excess(scene, o, d, t, t, ids, t0s, t1s, count)
                if side == 0.0:
                    side = wp.where(value < 0.0, -1.0, 1.0)
                before = wp.min(-side * value, -1.0e-7)
                after = -side * excess(scene, o, d, right, t, ids, t0s, t1s, count)
                if after >= 0.0:
                    low = float(t)
                    high = float(right)
                    middle = float(right)
                    stayed = float(0.0)
                    for _k in range(_TRIES):
                        middle = high - (high - low) * after / (after - before)
                        f = -side * excess(scene, o, d, middle, t, ids, t0s, t1s, count)
                        if wp.abs(f) < _CLOSE or middle <= low or middle >= high:
                            break
                        # Illinois: halve the value at an end that stays twice in a row.
                        if f < 0.0:
                            low = middle
                            before = f
                            after *= wp.where(stayed > 0.0, 0.5, 1.0)
                            stayed = 1.0
                        else:
                            high = middle
                            after = f
                            before *= wp.where(stayed < 0.0, 0.5, 1.0)
                            stayed = -1.0
                    return middle, side
            t = right
        return float(NO_HIT), side

    return sweep
