"""The field of a `Source` at a point of the world's frame, written once for numba and for plain Python.

`maker(native)` gives the decorator: numba's, or none. Vectors are tuples; a turn is nine numbers of a row, by rows.
"""

import functools
import math

from fieldsim.mujoco.callback.field_callbacks import caller
from fieldsim.mujoco.callback.rows import (
    AXIS_X,
    CENTER_X,
    COUNT,
    FIRST,
    GROUP_CENTER_X,
    GROUP_COUNT,
    GROUP_FIRST,
    GROUP_SPINS,
    INSIDE_X,
    PHASE,
    RATE,
    SPINS,
)
from fieldsim.numerics.rotations import rotation


def maker(native: bool, inline: bool = True):
    """What compiles a function: numba, or nothing. inline: whether into its callers, unless it is long."""
    if not native:
        return lambda function: function
    import numba

    # As with portable functions: inlined, and without counting references to the tables that are passed down. Nobody
    # calls them from Python or C: without ways in for these a quarter of the time to compile is saved.
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return numba.njit(error_model="numpy", forceinline=inline, _nrt=False, fastmath={"contract"}, **options)


@functools.cache
def turning(native: bool):
    """Function (source, time, turns): fill turns (G, TURNED_WIDTH) with what the groups are now."""
    about = rotation.native if native else rotation

    @maker(native)
    def fill(source, time, turns):
        motions = source.motions
        for g in range(motions.shape[0]):
            for c in range(3):
                turns[g, GROUP_CENTER_X + c] = motions[g, CENTER_X + c]
            turns[g, GROUP_FIRST], turns[g, GROUP_COUNT] = source.groups[g, FIRST], source.groups[g, COUNT]
            turns[g, GROUP_SPINS] = source.groups[g, SPINS]
            if source.groups[g, SPINS]:
                angle = motions[g, PHASE] + motions[g, RATE] * time
                m = about(motions[g, AXIS_X], motions[g, AXIS_X + 1], motions[g, AXIS_X + 2], angle)
                turns[g, 0], turns[g, 1], turns[g, 2] = m[0], m[1], m[2]
                turns[g, 3], turns[g, 4], turns[g, 5] = m[3], m[4], m[5]
                turns[g, 6], turns[g, 7], turns[g, 8] = m[6], m[7], m[8]

    return fill


@functools.cache
def turns(native: bool):
    """Functions (table, row, vector) -> the vector turned by the rotation in a row, and turned back."""

    @maker(native)
    def turn(m, k, v):
        x, y, z = v
        return (
            m[k, 0] * x + m[k, 1] * y + m[k, 2] * z,
            m[k, 3] * x + m[k, 4] * y + m[k, 5] * z,
            m[k, 6] * x + m[k, 7] * y + m[k, 8] * z,
        )

    @maker(native)
    def back(m, k, v):
        x, y, z = v
        return (
            m[k, 0] * x + m[k, 3] * y + m[k, 6] * z,
            m[k, 1] * x + m[k, 4] * y + m[k, 7] * z,
            m[k, 2] * x + m[k, 5] * y + m[k, 8] * z,
        )

    return turn, back


@functools.cache
def product(native: bool):
    """Function (hessian, vector) -> hessian . vector."""

    @maker(native)
    def across(hessian, v):
        xx, yy, zz, xy, xz, yz = hessian
        return (
            xx * v[0] + xy * v[1] + xz * v[2],
            xy * v[0] + yy * v[1] + yz * v[2],
            xz * v[0] + yz * v[1] + zz * v[2],
        )

    return across


@functools.cache
def vectors(native: bool):
    """Functions of vectors: (a, b) -> dot product and cross product; (a, hessian, b) -> a . hessian b."""
    across = product(native)

    @maker(native)
    def dot(a, b):
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

    @maker(native)
    def cross(a, b):
        return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]

    @maker(native)
    def between(a, hessian, b):
        return dot(a, across(hessian, b))

    return dot, cross, between


def into_group(native: bool):
    """Function (point, source, turns, group) -> the point in the frame of the group's rows."""
    return _about_center(native, 1)


def _out_of_group(native: bool):
    """Function (point, source, turns, group): `into_group` back."""
    return _about_center(native, 0)


@functools.cache
def _about_center(native: bool, which: int):
    """Function (point, source, turns, group) -> the point turned about the group's centre; which: of `turns`."""
    turn = turns(native)[which]

    @maker(native)
    def turned_point(p, source, turned, g):
        if not source.groups[g, SPINS]:
            return p
        motions = source.motions
        cx, cy, cz = motions[g, CENTER_X], motions[g, CENTER_X + 1], motions[g, CENTER_X + 2]
        x, y, z = turn(turned, g, (p[0] - cx, p[1] - cy, p[2] - cz))
        return x + cx, y + cy, z + cz

    return turned_point


