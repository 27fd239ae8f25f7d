"""Integrals of even powers of the sine from 0 to an angle, portable, to rounding also for small angles."""

from fieldsim.numerics.constants import COS_30
from fieldsim.portable import portable, real


@portable
def sine_fourth_series(u: real):
    """Integral of sin^4 from 0 to an angle below 30 degrees over t^5, t = tan(angle / 2), as a series in u = t^2."""
    p = real(789.5640093228268)
    p = p * u - real(918.4891935592188)
    p = p * u + real(747.2761859335488)
    p = p * u - real(555.3818682741709)
    p = p * u + real(395.27874539897095)
    p = p * u - real(268.7996256628945)
    p = p * u + real(172.30768660581057)
    p = p * u - real(101.81818176740428)
    p = p * u + real(53.33333333310107)
    p = p * u - real(22.857142857142442)
    p = p * u + real(6.3999999999999995)
    return p


@portable
def sine_powers(sin: real, cos: real, angle: real):
    """Integrals of sin^2 and of sin^4 from 0 to `angle` (0..pi), each to rounding; sin and cos are the angle's.

    The angle itself is read only where cos < COS_30.
    """
    cube = sin * sin * sin
    if cos < real(COS_30):
        square = real(0.5) * (angle - sin * cos)
        return square, real(0.75) * square - real(0.25) * cube * cos
    # Small angles, where these differences cancel: a Chebyshev series in t^2 = tan(angle / 2)^2 <= 0.0718.
    t = sin / (real(1.0) + cos)
    u = t * t
    fourth = sine_fourth_series(u) * u * u * t
    return (real(4.0) * fourth + cube * cos) / real(3.0), fourth


@portable
def sine_sixth(sin: real, cos: real, fourth: real):
    """Integral of sin^6 from 0 to an angle (0..pi), to rounding; sin and cos: the angle's; fourth: that of sin^4."""
    cube = sin * sin * sin
    if cos < real(COS_30):
        return (real(5.0) * fourth - cube * sin * sin * cos) / real(6.0)
    # As in `sine_powers`, a Chebyshev series in t^2 = tan(angle / 2)^2 <= 0.0718; its relative error is 7e-18.
    t = sin / (real(1.0) + cos)
    u = t * t
    p = -real(30375.974594686526)
    p = p * u + real(33879.76593772341)
    p = p * u - real(25207.637539041425)
    p = p * u + real(16684.585495158175)
    p = p * u - real(10458.196212740755)
    p = p * u + real(6224.805366193648)
    p = p * u - real(3478.5875112311032)
    p = p * u + real(1791.9999909275573)
    p = p * u - real(827.0769230097103)
    p = p * u + real(325.81818181792414)
    p = p * u - real(99.55555555555517)
    p = p * u + real(18.285714285714285)
    return p * u * u * u * t
