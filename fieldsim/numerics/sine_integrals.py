"""Integrals of even powers of the sine from 0 to an angle, portable: also small angles keep their digits."""

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
    """Integrals of sin^2 and of sin^4 from 0 to `angle` (0..pi); sin and cos are the angle's.

    The angle itself is read only where cos < COS_30. Relative errors < 20 and 60 ulp of the type.
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
    """Integral of sin^6 from 0 to an angle (0..pi) of given sine and cosine; fourth: that of sin^4. Error < 200 ulp."""
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


@portable
def sixth_power(u: real):
    """6 (integral of sin^6 from 0 to an angle up to pi/2) / (sin^6 t), t = tan(angle / 2), for u = t^2 in 0..1.

    (1 + u)^6 times its logarithm is all that is singular here, and at u = -1 only: a polynomial (Chebyshev
    interpolation in 60 digits) has a relative error of 2.4e-17. Short chains keep the processor's pipes full.
    """
    u2 = u * u
    u4 = u2 * u2
    a = real(1.7142857142857142) + real(0.9523809523809363) * u
    b = real(0.25974025974130754) + real(0.019980019952839847) * u
    c = real(-0.0013320009615797924) + real(0.0002350560095436157) * u
    d = real(-6.184121347613021e-05) + real(2.0558212962617222e-05) * u
    e = real(-7.907214725848895e-06) + real(3.2402367984700366e-06) * u
    f = real(-1.268611609358195e-06) + real(4.1215202816336025e-07) * u
    g = real(-9.252085993133494e-08) + real(1.0290551292250506e-08) * u
    return (a + b * u2) + u4 * ((c + d * u2) + u4 * (e + u2 * (f + u2 * g)))