@functools.cache
def group_field(native: bool, name: str = "field"):
    """Function (point, source, turns, group) -> (F, gradient) of one group; or of the sum of another name."""
    total = caller(name, native)
    local = into_group(native)
    turn, _ = turns(native)

    @maker(native)
    def field(p, source, turned, g):
        q = local(p, source, turned, g)
        f, x, y, z = total(q[0], q[1], q[2], source, source.groups[g, FIRST], source.groups[g, COUNT])
        if source.groups[g, SPINS]:
            x, y, z = turn(turned, g, (x, y, z))
        return f, (x, y, z)

    return field


@functools.cache
def field_at(native: bool, name: str = "field"):
    """Function (point, source, turns) -> (F, gradient); or of the sum of another name, such as "weight"."""
    of_group = group_field(native, name)

    @maker(native)
    def field(p, source, turned):
        f, x, y, z = 0.0, 0.0, 0.0, 0.0
        for g in range(source.groups.shape[0]):
            more, d = of_group(p, source, turned, g)
            f += more
            x += d[0]
            y += d[1]
            z += d[2]
        return f, (x, y, z)

    return field


@functools.cache
def _group_jet(native: bool):
    """Function (point, source, turns, group) -> F, gradient and Hessian of one group, ten numbers."""
    total = caller("jet", native)
    local = into_group(native)
    turn, _ = turns(native)
    _, _, between = vectors(native)

    @maker(native)
    def row(turned, g, k):
        return turned[g, 3 * k], turned[g, 3 * k + 1], turned[g, 3 * k + 2]

    @maker(native)
    def jet(p, source, turned, g):
        q = local(p, source, turned, g)
        first, count = source.groups[g, FIRST], source.groups[g, COUNT]
        f, x, y, z, xx, yy, zz, xy, xz, yz = total(q[0], q[1], q[2], source, first, count)
        if source.groups[g, SPINS]:
            x, y, z = turn(turned, g, (x, y, z))
            h = xx, yy, zz, xy, xz, yz
            a, b, c = row(turned, g, 0), row(turned, g, 1), row(turned, g, 2)
            xx, yy, zz = between(a, h, a), between(b, h, b), between(c, h, c)
            xy, xz, yz = between(a, h, b), between(a, h, c), between(b, h, c)
        return f, x, y, z, xx, yy, zz, xy, xz, yz

    return jet


@functools.cache
def jet_at(native: bool):
    """Function (point, source, turns) -> (F, gradient, Hessian as xx, yy, zz, xy, xz, yz)."""
    of_group = _group_jet(native)

    @maker(native)
    def jet(p, source, turned):
        f, x, y, z, xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for g in range(source.groups.shape[0]):
            more = of_group(p, source, turned, g)
            f += more[0]
            x += more[1]
            y += more[2]
            z += more[3]
            xx += more[4]
            yy += more[5]
            zz += more[6]
            xy += more[7]
            xz += more[8]
            yz += more[9]
        return f, (x, y, z), (xx, yy, zz, xy, xz, yz)

    return jet


@functools.cache
def room_at(native: bool):
    """Function (point, source, turns) -> a distance within which no surface can be."""
    margin = caller("margin", native)
    local = into_group(native)

    @maker(native)
    def room(p, source, turned):
        least = math.inf
        for g in range(source.groups.shape[0]):
            first, count = source.groups[g, FIRST], source.groups[g, COUNT]
            q = local(p, source, turned, g)
            least = min(least, margin(q[0], q[1], q[2], source, first, count)[0])
        return least

    return room


@functools.cache
def near_foot(native: bool):
    """Function (point, source, turns, group, i, k) -> the k-th foot on element i, of that group, and its margin."""
    foot = caller("foot", native)
    local, world = into_group(native), _out_of_group(native)

    @maker(native)
    def near(p, source, turned, g, i, k):
        q = local(p, source, turned, g)
        x, y, z, margin = foot(q[0], q[1], q[2], source, i, k)
        return world((x, y, z), source, turned, g), margin

    return near


@functools.cache
def start_inside(native: bool):
    """Function (source, turns, group, i, k) -> the k-th place inside element i, of that group (see `INSIDE`)."""
    world = _out_of_group(native)

    @maker(native)
    def start(source, turned, g, i, k):
        rows, first = source.rows, INSIDE_X + 3 * k
        return world((rows[i, first], rows[i, first + 1], rows[i, first + 2]), source, turned, g)

    return start
