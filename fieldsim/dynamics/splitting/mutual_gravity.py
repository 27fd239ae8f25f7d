"""Particles that pull each other: a direct sum over all that have gravity, at every stage of a splitting.

Each pulls with its kernel as a Point does, so any kernel may rule. All pulls come in equal and opposite pairs, which
keeps momentum to rounding. One launch for each part of a stage: a drift of all has to end before the next kick. A few
particles on a CPU are moved by one thread through all steps: launches would take longer than what they do. Of very many
the sum is a fast one, right to a tolerance (see `fast_pull`).
"""

import functools

import numpy as np
import warp as wp

from fieldsim.arrays import kept, read_only
from fieldsim.copies import Uncopied
from fieldsim.dynamics.integrators.splittings import Integrator
from fieldsim.dynamics.splitting.fast_pull import EXACT, USUAL, FastPull, checked_tolerance, unfit
from fieldsim.dynamics.splitting.groups import (
    X_REST,
    A,
    V,
    X,
    column,
    kicked_of,
    lanes_of,
    launch_groups,
    load_of,
    rows_of,
    store_of,
    vectors,
)
from fieldsim.dynamics.splitting.method import Method, SubStep, method_of, substep_of
from fieldsim.dynamics.state import State
from fieldsim.errors import InputError
from fieldsim.launch import launch
from fieldsim.numerics.running_sums import added
from fieldsim.portable import Table, hole, portable, real
from fieldsim.portable.lanes.functions import group_function
from fieldsim.potentials.row import Layout, offset_from, vector_of
from fieldsim.sources.field import bends_at, bent_along, pulls_at
from fieldsim.sources.stages import Stages
from fieldsim.types import RealLike

# One thread moves all particles where no more pairs than these are to be summed.
FEW_PAIRS = 4096


# Columns of a source: its place, its strength G m, the kernel's width, and its acceleration.
SOURCE = Layout()
PLACE = SOURCE.vector("PLACE", "position")
PULL = SOURCE.number("PULL", "strength, G m")
WIDTH = SOURCE.number("WIDTH", "the kernel's parameter")
ACCELERATION = SOURCE.vector("ACCELERATION", "acceleration, where a force gradient is asked for")
ACCELERATION_X = wp.constant(ACCELERATION.start)
from_place = offset_from(PLACE)
acceleration_of = vector_of(ACCELERATION)

law = hole("r2, width, fold, times")


@portable
def pull_of_sources(x: real, y: real, z: real, rows: Table, count: int):
    """The acceleration at a point by `count` sources."""
    ax = real(0.0)
    ay = real(0.0)
    az = real(0.0)
    for k in range(count):
        dx, dy, dz = from_place(x, y, z, rows, k)
        _h, slope, _bend = law(dx * dx + dy * dy + dz * dz, rows[k, WIDTH], real(0.0), real(0.0))
        pull = rows[k, PULL] * (real(2.0) * slope)
        ax += pull * dx
        ay += pull * dy
        az += pull * dz
    return ax, ay, az


@portable
def _gradient_of_sources(x: real, y: real, z: real, ax: real, ay: real, az: real, rows: Table, count: int):
    """Half the gradient of the sum of all |acceleration|^2: Hessians of h times differences of accelerations."""
    gx = real(0.0)
    gy = real(0.0)
    gz = real(0.0)
    for k in range(count):
        dx, dy, dz = from_place(x, y, z, rows, k)
        bx, by, bz = acceleration_of(rows, k)
        r2 = dx * dx + dy * dy + dz * dz
        # The law's bend is taken times r^2, so that nothing overflows near a source.
        _h, slope, bend = law(r2, rows[k, WIDTH], real(0.0), r2)
        along = dx * (ax - bx) + dy * (ay - by) + dz * (az - bz)
        if r2 > real(0.0):
            along = real(4.0) * bend * (along / r2)
        pull = real(2.0) * slope
        gx += rows[k, PULL] * (pull * (ax - bx) + along * dx)
        gy += rows[k, PULL] * (pull * (ay - by) + along * dy)
        gz += rows[k, PULL] * (pull * (az - bz) + along * dz)
    return gx, gy, gz


@wp.struct
class Pull:
    """What pulls: rows (M, columns of SOURCE), and of each particle which row is its, or -1 (N,)."""

    rows: wp.array2d(dtype=wp.float64)
    index: wp.array(dtype=wp.int32)


