"""Free bodies, and what prescribed ones give, as the tables that kernels read."""

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.contact.surface_points import spacing
from fieldsim.dynamics.rigid.gravity import Masses
from fieldsim.dynamics.rigid.rigids import Rigids
from fieldsim.dynamics.rigid.shells import Shells
from fieldsim.numerics import quaternion
from fieldsim.potentials.bounds.reach import scale
from fieldsim.potentials.elements import concatenate
from fieldsim.potentials.row import ROW_WIDTH
from fieldsim.sources.elements import Sources
from fieldsim.sources.margins import with_reach
from fieldsim.sources.rows import STILL_WIDTH
from fieldsim.sources.stages import Stages, tables, upload
from fieldsim.sources.surface_velocity import twist_rates

HOST = "cpu"


def prescribed_tables(gravity: Sources, surfaces: Sources, times, rates: bool = False) -> tuple[Stages, Stages]:
    """What prescribed bodies give at the stages `times`: their gravity, and their surfaces with their reach.

    rates: whether with their twists per unit of time as well.
    """
    fixed = with_reach(surfaces.fixed.rows, surfaces.fixed.kinds, len(surfaces))
    moving = with_reach(surfaces.rows_at(times), surfaces.moving_kinds, len(surfaces))
    if rates:
        moving = np.concatenate([moving, twist_rates(surfaces, times)], axis=-1)
    return upload(gravity, times, HOST), tables(surfaces, fixed, moving, HOST)


def rigid_state(starts) -> Rigids:
    """The state at the start."""
    state = Rigids()
    motions = [start.body.motion for start in starts]
    q = np.array([start.turn for start in starts])
    turns = quaternion.matrices(q)
    local = np.einsum("bji,bj->bi", turns, [motion.angular_velocity for motion in motions])
    moments = np.array([start.moments for start in starts])
    state.x = host_array([start.center for start in starts], wp.vec3d)
    state.p = host_array([s.mass * np.array(m.velocity) for m, s in zip(motions, starts, strict=True)], wp.vec3d)
    state.q = host_array(q[:, [1, 2, 3, 0]], wp.quatd)
    state.spin = host_array(np.einsum("bij,bj->bi", turns, moments * local), wp.vec3d)
    state.e = host_array(0.5 * np.sum(moments * local**2, axis=1), wp.float64)
    state.e_rest = wp.zeros(len(starts), dtype=wp.float64, device=HOST)
    for name in ("x_rest", "p_rest", "spin_rest", "force", "torque"):
        setattr(state, name, wp.zeros(len(starts), dtype=wp.vec3d, device=HOST))
    return state


def masses_of(starts) -> Masses:
    """Free bodies as gravity sees them."""
    masses = Masses()
    points, weights = zip(*(start.mass_points() for start in starts), strict=True)
    masses.mass = host_array([start.mass for start in starts], wp.float64)
    masses.inverse = host_array([1.0 / start.moments for start in starts], wp.vec3d)
    masses.points, masses.first_point = host_array(np.concatenate(points), wp.vec3d), _firsts(points)
    masses.weights = host_array(np.concatenate(weights), wp.float64)
    _pack_rows(masses, [start.gravity_elements() for start in starts], ROW_WIDTH)
    return masses


def shells_of(starts, stiffnesses) -> Shells:
    """Free bodies as contact sees them; stiffnesses: one per body."""
    shells = Shells()
    found = [start.shell for start in starts if start.shell]
    before = np.cumsum([0, *(len(shell.points) for shell in found)])
    ends = [shell.ends + first for shell, first in zip(found, before, strict=False)]
    shells.points = host_array(np.concatenate([np.zeros((0, 3)), *(shell.points for shell in found)]), wp.vec3d)
    shells.blocks = host_array(np.concatenate([np.zeros((0, 4)), *(shell.blocks for shell in found)]), wp.vec4d)
    shells.block_end = wp.array(np.concatenate([[], *ends]), dtype=wp.int32, device=HOST)
    shells.first_block = _firsts([start.shell.ends if start.shell else () for start in starts])
    _pack_rows(shells, [start.surface_elements() for start in starts], STILL_WIDTH)
    reach = [np.linalg.norm(start.shell.points, axis=1).max() if start.shell else 0.0 for start in starts]
    shells.reach = host_array(1.01 * np.array(reach), wp.float64)
    shells.spacing = host_array([spacing(start.radius) if start.shell else 0.0 for start in starts], wp.float64)
    set_stiffness(shells, starts, stiffnesses)
    return shells


def set_stiffness(shells: Shells, starts, stiffnesses) -> None:
    """Give the surfaces their stiffnesses, one per body."""
    weights = [k * start.shell.areas for start, k in zip(starts, stiffnesses, strict=True) if start.shell]
    shells.weights = host_array(np.concatenate([[], *weights]), wp.float64)
    shells.stiffness = host_array(stiffnesses, wp.float64)


def grains_of(starts, surfaces: Sources, time: float):
    """Lengths over which the surfaces' fields vary (B + 1,): of the free bodies, and of all prescribed ones."""
    parts = [start.surface_elements() for start in starts]
    lengths = [scale(part.rows, part.kinds) for part in parts]
    moving = surfaces.rows_at(np.array([time]))[0]
    fixed = surfaces.fixed
    lengths.append(np.concatenate([scale(fixed.rows, fixed.kinds), scale(moving, surfaces.moving_kinds)]))
    # What has no elements is never asked.
    return host_array([np.min(part, initial=validate.FARTHEST) for part in lengths], wp.float64)


def that_feel(masses: Masses, shells: Shells) -> tuple[Masses, Shells]:
    """Tables of the same bodies, which feel what is prescribed, but not each other."""
    feeling, touching = _copied(Masses, masses), _copied(Shells, shells)
    feeling.first_row = wp.zeros_like(masses.first_row)
    touching.apart = 1
    return feeling, touching


def _copied(kind, table):
    """A table, of the struct `kind`, that shares the arrays of another."""
    copied = kind()
    for name in kind.vars:
        setattr(copied, name, getattr(table, name))
    return copied


def host_array(values, dtype):
    """A Warp array on the host."""
    return wp.array(np.asarray(values, dtype=float), dtype=dtype, device=HOST)


def _firsts(parts):
    """Where each part begins in all together, and the end of the last."""
    return wp.array(np.cumsum([0, *(len(part) for part in parts)]), dtype=wp.int32, device=HOST)


def _pack_rows(table, parts, width):
    """Elements of all bodies into a table's rows, kinds and first_row."""
    rows = np.concatenate([np.zeros((0, width)), *(part.rows for part in parts if len(part))])
    table.rows = wp.array(rows, dtype=wp.float64, device=HOST)
    table.kinds = wp.array(concatenate(parts).kinds, dtype=wp.int32, device=HOST)
    table.first_row = _firsts(parts)
