"""First hits by polynomials along the ray: all roots by Laguerre's method with deflation, in float64.

A ray's intervals with elements' bounding volumes are cut at every entry and exit. In each piece the field is a sum of
polynomials, one an element, of degree 6 at most, in u = 0..1 along the piece (Nishimura et al. 1985; Wyvill & Trotman
1990; McCormack & Sherstyuk 1998).
"""

import warp as wp

from fieldsim.numerics.roots import NOWHERE, Polynomial, first_rise
from fieldsim.render.scene.tables import NO_HIT, SceneTables


@wp.func
def polynomial_end(scene: SceneTables, i: int, t: float, t0: float, t1: float):
    """Where the polynomial valid at t ends, if one polynomial holds on all of an element's interval t0..t1."""
    return t1


def polynomial_sweep(piece, last=polynomial_end):
    """The Warp function that sweeps a ray through sorted intervals (see `hermite.first_hit`).

    piece(scene, o, d, from, to, i, t0, t1): element i's Polynomial in u on from..to, within its interval t0..t1;
    last(scene, i, t, t0, t1): up to where the same polynomial holds as at t.
    """

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
        hit = float(NO_HIT)
        side = float(known_side)
        t = float(begin)
        while t < end and hit < 0.0:
            # Up to the next entry or exit.
            next = float(end)
            for k in range(count):
                if t0s[k] > t:
                    next = wp.min(next, t0s[k])
                elif t1s[k] > t:
                    next = wp.min(next, last(scene, ids[k], t, t0s[k], t1s[k]))
            p = Polynomial()
            p[0] = wp.float64(-1.0)
            for k in range(count):
                if t0s[k] <= t and t1s[k] > t:
                    p += piece(scene, o, d, t, next, ids[k], t0s[k], t1s[k])
            if side == 0.0:
                side = wp.where(p[0] < wp.float64(0.0), -1.0, 1.0)
            u = first_rise(wp.float64(-side) * p)
            if u < wp.float64(NOWHERE):
                hit = t + float(u) * (next - t)
            t = next
        return hit, side

    return sweep