@functools.cache
def _shifts_of(lanes: int):
    """Warp functions for groups of particles: move and tell (see `parts_of`)."""
    load, store, kicked, vectors_in = load_of(lanes), store_of(lanes), kicked_of(lanes), rows_of(lanes)

    @wp.func
    def move(first: int, part: SubStep, pull: Pull, state: State):
        count = wp.min(lanes, state.x.shape[0] - first)
        p = load(state, first, count)
        if part.opening != wp.float64(0.0):
            p = kicked(p, part.opening * vectors_in(p, A))
        x, x_rest = added(vectors_in(p, X), vectors_in(p, X_REST), part.drift * vectors_in(p, V))
        for c in range(3):
            p[X + c] = x[c]
            p[X_REST + c] = x_rest[c]
        store(p, state, first, count)
        for k in range(count):
            row = pull.index[first + k]
            if row >= 0:
                for c in range(3):
                    pull.rows[row, c] = x[c, k]

    @wp.func
    def tell(first: int, pull: Pull, state: State):
        for i in range(first, wp.min(first + lanes, state.x.shape[0])):
            row = pull.index[i]
            if row >= 0:
                a = state.a[i]
                for c in range(3):
                    pull.rows[row, ACCELERATION_X + c] = a[c]

    return move, tell


@functools.cache
def _forces_of(kinds_used, kernel, gradients: bool, lanes: int):
    """Warp functions for groups of particles: accelerate and kick (see `parts_of`)."""
    load, store, kicked, vectors_in = load_of(lanes), store_of(lanes), kicked_of(lanes), rows_of(lanes)
    field, bends = pulls_at(kinds_used, lanes), bends_at(kinds_used, lanes)
    of_sources = ("table", "int")
    pulled, bent = (
        group_function(portable.bind(law=kernel.law), wp.float64, (rows, *of_sources), (0, 1, 2), lanes)
        for portable, rows in ((pull_of_sources, "rows 3"), (_gradient_of_sources, "rows 6"))
    )
    matrix, six = vectors(lanes), wp.types.matrix((6, lanes), wp.float64)

    @wp.func
    def places_and_pulls(x: matrix, a: matrix):
        found = six()
        for c in range(3):
            found[c] = x[c]
            found[c + 3] = a[c]
        return found

    @wp.func
    def accelerate(first: int, stage: int, gravity: Stages, pull: Pull, state: State):
        count = wp.min(lanes, state.x.shape[0] - first)
        p = load(state, first, count)
        x = vectors_in(p, X)
        a = field(x, gravity, stage) + pulled(x, pull.rows, pull.rows.shape[0])
        for k in range(count):
            state.a[first + k] = column(a, 0, k)

    @wp.func
    def kick(first: int, part: SubStep, stage: int, gravity: Stages, pull: Pull, state: State):
        count = wp.min(lanes, state.x.shape[0] - first)
        p = load(state, first, count)
        a = vectors_in(p, A)
        impulse = part.kick * a
        if wp.static(gradients):
            if part.factor != wp.float64(0.0):
                x = vectors_in(p, X)
                _a, h = bends(x, gravity, stage)
                push = bent_along(h, a) + bent(places_and_pulls(x, a), pull.rows, pull.rows.shape[0])
                impulse = impulse + part.factor * push
        store(kicked(p, impulse), state, first, count)

    return accelerate, kick


def parts_of(kinds_used, kernel, gradients: bool, lanes: int):
    """The parts of a stage, each for one group of particles, as Warp functions.

    move (first, part, pull, state): what of the kick by the old acceleration is due, and the drift.
    accelerate (first, stage, gravity, pull, state): the new acceleration. tell (first, pull, state): it to the sources.
    kick (first, part, stage, gravity, pull, state): the kick by the new one, with its force gradient.

    For gravity of the given kinds and particles that pull with `kernel`, a class.
    """
    move, tell = _shifts_of(lanes)
    accelerate, kick = _forces_of(kinds_used, kernel, gradients, lanes)
    return move, accelerate, tell, kick


