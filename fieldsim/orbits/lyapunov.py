"""Lyapunov exponents: how fast neighbouring orbits part, by the variational equations with the analytic Hessian.

A tangent vector (dx, dv) moves by the linearised splitting: a drift adds dt drifts[j] dv to dx, a kick adds
dt kicks[j] H dx to dv, H the Hessian of F. That is the exact derivative of the numerical orbit, and symplectic as it
is. Vectors are made orthonormal now and then, and what they had grown is summed (Benettin et al. 1980).
"""

import dataclasses
import functools

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.integrators.splittings import Splitting
from fieldsim.dynamics.refusals import refuse
from fieldsim.dynamics.simulation import Simulation
from fieldsim.dynamics.splitting.groups import (
    V_REST,
    X_REST,
    A,
    V,
    X,
    lanes_of,
    launch_groups,
    load_of,
    rows_of,
    store_of,
)
from fieldsim.dynamics.splitting.method import Method, method_of, substep_of
from fieldsim.dynamics.state import State
from fieldsim.errors import InputError
from fieldsim.launch import checked_threads
from fieldsim.numerics.running_sums import added
from fieldsim.orbits.poincare import splitting_for
from fieldsim.sources.field import bends_at
from fieldsim.sources.stages import Stages
from fieldsim.types import RealLike, WholeLike
from fieldsim.world.world import World, given_world

MOST_SAMPLES = 1_000_000
# Tangent vectors are made orthonormal every so many steps, before they fall onto one another.
EVERY = wp.constant(16)


@dataclasses.dataclass(frozen=True)
class Lyapunov:
    """Exponents of N particles, in 1 / time, as they converge: times (T,), exponents (T, N, count), largest first.

    A regular orbit's fall like log(t) / t; a chaotic orbit's settle at the inverse of its Lyapunov time.
    """

    times: np.ndarray
    exponents: np.ndarray

    @property
    def largest(self) -> np.ndarray:
        """The largest exponent of each particle at the end, (N,)."""
        return self.exponents[-1, :, 0]


def lyapunov(
    world: World,
    duration: RealLike,
    integrator: Splitting | None = None,
    *,
    count: WholeLike = 1,
    samples: WholeLike = 100,
    seed: WholeLike = 0,
    device: str | None = None,
    threads: WholeLike | None = None,
) -> Lyapunov:
    """Lyapunov exponents of the particles of `world` over `duration`: how fast neighbours of each part from it.

    Bodies move as they do in a simulation, free ones too: no particle acts on them.
    count: how many exponents, 1..6; samples: equally spaced times at which they are given; seed: of the first tangent
    vectors. integrator: a splitting without force gradients (default `Leapfrog()`). Raises InputError for others,
    and where particles have a contact law, may escape or pull each other.
    """
    world = given_world("lyapunov", world)
    refuse("lyapunov", "lyapunov", world)
    duration = validate.number("lyapunov", "duration", duration, above=0.0)
    # As many as phase space has dimensions.
    count = validate.whole("lyapunov", "count", count, at_least=1, at_most=6)
    samples = validate.whole("lyapunov", "samples", samples, at_least=1, at_most=MOST_SAMPLES)
    seed = validate.seed("lyapunov", seed)
    threads = checked_threads("lyapunov", threads)
    integrator = splitting_for("lyapunov", integrator)
    if any(integrator.gradients):
        name = type(integrator).__name__
        raise InputError(f"lyapunov: {name} has force gradients, whose derivative is not known; give fs.BlanesMoan6")
    simulation = _Tangent(world, integrator, device=device, threads=threads)
    simulation.begin(count, seed)
    times = np.linspace(0.0, duration, samples + 1)[1:]
    rows = []
    for time in times:
        simulation.advance(time)
        rows.append(simulation.growth.numpy() / time)
    return Lyapunov(times, np.array(rows))


class _Tangent(Simulation):
    """A simulation that carries tangent vectors along."""

    def begin(self, count, seed):
        """Start with random orthonormal tangent vectors."""
        frames = np.linalg.qr(np.random.default_rng(seed).normal(size=(self._count, 6, count)))[0]
        halves = frames[:, :3], frames[:, 3:]
        self._dx, self._dv = (
            wp.array(np.ascontiguousarray(np.swapaxes(half, 1, 2)), dtype=wp.vec3d, device=self.device)
            for half in halves
        )
        self.growth = wp.zeros((self._count, count), dtype=wp.float64, device=self.device)

    def _fly(self, steps, start, dt, gravity):
        method = method_of(self._splitting, dt, self.device)
        kernel = tangent_kernel(self._gravity.kinds_used, lanes_of(self.device))
        inputs, outputs = [len(steps), method, gravity], [self._state, self._dx, self._dv, self.growth]
        launch_groups(kernel, self._count, inputs, outputs, device=self.device, threads=self.threads)


