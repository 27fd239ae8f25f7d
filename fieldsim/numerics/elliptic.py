"""Elliptic integrals and functions, portable: complete ones for circles, Carlson's for arcs, Jacobi's for rotors."""

import math

from fieldsim.numerics.polynomials import degree_11
from fieldsim.portable import portable, real


@portable
def elliptic_dv(m1: real):
    """Complete elliptic integrals (D, V) of the complementary parameter m1 = 1 - m in (0, 1].

    D = integral of sin^2 / Delta, V = 3 integral of sin^2 cos^2 / Delta over 0..pi/2, Delta = sqrt(1 - m sin^2). All
    others follow as sums of positive terms: B = m V + m1 D (the integral of cos^2 / Delta), K = B + D, E = B + m1 D,
    K - E = m D. Associate integrals: Fukushima 2011; V because B - m1 D = m V is what vanishes on a ring's axis: with D
    and V a ring's attraction cancels neither there nor on its wire.
    Fits P - log(m1) Q (after Cephes), relative error 1e-18 for D, 3e-17 for V; with rounding < 8 and < 20 ulp of the
    type, V's because P and log(m1) Q have opposite signs there.
    """
    log = math.log(m1)
    d = degree_11(
        m1,
        real(0.38629436111989063),
        real(0.039720770841994595),
        real(0.013800726476026414),
        real(0.006907998252931432),
        real(0.004204450369461891),
        real(0.004620747997290806),
        real(0.020242149835704208),
        real(0.07573202518765218),
        real(0.12758538983406545),
        real(0.0858886128681482),
        real(0.01945958378693224),
        real(0.0009413468273502661),
    ) - log * degree_11(
        m1,
        real(0.5),
        real(0.3749999999997751),
        real(0.3515624994311849),
        real(0.3417966717555357),
        real(0.33643727160701353),
        real(0.33246976918120413),
        real(0.32242773235621264),
        real(0.2778920450520383),
        real(0.17101526724808247),
        real(0.0566580341563865),
        real(0.00724815060444629),
        real(0.00019299268313037652),
    )
    v = degree_11(
        m1,
        real(1.0),
        real(0.670558458303885),
        real(0.6479220709003815),
        real(0.6421397165726599),
        real(0.6388847738911166),
        real(0.611695514764977),
        real(0.35353670936305065),
        -real(0.6099759728091586),
        -real(1.7105994175435988),
        -real(1.3190010993964651),
        -real(0.3199162391295717),
        -real(0.016195892369189908),
    ) - log * degree_11(
        m1,
        real(0.0),
        -real(0.7499999999983039),
        -real(1.4062499944267117),
        -real(2.050778915359844),
        -real(2.691405635786438),
        -real(3.322184339238274),
        -real(3.8432805842680313),
        -real(3.782877107890597),
        -real(2.554104387773622),
        -real(0.9023932594957298),
        -real(0.12101610269230859),
        -real(0.003343093980739582),
    )
    return d, v


@portable
def carlson_d_pair(x: real, y: real, z: real):
    """Carlson's R_D(x, z; y) and R_D(x, y; z) for 0 <= x <= y <= z, y > 0. Relative error < 16 ulp of the type."""
    d_y, d_z, _ratio = carlson_d_trio(x, y, z)
    return d_y, d_z


@portable
def carlson_d_trio(x: real, y: real, z: real):
    """R_D(x, z; y), R_D(x, y; z) and (the first - the second) / (z - y), arguments as `carlson_d_pair`.

    Duplication (Carlson 1995) until the arguments agree to 6 %, then a series. Each round quarters the spread: 2 to 6
    rounds, more only where y / z < 1e-9. The ratio, which is -2 dR_D(x, z; y)/dz, takes the differences inside the
    sums: all its terms are positive. Relative error of the ratio < 20 ulp.
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


# Taylor coefficients of `jacobi_functions`: with e = P + N, f = P N,
# S = t - e t^3/3! + (e^2 + 12 f) t^5/5! - (e^3 + 132 e f) t^7/7! + ...
C3 = 1 / 6
C5 = 1 / 120
C7 = 1 / 5040
C9 = 1 / 362880
C11 = 1 / 39916800


@portable
def jacobi_functions(t: real, p: real, n: real):
    """S of S'^2 = (1 - P S^2) (1 - N S^2) and its partners C = sqrt(1 - P S^2), D = sqrt(1 - N S^2).

    For max(P, N) t^2 <= 1/16. With P = lambda^2 >= N = (k lambda)^2 these are Jacobi's sn(lambda t) / lambda, cn and
    dn. The series of a quarter of t (DLMF 22.10.4), doubled twice (22.6.5). Relative error < 4 ulp of the type.
    """
    h = real(0.25) * t
    e = (p + n) * h * h
    f = p * n * h * h * h * h
    series = real(1.0) - real(C3) * e + real(C5) * (e * e + real(12.0) * f)
    series -= real(C7) * e * (e * e + real(132.0) * f)
    series += real(C9) * (e * e * e * e + real(1224.0) * e * e * f + real(3024.0) * f * f)
    series -= real(C11) * e * (e * e * e * e + real(11064.0) * e * e * f + real(132624.0) * f * f)
    s = h * series
    c = real(1.0)
    d = real(1.0)
    for k in range(3):
        s2 = s * s
        c = math.sqrt(real(1.0) - p * s2)
        d = math.sqrt(real(1.0) - n * s2)
        if k < 2:
            s = real(2.0) * s * c * d / (real(1.0) - p * n * s2 * s2)
    return s, c, d
