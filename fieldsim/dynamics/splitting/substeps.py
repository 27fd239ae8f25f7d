"""The one loop over the stages of a splitting, portable: on CPUs in lanes, a particle each; on GPUs a thread each.

Sums are compensated. The last acceleration is carried along, from step to step and from launch to launch, so that a run
cut into launches anywhere gives the same bytes.
"""

import functools
import math

from fieldsim.numerics.running_sums import compensated
from fieldsim.portable import Indices, Portable, Table, hole, portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.row import Layout

# What leads to one stage, in units of the step: the kick by the old acceleration that is due, a drift, the kick by the
# new acceleration, and the factor of the force gradient in it.
SUBSTEP = Layout()
OPENING = SUBSTEP.number("OPENING", "kick by the old acceleration")
DRIFT = SUBSTEP.number("DRIFT", "drift")
KICK = SUBSTEP.number("KICK", "kick by the new acceleration")
GRADIENT = SUBSTEP.number("GRADIENT", "factor of the force gradient")

fixed = hole("x, y, z, rows, kinds, first, count")
moving = hole("x, y, z, rows, kinds, first, count")
fixed_jet = hole("x, y, z, rows, kinds, first, count")
moving_jet = hole("x, y, z, rows, kinds, first, count")
plain = hole("x, y, z, factor, rows, kinds, still, moving_rows, moving_kinds, first, count")
pull = hole("x, y, z, factor, rows, kinds, still, moving_rows, moving_kinds, first, count")


@portable
def _plain_pull(
    x: real,
    y: real,
    z: real,
    factor: real,
    rows: Table,
    kinds: Indices,
    still: int,
    moving_rows: Table,
    moving_kinds: Indices,
    first: int,
    count: int,
):
    _f, ax, ay, az = fixed(x, y, z, rows, kinds, 0, still)
    _g, bx, by, bz = moving(x, y, z, moving_rows, moving_kinds, first, count)
    zero = real(0.0)
    return ax + bx, ay + by, az + bz, zero, zero, zero


@portable
def _pull_with_gradient(
    x: real,
    y: real,
    z: real,
    factor: real,
    rows: Table,
    kinds: Indices,
    still: int,
    moving_rows: Table,
    moving_kinds: Indices,
    first: int,
    count: int,
):
    if factor == real(0.0):
        return plain(x, y, z, factor, rows, kinds, still, moving_rows, moving_kinds, first, count)
    _f, ax, ay, az, axx, ayy, azz, axy, axz, ayz = fixed_jet(x, y, z, rows, kinds, 0, still)
    _g, bx, by, bz, bxx, byy, bzz, bxy, bxz, byz = moving_jet(x, y, z, moving_rows, moving_kinds, first, count)
    ax += bx
    ay += by
    az += bz
    xy = axy + bxy
    xz = axz + bxz
    yz = ayz + byz
    gx = factor * ((axx + bxx) * ax + xy * ay + xz * az)
    gy = factor * (xy * ax + (ayy + byy) * ay + yz * az)
    gz = factor * (xz * ax + yz * ay + (azz + bzz) * az)
    return ax, ay, az, gx, gy, gz


@portable
def substep(method: Table, j: int, dt: real):
    """What leads to stage j + 1, with the step put in: opening kick, drift, kick and factor of the force gradient."""
    factor = dt * (dt * (dt * method[j, GRADIENT]))
    return dt * method[j, OPENING], dt * method[j, DRIFT], dt * method[j, KICK], factor


@portable
def _substeps(
    x: real,
    y: real,
    z: real,
    u: real,
    v: real,
    w: real,
    x_rest: real,
    y_rest: real,
    z_rest: real,
    u_rest: real,
    v_rest: real,
    w_rest: real,
    ax: real,
    ay: real,
    az: real,
    dt: real,
    method: Table,
    begin: int,
    end: int,
    steps: int,
    stage: int,
    rows: Table,
    kinds: Indices,
    still: int,
    moving_rows: Table,
    moving_kinds: Indices,
    elements: int,
):
    """Positions, velocities, their rests and accelerations after sub-steps begin to end - 1 of `steps` steps.

    stage: at which they begin; still: how many elements stay; elements: how many move. The last result bounds how far
    from its start the path came: what the drifts add up to, and what the kicks may bend. Who leaves it pays nothing.
    """
    travel = real(0.0)
    for _step in range(steps):
        for j in range(begin, end):
            stage += 1
            opening, drift, kick, factor = substep(method, j, dt)
            x0 = x
            y0 = y
            z0 = z
            u0 = u
            v0 = v
            w0 = w
            kx = opening * ax
            ky = opening * ay
            kz = opening * az
            x, x_rest = compensated(x, x_rest, drift * (u + (u_rest + kx)))
            y, y_rest = compensated(y, y_rest, drift * (v + (v_rest + ky)))
            z, z_rest = compensated(z, z_rest, drift * (w + (w_rest + kz)))
            if kick != real(0.0) or factor != real(0.0):
                ax, ay, az, gx, gy, gz = pull(
                    x, y, z, factor, rows, kinds, still, moving_rows, moving_kinds, stage * elements, elements
                )
                u, u_rest = compensated(u, u_rest, kx + gx + kick * ax)
                v, v_rest = compensated(v, v_rest, ky + gy + kick * ay)
                w, w_rest = compensated(w, w_rest, kz + gz + kick * az)
            path = (x - x0) * (x - x0) + (y - y0) * (y - y0) + (z - z0) * (z - z0)
            bend = (u - u0) * (u - u0) + (v - v0) * (v - v0) + (w - w0) * (w - w0)
            travel += math.sqrt(path) + dt * math.sqrt(bend)
    return x, y, z, u, v, w, x_rest, y_rest, z_rest, u_rest, v_rest, w_rest, ax, ay, az, travel


@functools.cache
def substeps_of(kinds_used, gradients: bool) -> Portable:
    """The portable function for gravity of the given kinds, of what stays and of what moves.

    gradients: whether the method has any.
    """
    sums = [registry.field_sum(kinds) for kinds in kinds_used]
    acting = _plain_pull.bind(fixed=sums[0], moving=sums[1])
    if gradients:
        jets = [registry.jet_sum(kinds) for kinds in kinds_used]
        acting = _pull_with_gradient.bind(plain=acting, fixed_jet=jets[0], moving_jet=jets[1])
    return _substeps.bind(pull=acting)
