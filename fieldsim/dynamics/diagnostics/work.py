"""The work that moving sources do on particles.

A particle of unit mass in a field F(x, t) has the energy v^2 / 2 - F, which changes at the rate -dF/dt at its place:
the work of moving the sources. With time as one more coordinate this rate is the kick of the momentum conjugate to
time: the sum over a splitting's kicks is as accurate as the orbit, and energy minus work is conserved as energy is for
sources at rest.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.arrays import kept
from fieldsim.dynamics.integrators.splittings import moments
from fieldsim.dynamics.splitting.groups import X, column, group_of, lanes_of, launch_groups, load_of
from fieldsim.dynamics.splitting.method import Method, method_of, substep_of
from fieldsim.dynamics.splitting.step import advance_of
from fieldsim.dynamics.state import State
from fieldsim.sources.field import field_at
from fieldsim.sources.stages import Stages, upload

# Time derivatives are differences over this share of a step, of fourth order: their errors, of rounding and of the
# difference, stay below those of the orbits.
SHARE = 1.0 / 32.0
OFFSETS = SHARE * np.array([-2.0, -1.0, 1.0, 2.0])


class Work:
    """Sums the work done on each particle of a simulation, in free flight, from now on.

    Each launch is followed ahead of the simulation on a copy of its state, so contacts are not seen.
    """

    def __init__(self, simulation):
        self._simulation = simulation
        self._sum = wp.zeros(sum(map(len, simulation.world.particles)), dtype=wp.float64, device=simulation.device)
        simulation.watch(self._follow, sums=[self._sum])

    def values(self) -> np.ndarray:
        """Work done so far per unit mass, (N,): positive where particles gained energy."""
        return kept(self._sum.numpy())

    def _follow(self, sources, state, steps, start, dt):
        integrator, device = self._simulation.integrator, self._simulation.device
        nodes = moments(steps, integrator.nodes)
        now = upload(sources, start + dt * nodes, device)
        around = upload(sources, start + dt * (nodes[:, None] + OFFSETS).ravel(), device)
        kernel = work_kernel(sources.kinds_used, any(integrator.gradients), lanes_of(device))
        inputs = [len(steps), wp.float64(dt * SHARE), method_of(integrator, dt, device), now, around, state]
        threads = self._simulation.threads
        launch_groups(kernel, len(self._sum), inputs, [self._sum], device=device, threads=threads)


@functools.cache
def work_kernel(kinds_used, gradients: bool, lanes: int):
    """Kernel over groups: a launch's steps, without writing the state; `work` (N,) grows by what is done on each.

    around: the moving rows at four times OFFSETS about each stage; between them lies the time `share`.
    """
    Group = group_of(lanes)
    Numbers = wp.types.vector(lanes, wp.float64)
    advance, load = advance_of(kinds_used, gradients, lanes), load_of(lanes)
    total = field_at(kinds_used)
    moving = field_at(((), kinds_used[1]))

    @wp.func
    def rates(p: wp.vec3d, around: Stages, node: int, share: wp.float64):
        f0, g0 = moving(p, around, 4 * node)
        f1, g1 = moving(p, around, 4 * node + 1)
        f2, g2 = moving(p, around, 4 * node + 2)
        f3, g3 = moving(p, around, 4 * node + 3)
        eight = wp.float64(8.0)
        over = wp.float64(1.0) / (wp.float64(12.0) * share)
        return over * (eight * (f2 - f1) - (f3 - f0)), over * (eight * (g2 - g1) - (g3 - g0))

    @wp.func
    def done_by(
        group: Group, kick: wp.float64, factor: wp.float64, now: Stages, around: Stages, node: int, share: wp.float64
    ):
        """Work of one kick, per unit of its weight; that of the force gradient is by the potential |g|^2 / 2."""
        work = Numbers()
        for k in range(wp.int32(lanes)):
            p = column(group, X, k)
            f, g = rates(p, around, node, share)
            work[k] = -kick * f
            if factor != wp.float64(0.0):
                _f, pull = total(p, now, node)
                work[k] = work[k] - factor * wp.dot(pull, g)
        return work

    @wp.kernel(module="unique", enable_backward=False)
    def follow(
        start: int,
        steps: int,
        share: wp.float64,
        method: Method,
        now: Stages,
        around: Stages,
        state: State,
        work: wp.array(dtype=wp.float64),
    ):
        first = (start + wp.tid()) * lanes
        count = wp.min(lanes, work.shape[0] - first)
        p = load(state, first, count)
        done = Numbers()
        for step in range(steps):
            for j in range(method.stages):
                node = step * method.stages + j
                part = substep_of(method, j)
                if part.opening != wp.float64(0.0):
                    done += done_by(p, part.opening, wp.float64(0.0), now, around, node, share)
                p = advance(p, method, j, j + 1, 1, node, now)
                if part.evaluating:
                    done += done_by(p, part.kick, part.factor, now, around, node + 1, share)
        for k in range(count):
            work[first + k] = work[first + k] + done[k]

    return follow
