"""Particles that pull each other: a direct sum over all that have gravity, at every stage of a splitting.

Each pulls with its kernel as a Point does, so any kernel may rule. All pulls come in equal and opposite pairs, which
keeps momentum to rounding. One thread per particle and stage: a drift of all has to end before the next kick. A few
particles on a CPU are moved by one thread through all steps: launches would take longer than what they do.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.arrays import kept, read_only
from fieldsim.copies import Uncopied
from fieldsim.dynamics.state import State
from fieldsim.launch import launch
from fieldsim.numerics.running_sums import added
from fieldsim.sources.field import field_at
from fieldsim.sources.stages import Stages

# One thread moves all particles where no more pairs than these are to be summed.
FEW_PAIRS = 4096


@wp.struct
class Pull:
    """Which particles pull, (M,) indices; with what strength, G mass (M,); and their kernel's width."""

    sources: wp.array(dtype=wp.int32)
    strengths: wp.array(dtype=wp.float64)
    width: wp.float64


@functools.cache
def _kicked(kinds_used, kernel):
    """Warp function that kicks one particle by the pull of the bodies and of the particles."""
    field = field_at(kinds_used)
    law = kernel.law.warp(wp.float64)

    @wp.func
    def kicked(
        i: int,
        weight: wp.float64,
        stage: int,
        gravity: Stages,
        pull: Pull,
        x: wp.array(dtype=wp.vec3d),
        v: wp.array(dtype=wp.vec3d),
        v_rest: wp.array(dtype=wp.vec3d),
    ):
        here = x[i]
        _f, a = field(here, gravity, stage)
        for k in range(pull.sources.shape[0]):
            away = here - x[pull.sources[k]]
            _h, slope, _bend = law(wp.dot(away, away), pull.width, wp.float64(0.0), wp.float64(0.0))
            a = a + (pull.strengths[k] * (wp.float64(2.0) * slope)) * away
        new, rest = added(v[i], v_rest[i], weight * a)
        v[i] = new
        v_rest[i] = rest

    return kicked


@functools.cache
def kick_kernel(kinds_used, kernel):
    """Kernel (v, v_rest; x, weight, stage, gravity, pull): v += weight * (pull of the bodies and of the particles)."""
    kicked = _kicked(kinds_used, kernel)

    @wp.kernel(module="unique", enable_backward=False)
    def kick(
        start: int,
        weight: wp.float64,
        stage: int,
        gravity: Stages,
        pull: Pull,
        x: wp.array(dtype=wp.vec3d),
        v: wp.array(dtype=wp.vec3d),
        v_rest: wp.array(dtype=wp.vec3d),
    ):
        kicked(start + wp.tid(), weight, stage, gravity, pull, x, v, v_rest)

    return kick


@functools.cache
def steps_kernel(kinds_used, kernel):
    """Kernel: all particles through all steps of a launch on one thread."""
    kicked = _kicked(kinds_used, kernel)

    @wp.kernel(module="unique", enable_backward=False)
    def leap(
        start: int,
        steps: int,
        kicks: wp.array(dtype=wp.float64),
        drifts: wp.array(dtype=wp.float64),
        gravity: Stages,
        pull: Pull,
        x: wp.array(dtype=wp.vec3d),
        v: wp.array(dtype=wp.vec3d),
        x_rest: wp.array(dtype=wp.vec3d),
        v_rest: wp.array(dtype=wp.vec3d),
    ):
        for step in range(steps):
            for j in range(kicks.shape[0]):
                if j > 0:
                    for i in range(x.shape[0]):
                        new, rest = added(x[i], x_rest[i], drifts[j - 1] * v[i])
                        x[i] = new
                        x_rest[i] = rest
                if kicks[j] != wp.float64(0.0):
                    for i in range(x.shape[0]):
                        kicked(i, kicks[j], step * drifts.shape[0] + j, gravity, pull, x, v, v_rest)

    return leap


@functools.cache
def potential_kernel(kernel):
    """Kernel (pull, x; energies): potential energy of each particle in the pull of the others."""
    law = kernel.law.warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def potential(start: int, pull: Pull, x: wp.array(dtype=wp.vec3d), energies: wp.array(dtype=wp.float64)):
        i = start + wp.tid()
        total = wp.float64(0.0)
        for k in range(pull.sources.shape[0]):
            if pull.sources[k] != i:
                away = x[i] - x[pull.sources[k]]
                h, _slope, _bend = law(wp.dot(away, away), pull.width, wp.float64(0.0), wp.float64(0.0))
                total = total - pull.strengths[k] * h
        energies[i] = total

    return potential


