"""The deepest points of a geom in the surface: local minima of the level (see `surface`) over its core.

A search begins at the core's point nearest to each element that is near, and at each sample that is within the surface.
It steps to where the model of the level at hand, linear and its bends, is least over the core. Of a ball all nearest
points of the surface to its centre are found. Of several deepest points of one place, between which the core is within
the surface all along, the deepest alone counts, so that nothing jumps where another appears.
"""

import functools
import math

from fieldsim.dynamics.contact.laws import pressed
from fieldsim.mujoco.callback.evaluate import field_at, maker, near_foot, start_inside, turns, vectors
from fieldsim.mujoco.callback.rows import COUNT, FEET, FIRST, HEAVIEST, RADIUS, STARTS
from fieldsim.mujoco.contact.convex import lowest
from fieldsim.mujoco.contact.rows import (
    BOUND,
    CORE_X,
    DEPTH,
    ENERGY,
    FIRST_SAMPLE,
    FOOT_X,
    FRAME_XX,
    KIND,
    LEVEL,
    MOST_ABOVE,
    MOST_DEEPEST,
    NORMAL_X,
    ORIGIN_X,
    POINT,
    RISE_X,
    ROUND,
    SAMPLE_COUNT,
    SHARE,
    STRICT,
)
from fieldsim.mujoco.contact.surface import THIRD, felt_at

# Steps at most; gain of level below which a search has ended; bends count as no less than this share of the greatest.
CLIMBS, GAIN, FLAT = 30, 1e-15, 1e-6
# 1 + h k of a nearest point that is nearer than those around it, at least.
NEARER = 1e-5
# What is nearer to another than this, in radii of the surface, is the same; levels and normals that differ by less are.
SAME, ALIKE = 1e-4, 1e-6
# A search that would begin nearer than this to what is known, in radii, is left out.
BESIDE = 0.2
# Shares of the way between two deepest points at which it is looked whether they are of one place.
BETWEEN = (0.25, 0.5, 0.75)
NEAREST = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)


@functools.cache
def placed(native: bool):
    """Functions (views, b, plan, i) -> where geom i of body b is: origin and nine numbers; places in and out of it."""
    turn, _ = turns(native)

    @maker(native)
    def place(views, b, plan, i):
        row, x = plan.geoms, views.xipos
        o = turn(views.ximat, b, (row[i, ORIGIN_X], row[i, ORIGIN_X + 1], row[i, ORIGIN_X + 2]))
        r0, r3, r6 = turn(views.ximat, b, (row[i, FRAME_XX], row[i, FRAME_XX + 3], row[i, FRAME_XX + 6]))
        r1, r4, r7 = turn(views.ximat, b, (row[i, FRAME_XX + 1], row[i, FRAME_XX + 4], row[i, FRAME_XX + 7]))
        r2, r5, r8 = turn(views.ximat, b, (row[i, FRAME_XX + 2], row[i, FRAME_XX + 5], row[i, FRAME_XX + 8]))
        return (o[0] + x[b, 0], o[1] + x[b, 1], o[2] + x[b, 2]), (r0, r1, r2, r3, r4, r5, r6, r7, r8)

    @maker(native)
    def outside(at, v):
        o, r = at
        return (
            o[0] + r[0] * v[0] + r[1] * v[1] + r[2] * v[2],
            o[1] + r[3] * v[0] + r[4] * v[1] + r[5] * v[2],
            o[2] + r[6] * v[0] + r[7] * v[1] + r[8] * v[2],
        )

    @maker(native)
    def back(at, v):
        r = at[1]
        return (
            r[0] * v[0] + r[3] * v[1] + r[6] * v[2],
            r[1] * v[0] + r[4] * v[1] + r[7] * v[2],
            r[2] * v[0] + r[5] * v[1] + r[8] * v[2],
        )

    return place, outside, back