@functools.cache
def stage_kernels(kinds_used, kernel, gradients: bool, lanes: int):
    """Kernels over groups, for the parts of a stage (see `parts_of`): move, accelerate, tell and kick."""
    move_group, accelerate_group, tell_group, kick_group = parts_of(kinds_used, kernel, gradients, lanes)

    @wp.kernel(module="unique", enable_backward=False)
    def move(start: int, method: Method, j: int, pull: Pull, state: State):
        move_group((start + wp.tid()) * lanes, substep_of(method, j), pull, state)

    @wp.kernel(module="unique", enable_backward=False)
    def accelerate(start: int, stage: int, gravity: Stages, pull: Pull, state: State):
        accelerate_group((start + wp.tid()) * lanes, stage, gravity, pull, state)

    @wp.kernel(module="unique", enable_backward=False)
    def tell(start: int, pull: Pull, state: State):
        tell_group((start + wp.tid()) * lanes, pull, state)

    @wp.kernel(module="unique", enable_backward=False)
    def kick(start: int, method: Method, j: int, stage: int, gravity: Stages, pull: Pull, state: State):
        kick_group((start + wp.tid()) * lanes, substep_of(method, j), stage, gravity, pull, state)

    return move, accelerate, tell, kick


@functools.cache
def steps_kernel(kinds_used, kernel, gradients: bool, lanes: int):
    """Kernel: all particles through all steps of a launch on one thread."""
    move, accelerate, tell, kick = parts_of(kinds_used, kernel, gradients, lanes)

    @wp.kernel(module="unique", enable_backward=False)
    def leap(start: int, steps: int, method: Method, gravity: Stages, pull: Pull, state: State):
        groups = (state.x.shape[0] + lanes - 1) // lanes
        for step in range(steps):
            for j in range(method.stages):
                part = substep_of(method, j)
                stage = step * method.stages + j + 1
                for group in range(groups):
                    move(group * lanes, part, pull, state)
                if part.evaluating:
                    for group in range(groups):
                        accelerate(group * lanes, stage, gravity, pull, state)
                    if part.factor != wp.float64(0.0):
                        for group in range(groups):
                            tell(group * lanes, pull, state)
                    for group in range(groups):
                        kick(group * lanes, part, stage, gravity, pull, state)

    return leap


@portable
def _potential_of_sources(x: real, y: real, z: real, rows: Table, count: int, own: int):
    """Minus the sum of G m h at a point, without source `own`."""
    total = real(0.0)
    for k in range(count):
        if k != own:
            dx, dy, dz = from_place(x, y, z, rows, k)
            h, _slope, _bend = law(dx * dx + dy * dy + dz * dz, rows[k, WIDTH], real(0.0), real(0.0))
            total = total - rows[k, PULL] * h
    return total


@functools.cache
def potential_kernel(kernel):
    """Kernel (pull, x; energies): potential energy of each particle in the pull of the others."""
    potential_of = _potential_of_sources.bind(law=kernel.law).warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def potential(start: int, pull: Pull, x: wp.array(dtype=wp.vec3d), energies: wp.array(dtype=wp.float64)):
        i = start + wp.tid()
        p = x[i]
        energies[i] = potential_of(p[0], p[1], p[2], pull.rows, pull.rows.shape[0], pull.index[i])

    return potential