@wp.kernel(module="unique", enable_backward=False)
def drift_kernel(
    start: int,
    time: wp.float64,
    v: wp.array(dtype=wp.vec3d),
    x: wp.array(dtype=wp.vec3d),
    x_rest: wp.array(dtype=wp.vec3d),
):
    """Move every particle freely for a time."""
    i = start + wp.tid()
    new, rest = added(x[i], x_rest[i], time * v[i])
    x[i] = new
    x_rest[i] = rest


class MutualGravity(Uncopied):
    """The pull of a world's particles on each other, all with one kernel. len(): how many pull."""

    _remedy = "copy what it gives, such as its energy"

    def __init__(self, world, device, threads=None):
        self.device, self.threads = device, threads
        pulling = [particles for particles in world.particles if particles.gravity is not None]
        self._kernel = pulling[0].gravity if pulling else None
        strengths = [np.full(len(p), p.G * p.mass if p.gravity is not None else 0.0) for p in world.particles if len(p)]
        # G m of each particle, 0 of those that do not pull.
        self.strengths = read_only(np.concatenate([[], *strengths]))
        self._sources = np.flatnonzero(self.strengths)

    def __len__(self) -> int:
        return len(self._sources)

    @functools.cached_property
    def _pull(self):
        pull = Pull()
        pull.sources = wp.array(self._sources, dtype=wp.int32, device=self.device)
        pull.strengths = wp.array(self.strengths[self._sources], dtype=wp.float64, device=self.device)
        pull.width = self._kernel.width if self._kernel else 0.0
        return pull

    def leap(self, state: State, steps: int, dt: float, method, gravity: Stages, kinds_used) -> None:
        """Take all particles through `steps` steps; gravity: the bodies' tables at the stages of all of them."""
        count = len(self.strengths)
        if not state.x.device.is_cuda and count * len(self) <= FEW_PAIRS:
            kernel = steps_kernel(kinds_used, type(self._kernel))
            tables = (wp.array(dt * np.array(t), dtype=wp.float64, device="cpu") for t in (method.kicks, method.drifts))
            inputs = [steps, *tables, gravity, self._pull]
            launch(kernel, 1, inputs, [state.x, state.v, state.x_rest, state.v_rest], device=self.device, threads=1)
            return
        kick = kick_kernel(kinds_used, type(self._kernel))
        options = {"device": self.device, "threads": self.threads, "grain": 16}
        for step in range(steps):
            for j, weight in enumerate(method.kicks):
                if j:
                    shares = [wp.float64(dt * method.drifts[j - 1]), state.v]
                    launch(drift_kernel, count, shares, [state.x, state.x_rest], **options)
                if weight:
                    stage = step * len(method.drifts) + j
                    inputs = [wp.float64(dt * weight), stage, gravity, self._pull, state.x]
                    launch(kick, count, inputs, [state.v, state.v_rest], **options)

    def accelerations(self, state: State, gravity: Stages, kinds_used) -> np.ndarray:
        """Of all particles by the pull of the bodies, at the first stage of `gravity`, and of each other, (N, 3)."""
        found, rest = wp.zeros_like(state.v), wp.zeros_like(state.v)
        inputs = [wp.float64(1.0), 0, gravity, self._pull, state.x]
        kernel = kick_kernel(kinds_used, type(self._kernel))
        launch(kernel, len(found), inputs, [found, rest], device=self.device, threads=self.threads)
        return found.numpy()

    def potential_energies(self, positions: np.ndarray) -> np.ndarray:
        """Of each particle in the pull of the others, (N,): minus G m of the others times h, per unit of its mass."""
        points = wp.array(positions, dtype=wp.vec3d, device=self.device)
        energies = wp.empty(len(positions), dtype=wp.float64, device=self.device)
        kernel = potential_kernel(type(self._kernel))
        launch(kernel, len(positions), [self._pull, points], [energies], device=self.device, threads=self.threads)
        return kept(energies.numpy())
