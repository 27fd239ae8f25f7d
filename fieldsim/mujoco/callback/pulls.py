"""The pull of the field on one mass point of a body, or on a whole body at its centre of mass: portable, run in lanes.

Two ways to feel gravity: as a sum over mass points ("points", "geoms"), which derives from its energy exactly, or at
the centre of mass with the torque of the field's gradient across the body ("torque"). Each gives the force, the torque
about the centre of mass and the potential energy: seven numbers, of one point or of the body.
"""

import functools

from fieldsim.mujoco.callback.rows import (
    BODY_INERTIA,
    BODY_MATRIX_X,
    GROUP_CENTER_X,
    GROUP_COUNT,
    GROUP_FIRST,
    GROUP_SPINS,
    GROUP_TURN_X,
    PLACED_WIDTH,
    PULL_WIDTH,
)
from fieldsim.portable import Indices, Portable, Table, hole, portable, real
from fieldsim.potentials import registry

TURN, CENTER, MATRIX, INERTIA = GROUP_TURN_X, GROUP_CENTER_X, BODY_MATRIX_X, BODY_INERTIA

total = hole("x, y, z, rows, kinds, first, count")
field = hole("x, y, z, turned, groups, rows, kinds")
jet = hole("x, y, z, turned, groups, rows, kinds")


@portable
def _turned(x: real, y: real, z: real, table: Table, k: int, first: int):
    """A vector turned by the rotation in columns first.. of a row."""
    return (
        table[k, first] * x + table[k, first + 1] * y + table[k, first + 2] * z,
        table[k, first + 3] * x + table[k, first + 4] * y + table[k, first + 5] * z,
        table[k, first + 6] * x + table[k, first + 7] * y + table[k, first + 8] * z,
    )


@portable
def _turned_back(x: real, y: real, z: real, table: Table, k: int, first: int):
    """`_turned` back."""
    return (
        table[k, first] * x + table[k, first + 3] * y + table[k, first + 6] * z,
        table[k, first + 1] * x + table[k, first + 4] * y + table[k, first + 7] * z,
        table[k, first + 2] * x + table[k, first + 5] * y + table[k, first + 8] * z,
    )


@portable
def _into_group(x: real, y: real, z: real, turned: Table, g: int):
    """A point in the frame of a group that spins."""
    qx, qy, qz = _turned_back(
        x - turned[g, CENTER], y - turned[g, CENTER + 1], z - turned[g, CENTER + 2], turned, g, TURN
    )
    return qx + turned[g, CENTER], qy + turned[g, CENTER + 1], qz + turned[g, CENTER + 2]


@portable
def _field(x: real, y: real, z: real, turned: Table, groups: int, rows: Table, kinds: Indices):
    """F and its gradient, of all groups."""
    f = real(0.0)
    fx = real(0.0)
    fy = real(0.0)
    fz = real(0.0)
    for g in range(groups):
        first = int(turned[g, GROUP_FIRST])
        count = int(turned[g, GROUP_COUNT])
        if turned[g, GROUP_SPINS] != real(0.0):
            qx, qy, qz = _into_group(x, y, z, turned, g)
            more, gx, gy, gz = total(qx, qy, qz, rows, kinds, first, count)
            gx, gy, gz = _turned(gx, gy, gz, turned, g, TURN)
        else:
            more, gx, gy, gz = total(x, y, z, rows, kinds, first, count)
        f += more
        fx += gx
        fy += gy
        fz += gz
    return f, fx, fy, fz


@portable
def _across(x: real, y: real, z: real, xx: real, yy: real, zz: real, xy: real, xz: real, yz: real):
    """Hessian times a vector."""
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@portable
def _hessian_turned(xx: real, yy: real, zz: real, xy: real, xz: real, yz: real, turned: Table, g: int):
    """A group's Hessian in the world's frame: with the rows a, b, c of its rotation, a . H a and so on."""
    ax = turned[g, TURN]
    ay = turned[g, TURN + 1]
    az = turned[g, TURN + 2]
    bx = turned[g, TURN + 3]
    by = turned[g, TURN + 4]
    bz = turned[g, TURN + 5]
    cx = turned[g, TURN + 6]
    cy = turned[g, TURN + 7]
    cz = turned[g, TURN + 8]
    ux, uy, uz = _across(ax, ay, az, xx, yy, zz, xy, xz, yz)
    vx, vy, vz = _across(bx, by, bz, xx, yy, zz, xy, xz, yz)
    wx, wy, wz = _across(cx, cy, cz, xx, yy, zz, xy, xz, yz)
    return (
        ax * ux + ay * uy + az * uz,
        bx * vx + by * vy + bz * vz,
        cx * wx + cy * wy + cz * wz,
        ax * vx + ay * vy + az * vz,
        ax * wx + ay * wy + az * wz,
        bx * wx + by * wy + bz * wz,
    )


