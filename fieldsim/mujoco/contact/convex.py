"""Least values of quadratic models over convex sets: the cores of geoms, in their own frames.

`lowest` (plan, i, o, g, a, x): the point of the core of row i of `geoms` where g . (x - o) + (x - o) . A (x - o) / 2 is
least, with the symmetric A of no negative eigenvalue as (xx, yy, zz, xy, xz, yz); x: a point to begin at. With g = 0
and A = 1 it is the nearest point to o (of a polytope, on its faces).
"""

import functools
import math

from fieldsim.mujoco.callback.evaluate import maker, product, vectors
from fieldsim.mujoco.contact.rows import (
    CORNER_X,
    CYLINDER,
    ELLIPSOID,
    FACE_COUNT,
    FIRST_FACE,
    KIND,
    ONE_X,
    OTHER_X,
    POLYTOPE,
    SEGMENT,
    SIZE_X,
    SIZE_Y,
    SIZE_Z,
)

# Iterations at most, over a cylinder and over an ellipsoid, and the share of its size by which the last ones move.
GLIDES, TURNS, STILL = 80, 12, 1e-10
# On an ellipsoid curvatures count as at least this share of the greatest.
RIDGE = 1e-3


@functools.cache
def uphill(native: bool):
    """Function (u, g, h): one step of Newton's method on the unit sphere towards the greatest value; (u, length)."""
    dot, cross, between = vectors(native)

    @maker(native)
    def unit(v):
        size = math.sqrt(dot(v, v))
        return v[0] / size, v[1] / size, v[2] / size

    @maker(native)
    def step(u, g, h):
        away = (1.0, 0.0, 0.0) if abs(u[0]) < 0.7 else (0.0, 1.0, 0.0)
        a = unit(cross(u, away))
        b = cross(u, a)
        ga, gb = dot(g, a), dot(g, b)
        steep = dot(g, u)
        aa, ab, bb = between(a, h, a) - steep, between(a, h, b), between(b, h, b) - steep
        # Make the curvatures negative and bound them away from 0, for an ascent step of bounded length, also along a
        # ridge.
        middle, half = 0.5 * (aa + bb), 0.5 * (aa - bb)
        radius = max(math.sqrt(half * half + ab * ab), 1e-300)
        least = max(RIDGE * (abs(middle) + radius), 1e-300)
        f, g = 1.0 / max(abs(middle - radius), least), 1.0 / max(abs(middle + radius), least)
        same, other = 0.5 * (f + g), 0.5 * (g - f) / radius
        da = same * ga + other * (half * ga + ab * gb)
        db = same * gb + other * (ab * ga - half * gb)
        length = math.sqrt(da * da + db * db)
        if length > 0.5:
            da, db = 0.5 * da / length, 0.5 * db / length
        return unit((u[0] + da * a[0] + db * b[0], u[1] + da * a[1] + db * b[1], u[2] + da * a[2] + db * b[2])), length

    return step


@functools.cache
def _slope(native: bool):
    """Function (x, o, g, a) -> gradient of the model at x."""
    across = product(native)

    @maker(native)
    def slope(x, o, g, a):
        h = across(a, (x[0] - o[0], x[1] - o[1], x[2] - o[2]))
        return g[0] + h[0], g[1] + h[1], g[2] + h[2]

    return slope


@functools.cache
def _on_ellipsoid(native: bool):
    step = uphill(native)
    slope = _slope(native)

    @maker(native)
    def lowest(axes, o, g, a, x):
        u = x[0] / axes[0], x[1] / axes[1], x[2] / axes[2]
        size = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
        u = (u[0] / size, u[1] / size, u[2] / size) if size > 1e-9 else (0.0, 0.0, 1.0)
        xx, yy, zz, xy, xz, yz = a
        h = (
            -axes[0] * axes[0] * xx,
            -axes[1] * axes[1] * yy,
            -axes[2] * axes[2] * zz,
            -axes[0] * axes[1] * xy,
            -axes[0] * axes[2] * xz,
            -axes[1] * axes[2] * yz,
        )
        for _ in range(TURNS):
            d = slope((axes[0] * u[0], axes[1] * u[1], axes[2] * u[2]), o, g, a)
            u, length = step(u, (-axes[0] * d[0], -axes[1] * d[1], -axes[2] * d[2]), h)
            if length < STILL:
                break
        return axes[0] * u[0], axes[1] * u[1], axes[2] * u[2]

    return lowest


@functools.cache
def _on_segment(native: bool):
    slope = _slope(native)

    @maker(native)
    def lowest(half, o, g, a, x):
        steep, bend = slope((0.0, 0.0, 0.0), o, g, a)[2], a[2]
        # Flat models stay where they are.
        if bend > 0.0:
            z = -steep / bend
        elif steep == 0.0:
            z = x[2]
        else:
            z = -math.copysign(half, steep)
        return 0.0, 0.0, min(max(z, -half), half)

    return lowest