@functools.cache
def _model(native: bool):
    """Function (at, bends) -> the model's matrix in the geom's frame, a little round where it is flat."""
    _, _, back = placed(native)

    @maker(native)
    def model(at, bends, rise):
        one, other, b1, b2 = bends
        u, v = back(at, one), back(at, other)
        # A little round where it is flat, so that the nearest of places that are as good is taken.
        least = FLAT * max(b1, b2, 1e-3 * rise)
        return (
            least + b1 * u[0] * u[0] + b2 * v[0] * v[0],
            least + b1 * u[1] * u[1] + b2 * v[1] * v[1],
            least + b1 * u[2] * u[2] + b2 * v[2] * v[2],
            b1 * u[0] * u[1] + b2 * v[0] * v[1],
            b1 * u[0] * u[2] + b2 * v[0] * v[2],
            b1 * u[1] * u[2] + b2 * v[1] * v[2],
        )

    return model


@functools.cache
def climb(native: bool):
    """Function (p, q, inside, longest, i, at, plan, turns): from the core's point p to where it is deepest.

    p: in the core's frame. Returns the deepest point in the world's frame and what `felt` says of it.
    """
    felt = felt_at(native)
    model = _model(native)
    least = lowest(native)
    _, outside, back = placed(native)
    dot, _, between = vectors(native)

    @maker(native)
    def search(p, q, inside, longest, i, at, plan, turned):
        c = outside(at, p)
        now = felt(c, q, inside, longest, i, plan, turned)
        if plan.geoms[i, KIND] == POINT:
            return c, now
        share, target = 1.0, p
        for _ in range(CLIMBS):
            if not now[0]:
                break
            if share == 1.0:
                g = back(at, now[4])
                a = model(at, now[6], math.sqrt(dot(g, g)))
                target = least(plan, i, p, g, a, p)
                d = target[0] - p[0], target[1] - p[1], target[2] - p[2]
                if dot(g, d) + 0.5 * between(d, a, d) > -GAIN:
                    break
            d = share * (target[0] - p[0]), share * (target[1] - p[1]), share * (target[2] - p[2])
            tried = p[0] + d[0], p[1] + d[1], p[2] + d[2]
            place = outside(at, tried)
            then = felt(place, now[1], now[1], longest, i, plan, turned)
            if then[0] and then[3] < now[3]:
                p, c, now, share = tried, place, then, 1.0
            else:
                share *= 0.25
                if share < 1e-3:
                    break
        return c, now

    return search


@functools.cache
def noting(native: bool):
    """Function (contacts, k, c, felt, rounding): write a contact into row k."""
    law_of = pressed.native if native else pressed

    @maker(native)
    def note(contacts, k, c, now, rounding):
        for j in range(3):
            contacts[k, CORE_X + j] = c[j]
            contacts[k, FOOT_X + j] = now[1][j]
            contacts[k, NORMAL_X + j] = now[2][j]
            contacts[k, RISE_X + j] = now[4][j]
        contacts[k, LEVEL] = now[3]
        contacts[k, DEPTH] = rounding - now[5]
        contacts[k, STRICT] = 1.0 if now[7] > NEARER else 0.0
        contacts[k, ENERGY] = law_of(-now[3], 1.0)[0]
        contacts[k, SHARE] = 1.0

    return note


@functools.cache
def _is_known(native: bool):
    """Function (c, felt, longest, i, contacts, count, plan, turns): whether it is one of the contacts already.

    It is where its foot is one of theirs, or it is as deep as one and so is what lies between: along a flat place.
    """
    felt = felt_at(native)
    dot, _, _ = vectors(native)

    @maker(native)
    def is_known(c, now, longest, i, contacts, count, plan, turned):
        q, n = now[1], now[2]
        for k in range(count):
            d = q[0] - contacts[k, FOOT_X], q[1] - contacts[k, FOOT_X + 1], q[2] - contacts[k, FOOT_X + 2]
            if dot(d, d) < (SAME * longest) ** 2:
                return True
            if plan.geoms[i, KIND] == POINT:
                continue
            along = n[0] * contacts[k, NORMAL_X] + n[1] * contacts[k, NORMAL_X + 1] + n[2] * contacts[k, NORMAL_X + 2]
            level = contacts[k, LEVEL]
            if along > 1.0 - ALIKE and abs(now[3] - level) < ALIKE * abs(level):
                middle = (
                    0.5 * (c[0] + contacts[k, CORE_X]),
                    0.5 * (c[1] + contacts[k, CORE_X + 1]),
                    0.5 * (c[2] + contacts[k, CORE_X + 2]),
                )
                between = felt(middle, q, q, longest, i, plan, turned)
                if between[0] and between[3] < level + ALIKE * abs(level):
                    return True
        return False

    return is_known