class MutualGravity(Uncopied):
    """The pull of a world's particles on each other, all with one kernel. len(): how many pull."""

    _remedy = "copy what it gives, such as its energy"

    def __init__(self, world, device, threads=None, tolerance: RealLike | None = None):
        self.device, self.threads, self._wanted = device, threads, checked_tolerance("Simulation", tolerance)
        pulling = [particles for particles in world.particles if particles.gravity is not None]
        self.kernel = pulling[0].gravity if pulling else None
        strengths = [
            np.broadcast_to(p.G * np.asarray(p.mass) if p.gravity is not None else 0.0, len(p)) for p in world.particles
        ]
        # G m of each particle, 0 of those that do not pull.
        self.strengths = read_only(np.concatenate([[], *strengths]))
        self._sources = np.flatnonzero(self.strengths)
        self._fast: FastPull | None = None

    def __len__(self) -> int:
        return len(self._sources)

    @property
    def tolerance(self) -> float:
        """How wrong accelerations by each other may be, over their root mean square; 0 where sums are exact."""
        return self._fast.tolerance if self._fast else 0.0

    def choose_sums(self, method: Integrator) -> None:
        """Let sums be fast ones under an integrator, where this is wanted or there are many particles.

        Raises InputError where fast sums are wanted and cannot be.
        """
        reason, tolerance = unfit(self.kernel, self.device, method), self._wanted
        if tolerance and reason:
            raise InputError(f"Simulation: pull_tolerance is {tolerance:g}, but {reason}; leave it out")
        if tolerance is None and not reason and len(self) > EXACT:
            tolerance = USUAL
        if tolerance and self.kernel is not None:
            strengths = self.strengths[self._sources]
            self._fast = FastPull(self.kernel, strengths, self._sources, tolerance, self.threads)

    def rows_at(self, x) -> np.ndarray:
        """Rows (M, columns of SOURCE) of what pulls, with the particles at x (N,)."""
        rows = np.zeros((len(self), SOURCE.width))
        rows[:, PLACE] = x.numpy()[self._sources]
        rows[:, PULL] = self.strengths[self._sources]
        rows[:, WIDTH] = self.kernel.width if self.kernel else 0.0
        return rows

    def _pull_at(self, x) -> Pull:
        """What pulls, with the particles at x (N,)."""
        pull = Pull()
        pull.rows = wp.array(self.rows_at(x), dtype=wp.float64, device=self.device)
        pull.index = self.index
        return pull

    def _pull_in_kernels(self, x) -> Pull:
        """What pulls by a kernel's own sums: nothing where there are fast ones."""
        if not self._fast:
            return self._pull_at(x)
        pull = Pull()
        pull.rows = wp.zeros((0, SOURCE.width), dtype=wp.float64, device=self.device)
        pull.index = wp.full(len(self.strengths), -1, dtype=wp.int32, device=self.device)
        return pull

    @functools.cached_property
    def index(self) -> wp.array:
        """Which row of a `Pull` is each particle's, or -1, (N,)."""
        index = np.full(len(self.strengths), -1)
        index[self._sources] = np.arange(len(self))
        return wp.array(index, dtype=wp.int32, device=self.device)

    def leap(self, state: State, steps: int, dt: float, splitting, gravity: Stages, kinds_used) -> None:
        """Take all particles through `steps` steps; gravity: the bodies' tables at the stages of all of them."""
        count, lanes = len(self.strengths), lanes_of(self.device)
        method, pull = method_of(splitting, dt, self.device), self._pull_in_kernels(state.x)
        code = kinds_used, type(self.kernel), any(splitting.gradients), lanes
        if not self.device.is_cuda and not self._fast and count * len(self) <= FEW_PAIRS:
            inputs = [steps, method, gravity, pull, state]
            launch(steps_kernel(*code), 1, inputs, device=self.device, threads=1)
            return
        move, accelerate, tell, kick = stage_kernels(*code)
        options = {"device": self.device, "threads": self.threads}
        for step in range(steps):
            for j, (weight, factor) in enumerate(zip(splitting.kicks[1:], splitting.gradients[1:], strict=True)):
                stage = step * len(splitting.drifts) + j + 1
                launch_groups(move, count, [method, j, pull, state], **options)
                if weight or factor:
                    self._accelerate(accelerate, stage, gravity, pull, state)
                    if factor:
                        launch_groups(tell, count, [pull, state], **options)
                    launch_groups(kick, count, [method, j, stage, gravity, pull, state], **options)

    def _accelerate(self, kernel, stage, gravity, pull, state):
        """The accelerations of a state's particles, by a kernel of `stage_kernels`."""
        inputs = [stage, gravity, pull, state]
        launch_groups(kernel, len(state.x), inputs, device=self.device, threads=self.threads)
        if self._fast:
            a = state.a.numpy()  # on a CPU the array itself
            a += self._fast.accelerations(state.x.numpy())

    def accelerations(self, x, gravity: Stages, kinds_used):
        """Of particles at x (N,), by the bodies at the first stage of `gravity` and by each other; an array as x."""
        state = State()
        state.x = x
        state.v, state.x_rest, state.v_rest, state.a = (wp.zeros_like(x) for _ in range(4))
        _move, accelerate, _tell, _kick = stage_kernels(kinds_used, type(self.kernel), False, lanes_of(self.device))
        self._accelerate(accelerate, 0, gravity, self._pull_in_kernels(x), state)
        return state.a

    def potential_energies(self, positions: np.ndarray) -> np.ndarray:
        """Of each particle in the pull of the others, (N,): minus G m of the others times h, per unit of its mass."""
        if self._fast and self._fast.is_finite:
            return kept(self._fast.potentials(positions))
        points = wp.array(positions, dtype=wp.vec3d, device=self.device)
        energies = wp.empty(len(positions), dtype=wp.float64, device=self.device)
        kernel = potential_kernel(type(self.kernel))
        inputs = [self._pull_at(points), points]
        launch(kernel, len(positions), inputs, [energies], device=self.device, threads=self.threads)
        return kept(energies.numpy())