@portable
def _jet(x: real, y: real, z: real, turned: Table, groups: int, rows: Table, kinds: Indices):
    """F, gradient and Hessian, of all groups."""
    f = real(0.0)
    fx = real(0.0)
    fy = real(0.0)
    fz = real(0.0)
    xx = real(0.0)
    yy = real(0.0)
    zz = real(0.0)
    xy = real(0.0)
    xz = real(0.0)
    yz = real(0.0)
    for g in range(groups):
        first = int(turned[g, GROUP_FIRST])
        count = int(turned[g, GROUP_COUNT])
        if turned[g, GROUP_SPINS] != real(0.0):
            qx, qy, qz = _into_group(x, y, z, turned, g)
            more, gx, gy, gz, a, b, c, d, e, h = total(qx, qy, qz, rows, kinds, first, count)
            gx, gy, gz = _turned(gx, gy, gz, turned, g, TURN)
            a, b, c, d, e, h = _hessian_turned(a, b, c, d, e, h, turned, g)
        else:
            more, gx, gy, gz, a, b, c, d, e, h = total(x, y, z, rows, kinds, first, count)
        f += more
        fx += gx
        fy += gy
        fz += gz
        xx += a
        yy += b
        zz += c
        xy += d
        xz += e
        yz += h
    return f, fx, fy, fz, xx, yy, zz, xy, xz, yz


@portable
def _on_point(
    k: int,
    ax: real,
    ay: real,
    az: real,
    x: real,
    y: real,
    z: real,
    m: real,
    frames: Table,
    turned: Table,
    groups: int,
    rows: Table,
    kinds: Indices,
):
    """Force, torque and energy of a point (x, y, z) of mass m, on an arm a."""
    f, gx, gy, gz = field(x, y, z, turned, groups, rows, kinds)
    gx *= m
    gy *= m
    gz *= m
    return gx, gy, gz, ay * gz - az * gy, az * gx - ax * gz, ax * gy - ay * gx, -(m * f)


@portable
def _at_center(
    k: int,
    ax: real,
    ay: real,
    az: real,
    x: real,
    y: real,
    z: real,
    m: real,
    frames: Table,
    turned: Table,
    groups: int,
    rows: Table,
    kinds: Indices,
):
    """Force at a body's centre of mass, the torque of the field's gradient across it, and the energy.

    With the principal axes e_i, moments I_i and H_ij = e_i . Hessian e_j, the torque about e_1 is (I_3 - I_2) H_23, and
    so on round; the energy is -m F - sum of j_i H_ii / 2 where j_i = (I_j + I_k - I_i) / 2 is the sum of m r_i^2. The
    tide's pull on the centre of mass, smaller by (size / distance)^2, is left out, and with it the energy is not kept:
    it takes third derivatives. The point is the body's centre, without an arm.
    """
    f, gx, gy, gz, xx, yy, zz, xy, xz, yz = jet(x, y, z, turned, groups, rows, kinds)
    i1 = frames[k, INERTIA]
    i2 = frames[k, INERTIA + 1]
    i3 = frames[k, INERTIA + 2]
    # The second and the third axis: columns of the body's matrix.
    bx = frames[k, MATRIX + 1]
    by = frames[k, MATRIX + 4]
    bz = frames[k, MATRIX + 7]
    cx = frames[k, MATRIX + 2]
    cy = frames[k, MATRIX + 5]
    cz = frames[k, MATRIX + 8]
    vx, vy, vz = _across(bx, by, bz, xx, yy, zz, xy, xz, yz)
    wx, wy, wz = _across(cx, cy, cz, xx, yy, zz, xy, xz, yz)
    h23 = bx * wx + by * wy + bz * wz
    h13 = frames[k, MATRIX] * wx + frames[k, MATRIX + 3] * wy + frames[k, MATRIX + 6] * wz
    h12 = frames[k, MATRIX] * vx + frames[k, MATRIX + 3] * vy + frames[k, MATRIX + 6] * vz
    tx, ty, tz = _turned((i3 - i2) * h23, (i1 - i3) * h13, (i2 - i1) * h12, frames, k, MATRIX)
    h2 = bx * vx + by * vy + bz * vz
    h3 = cx * wx + cy * wy + cz * wz
    h1 = xx + yy + zz - h2 - h3
    spread = (i2 + i3 - i1) * h1 + (i3 + i1 - i2) * h2 + (i1 + i2 - i3) * h3
    return m * gx, m * gy, m * gz, tx, ty, tz, -m * f - real(0.25) * spread


# What the arguments of `pull_of` are in lanes (see `portable.lanes.words`), and its results.
INPUTS = ("integers", *("reals",) * PLACED_WIDTH, "table", "table", "int", "table", "indices")
OUTPUTS = tuple(range(PULL_WIDTH))


@functools.cache
def pull_of(accuracy: str, kinds_used: tuple[int, ...]) -> Portable:
    """Portable (k, *placed, frames, turned, groups, rows, kinds) -> force, torque and energy of a point.

    k: its body's row in `frames`; placed: PLACED_WIDTH numbers. placed, frames, turned: see `mujoco.callback.rows`; the
    groups' elements are in rows and kinds.
    """
    if accuracy == "torque":
        return _at_center.bind(jet=_jet.bind(total=registry.jet_sum(kinds_used)))
    return _on_point.bind(field=_field.bind(total=registry.field_sum(kinds_used)))
