"""How deep a point lies within a surface: its distance to the nearest point of F = 1, as Warp functions.

The gradient of this depth is the normal at that nearest point, so a force along it that follows from the depth alone
is the derivative of an energy. The nearest point is found by Newton's method on log F (see `contact.nearest`), begun at
the point itself.
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.nearest import nearest_step
from fieldsim.dynamics.rigid.shells import Shells
from fieldsim.potentials import registry
from fieldsim.sources.field import jet_at
from fieldsim.sources.stages import Stages

_step = nearest_step.warp(wp.float64)
# Greatest number of steps, and the longest along the normal, in grains (lengths over which the field varies).
STEPS = wp.constant(32)
LONGEST = wp.constant(wp.float64(4.0))
# A step below this share of the radius of curvature, and of the grain, was the last: the next would be as its square.
LAST = wp.constant(wp.float64(1e-8))


@functools.cache
def within_prescribed(kinds_used):
    """Warp function (point, surfaces, stage, grain) -> (depth, outward normal), at a point where F > 1."""
    return _within(jet_at(kinds_used), Stages)


@functools.cache
def within_body(kinds):
    """Warp function (point, shells, b, grain) -> (depth, outward normal), at a point of body b's frame where F > 1."""
    total = registry.jet_sum(kinds).warp(wp.float64)

    @wp.func
    def jet(p: wp.vec3d, shells: Shells, b: int):
        first = shells.first_row[b]
        f, x, y, z, xx, yy, zz, xy, xz, yz = total(
            p[0], p[1], p[2], shells.rows, shells.kinds, first, shells.first_row[b + 1] - first
        )
        return f, wp.vec3d(x, y, z), wp.mat33d(xx, xy, xz, xy, yy, yz, xz, yz, zz)

    return _within(jet, Shells)


def _within(jet, table):
    """Warp function (point, table, index, grain) -> (depth, normal) in the field with the jet (point, table, index).

    grain: a length over which the field varies.
    """

    @wp.func(inline=False)
    def within(c: wp.vec3d, source: table, index: int, grain: wp.float64):
        q = c
        depth = wp.float64(0.0)
        normal = wp.vec3d()
        for _ in range(STEPS):
            f, g, h = jet(q, source, index)
            if not (f > wp.float64(0.0) and wp.dot(g, g) > wp.float64(0.0)):
                break
            o = c - q
            dx, dy, dz, nx, ny, nz, _m, _ex, _ey, _ez, radius = _step(
                o[0], o[1], o[2], f, g[0], g[1], g[2],
                h[0, 0], h[1, 1], h[2, 2], h[0, 1], h[0, 2], h[1, 2], LONGEST * grain,
            )  # fmt: skip
            d = wp.vec3d(dx, dy, dz)
            q = q + d
            normal = wp.vec3d(nx, ny, nz)
            depth = wp.max(wp.dot(q - c, normal), wp.float64(0.0))
            if wp.length(d) < LAST * wp.min(radius, grain):
                break
        return depth, normal

    return within
