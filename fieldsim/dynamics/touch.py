"""How a sphere lies to the surface F = 1, as Warp functions.

The *gap* of a sphere of radius r at x is log F(x + r n) with n = grad F / |grad F|: zero where the sphere touches the
surface, negative outside. The logarithm makes it smooth (quadratic along a line for one Gaussian) and never steep.
While a step lasts, log F of a moving surface is interpolated between its two stages, which moves one Gaussian as it
should be moved.
"""

import functools

import warp as wp

from fieldsim.dynamics.sources import Stages, field_at

# In units of the gap: where a touching sphere is put, and what still counts as touching.
TOLERANCE = wp.constant(wp.float64(1e-10))
TOUCHING = wp.constant(wp.float64(1e-9))
# Steps of an iteration at most.
REFINEMENTS = wp.constant(64)
TINY = wp.constant(wp.float64(1e-300))


@wp.struct
class Touch:
    """A sphere's relation to the surface: gap, outward unit normal, |grad gap|, the surface's speed along it."""

    gap: wp.float64
    normal: wp.vec3d
    slope: wp.float64
    speed: wp.float64


@wp.struct
class Moment:
    """Where in time: the step's first stage, its length dt, and the time t elapsed within it."""

    stage: int
    dt: wp.float64
    t: wp.float64


@functools.cache
def log_surface(kinds_used):
    """Warp function (point, surfaces, stage, s) -> (log F, its gradient) at the fraction s, and the surface's advance.

    The advance is how far the level surface through the point moves outward in the whole step.
    """
    field = field_at(kinds_used)

    @wp.func
    def logarithm(p: wp.vec3d, surfaces: Stages, stage: int):
        f, g = field(p, surfaces, stage)
        f = wp.max(f, TINY)
        return wp.log(f), g / f

    @wp.func
    def still(p: wp.vec3d, surfaces: Stages, stage: int, s: wp.float64):
        f, g = logarithm(p, surfaces, stage)
        return f, g, wp.float64(0.0)

    @wp.func
    def changing(p: wp.vec3d, surfaces: Stages, stage: int, s: wp.float64):
        f0, g0 = logarithm(p, surfaces, stage)
        f1, g1 = logarithm(p, surfaces, stage + 1)
        # The mean slope makes this exact for a Gaussian that is moved.
        mean = wp.max(wp.float64(0.5) * wp.length(g0 + g1), TINY)
        return f0 + s * (f1 - f0), g0 + s * (g1 - g0), (f1 - f0) / mean

    return changing if kinds_used[1] else still


@functools.cache
def touch_at(kinds_used):
    """Warp function (point, radius, surfaces, moment, time after it) -> Touch."""
    surface = log_surface(kinds_used)

    @wp.func
    def touch(p: wp.vec3d, radius: wp.float64, surfaces: Stages, moment: Moment, later: wp.float64):
        s = (moment.t + later) / moment.dt
        _gap, inward, _advance = surface(p, surfaces, moment.stage, s)
        gap, g, advance = surface(p + radius * wp.normalize(inward), surfaces, moment.stage, s)
        result = Touch()
        result.gap = gap
        result.slope = wp.max(wp.length(g), TINY)
        result.normal = -g / result.slope
        if wp.length(g) == wp.float64(0.0):  # at the very centre of a body every way is out
            result.normal = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(1.0))
        result.speed = advance / moment.dt
        return result

    return touch


@functools.cache
def push_out(kinds_used):
    """Warp function (point, radius, grain, surfaces, moment) -> the point moved along the gradient until it touches."""
    touch_of = touch_at(kinds_used)

    @wp.func
    def push(p: wp.vec3d, radius: wp.float64, grain: wp.float64, surfaces: Stages, moment: Moment):
        longest = wp.float64(4.0) * grain
        for _ in range(REFINEMENTS):
            touch = touch_of(p, radius, surfaces, moment, wp.float64(0.0))
            if touch.gap <= wp.float64(0.0) and touch.gap >= -TOLERANCE:
                break
            step = (touch.gap + wp.float64(0.5) * TOLERANCE) / touch.slope
            p = p + wp.clamp(step, -longest, longest) * touch.normal
        return p

    return push
