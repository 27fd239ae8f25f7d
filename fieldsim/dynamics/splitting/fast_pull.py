"""Accelerations of many particles by each other through fast sums (`potentials.fast_summation`), on the CPU."""

import math

import numpy as np

from fieldsim import validate
from fieldsim.dynamics.integrators.splittings import Integrator, Splitting
from fieldsim.potentials.elements import Elements, pack
from fieldsim.potentials.fast_summation.laws import law_values
from fieldsim.potentials.fast_summation.octree import enclosing
from fieldsim.potentials.fast_summation.summation import Group, fast_sum
from fieldsim.potentials.kernels import Kernel
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.row import CENTER, STRENGTH
from fieldsim.types import RealLike

# Up to so many particles exact sums take no longer.
EXACT = 20_000
# Fast sums of more than these are made as exact as this, if nothing else is said; and no more or less exact than these.
USUAL, FINEST, COARSEST = 1e-6, 1e-9, 1e-2
# Particles of a cell that is not divided further.
MOST = 48
# Where a sum is too wrong it is made again, aiming at this share of what is allowed; so often.
AIM, TRIALS = 0.3, 5
# The finest tolerance of a fast sum of values.
_FINEST_VALUE = 1e-13


class FastPull:
    """The pull of particles on each other, wrong by at most `tolerance`.

    tolerance: the largest error of an acceleration over the root mean square of all; it is estimated, with room, from
    errors at 64 particles. strengths (M,): G m of those that pull, `sources` (M,) their places among all.
    """

    def __init__(self, kernel: Kernel, strengths: np.ndarray, sources: np.ndarray, tolerance: float, threads=None):
        self.tolerance, self._kernel, self._threads = tolerance, kernel, threads
        self._strengths, self._sources = strengths, sources
        one = pack([Point((0, 0, 0))], [kernel], [1.0])
        self._row, self._kind = one.rows[0], one.kinds[0]
        self._own = float(law_values(kernel, np.zeros(1))[0])
        # What values must be right to for accelerations to be as right as asked for.
        self._value_tolerance = tolerance

    def accelerations(self, x: np.ndarray) -> np.ndarray:
        """Of all particles at x (N, 3), (N, 3); not finite where x is not."""
        if not np.isfinite(x).all():
            return np.full_like(x, math.nan)
        group = self._group(x)
        pulls, ratio = self._tried(group, x)
        for _trial in range(TRIALS):
            if ratio <= 1.0 or self._value_tolerance <= _FINEST_VALUE:
                break
            # It stays as fine for all later sums: stages of a step, and steps, ask for much the same.
            self._value_tolerance = max(_FINEST_VALUE, self._value_tolerance * max(AIM / ratio, 1e-3))
            pulls, ratio = self._tried(group, x)
        return pulls

    def _tried(self, group, x):
        """Accelerations (N, 3), and how large their error is, as estimated, over what is allowed."""
        made = fast_sum(group, x, self._value_tolerance, 1, threads=self._threads)
        pulls = made.results[1]
        allowed = self.tolerance * math.sqrt((pulls**2).sum() / len(pulls))
        return pulls, made.found[1] / max(allowed, 1e-300)

    @property
    def is_finite(self) -> bool:
        """Whether a particle's own potential is, so that it can be left out of a sum."""
        return math.isfinite(self._own)

    def potentials(self, x: np.ndarray) -> np.ndarray:
        """Minus the sum of G m h of the others at each particle (N,), for kernels that are finite at their point."""
        values = fast_sum(self._group(x), x, self._value_tolerance, 0, threads=self._threads).results[0]
        own = np.zeros(len(x))
        own[self._sources] = self._strengths * self._own
        return own - values

    def _group(self, x):
        places = x[self._sources]
        rows = np.tile(self._row, (len(places), 1))
        rows[:, CENTER], rows[:, STRENGTH] = places, self._strengths
        kinds = np.full(len(places), self._kind)
        # A power of two wide, so that steps have the same one and need no other translations.
        root = enclosing(x.min(axis=0), x.max(axis=0), bits=1)
        return Group(Elements(rows, kinds, np.arange(len(places))), self._kernel, MOST, root)


def checked_tolerance(owner: str, tolerance: RealLike | None) -> float | None:
    """A tolerance of fast sums, 0 for exact ones, or None."""
    if tolerance is None:
        return None
    value = validate.number(owner, "pull_tolerance", tolerance, at_least=0.0)
    return validate.number(owner, "pull_tolerance", value, at_least=FINEST, at_most=COARSEST) if value else 0.0


def unfit(kernel: Kernel | None, device, method: Integrator) -> str | None:
    """Why particles that pull with a kernel cannot do so through fast sums, if they cannot."""
    if kernel is None:
        return "no particles pull each other"
    if not (kernel.power or kernel.compact or kernel.folds):
        return f"there are no fast sums for {kernel!r}"
    if device.is_cuda:
        return f"fast sums are made on the CPU, and device is {device}"
    if not isinstance(method, Splitting):
        return f"{method!r} sums exactly"
    return f"force gradients, which {method!r} has, are summed exactly" if any(method.gradients) else None
