"""Where a query lies beside the ends of a bare arc, with more digits than coordinates have.

How far along the tangent the query is from an end is a difference of numbers of the arc's size, so that rounding left
1e-16 of that: too much for a field that grows towards the end. The few queries this close take it in pairs of numbers
whose sum has twice the digits (see `numerics.compensated`).
"""

from fieldsim.numerics.compensated import pair_product, pair_sum, two_difference
from fieldsim.portable import Table, portable, real
from fieldsim.potentials.row import ANGLE, FIRST_X, NORMAL_X, center_of, normal_of

# Closer to an end than this part of the radius, its distance is computed with care.
BESIDE = 1 / 64
BESIDE_SINGLE = 1 / 8
# Doublings of an angle, after which its series needs two terms beyond the angle itself.
DOUBLINGS = 20
SCALE = 2.0**-20


@portable
def _dot(ax: real, ax_low: real, ay: real, ay_low: real, az: real, az_low: real, rows: Table, i: int, k: int):
    """The product of a vector of pairs with the row's vector that starts at column k."""
    s, low = pair_product(ax, ax_low, rows[i, k], real(0.0))
    p, p_low = pair_product(ay, ay_low, rows[i, k + 1], real(0.0))
    s, low = pair_sum(s, low, p, p_low)
    p, p_low = pair_product(az, az_low, rows[i, k + 2], real(0.0))
    return pair_sum(s, low, p, p_low)


@portable
def _binormal(rows: Table, i: int, j: int, k: int):
    """The component of normal x start to which their columns j and k (0, 1, 2) make up, as a pair."""
    p, p_low = pair_product(rows[i, NORMAL_X + j], real(0.0), rows[i, FIRST_X + k], real(0.0))
    q, q_low = pair_product(rows[i, NORMAL_X + k], real(0.0), rows[i, FIRST_X + j], real(0.0))
    return pair_sum(p, p_low, -q, -q_low)


@portable
def _sine_versine(angle: real):
    """Sine and 1 - cosine, as pairs: of a small part of the angle by series, then doubled again and again."""
    x = real(SCALE) * angle
    u = x * x
    s = x
    s_low = x * u * (u / real(120.0) - real(1.0) / real(6.0))
    v, v_low = pair_product(real(0.5) * x, real(0.0), x, real(0.0))
    v_low += u * u * (u / real(720.0) - real(1.0) / real(24.0))
    for _ in range(int(DOUBLINGS)):
        p, p_low = pair_product(s, s_low, v, v_low)
        v, v_low = pair_product(s, s_low, s, s_low)
        v *= real(2.0)
        v_low *= real(2.0)
        s, s_low = pair_sum(s, s_low, -p, -p_low)
        s *= real(2.0)
        s_low *= real(2.0)
    return s, s_low, v, v_low


@portable
def _along_the_start(x: real, y: real, z: real, rows: Table, i: int):
    """The offset from the centre along the tangent at the start, and from the centre towards the start, as pairs.

    The start counts across the normal, and both are in the same unit, 1 to rounding.
    """
    cx, cy, cz = center_of(rows, i)
    dx, dx_low = two_difference(x, cx)
    dy, dy_low = two_difference(y, cy)
    dz, dz_low = two_difference(z, cz)
    bx, bx_low = _binormal(rows, i, 1, 2)
    by, by_low = _binormal(rows, i, 2, 0)
    bz, bz_low = _binormal(rows, i, 0, 1)
    q, q_low = pair_product(dx, dx_low, bx, bx_low)
    p, p_low = pair_product(dy, dy_low, by, by_low)
    q, q_low = pair_sum(q, q_low, p, p_low)
    p, p_low = pair_product(dz, dz_low, bz, bz_low)
    q, q_low = pair_sum(q, q_low, p, p_low)
    # Towards the start; what this has along the normal is taken off, and the normal is 1 to rounding only.
    p, p_low = _dot(dx, dx_low, dy, dy_low, dz, dz_low, rows, i, FIRST_X)
    zero = real(0.0)
    nx, ny, nz = normal_of(rows, i)
    lean, lean_low = _dot(nx, zero, ny, zero, nz, zero, rows, i, FIRST_X)
    size, size_low = _dot(nx, zero, ny, zero, nz, zero, rows, i, NORMAL_X)
    height = dx * nx + dy * ny + dz * nz
    excess = real(0.5) * ((size - real(1.0)) + size_low)
    p, p_low = pair_sum(p, p_low, p * excess - (lean + lean_low) * height, zero)
    return q, q_low, p, p_low


@portable
def beside_start(x: real, y: real, z: real, rows: Table, i: int):
    """The offset along the tangent at the arc's start."""
    q, _q_low, _p, _p_low = _along_the_start(x, y, z, rows, i)
    return q


@portable
def beside_end(x: real, y: real, z: real, rows: Table, i: int):
    """The offset along the tangent at the arc's end."""
    q, q_low, p, p_low = _along_the_start(x, y, z, rows, i)
    s, s_low, v, v_low = _sine_versine(rows[i, ANGLE])
    a, a_low = pair_product(q, q_low, v, v_low)
    q, q_low = pair_sum(q, q_low, -a, -a_low)
    b, b_low = pair_product(p, p_low, s, s_low)
    q, q_low = pair_sum(q, q_low, -b, -b_low)
    return q