@wp.func
def orthonormalise(
    i: int,
    dx: wp.array2d(dtype=wp.vec3d),
    dv: wp.array2d(dtype=wp.vec3d),
    growth: wp.array2d(dtype=wp.float64),
):
    """Gram-Schmidt on a particle's tangent vectors; `growth` sums the logarithms of the lengths that it finds."""
    for k in range(dx.shape[1]):
        for other in range(k):
            share = wp.dot(dx[i, k], dx[i, other]) + wp.dot(dv[i, k], dv[i, other])
            dx[i, k] = dx[i, k] - share * dx[i, other]
            dv[i, k] = dv[i, k] - share * dv[i, other]
        size = wp.sqrt(wp.dot(dx[i, k], dx[i, k]) + wp.dot(dv[i, k], dv[i, k]))
        growth[i, k] = growth[i, k] + wp.log(size)
        dx[i, k] = dx[i, k] / size
        dv[i, k] = dv[i, k] / size


@functools.cache
def tangent_kernel(kinds_used, lanes: int):
    """Kernel over groups: the steps of a launch for particles and their tangent vectors dx, dv (N, count)."""
    six = wp.types.matrix((6, lanes), wp.float64)
    jets, load, store, rows = bends_at(kinds_used, lanes), load_of(lanes), store_of(lanes), rows_of(lanes)

    @wp.func
    def stretch(
        first: int, count: int, share: wp.float64, dx: wp.array2d(dtype=wp.vec3d), dv: wp.array2d(dtype=wp.vec3d)
    ):
        """A drift of tangent vectors."""
        for i in range(first, first + count):
            for k in range(dx.shape[1]):
                dx[i, k] = dx[i, k] + share * dv[i, k]

    @wp.func
    def turn(
        first: int,
        count: int,
        share: wp.float64,
        bends: six,
        dx: wp.array2d(dtype=wp.vec3d),
        dv: wp.array2d(dtype=wp.vec3d),
    ):
        """A kick of tangent vectors."""
        for i in range(count):
            bend = wp.mat33d(
                bends[0, i], bends[3, i], bends[4, i],
                bends[3, i], bends[1, i], bends[5, i],
                bends[4, i], bends[5, i], bends[2, i],
            )  # fmt: skip
            for k in range(dx.shape[1]):
                dv[first + i, k] = dv[first + i, k] + share * (bend * dx[first + i, k])

    @wp.kernel(module="unique", enable_backward=False)
    def follow(
        start: int,
        steps: int,
        method: Method,
        gravity: Stages,
        state: State,
        dx: wp.array2d(dtype=wp.vec3d),
        dv: wp.array2d(dtype=wp.vec3d),
        growth: wp.array2d(dtype=wp.float64),
    ):
        first = (start + wp.tid()) * lanes
        count = wp.min(lanes, state.x.shape[0] - first)
        p = load(state, first, count)
        x = rows(p, X)
        v = rows(p, V)
        x_rest = rows(p, X_REST)
        v_rest = rows(p, V_REST)
        a, bends = jets(x, gravity, 0)
        for step in range(steps):
            for j in range(method.stages):
                part = substep_of(method, j)
                if part.opening != wp.float64(0.0):
                    v, v_rest = added(v, v_rest, part.opening * a)
                    turn(first, count, part.opening, bends, dx, dv)
                x, x_rest = added(x, x_rest, part.drift * v)
                stretch(first, count, part.drift, dx, dv)
                if part.evaluating:
                    a, bends = jets(x, gravity, step * method.stages + j + 1)
                    v, v_rest = added(v, v_rest, part.kick * a)
                    turn(first, count, part.kick, bends, dx, dv)
            if (step + 1) % EVERY == 0 or step + 1 == steps:
                for i in range(first, first + count):
                    orthonormalise(i, dx, dv, growth)
        for c in range(3):
            p[X + c] = x[c]
            p[V + c] = v[c]
            p[X_REST + c] = x_rest[c]
            p[V_REST + c] = v_rest[c]
            p[A + c] = a[c]
        store(p, state, first, count)

    return follow
