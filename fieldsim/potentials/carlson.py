"""Carlson's elliptic integral R_D, in the pairs that arcs need, as portable functions."""

import math

from fieldsim.portable import portable, real


@portable
def carlson_d_pair(x: real, y: real, z: real):
    """Carlson's R_D(x, z; y) and R_D(x, y; z) for 0 <= x <= y <= z, y > 0. Relative error 2e-15."""
    d_y, d_z, _ratio = carlson_d_trio(x, y, z)
    return d_y, d_z


@portable
def carlson_d_trio(x: real, y: real, z: real):
    """R_D(x, z; y), R_D(x, y; z) and (the first - the second) / (z - y), each to 2e-15; arguments as `carlson_d_pair`.

    Duplication (Carlson 1995) until the arguments agree to 1 %, then the series of DLMF 19.36.2, whose error is of
    eighth order. Each round quarters the spread: 4 to 8 rounds, more only where y / z < 1e-9. The ratio, which is
    -2 dR_D(x, z; y)/dz, takes the differences inside the sums: all its terms are positive.
    """
    sum_y = real(0.0)
    sum_z = real(0.0)
    ratio = real(0.0)
    factor = real(3.0)
    quarters = real(1.0)
    while z - x > real(0.01) * z:
        root_x = math.sqrt(x)
        root_y = math.sqrt(y)
        root_z = math.sqrt(z)
        step = root_x * root_y + root_x * root_z + root_y * root_z
        per_y = factor / (root_y * (y + step))
        per_z = factor / (root_z * (z + step))
        sum_y += per_y
        sum_z += per_z
        ratio += per_y * per_z * (y + z + root_y * root_z + step) / (real(3.0) * (root_y + root_z))
        factor *= real(0.25)
        quarters *= real(0.25)
        x = real(0.25) * (x + step)
        y = real(0.25) * (y + step)
        z = real(0.25) * (z + step)
    factor /= real(3.0)
    ratio += factor * quarters * _carlson_ratio_near(x, y, z)
    return sum_y + factor * _carlson_d_near(x, z, y), sum_z + factor * _carlson_d_near(x, y, z), ratio


@portable
def _carlson_ratio_near(x: real, y: real, z: real):
    """The ratio of `carlson_d_trio` for arguments within 1 % of each other.

    3/5 of Carlson's R of degree -5/2 with weights 1/2, 3/2, 3/2: a series in the power sums of the deviations, up to
    the seventh (Carlson 1979: the coefficients are those of the product of (1 - t deviation)^-weight).
    """
    mean = (x + real(3.0) * (y + z)) / real(7.0)
    a = (mean - x) / mean
    b = (mean - y) / mean
    c = (mean - z) / mean
    aa = a * a
    bb = b * b
    cc = c * c
    p2 = aa + real(3.0) * (bb + cc)
    p3 = aa * a + real(3.0) * (bb * b + cc * c)
    p4 = aa * aa + real(3.0) * (bb * bb + cc * cc)
    p5 = aa * aa * a + real(3.0) * (bb * bb * b + cc * cc * c)
    p6 = aa * aa * aa + real(3.0) * (bb * bb * bb + cc * cc * cc)
    p7 = aa * aa * aa * a + real(3.0) * (bb * bb * bb * b + cc * cc * cc * c)
    t2 = p2 / real(4.0)
    t3 = p3 / real(6.0)
    t4 = (p4 + p2 * t2) / real(8.0)
    t5 = (p5 + p3 * t2 + p2 * t3) / real(10.0)
    t6 = (p6 + p4 * t2 + p3 * t3 + p2 * t4) / real(12.0)
    t7 = (p7 + p5 * t2 + p4 * t3 + p3 * t4 + p2 * t5) / real(14.0)
    series = real(0.2) + t2 / real(9.0) + t3 / real(11.0) + t4 / real(13.0)
    series += t5 / real(15.0) + t6 / real(17.0) + t7 / real(19.0)
    return real(3.0) * series / (mean * mean * math.sqrt(mean))


@portable
def _carlson_d_near(x: real, y: real, z: real):
    """R_D(x, y; z) for arguments within 1 % of each other."""
    mean = real(0.2) * (x + y + real(3.0) * z)
    a = (mean - x) / mean
    b = (mean - y) / mean
    c = -(a + b) / real(3.0)
    ab = a * b
    cc = c * c
    e2 = ab - real(6.0) * cc
    e3 = (real(3.0) * ab - real(8.0) * cc) * c
    e4 = real(3.0) * (ab - cc) * cc
    e5 = ab * cc * c
    series = real(1.0) - e2 * real(3.0) / real(14.0) + e3 / real(6.0)
    series += e2 * e2 * real(9.0) / real(88.0) - e4 * real(3.0) / real(22.0) - e2 * e3 * real(9.0) / real(52.0)
    series += e5 * real(3.0) / real(26.0) - e2 * e2 * e2 / real(16.0) + e3 * e3 * real(3.0) / real(40.0)
    series += e2 * e4 * real(3.0) / real(20.0) + e2 * e2 * e3 * real(45.0) / real(272.0)
    series -= (e3 * e4 + e2 * e5) * real(9.0) / real(68.0)
    return series / (mean * math.sqrt(mean))
