"""The field of a `Source` at a point of the world's frame, written once for numba and for plain Python.

`maker(native)` gives the decorator: numba's, or none. Vectors are tuples; a turn is nine numbers of a row, by rows.
"""

import functools
import math

from fieldsim.mujoco.sums import caller


def maker(native: bool):
    """What compiles a function: numba, or nothing."""
    if not native:
        return lambda function: function
    import numba

    # As with portable functions: inlined, and without counting references to the tables that are passed down.
    return numba.njit(error_model="numpy", forceinline=True, _nrt=False)


@functools.cache
def turning(native: bool):
    """Function (groups, time, turns): fill turns (G, 9) with the rotations of the groups that spin (Rodrigues)."""

    @maker(native)
    def fill(groups, time, turns):
        for g in range(groups.shape[0]):
            if groups[g, 2] != 0.0:
                x, y, z = groups[g, 3], groups[g, 4], groups[g, 5]
                angle = groups[g, 7] + groups[g, 6] * time
                s = math.sin(angle)
                c = math.cos(angle)
                # 1 - cos, without cancellation.
                v = 2.0 * math.sin(0.5 * angle) ** 2
                turns[g, 0] = c + v * x * x
                turns[g, 1] = v * x * y - s * z
                turns[g, 2] = v * x * z + s * y
                turns[g, 3] = v * x * y + s * z
                turns[g, 4] = c + v * y * y
                turns[g, 5] = v * y * z - s * x
                turns[g, 6] = v * x * z - s * y
                turns[g, 7] = v * y * z + s * x
                turns[g, 8] = c + v * z * z

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
def vectors(native: bool):
    """Functions of vectors: (a, b) -> dot product and cross product; (a, hessian, b) -> a . hessian b."""

    @maker(native)
    def dot(a, b):
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

    @maker(native)
    def cross(a, b):
        return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]

    @maker(native)
    def between(a, hessian, b):
        xx, yy, zz, xy, xz, yz = hessian
        return (
            a[0] * (xx * b[0] + xy * b[1] + xz * b[2])
            + a[1] * (xy * b[0] + yy * b[1] + yz * b[2])
            + a[2] * (xz * b[0] + yz * b[1] + zz * b[2])
        )

    return dot, cross, between


@functools.cache
def into_group(native: bool):
    """Function (point, source, turns, group) -> the point in the frame of the group's rows."""
    _, back = turns(native)

    @maker(native)
    def local(p, source, turned, g):
        groups = source.groups
        if groups[g, 2] == 0.0:
            return p
        x, y, z = back(turned, g, (p[0] - groups[g, 8], p[1] - groups[g, 9], p[2] - groups[g, 10]))
        return x + groups[g, 8], y + groups[g, 9], z + groups[g, 10]

    return local


@functools.cache
def field_at(native: bool):
    """Function (point, source, turns) -> (F, gradient)."""
    total = caller("field", native)
    local = into_group(native)
    turn, _ = turns(native)

    @maker(native)
    def field(p, source, turned):
        f, gx, gy, gz = 0.0, 0.0, 0.0, 0.0
        for g in range(source.groups.shape[0]):
            first, count = int(source.groups[g, 0]), int(source.groups[g, 1])
            q = local(p, source, turned, g)
            one, x, y, z = total(q[0], q[1], q[2], source, first, count)
            if source.groups[g, 2] != 0.0:
                x, y, z = turn(turned, g, (x, y, z))
            f += one
            gx += x
            gy += y
            gz += z
        return f, (gx, gy, gz)

    return field


@functools.cache
def jet_at(native: bool):
    """Function (point, source, turns) -> (F, gradient, Hessian as xx, yy, zz, xy, xz, yz)."""
    total = caller("jet", native)
    local = into_group(native)
    turn, _ = turns(native)
    _, _, between = vectors(native)

    @maker(native)
    def row(turned, g, k):
        return turned[g, 3 * k], turned[g, 3 * k + 1], turned[g, 3 * k + 2]

    @maker(native)
    def jet(p, source, turned):
        f, gx, gy, gz = 0.0, 0.0, 0.0, 0.0
        hxx, hyy, hzz, hxy, hxz, hyz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for g in range(source.groups.shape[0]):
            first, count = int(source.groups[g, 0]), int(source.groups[g, 1])
            q = local(p, source, turned, g)
            one, x, y, z, xx, yy, zz, xy, xz, yz = total(q[0], q[1], q[2], source, first, count)
            if source.groups[g, 2] != 0.0:
                x, y, z = turn(turned, g, (x, y, z))
                h = xx, yy, zz, xy, xz, yz
                a, b, c = row(turned, g, 0), row(turned, g, 1), row(turned, g, 2)
                xx, yy, zz = between(a, h, a), between(b, h, b), between(c, h, c)
                xy, xz, yz = between(a, h, b), between(a, h, c), between(b, h, c)
            f += one
            gx += x
            gy += y
            gz += z
            hxx += xx
            hyy += yy
            hzz += zz
            hxy += xy
            hxz += xz
            hyz += yz
        return f, (gx, gy, gz), (hxx, hyy, hzz, hxy, hxz, hyz)

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
            first, count = int(source.groups[g, 0]), int(source.groups[g, 1])
            q = local(p, source, turned, g)
            least = min(least, margin(q[0], q[1], q[2], source, first, count)[0])
        return least

    return room
