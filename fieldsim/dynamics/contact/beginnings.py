"""Where searches for contacts begin: beside the feet of elements near enough, as Warp functions."""

import functools

import warp as wp

from fieldsim.potentials import registry
from fieldsim.potentials.bounds.feet import foot_of
from fieldsim.sources.moments import Moment, fraction
from fieldsim.sources.rows import ALONE, REACH, shift_of, turn_of
from fieldsim.sources.stages import Stages
from fieldsim.sources.surface_velocity import screw


@wp.func
def direction_from(foot: wp.vec3d, center: wp.vec3d):
    """Unit vector from a foot to the centre; on the skeleton itself, some direction."""
    away = center - foot
    size = wp.length(away)
    if size > wp.float64(0.0):
        return away / size
    return wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(1.0))


@functools.cache
def _inner_of(kinds: tuple[int, ...]):
    """Warp function (point, foot, rows, kinds, i) -> where a search from a foot of row i goes that finds no field."""
    used = [formula for formula in registry.FORMULAS.values() if formula.kind in kinds]
    inner = {one.kind: one.primitive.inner or one.primitive.feet[0] for one in used if one.primitive.feet}
    if not any(one.primitive.inner for one in used):

        @wp.func
        def at_foot(
            p: wp.vec3d, foot: wp.vec3d, rows: wp.array2d(dtype=wp.float64), kinds: wp.array(dtype=wp.int32), i: int
        ):
            return foot

        return at_foot
    place = registry.by_kind(inner).warp(wp.float64)

    @wp.func
    def inside(
        p: wp.vec3d, foot: wp.vec3d, rows: wp.array2d(dtype=wp.float64), kinds: wp.array(dtype=wp.int32), i: int
    ):
        x, y, z = place(p[0], p[1], p[2], rows, kinds, i)
        return wp.vec3d(x, y, z)

    return inside


@wp.struct
class Beginning:
    """Where a search begins: the start beside a foot; near: 1 if what it finds can be near enough.

    foot: where the search goes if there is no field: the foot, or another place of the element.
    """

    near: wp.int32
    foot: wp.vec3d
    start: wp.vec3d


@functools.cache
def beginning_at(kinds_used):
    """Warp function (i, which, centre, within, surfaces, moment, time after it) -> Beginning.

    Of foot number `which` of element i, those that move after those that do not; within: how far from the centre the
    surface matters.
    """
    fixed_kinds, moving_kinds = kinds_used
    foot_fixed, foot_moving = (foot_of(kinds).warp(wp.float64) for kinds in kinds_used)
    inner_fixed, inner_moving = _inner_of(fixed_kinds), _inner_of(moving_kinds)

    @wp.func
    def still(i: int, which: int, center: wp.vec3d, within: wp.float64, surfaces: wp.ref[Stages], moment: Moment,
              later: wp.float64):  # fmt: skip
        result = Beginning()
        x, y, z = foot_fixed(center[0], center[1], center[2], surfaces.rows, surfaces.kinds, i, which)
        foot = wp.vec3d(x, y, z)
        if wp.length(foot - center) - surfaces.rows[i, REACH] < within:
            result.near = wp.int32(1)
            result.foot = inner_fixed(center, foot, surfaces.rows, surfaces.kinds, i)
            result.start = foot + surfaces.rows[i, ALONE] * direction_from(foot, center)
        return result

    @wp.func
    def changing(i: int, which: int, center: wp.vec3d, within: wp.float64, surfaces: wp.ref[Stages], moment: Moment,
                 later: wp.float64):  # fmt: skip
        fixed = surfaces.kinds.shape[0]
        if i < fixed:
            return still(i, which, center, within, surfaces, moment, later)
        result = Beginning()
        row = moment.stage * surfaces.moving + i - fixed
        s = fraction(moment, later)
        turn = s * turn_of(surfaces.moving_rows, row)
        shift = s * shift_of(surfaces.moving_rows, row)
        back = screw(center, -turn, -shift)
        x, y, z = foot_moving(back[0], back[1], back[2], surfaces.moving_rows, surfaces.moving_kinds, row, which)
        foot = wp.vec3d(x, y, z)
        if wp.length(foot - back) - surfaces.moving_rows[row, REACH] < within:
            result.near = wp.int32(1)
            inner = inner_moving(back, foot, surfaces.moving_rows, surfaces.moving_kinds, row)
            result.foot = screw(inner, turn, shift)
            foot = screw(foot, turn, shift)
            result.start = foot + surfaces.moving_rows[row, ALONE] * direction_from(foot, center)
        return result

    return changing if moving_kinds else still