@functools.cache
def _merging(native: bool):
    """Function (contacts, count, i, plan, turns): let the deepest point of each place alone touch."""
    field, felt = field_at(native), felt_at(native)

    @maker(native)
    def mixed(contacts, k, m, first, share):
        rest = 1.0 - share
        return (
            rest * contacts[k, first] + share * contacts[m, first],
            rest * contacts[k, first + 1] + share * contacts[m, first + 1],
            rest * contacts[k, first + 2] + share * contacts[m, first + 2],
        )

    @maker(native)
    def is_one(contacts, k, m, i, plan, turned):
        """Whether all between two deepest points is within the surface."""
        radius = plan.law[HEAVIEST] ** -THIRD
        for share in BETWEEN:
            c = mixed(contacts, k, m, CORE_X, share)
            if plan.geoms[i, ROUND] == 0.0:
                if not field(c, plan.surface, turned)[0] > 1.0:
                    return False
                continue
            q = mixed(contacts, k, m, FOOT_X, share)
            now = felt(c, q, q, radius, i, plan, turned)
            if not (now[0] and now[3] < 0.0):
                return False
        return True

    @maker(native)
    def merge(contacts, count, i, plan, turned):
        if plan.geoms[i, KIND] == POINT:
            return
        for k in range(count):
            for m in range(count):
                level, other = contacts[k, LEVEL], contacts[m, LEVEL]
                if level < other < 0.0 or (k < m and level == other < 0.0):
                    if is_one(contacts, k, m, i, plan, turned):
                        contacts[m, LEVEL] = 0.0

    return merge


@functools.cache
def beginning(native: bool):
    """Function (g, j, k, i, at, plan, turns): where a search from foot k of element j of group g begins.

    Behind the feet come the places inside the element. Whether the surface may be near, the core's point nearest to
    the element, in its frame, a point near the surface between the two, and the foot or the place inside.
    """
    foot, inner = near_foot(native), start_inside(native)
    least = lowest(native)
    _, outside, back = placed(native)
    dot, _, _ = vectors(native)

    @maker(native)
    def apart(a, b):
        d = a[0] - b[0], a[1] - b[1], a[2] - b[2]
        return math.sqrt(dot(d, d))

    @maker(native)
    def begin(g, j, k, i, at, plan, turned):
        origin, feet = at[0], int(plan.surface.rows[j, FEET])
        which = k if k < feet else 0
        f, margin = foot(origin, plan.surface, turned, g, j, which)
        p = 0.0, 0.0, 0.0
        if margin > plan.geoms[i, BOUND]:
            return False, p, f, f
        if plan.geoms[i, KIND] != POINT:
            for _ in range(2):
                o = back(at, (f[0] - origin[0], f[1] - origin[1], f[2] - origin[2]))
                p = least(plan, i, o, (0.0, 0.0, 0.0), NEAREST, o)
                if which > 0:
                    # The same place, as near as the core is to it.
                    margin += apart(outside(at, p), f) - apart(origin, f)
                    break
                f, margin = foot(outside(at, p), plan.surface, turned, g, j, which)
            if margin > plan.geoms[i, ROUND]:
                return False, p, f, f
        if k >= feet:
            f = inner(plan.surface, turned, g, j, k - feet)
        c = outside(at, p)
        d = c[0] - f[0], c[1] - f[1], c[2] - f[2]
        away = apart(c, f)
        if not away > 0.0:
            d = origin[0] - f[0], origin[1] - f[1], origin[2] - f[2]
            away = apart(origin, f)
            if not away > 0.0:
                d, away = (0.0, 0.0, 1.0), 1.0
        share = plan.surface.rows[j, RADIUS] / away
        return True, p, (f[0] + share * d[0], f[1] + share * d[1], f[2] + share * d[2]), f

    return begin