@functools.cache
def _on_cylinder(native: bool):
    """By an accelerated gradient method that starts anew where it would climb (O'Donoghue & Candes 2015)."""
    slope = _slope(native)
    dot, _, _ = vectors(native)

    @maker(native)
    def within(radius, half, x):
        rho = math.sqrt(x[0] * x[0] + x[1] * x[1])
        share = radius / rho if rho > radius else 1.0
        return share * x[0], share * x[1], min(max(x[2], -half), half)

    @maker(native)
    def lowest(radius, half, o, g, a, x):
        x = within(radius, half, x)
        size = radius + half
        pace = 1.0 / max(a[0] + a[1] + a[2], 1e-6 * math.sqrt(dot(g, g)) / size)
        y, t = x, 1.0
        for _ in range(GLIDES):
            d = slope(y, o, g, a)
            z = within(radius, half, (y[0] - pace * d[0], y[1] - pace * d[1], y[2] - pace * d[2]))
            move = z[0] - x[0], z[1] - x[1], z[2] - x[2]
            if (y[0] - z[0]) * move[0] + (y[1] - z[1]) * move[1] + (y[2] - z[2]) * move[2] > 0.0:
                t = 1.0
            later = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * t * t))
            on = (t - 1.0) / later
            y = z[0] + on * move[0], z[1] + on * move[1], z[2] + on * move[2]
            x, t = z, later
            if dot(move, move) < (STILL * size) ** 2:
                break
        return x

    return lowest


@functools.cache
def _on_face(native: bool):
    """Function (v, w, s, a) -> value and coordinates of the least s . x + x . A x / 2 over x = i v + j w in a triangle.

    i, j >= 0 and i + j <= 1: within where the model is least there, or on the edge where it is least.
    """
    dot, _, between = vectors(native)

    @maker(native)
    def on_edge(steep, bend):
        """The share of the way along an edge."""
        if bend > 1e-300:
            return min(max(-steep / bend, 0.0), 1.0)
        return 1.0 if steep < 0.0 else 0.0

    @maker(native)
    def lowest(v, w, s, a):
        sv, sw = dot(s, v), dot(s, w)
        vv, vw, ww = between(v, a, v), between(v, a, w), between(w, a, w)
        inner = vv * ww - vw * vw
        if inner > 1e-12 * vv * ww:
            i, j = (vw * sw - ww * sv) / inner, (vw * sv - vv * sw) / inner
            if i >= 0.0 and j >= 0.0 and i + j <= 1.0:
                return 0.5 * (i * sv + j * sw), i, j
        i = on_edge(sv, vv)
        least, one, other = i * (sv + 0.5 * i * vv), i, 0.0
        j = on_edge(sw, ww)
        value = j * (sw + 0.5 * j * ww)
        if value < least:
            least, one, other = value, 0.0, j
        # From the end of v to that of w.
        k = on_edge(sw - sv + vw - vv, vv - 2.0 * vw + ww)
        i, j = 1.0 - k, k
        value = i * sv + j * sw + 0.5 * (i * i * vv + 2.0 * i * j * vw + j * j * ww)
        if value < least:
            least, one, other = value, i, j
        return least, one, other

    return lowest


@functools.cache
def _on_polytope(native: bool):
    on_face = _on_face(native)
    dot, _, between = vectors(native)
    across = product(native)

    @maker(native)
    def vector(table, i, first):
        return table[i, first], table[i, first + 1], table[i, first + 2]

    @maker(native)
    def lowest(faces, first, count, o, g, a, x):
        least = math.inf
        for k in range(first, first + count):
            c, v, w = vector(faces, k, CORNER_X), vector(faces, k, ONE_X), vector(faces, k, OTHER_X)
            d = c[0] - o[0], c[1] - o[1], c[2] - o[2]
            # The model is no less than its linear part.
            if dot(g, d) + min(0.0, dot(g, v), dot(g, w)) >= least:
                continue
            h = across(a, d)
            value, i, j = on_face(v, w, (g[0] + h[0], g[1] + h[1], g[2] + h[2]), a)
            value += dot(g, d) + 0.5 * between(d, a, d)
            if value < least:
                least = value
                x = c[0] + i * v[0] + j * w[0], c[1] + i * v[1] + j * w[1], c[2] + i * v[2] + j * w[2]
        return x

    return lowest


@functools.cache
def lowest(native: bool):
    """See the module's text."""
    ellipsoid, segment = _on_ellipsoid(native), _on_segment(native)
    cylinder, polytope = _on_cylinder(native), _on_polytope(native)

    @maker(native, inline=False)
    def lowest(plan, i, o, g, a, x):
        row = plan.geoms
        kind = row[i, KIND]
        if kind == SEGMENT:
            return segment(row[i, SIZE_Z], o, g, a, x)
        if kind == ELLIPSOID:
            return ellipsoid((row[i, SIZE_X], row[i, SIZE_Y], row[i, SIZE_Z]), o, g, a, x)
        if kind == CYLINDER:
            return cylinder(row[i, SIZE_X], row[i, SIZE_Z], o, g, a, x)
        if kind == POLYTOPE:
            return polytope(plan.faces, int(row[i, FIRST_FACE]), int(row[i, FACE_COUNT]), o, g, a, x)
        return 0.0, 0.0, 0.0

    return lowest
