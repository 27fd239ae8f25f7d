"""Poincare sections under Radau: crossings on the dense output, as exact as the orbits themselves."""

import numpy as np

# Greatest number of Newton steps and bisections of a crossing.
REFINEMENTS = 60


def radau_crossings(run, section, start: float, end: float):
    """Crossings of the particles of a `RadauRun` with `section` between the times start and end.

    Returns times (M,), particles (M,), positions and velocities (M, 3), both in the section's frame.
    """
    states = _SectionStates(run, section)
    times = np.full(len(run.span[1]), start)
    heights, _rates, _x, _v = states.at(times)
    found = [(np.zeros(0), np.zeros(0, dtype=int), np.zeros((0, 3)), np.zeros((0, 3)))]
    while (times < end).any():
        run.step(end)
        begin, after = run.span
        if (after == times).all():  # those left are lost
            break
        new, _rates, _x, _v = states.at(after)
        above = new >= 0.0
        pierced = (above != (heights >= 0.0)) & (after > times)
        if section.direction:
            pierced &= above == (section.direction > 0)
        if pierced.any():
            found.append(_refined(states, pierced, begin, after, heights, end))
        times, heights = after, new
    return tuple(np.concatenate(part) for part in zip(*found, strict=True))


class _SectionStates:
    """The particles of a run in the section's frame."""

    def __init__(self, run, section):
        self._run, self._section = run, section

    def at(self, times):
        """Heights over the plane (N,), their rates (N,), positions and velocities (N, 3) at a time (N,) of each."""
        x, v = self._section.seen(times, *self._run.at(times))
        normal = np.array(self._section.normal)
        return (x - self._section.point) @ normal, v @ normal, x, v


def _refined(states, pierced, begin, after, heights, end):
    """Times, particles, positions and velocities of one crossing each of the particles that pierced the plane."""
    below = heights < 0.0
    low, high = begin.copy(), after.copy()
    # Dense output is needed for the particles that crossed only: the others are taken at their ends.
    times = np.where(pierced, 0.5 * (low + high), after)
    for _ in range(REFINEMENTS):
        height, rate, _x, _v = states.at(times)
        before = (height < 0.0) == below
        low, high = np.where(before, times, low), np.where(before, high, times)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = times - height / rate
        # A time beyond an end by rounding is moved to that end; farther ones, and NaN, are bisected.
        slack = 2.0 * np.spacing(np.abs(times))
        near = (step > low - slack) & (step < high + slack)
        new = np.where(pierced, np.where(near, np.clip(step, low, high), 0.5 * (low + high)), after)
        settled = np.abs(new - times) <= slack
        times = new
        if settled.all():
            break
    _height, _rate, x, v = states.at(times)
    kept = np.flatnonzero(pierced & (times <= end))
    return times[kept], kept, x[kept], v[kept]
