"""The gap between a sphere and the surface F = 1, as Warp functions.

The *gap* of a sphere of radius r at x is log F(x + r n) with n = grad F / |grad F|: zero where the sphere touches the
surface, negative outside. The logarithm makes it smooth (quadratic along a line for one Gaussian) and never steep.
Within a step, log F of a moving surface is interpolated linearly between its two stages, which is exact for the motion
of one Gaussian.
"""

import functools

import warp as wp

from fieldsim.sources.field import field_at
from fieldsim.sources.stages import Stages
from fieldsim.sources.surface_velocity import twist_at

# In units of the gap: accuracy of the contact position, and the greatest gap that counts as touching.
TOLERANCE = wp.constant(wp.float64(1e-10))
TOUCHING = wp.constant(wp.float64(1e-9))
# Greatest number of iterations.
REFINEMENTS = wp.constant(64)
# Directions that differ by less count as equal; step of finite differences, in radii.
ALIGNED = wp.constant(wp.float64(1e-9))
DIFFERENCE = wp.constant(wp.float64(1e-5))
TINY = wp.constant(wp.float64(1e-300))


@wp.struct
class Gap:
    """Gap of a sphere: value, outward unit normal, slope |grad gap|, and speed of the surface along the normal.

    low: the sphere's lowest point, where the gap is measured.
    """

    value: wp.float64
    normal: wp.vec3d
    slope: wp.float64
    speed: wp.float64
    low: wp.vec3d


@wp.struct
class Level:
    """log F at a point, its gradient, and how much both change over the step."""

    value: wp.float64
    gradient: wp.vec3d
    change: wp.float64
    turn: wp.vec3d


@wp.struct
class Moment:
    """A time within a step: the step's first stage, its length dt, and the time t since its start."""

    stage: int
    dt: wp.float64
    t: wp.float64


@functools.cache
def log_surface(kinds_used):
    """Warp function (point, surfaces, stage, s) -> Level at the fraction s of a step."""
    field = field_at(kinds_used)

    @wp.func
    def logarithm(p: wp.vec3d, surfaces: Stages, stage: int):
        f, g = field(p, surfaces, stage)
        f = wp.max(f, TINY)
        return wp.log(f), g / f

    @wp.func
    def still(p: wp.vec3d, surfaces: Stages, stage: int, s: wp.float64):
        f, g = logarithm(p, surfaces, stage)
        return Level(f, g, wp.float64(0.0), wp.vec3d())  # pyrefly: ignore[bad-argument-count]

    @wp.func
    def changing(p: wp.vec3d, surfaces: Stages, stage: int, s: wp.float64):
        f0, g0 = logarithm(p, surfaces, stage)
        f1, g1 = logarithm(p, surfaces, stage + 1)
        return Level(f0 + s * (f1 - f0), g0 + s * (g1 - g0), f1 - f0, g1 - g0)  # pyrefly: ignore[bad-argument-count]

    return changing if kinds_used[1] else still


@functools.cache
def gap_at(kinds_used):
    """Warp function (point, radius, surfaces, moment, time after it) -> Gap.

    The normal is the gradient of the gap itself, which in a concave corner is not that of F at the lowest point: as the
    sphere moves, n turns. With w = grad log F there and L = grad log F at the centre, it is w + r/|L| H w', where w' is
    the part of w across L and H the Hessian of log F at the centre, taken as a difference.
    """
    surface = log_surface(kinds_used)
    twist = twist_at(kinds_used)

    @wp.func
    def gap(p: wp.vec3d, radius: wp.float64, surfaces: Stages, moment: Moment, later: wp.float64):
        s = (moment.t + later) / moment.dt
        center = surface(p, surfaces, moment.stage, s)
        size = wp.max(wp.length(center.gradient), TINY)
        lowest = p + radius / size * center.gradient
        low = surface(lowest, surfaces, moment.stage, s)
        gradient = low.gradient
        change = low.change
        # With the mean slope over the step the speed of a moved Gaussian is exact.
        mean = gradient + (wp.float64(0.5) - s) * low.turn
        across = gradient - wp.dot(gradient, center.gradient) / (size * size) * center.gradient
        aside = wp.length(across)
        if aside > ALIGNED * wp.length(gradient):
            step = DIFFERENCE * radius / aside
            beside = surface(p + step * across, surfaces, moment.stage, s)
            turned = radius / (size * step) * (beside.gradient - center.gradient)
            gradient = gradient + turned
            mean = mean + turned
            change = change + radius / size * wp.dot(across, center.turn)
        result = Gap()
        result.value = low.value
        result.low = lowest
        result.slope = wp.max(wp.length(gradient), TINY)
        result.normal = -gradient / result.slope
        if wp.length(gradient) == wp.float64(0.0):  # at the very centre of a body any direction leads out
            result.normal = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(1.0))
        # Speed along the normal: that of the material, and what growth and deformation add.
        turn, shift = twist(lowest, surfaces, moment.stage)
        carried = wp.cross(turn, lowest) + shift
        grown = (change + wp.dot(mean, carried)) / wp.max(wp.length(mean), TINY)
        result.speed = (wp.dot(carried, result.normal) + grown) / moment.dt
        return result

    return gap


@functools.cache
def push_out(kinds_used):
    """Warp function (point, radius, grain, surfaces, moment) -> the point moved along the gradient until it touches."""
    gap_of = gap_at(kinds_used)

    @wp.func
    def push(p: wp.vec3d, radius: wp.float64, grain: wp.float64, surfaces: Stages, moment: Moment):
        longest = wp.float64(4.0) * grain
        for _ in range(REFINEMENTS):
            gap = gap_of(p, radius, surfaces, moment, wp.float64(0.0))
            if gap.value <= wp.float64(0.0) and gap.value >= -TOLERANCE:
                break
            step = (gap.value + wp.float64(0.5) * TOLERANCE) / gap.slope
            p = p + wp.clamp(step, -longest, longest) * gap.normal
        return p

    return push
