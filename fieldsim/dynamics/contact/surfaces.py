"""Surfaces for contact: rows with their reach (see `sources.margins`), those that move with the twist of their body."""

import math
import warnings

import numpy as np
import warp as wp

from fieldsim.dynamics.refusals import body_name
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.potentials.bounds.reach import scale
from fieldsim.sources.elements import Sources
from fieldsim.sources.field import field_and_gradient
from fieldsim.sources.margins import sweeps, with_reach
from fieldsim.sources.stages import Stages, tables, upload
from fieldsim.sources.surface_velocity import twists
from fieldsim.world.motion import Spin


def surfaces_touched(world, time: float, free=None) -> "Surfaces | None":
    """The surfaces that particles of the world may touch, or None."""
    touching = any(particles.contact for particles in world.particles)
    return Surfaces(world, time, free) if touching else None


class Surfaces:
    """The collidable surfaces of a world. grain: length over which the field of the thinnest varies little."""

    def __init__(self, world, time: float, free=None):
        self.sources = Sources(world, "surface", time, free)
        fixed = self.sources.fixed
        self._fixed_rows = with_reach(fixed.rows, fixed.kinds, len(self.sources))
        moving = self.sources.rows_at(np.array([time]))
        lengths = [scale(fixed.rows, fixed.kinds), scale(moving[0], self.sources.moving_kinds)]
        self.grain = 0.5 * np.min(np.concatenate(lengths), initial=math.inf)
        self._still = None
        self._warned = False
        self._spins = [(k, b) for k, b in enumerate(world.bodies) if b.surface and isinstance(b.motion, Spin)]

    def __len__(self) -> int:
        return len(self.sources)

    def upload(self, times, device) -> Stages:
        """The tables of a launch whose stages are at `times`."""
        if self._still is not None and not self.sources.moving:
            return self._still
        self._refuse_spins(times)
        rows = with_reach(self.sources.rows_at(times), self.sources.moving_kinds, len(self))
        sweep = sweeps(rows, self.sources.moving_kinds)
        deforming = self.sources.deforming
        # What only moves is exact between stages.
        self._warn_of_leaps(sweeps(rows[:, deforming], self.sources.moving_kinds[deforming]), times)
        deforms = np.broadcast_to(deforming, rows.shape[:2])[..., None]
        rows = np.concatenate([rows, twists(*self.sources.poses_at(times)), deforms], axis=-1)
        stages = tables(self.sources, self._fixed_rows, rows, device, self._still, sweep)
        if self._still is None:
            self._still = stages
        return stages

    def field(self, points: wp.array, time: float, *, threads=None) -> np.ndarray:
        """The field of the surfaces at `points` (N,) of vec3d at `time`, (N,): 1 on the surface."""
        stages = upload(self.sources, np.array([time]), points.device)
        return field_and_gradient(self.sources, stages, points, threads=threads)[0].numpy()

    def _refuse_spins(self, times):
        """Raise InputError where a body spins by half a turn from one time to the next: poses do not tell which way."""
        step = np.diff(times).max(initial=0.0)
        for index, body in self._spins:
            rate = abs(body.motion.rate)
            if rate * step >= math.pi:
                raise InputError(
                    f"{body_name(index, body)} spins by {rate * step / math.tau:.3g} turns in a step of {step:g}: what "
                    f"particles touch of it is not known then; give a dt below {math.pi / rate:.3g}"
                )

    def _warn_of_leaps(self, sweep, times):
        fastest = int(np.argmax(sweep))
        if sweep[fastest] > 2.0 * self.grain and not self._warned:
            self._warned = True
            warnings.warn(
                f"at time {times[fastest]:g} a surface deforms by {sweep[fastest]:.3g} in one step, more than its "
                f"softness {2 * self.grain:.3g}: it may pass over particles; give a shorter dt",
                FieldsimWarning,
                stacklevel=4,
            )


def ground_at(surfaces: Surfaces | None, x, time: float) -> np.ndarray:
    """The field of the surfaces, or of none, at places x (N,) at a time, (N,): 1 on the surface."""
    return surfaces.field(x, time) if surfaces else np.zeros(len(x))
