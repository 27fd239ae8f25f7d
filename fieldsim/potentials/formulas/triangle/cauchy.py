"""Triangles under the Cauchy kernel, edge by edge; interfaces as in `edges`, P as in `rational`."""

from fieldsim.portable import portable, real
from fieldsim.potentials.formulas.triangle.cubature import points_a_side
from fieldsim.potentials.formulas.triangle.edges import triangle_formula
from fieldsim.potentials.formulas.triangle.rational import strips
from fieldsim.potentials.kernels import Cauchy

# ... and Cauchy.
FAR_CAUCHY = 5.0


@portable
def cauchy_edge(d: real, lo: real, length: real, z: real, s: real, fold: real, outside: real):
    """All in units of F: s^-4 is taken in here."""
    i2 = real(1.0) / (s * s)
    zeta = z * z + i2
    g2 = d * d + zeta
    hi = lo + length
    _first, second, third, q_1, q_2, q_3 = strips(d, lo, length, zeta, outside)
    w_lo = i2 / (g2 + lo * lo)
    w_hi = i2 / (g2 + hi * hi)
    along = -s * s * length * (lo + hi) * w_lo * w_hi * (w_lo + w_hi)
    i4 = i2 * i2
    across = -real(2.0) * i4 * third
    nil = real(0.0)
    one = real(1.0)
    return i4 * second, along, across, i4 * q_1, i4 * q_2, i4 * q_3, nil, one, nil, one, nil, one, nil


@portable
def cauchy_total(
    q_1: real,
    q_2: real,
    q_3: real,
    q_4: real,
    angle_1: real,
    angle_2: real,
    angle_3: real,
    z: real,
    s: real,
    fold: real,
    outside: real,
    trace: real,
):
    """(F, F_z, F_zz)."""
    zeta = z * z + real(1.0) / (s * s)
    slope = real(2.0) * q_2 / zeta
    return q_1, z * slope, slope + real(4.0) * (z * z / zeta) * (q_3 / zeta)


@portable
def cauchy_far(away: real, size: real, s: real):
    """Points a side once distance or width exceeds FAR_CAUCHY sizes."""
    return points_a_side((away + real(1.0) / (s * s)) / (size * size), real(FAR_CAUCHY))


cauchy_triangle_jet = triangle_formula(Cauchy, cauchy_edge, cauchy_total, cauchy_far)
