"""Quartics along the ray, each through five equally spaced samples of one element's field (McCormack & Sherstyuk 1998).

As published there is one quartic for all of an element's interval, which is some four kernel widths long for a point.
Longer intervals, along segments or of kernels with long tails, are divided evenly, as in the thesis (Sherstyuk 1999,
figure 4.5). The error is not controlled and the true field is not evaluated afterwards: the pictures show what the
method by itself can do.
"""

import functools

import warp as wp

from fieldsim.numerics.roots import Polynomial, product
from fieldsim.potentials import registry
from fieldsim.render.scene.tables import SceneTables
from fieldsim.render.solvers.hermite import CEILING
from fieldsim.render.solvers.polynomials import polynomial_sweep

_HALF, _TWO, _FOUR, _SIX, _EIGHT, _TWELVE, _SIXTEEN = (
    wp.constant(wp.float64(k)) for k in (0.5, 2.0, 4.0, 6.0, 8.0, 12.0, 16.0)
)
LENGTH = wp.constant(4.0)  # greatest length of a quartic, in kernel widths


@wp.func
def _part(scene: SceneTables, i: int, t: float, t0: float, t1: float):
    """Start and length of the quartic that is valid from t on."""
    parts = wp.max(wp.ceil((t1 - t0) / (LENGTH * scene.width[i])), 1.0)
    length = (t1 - t0) / parts
    # At the end of one, rounding must not select it again.
    return t0 + wp.floor((t - t0) / length + 1.0e-3) * length, length


@wp.func
def _last(scene: SceneTables, i: int, t: float, t0: float, t1: float):
    start, length = _part(scene, i, t, t0, t1)
    return wp.min(start + length, t1)


@functools.cache
def first_hit(kinds_used):
    """The Warp function that sweeps a ray through sorted intervals, for the given formulas."""
    element = registry.element_field(kinds_used).warp(wp.float32)

    @wp.func
    def sample(scene: SceneTables, o: wp.vec3, d: wp.vec3, t: float, i: int):
        p = o + t * d
        f, _x, _y, _z = element(p[0], p[1], p[2], scene.rows, scene.kinds, i)
        return wp.float64(wp.clamp(f, -CEILING, CEILING))

    @wp.func
    def piece(scene: SceneTables, o: wp.vec3, d: wp.vec3, begin: float, end: float, i: int, t0: float, t1: float):
        start, length = _part(scene, i, begin, t0, t1)
        step = 0.25 * length
        middle = start + 0.5 * length
        a = sample(scene, o, d, start, i)
        b = sample(scene, o, d, middle - step, i)
        c = sample(scene, o, d, middle, i)
        e = sample(scene, o, d, middle + step, i)
        f = sample(scene, o, d, start + length, i)
        # Through the five at w = -2..2: Newton's central form in even and odd parts.
        w = Polynomial()
        w[0] = wp.float64((begin - middle) / step)
        w[1] = wp.float64((end - begin) / step)
        w2 = product(w, w)
        far, near = _HALF * (a + f) - c, _HALF * (b + e) - c
        far_odd, near_odd = _HALF * (f - a), _HALF * (e - b)
        even = (_SIXTEEN * near - far) / _TWELVE * w2 + (far - _FOUR * near) / _TWELVE * product(w2, w2)
        odd = (_EIGHT * near_odd - far_odd) / _SIX * w + (far_odd - _TWO * near_odd) / _SIX * product(w2, w)
        result = even + odd
        result[0] += c
        return result

    return polynomial_sweep(piece, _last)
