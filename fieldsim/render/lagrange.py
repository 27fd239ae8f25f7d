"""One quartic an element along the ray, through five samples of its field, as published (McCormack & Sherstyuk 1998).

The samples are equally spaced over the element's interval; those at its ends are taken for 0. There is no control of
the error and nothing looks at the true field afterwards: the pictures show what the method by itself can do.
"""

import functools

import warp as wp

from fieldsim.potentials import cells
from fieldsim.render.hermite import CEILING, Scene
from fieldsim.render.polynomials import Polynomial, polynomial_sweep, product


@functools.cache
def first_hit(kinds_used):
    """The Warp function that sweeps a ray through sorted intervals, for the given cells."""
    element = cells.element_field(kinds_used).warp(wp.float32)

    @wp.func
    def sample(scene: Scene, o: wp.vec3, d: wp.vec3, t: float, i: int):
        p = o + t * d
        f, _x, _y, _z = element(p[0], p[1], p[2], scene.rows, scene.kinds, i)
        return wp.float64(wp.clamp(f, -CEILING, CEILING))

    @wp.func
    def piece(scene: Scene, o: wp.vec3, d: wp.vec3, begin: float, end: float, i: int, t0: float, t1: float):
        quarter = 0.25 * (t1 - t0)
        # The quartic is v (1 - v) Q, v = 0..1 over the interval; Q goes through these at w = 4 v - 2 = -1, 0, 1.
        a = sample(scene, o, d, t0 + quarter, i) * wp.float64(16.0) / wp.float64(3.0)
        b = sample(scene, o, d, t0 + 2.0 * quarter, i) * wp.float64(4.0)
        c = sample(scene, o, d, t1 - quarter, i) * wp.float64(16.0) / wp.float64(3.0)
        v = Polynomial()
        v[0] = wp.float64((begin - t0) / (t1 - t0))
        v[1] = wp.float64((end - begin) / (t1 - t0))
        w = wp.float64(4.0) * v
        w[0] -= wp.float64(2.0)
        rest = -v
        rest[0] += wp.float64(1.0)
        q = wp.float64(0.5) * (c - a) * w + (wp.float64(0.5) * (a + c) - b) * product(w, w)
        q[0] += b
        return product(product(v, rest), q)

    return polynomial_sweep(piece)
