"""The surface field at any moment within a step, as Warp functions.

Between two stages a body moves by the screw motion of its twist, so its elements at a fraction s of a step are those of
the stage, met at the point carried back by s of the twist: exact for a body that does not deform, however far it moves.
Of one that deforms, log F of an element is that of both stages, with the shares 1 - s and s.
"""

import functools

import warp as wp

from fieldsim.potentials import registry
from fieldsim.sources.field import jet_at
from fieldsim.sources.rows import DEFORMS, shift_of, turn_of
from fieldsim.sources.stages import Stages
from fieldsim.sources.surface_velocity import screw


@wp.struct
class Moment:
    """A time within a step: the step's first stage, its length dt, and the time t since its start."""

    stage: int
    dt: wp.float64
    t: wp.float64


@wp.struct
class SurfaceJet:
    """F at a point and a moment, its gradient and Hessian, and its change per step at a fixed point.

    turn, shift: twist per step of the material there, where bodies melt together their mean weighted by the fields.
    """

    f: wp.float64
    gradient: wp.vec3d
    hessian: wp.mat33d
    rate: wp.float64
    turn: wp.vec3d
    shift: wp.vec3d


@wp.func
def rotation_of(turn: wp.vec3d):
    """The rotation matrix of a rotation vector."""
    angle = wp.length(turn)
    q = wp.quatd(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0), wp.float64(1.0))
    if angle > wp.float64(0.0):
        q = wp.quat_from_axis_angle(turn / angle, angle)
    return wp.quat_to_matrix(q)


@wp.func
def fraction(moment: Moment, later: wp.float64):
    """The fraction of the step at a time after the moment."""
    return (moment.t + later) / moment.dt


@wp.func
def mixed(f: wp.float64, g: wp.vec3d, h: wp.mat33d, f1: wp.float64, g1: wp.vec3d, h1: wp.mat33d, s: wp.float64):
    """Jet (value, gradient, Hessian) at the share s from one to another, and what the value grows by per step.

    Logarithms are mixed where there are any, else the values. The growth is that with which the surface has its mean
    speed over the step: by the slope in the middle of it.
    """
    grown = f1 - f
    if f > wp.float64(0.0) and f1 > wp.float64(0.0):
        rise = wp.log(f1 / f)
        a = (wp.float64(1.0) - s) / f * g
        b = s / f1 * g1
        bend = (wp.float64(1.0) - s) * (h / f - wp.outer(g / f, g / f)) + s * (h1 / f1 - wp.outer(g1 / f1, g1 / f1))
        value = f * wp.exp(s * rise)
        middle = wp.float64(0.5) * wp.length(g / f + g1 / f1)
        if middle > wp.float64(0.0):
            rise = rise * wp.length(a + b) / middle
        return value, value * (a + b), value * (bend + wp.outer(a + b, a + b)), value * rise
    return f + s * grown, g + s * (g1 - g), h + s * (h1 - h), grown


@functools.cache
def surface_jet(kinds_used):
    """Warp function (point, surfaces, moment, time after it) -> SurfaceJet."""
    fixed_kinds, moving_kinds = kinds_used
    fixed = jet_at((fixed_kinds, ()))
    one = registry.element_jet(moving_kinds).warp(wp.float64)

    @wp.func
    def still(p: wp.vec3d, surfaces: wp.ref[Stages], moment: Moment, later: wp.float64):
        jet = SurfaceJet()
        f, g, h = fixed(p, surfaces, moment.stage)
        jet.f = f
        jet.gradient = g
        jet.hessian = h
        return jet

    @wp.func
    def carried(p: wp.vec3d, surfaces: wp.ref[Stages], i: int, share: wp.float64, turn: wp.vec3d, shift: wp.vec3d):
        """The jet of a moving row's element, a share of a twist after the row's stage."""
        q = screw(p, -share * turn, -share * shift)
        f, x, y, z, xx, yy, zz, xy, xz, yz = one(q[0], q[1], q[2], surfaces.moving_rows, surfaces.moving_kinds, i)
        g = wp.vec3d(x, y, z)
        h = wp.mat33d(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        if share != wp.float64(0.0) and wp.dot(turn, turn) > wp.float64(0.0):
            m = rotation_of(share * turn)
            g = m * g
            h = m * h * wp.transpose(m)
        return f, g, h

    @wp.func
    def changing(p: wp.vec3d, surfaces: wp.ref[Stages], moment: Moment, later: wp.float64):
        jet = still(p, surfaces, moment, later)
        s = fraction(moment, later)
        weight = wp.abs(jet.f)
        first = moment.stage * surfaces.moving
        rows = surfaces.moving_rows
        for i in range(first, first + surfaces.moving):
            turn = turn_of(rows, i)
            shift = shift_of(rows, i)
            f, g, h = carried(p, surfaces, i, s, turn, shift)
            grown = wp.float64(0.0)
            if rows[i, DEFORMS] != wp.float64(0.0):
                # The next stage's row, by the twist of this one, back from the step's end.
                e, g1, h1 = carried(p, surfaces, i + surfaces.moving, s - wp.float64(1.0), turn, shift)
                f, g, h, grown = mixed(f, g, h, e, g1, h1, s)
            jet.f += f
            jet.gradient += g
            jet.hessian += h
            jet.rate += grown - wp.dot(g, wp.cross(turn, p) + shift)
            jet.turn += wp.abs(f) * turn
            jet.shift += wp.abs(f) * shift
            weight += wp.abs(f)
        if weight > wp.float64(0.0):
            jet.turn = jet.turn / weight
            jet.shift = jet.shift / weight
        return jet

    return changing if moving_kinds else still