@functools.cache
def _keeping(native: bool):
    """Function (contacts, count): leaves out rows that are no contacts; how many are left."""

    @maker(native)
    def copy(contacts, k, m):
        for j in range(contacts.shape[1]):
            contacts[k, j] = contacts[m, j]

    @maker(native)
    def kept(contacts, count):
        """Leave out what does not touch, or is only as near as all around where there is anything else."""
        strict, best = 0, -1
        for k in range(count):
            if not contacts[k, LEVEL] < 0.0:
                continue
            if contacts[k, STRICT] != 0.0:
                copy(contacts, strict, k)
                strict += 1
            elif best < 0 or contacts[k, LEVEL] < contacts[best, LEVEL]:
                best = k
        if strict == 0 and best >= 0:
            copy(contacts, 0, best)
            return 1
        return strict

    return kept


@functools.cache
def _is_begun(native: bool):
    """Function (core point, foot, longest, contacts, count): see the function."""
    dot, _, _ = vectors(native)

    @maker(native)
    def is_begun(c, q, longest, contacts, count):
        """Whether a search from there would lead to what is known."""
        for k in range(count):
            d = q[0] - contacts[k, FOOT_X], q[1] - contacts[k, FOOT_X + 1], q[2] - contacts[k, FOOT_X + 2]
            e = c[0] - contacts[k, CORE_X], c[1] - contacts[k, CORE_X + 1], c[2] - contacts[k, CORE_X + 2]
            if dot(d, d) + dot(e, e) < (BESIDE * longest) ** 2:
                return True
        return False

    return is_begun


@functools.cache
def deepest(native: bool):
    """Function (i, at, plan, turns, contacts): the deepest points of geom i, as rows of `contacts`; how many."""
    begin, search = beginning(native), climb(native)
    note, is_known, is_begun = noting(native), _is_known(native), _is_begun(native)
    _, outside, _ = placed(native)
    field, merge, kept = field_at(native), _merging(native), _keeping(native)

    @maker(native, inline=False)
    def searched(p, q, inside, longest, i, at, plan, turned, contacts, count):
        """How many contacts there are with what is found from there."""
        c, now = search(p, q, inside, longest, i, at, plan, turned)
        # Those above the surface are only noted so that no other search looks for them.
        if not now[0] or now[7] < -NEARER or count >= (MOST_DEEPEST if now[3] < 0.0 else MOST_ABOVE):
            return count
        if is_known(c, now, longest, i, contacts, count, plan, turned):
            return count
        note(contacts, count, c, now, plan.geoms[i, ROUND])
        return count + 1

    @maker(native)
    def find(i, at, plan, turned, contacts):
        count = 0
        source, row = plan.surface, plan.geoms
        for g in range(source.groups.shape[0]):
            first = source.groups[g, FIRST]
            for j in range(first, first + source.groups[g, COUNT]):
                for k in range(int(source.rows[j, FEET] + source.rows[j, STARTS])):
                    near, p, q, f = begin(g, j, k, i, at, plan, turned)
                    longest = source.rows[j, RADIUS]
                    if not near or is_begun(outside(at, p), q, longest, contacts, count):
                        continue
                    count = searched(p, q, f, longest, i, at, plan, turned, contacts, count)
        if row[i, ROUND] == 0.0:
            radius = plan.law[HEAVIEST] ** -THIRD
            first = int(row[i, FIRST_SAMPLE])
            for s in range(first, first + int(row[i, SAMPLE_COUNT])):
                p = plan.samples[s, 0], plan.samples[s, 1], plan.samples[s, 2]
                c = outside(at, p)
                if field(c, source, turned)[0] > 1.0:
                    count = searched(p, c, c, radius, i, at, plan, turned, contacts, count)
        merge(contacts, count, i, plan, turned)
        return kept(contacts, count)

    return find
