"""Where free bodies were during the latest launch, at its stages and between them."""

import dataclasses

import numpy as np

from fieldsim.numerics import quaternion


@dataclasses.dataclass(frozen=True, eq=False)
class Track:
    """times (stages,); places (stages, B, 3): of centres of mass; rotations (stages, B, 4): of the bodies' frames.

    centers (B, 3): of mass, in the bodies' frames. speeds, rates (steps + 1, B, 3): velocities of the centres of mass
    and angular velocities at the steps' ends, world frame; None where there were no steps.
    """

    times: np.ndarray
    places: np.ndarray
    rotations: np.ndarray
    centers: np.ndarray
    speeds: np.ndarray | None
    rates: np.ndarray | None

    def at(self, b: int, times) -> tuple[np.ndarray, np.ndarray]:
        """Quaternions (n, 4) and positions (n, 3) of a body's frame at `times` (n,) of the launch.

        At its stages what the method found; else a cubic between the steps' ends, whose error is of fourth order.
        """
        if np.array_equal(times, self.times):
            rotations, places = self.rotations[:, b], self.places[:, b]
        elif self.speeds is None or self.rates is None or (times == self.times[-1]).all():
            rotations, places = (a[np.full(len(times), -1), b] for a in (self.rotations, self.places))
        else:
            rotations, places = self._between(b, times, self.speeds[:, b], self.rates[:, b])
        return rotations, places - quaternion.matrices(rotations) @ self.centers[b]

    def _between(self, b, times, speeds, rates):
        drifts = (len(self.times) - 1) // (len(speeds) - 1)
        ends = self.times[::drifts]
        k = np.clip(np.searchsorted(ends, times, side="right") - 1, 0, len(ends) - 2)
        step = (ends[k + 1] - ends[k])[:, None]
        u = (times - ends[k])[:, None] / step
        spin = np.concatenate([np.zeros((len(rates), 1)), rates], axis=1)
        places, turns = self.places[::drifts, b], _continuous(self.rotations[::drifts, b])
        moving = 0.5 * quaternion.product(spin, turns)
        rotations = _hermite(u, step, turns[k], turns[k + 1], moving[k], moving[k + 1])
        rotations /= np.linalg.norm(rotations, axis=1)[:, None]
        return rotations, _hermite(u, step, places[k], places[k + 1], speeds[k], speeds[k + 1])


def _continuous(turns):
    """Quaternions with their signs chosen so that each lies near the one before."""
    flips = np.where(np.sum(turns[1:] * turns[:-1], axis=1) < 0.0, -1.0, 1.0)
    return turns * np.cumprod([1.0, *flips])[:, None]


def _hermite(u, step, first, last, slope, end_slope):
    """The cubic with given ends and slopes, at the share u of a step."""
    rise = u * u * (3.0 - 2.0 * u)
    bend = u * (1.0 - u) * step
    return first + rise * (last - first) + bend * ((1.0 - u) * slope - u * end_slope)
