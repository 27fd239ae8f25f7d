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

    Duplication (Carlson 1995) until the arguments agree to 6 %, then a series. Each round quarters the spread: 2 to 6
    rounds, more only where y / z < 1e-9. The ratio, which is -2 dR_D(x, z; y)/dz, takes the differences inside the
    sums: all its terms are positive.
    """
    sum_y = real(0.0)
    sum_z = real(0.0)
    ratio = real(0.0)
    factor = real(3.0)
    quarters = real(1.0)
    while z - x > real(0.063) * z:
        root_x = math.sqrt(x)
        root_y = math.sqrt(y)
        root_z = math.sqrt(z)
        step = root_x * (root_y + root_z) + root_y * root_z
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
    factor *= real(1.0) / real(3.0)
    d_y, d_z, near = _carlson_near(x, y, z)
    return sum_y + factor * d_y, sum_z + factor * d_z, ratio + factor * quarters * near


@portable
def _carlson_near(x: real, y: real, z: real):
    """As `carlson_d_trio`, for arguments within 6.3 % of each other: the errors of the series are 9e-18 and 4e-16.

    Of R_F = S / sqrt(mean), -6 times the derivatives by y, by z, and 4 times that by both. In the elementary symmetric
    functions e2, e3 of the deviations, whose sum is 0, S is here summed to twelfth order: term n of (1 + e2 t^2 -
    e3 t^3)^(-1/2), divided by 2 n + 1 (Carlson 1979).
    """
    mean = (x + y + z) * (real(1.0) / real(3.0))
    per = real(1.0) / mean
    a = (mean - x) * per
    b = (mean - y) * per
    c = (mean - z) * per
    bc = b * c
    e2 = bc - a * a
    e3 = a * bc
    # S, and its derivatives by e2 and by e3: by powers of e3.
    p0 = real(-0.01171875) + real(0.0090234375) * e2
    p0 = ((p0 * e2 + real(0.01608455882352941)) * e2 - real(0.02403846153846154)) * e2
    p0 = ((p0 + real(0.041666666666666664)) * e2 - real(0.1)) * e2
    p1 = (real(-0.05756578947368421) + real(0.053498641304347824) * e2) * e2 + real(0.0625)
    p1 = (p1 * e2 - real(0.06818181818181818)) * e2 + real(0.07142857142857142)
    p2 = ((real(0.078125) - real(0.0984375) * e2) * e2 - real(0.05514705882352941)) * e2 + real(0.028846153846153848)
    p3 = real(0.01644736842105263) - real(0.04755434782608696) * e2
    s = real(1.0) + (p0 + e3 * (p1 + e3 * (p2 + e3 * (p3 + real(0.0109375) * e3))))
    by_e3 = p1 + e3 * (real(2.0) * p2 + e3 * (real(3.0) * p3 + real(0.04375) * e3))
    q0 = (real(-0.05859375) + real(0.054140625) * e2) * e2 + real(0.06433823529411764)
    q0 = ((q0 * e2 - real(0.07211538461538461)) * e2 + real(0.08333333333333333)) * e2 - real(0.1)
    q1 = ((real(0.2139945652173913) * e2 - real(0.17269736842105263)) * e2 + real(0.125)) * e2
    q1 -= real(0.06818181818181818)
    q2 = (real(0.15625) - real(0.2953125) * e2) * e2 - real(0.05514705882352941)
    by_e2 = q0 + e3 * (q1 + e3 * (q2 - real(0.04755434782608696) * e3))
    scale = per * math.sqrt(per)
    common = s + real(4.0) * e2 * by_e2 - real(2.0) * (e2 - real(3.0) * e3) * by_e3
    return (
        scale * (common - real(6.0) * b * by_e2 + real(6.0) * a * c * by_e3),
        scale * (common - real(6.0) * c * by_e2 + real(6.0) * a * b * by_e3),
        -real(6.0) * scale * per * (by_e2 + a * by_e3),
    )
