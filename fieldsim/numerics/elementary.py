"""Logarithm and exponential where their plain forms would cancel, portable. An ulp is 2^-52, in float32 2^-23."""

import math

from fieldsim.portable import portable, real


@portable
def log1p(x: real):
    """log(1 + x) for x >= -1 (-inf at -1, inf at inf). Relative error < 4 ulp.

    W. Kahan's form: log(u) x / (u - 1) with u = 1 + x as rounded, in which the rounding of u cancels (Goldberg 1991).
    """
    u = real(1.0) + x
    rounded = u - real(1.0)
    if rounded == real(0.0):
        return x
    if rounded == x:
        return math.log(u)
    return math.log(u) * (x / rounded)


@portable
def exp_slope(x: real):
    """(1 - exp(-x)) / x for x >= 0 (1 at 0). Relative error < 4 ulp.

    Kahan's form again, now with u = exp(-x) as rounded and x = -log(u).
    """
    u = math.exp(-x)
    if u == real(1.0):
        return real(1.0)
    if u < real(0.5):
        return (real(1.0) - u) / x
    return (u - real(1.0)) / math.log(u)


@portable
def exp_moment(x: real):
    """(1 - (1 + x) exp(-x)) / x^2 for x >= 0 (1/2 at 0): the integral of t exp(-x t) over 0..1. Error < 4 ulp."""
    if x < real(1.0):
        # Taylor's series to x^17.
        p = -real(1.4797143443923793e-16)
        p = p * x + real(2.6552651846596585e-15)
        p = p * x - real(4.498331606952833e-14)
        p = p * x + real(7.169215998581078e-13)
        p = p * x - real(1.0706029224547743e-11)
        p = p * x + real(1.4911969277048643e-10)
        p = p * x - real(1.9270852604185937e-09)
        p = p * x + real(2.296443268665491e-08)
        p = p * x - real(2.505210838544172e-07)
        p = p * x + real(2.48015873015873e-06)
        p = p * x - real(2.2045855379188714e-05)
        p = p * x + real(0.00017361111111111112)
        p = p * x - real(0.0011904761904761906)
        p = p * x + real(0.006944444444444444)
        p = p * x - real(0.03333333333333333)
        p = p * x + real(0.125)
        p = p * x - real(0.3333333333333333)
        p = p * x + real(0.5)
        return p
    u = math.exp(-x)
    return (real(1.0) - u - x * u) / (x * x)
