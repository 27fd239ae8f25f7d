"""How deep a point of a geom's core is: the surface's nearest point, and the depth in units of the local size.

The *level* of a point c of the core of a geom with rounding r is (h - r) / size, where h is its height over the nearest
point q of the surface F = 1, negative within, and size the lesser of half the geom's thickness and of the surface's
radius at q. Where bodies of several radii blend, 1 / radius^3 is the mean of theirs, weighted by their fields at q.
Below 0 the geom touches, and stores the energy hardness |level|^3 / 3 = stiffness depth^3 / 3.
"""

import functools
import math

from fieldsim.dynamics.contact.nearest import curvatures, nearest_step, shortened
from fieldsim.mujoco.callback.evaluate import field_at, jet_at, maker, vectors
from fieldsim.mujoco.callback.rows import HEAVIEST, LIGHTEST
from fieldsim.mujoco.contact.rows import ROUND, SLIGHT

# Steps at most towards a nearest point, and the share of the radius of curvature by which the last one moves; a search
# that ends with longer ones than the other share has found none.
STEPS, CLOSE, LOST = 50, 1e-7, 1e-2
# Nearer than this share of the longest step to the place that it goes to without a field, a search is there.
ARRIVED = 1e-3
# 1 + h k counts as no less in size.
FOCUS = 1e-2
THIRD = 1.0 / 3.0


@functools.cache
def foot_at(native: bool):
    """Function (c, q, inside, longest, source, turns) -> whether it is found; the nearest point to c, normal and bends.

    q: where the search begins; it goes towards `inside` as long as it finds no field; longest: of its steps along the
    normal. Bends: two principal directions, their curvatures. On a crease, as a profile with a kink makes one, steps
    along the surface lead from one side to the other: each time they are halved, and the normal is the direction from
    there.
    """
    jet = jet_at(native)
    dot, _, _ = vectors(native)
    step_of = nearest_step.native if native else nearest_step
    bends_of = curvatures.native if native else curvatures
    shorten = shortened.native if native else shortened

    @maker(native)
    def parted(d, g):
        """The parts of a vector along a gradient and across it."""
        part = dot(d, g) / dot(g, g)
        along = part * g[0], part * g[1], part * g[2]
        return along, (d[0] - along[0], d[1] - along[1], d[2] - along[2])

    @maker(native)
    def facing(c, x, n):
        """The direction between the points, as outward as n; n where they are one."""
        d = c[0] - x[0], c[1] - x[1], c[2] - x[2]
        size = math.copysign(math.sqrt(dot(d, d)), dot(d, n))
        if size == 0.0:
            return n
        return d[0] / size, d[1] / size, d[2] / size

    @maker(native)
    def foot(c, q, inside, longest, source, turned):
        x = y = n = q
        f, g, h = 0.0, q, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        moved, radius, known = math.inf, 1.0, False
        most, share, last = math.inf, 1.0, (0.0, 0.0, 0.0)
        for k in range(STEPS):
            f1, g1, h1 = jet(x, source, turned)
            if not (f1 > 1e-280 and dot(g1, g1) > 0.0):
                # Beyond the end of a kernel: halfway back, or inward.
                t = y if known else inside
                d = 0.5 * (t[0] - x[0]), 0.5 * (t[1] - x[1]), 0.5 * (t[2] - x[2])
                if not known and dot(d, d) <= (ARRIVED * longest) ** 2:
                    break
                x = x[0] + d[0], x[1] + d[1], x[2] + d[2]
                continue
            known = True
            y, f, g, h = x, f1, g1, h1
            d = step_of(
                c[0] - y[0], c[1] - y[1], c[2] - y[2],
                f, g[0], g[1], g[2], h[0], h[1], h[2], h[3], h[4], h[5], longest,
            )  # fmt: skip
            step, now = parted((d[0], d[1], d[2]), g)
            size, before, along = math.sqrt(dot(now, now)), math.sqrt(dot(last, last)), dot(now, last)
            most, share = shorten(size, before, along, most, share, k)
            last = now
            step = step[0] + share * now[0], step[1] + share * now[1], step[2] + share * now[2]
            x = y[0] + step[0], y[1] + step[1], y[2] + step[2]
            n = d[3], d[4], d[5]
            moved, radius = math.sqrt(dot(step, step)), min(d[10], longest)
            if moved < CLOSE * radius:
                break
        if not known or not moved < LOST * radius:
            return False, x, n, (n, n, 0.0, 0.0)
        if share < LOST:
            n = facing(c, x, n)
        b = bends_of(f, g[0], g[1], g[2], h[0], h[1], h[2], h[3], h[4], h[5])
        return True, x, n, ((b[3], b[4], b[5]), (b[6], b[7], b[8]), b[9], b[10])

    return foot


@functools.cache
def _slimness(native: bool):
    """Function (q, plan, turns) -> 1 / radius^3 of the surface at q, and its gradient along it."""
    weight = field_at(native, "weight")
    field = field_at(native)

    @maker(native)
    def slimness(q, plan, turned):
        law = plan.law
        if law[LIGHTEST] == law[HEAVIEST]:
            return law[LIGHTEST], (0.0, 0.0, 0.0)
        f, g = field(q, plan.surface, turned)
        w, d = weight(q, plan.surface, turned)
        if not f > 0.0:
            return law[HEAVIEST], (0.0, 0.0, 0.0)
        mean = w / f
        if mean <= law[LIGHTEST] or mean >= law[HEAVIEST]:
            return min(max(mean, law[LIGHTEST]), law[HEAVIEST]), (0.0, 0.0, 0.0)
        return mean, ((d[0] - mean * g[0]) / f, (d[1] - mean * g[1]) / f, (d[2] - mean * g[2]) / f)

    return slimness


@functools.cache
def felt_at(native: bool):
    """Function (c, q, inside, longest, i, plan, turns) -> what the core's point c of geom i has to do with the surface.

    Whether its nearest point is found, that point, its normal, the level of c, the level's gradient, the height of c;
    the two principal directions, each with the bend of the level along it; the least 1 + h k.
    """
    foot = foot_at(native)
    slimness = _slimness(native)
    dot, _, _ = vectors(native)

    @maker(native, inline=False)
    def felt(c, q, inside, longest, i, plan, turned):
        found, q, n, bends = foot(c, q, inside, longest, plan.surface, turned)
        one, other, k1, k2 = bends
        h = dot((c[0] - q[0], c[1] - q[1], c[2] - q[2]), n)
        m1, m2 = 1.0 + h * k1, 1.0 + h * k2
        w, d = slimness(q, plan, turned)
        slight = plan.geoms[i, SLIGHT]
        s = max(w, slight) ** THIRD
        over = h - plan.geoms[i, ROUND]
        # As c moves, q moves along the surface 1 / (1 + h k) times as far.
        rate = over * s / (3.0 * w) if w > slight else 0.0
        a = rate * dot(one, d) / math.copysign(max(abs(m1), FOCUS), m1)
        b = rate * dot(other, d) / math.copysign(max(abs(m2), FOCUS), m2)
        rise = (
            s * n[0] + a * one[0] + b * other[0],
            s * n[1] + a * one[1] + b * other[1],
            s * n[2] + a * one[2] + b * other[2],
        )
        # Bends of the other sign count as if they had the right one, so that a search goes down all the same.
        b1, b2 = s * abs(k1) / max(abs(m1), 0.1), s * abs(k2) / max(abs(m2), 0.1)
        return found, q, n, s * over, rise, h, (one, other, b1, b2), min(m1, m2)

    return felt
