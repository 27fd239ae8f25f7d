"""Trial runs for `Auto`: what they are of, how far they are from what they ought to keep, and passages foreseen."""

import dataclasses
import math
import warnings

import numpy as np

from fieldsim.dynamics.diagnostics.energy_log import EnergyLog
from fieldsim.dynamics.diagnostics.invariants import acting, energy
from fieldsim.dynamics.diagnostics.totals import BODIES, PARTICLES
from fieldsim.dynamics.integrators.splittings import Leapfrog
from fieldsim.dynamics.radau.radau import Radau
from fieldsim.dynamics.refusals import method_refusal
from fieldsim.dynamics.rigid.diagnostics import body_energy
from fieldsim.errors import FieldsimError, FieldsimWarning, InputError
from fieldsim.world.motion import Spin
from fieldsim.world.rigid import Rigid
from fieldsim.world.world import World

# A trial moves at most so many particles, and all that pull each other; it looks at them so often.
SAMPLE = 64
LOOKS = 16
# The next step that is tried is at least this share of the one before.
SHORTEST = 0.2
# A flight ahead lasts so many trials, and is looked at so many times during each.
AHEAD = 30
GLANCES = 4
# Where sources move, so many passages, the hardest, are tried.
PASSAGES = 4
# So many pairs of particles that pull each other, or of a mass point and an element, cost what a particle's pull does;
# free bodies and each function of time cost what so many particles do, everything what so few do, and contact more.
PAIRS = 20
BODIES_COST = 100
FUNCTION_COST = 500
FEWEST = 2
CONTACT_COST = 4


@dataclasses.dataclass(frozen=True)
class Trial:
    """Where a trial run begins: a world with its particles and free bodies as they are at `time`."""

    world: World
    time: float


def sampled(world):
    """The world with at most SAMPLE of its particles, evenly spread over them, and with all that pull each other."""
    sizes = [len(particles) for particles in world.particles]
    pulling = np.repeat([particles.gravity is not None for particles in world.particles], sizes).astype(bool)
    others = np.flatnonzero(~pulling)
    few = others[np.unique(np.linspace(0, len(others) - 1, min(SAMPLE, len(others))).astype(int))]
    return _picked(world, np.sort(np.concatenate([np.flatnonzero(pulling), few])))


def _picked(world, chosen, x=None, v=None):
    """The world with the `chosen` of its particles, indices over all sets in order, at x with velocities v (M, 3)."""
    sets, first = [], 0
    for particles in world.particles:
        mine = (chosen >= first) & (chosen < first + len(particles))
        own = chosen[mine] - first
        here = particles.positions[own] if x is None else x[mine]
        speed = particles.velocities[own] if v is None else v[mine]
        sets.append(dataclasses.replace(particles, positions=here, velocities=speed))
        first += len(particles)
    return world.replace(particles=sets)


def pace(simulation) -> float:
    """The dynamical time of what moves, (|v| + sqrt(2 |F|)) / |acceleration|; inf where nothing pulls.

    The median of the particles or the least of the free bodies, whichever is less.
    """
    found = [math.inf]
    state, bodies = simulation._state, simulation.bodies
    if len(state.x):
        parts = energy(simulation.snapshot())
        speed = np.sqrt(2.0 * parts.kinetic) + np.sqrt(2.0 * np.abs(parts.potential))
        found.append(np.median(_times(speed, state.a.numpy())))
    if bodies:
        depth = math.sqrt(2.0 * abs(bodies.potential_energy()) / bodies.masses.sum())
        speed = np.linalg.norm(bodies.momenta, axis=1) / bodies.masses + depth
        found.append(_times(speed, bodies.accelerations()).min())
    return float(min(found))


def _times(speed, pull):
    size = np.linalg.norm(pull, axis=1)
    return np.divide(speed, size, out=np.full(len(speed), math.inf), where=size > 0.0)


def evaluation_cost(simulation) -> float:
    """What one evaluation of all that moves costs, in particles."""
    count = sum(map(len, simulation.world.particles))
    cost = count + count * len(simulation.mutual) / PAIRS
    if simulation.bodies:
        cost += BODIES_COST + simulation.bodies.pairs / PAIRS
    cost += FUNCTION_COST * sum(map(_calls_python, acting(simulation.world)))
    touching = any(particles.contact for particles in simulation.world.particles)
    return max(FEWEST, cost) * (CONTACT_COST if touching else 1)


def _calls_python(body):
    """Whether a body's place or shape is a function of time, which Python has to call."""
    return body.deforming or (body.moving and not isinstance(body.motion, Spin | Rigid))


# Errors


class Watched:
    """A trial run under way, and how far it is from what it ought to keep.

    Particles and free bodies are judged by the invariants of an `EnergyLog`; those that have none by the difference of
    their energies to a run with finer steps, so many `times`.
    """

    def __init__(self, trial, integrator, simulate, times=1):
        self.simulation, self._simulate = simulate(trial.world, integrator, time=trial.time), simulate
        self._times, self._log = times, EnergyLog(self.simulation)
        kept = {total.whose for total in self._log.totals}
        mutual, bodies = self.simulation.mutual, self.simulation.bodies
        count = sum(map(len, trial.world.particles))
        together = np.array(mutual.strengths != 0.0) if mutual and PARTICLES in kept else np.zeros(count, dtype=bool)
        # Which particles, and whether the free bodies, have nothing that they keep.
        self._loose = np.zeros(count, dtype=bool) if self._log.judging else ~together
        self._drifting = bool(bodies) and BODIES not in kept
        self.compared = self._loose.any() or self._drifting
        self._finer = simulate(trial.world, _finer(integrator), time=trial.time) if self.compared else None

    def meet(self, here):
        """Start the run with finer steps anew from here, a trial: two runs may part where neither is wrong."""
        if self._finer and _starts(here, self._simulate):
            self._finer = self._simulate(here.world, self._finer.integrator, time=here.time)

    def error(self, moment) -> float:
        """The largest relative error of energy at the time `moment`; inf where the run flew apart."""
        try:
            self.simulation.advance(moment)
            if self._finer:
                self._finer.advance(moment)
        except InputError:
            raise
        except FieldsimError:
            return math.inf
        self._log.record()
        found = [total.drifts[-1] for total in self._log.totals if total.quantity == "energy"]
        found += self._log.history.largest[-1:]
        if self._finer:
            found += [self._times * difference(self._finer) for difference in (self._of_particles, self._of_bodies)]
        error = float(np.max(found, initial=0.0))
        return math.inf if math.isnan(error) else error

    def _of_particles(self, finer):
        """Of particles that touched nothing in either run."""
        if not self._loose.any():
            return 0.0
        one, other = energy(self.simulation.snapshot()), energy(finer.snapshot())
        touched = np.concatenate(self.simulation.bounce_counts) + np.concatenate(finer.bounce_counts)
        scale = np.maximum(other.kinetic + np.abs(other.potential), np.finfo(float).tiny)
        return float((np.abs(one.total - other.total) / scale)[self._loose & (touched == 0)].max(initial=0.0))

    def _of_bodies(self, finer):
        """Of the free bodies that have nothing that they keep."""
        if not self._drifting:
            return 0.0
        one, other = body_energy(self.simulation.bodies), body_energy(finer.bodies)
        scale = other.translation.sum() + other.rotation.sum() + abs(other.potential)
        return abs(one.total - other.total) / max(scale, np.finfo(float).tiny)

    def trial(self) -> Trial:
        """The present moment as one where a trial may begin."""
        moved, simulation = self.simulation.world, self.simulation
        if simulation.bodies:
            moved = moved.replace(bodies=simulation.bodies.as_bodies())
        everyone = np.arange(sum(map(len, moved.particles)))
        x, v = (_joined(sets) for sets in (simulation.positions, simulation.velocities))
        return Trial(_picked(moved, everyone, x, v), simulation.time)


def _joined(sets):
    return np.concatenate([np.zeros((0, 3)), *sets])


def _finer(integrator):
    """The same method with half the step."""
    if isinstance(integrator, Radau):
        return dataclasses.replace(integrator, tolerance=integrator.tolerance / 2**7)
    return dataclasses.replace(integrator, dt=integrator.dt / 2)


def worst(trials, integrator, span, tolerance, simulate) -> float:
    """The largest error of a method in the trials, each of duration `span`.

    What comes after a trial that fails is left out, and what comes after an error that no step in reach would mend.
    """
    error, hopeless = 0.0, tolerance / SHORTEST**integrator.order
    for trial in trials:
        # Differences between two runs add up until the end of a flight ahead.
        run = Watched(trial, integrator, simulate, AHEAD)
        for look in range(1, LOOKS + 1):
            error = max(error, run.error(trial.time + span / LOOKS * look))
            if error > hopeless:
                return error
        if error > tolerance:
            break
    return error


# Flights ahead


def scouted(trial, span, simulate, radius=None) -> list[Trial]:
    """Trials that begin shortly before the closest passages of a flight with Radau for AHEAD spans.

    [] where Radau cannot fly, and where particles pull each other, whose passages are no matter of each alone.

    Where nothing changes with time, one trial, with each particle where it is shortly before its closest passage. Else
    the trial given, and those of the PASSAGES hardest, when they are. What comes beyond the escape radius is not met.
    """
    pulling = any(particles.gravity is not None for particles in trial.world.particles)
    if pulling or method_refusal(Radau(), trial.world):
        return []
    looks, tau, when = _flown(trial, span / GLANCES, simulate, radius or math.inf)
    chosen = np.where(np.isfinite(tau), np.maximum((when - trial.time) // (span / GLANCES) - 1, 0), 0).astype(int)
    x, v = (np.stack(parts)[chosen, np.arange(len(chosen))] for parts in zip(*looks, strict=True))
    everyone = np.arange(len(chosen))
    if not any(body.moving or body.deforming for body in acting(trial.world)):
        return [Trial(_picked(trial.world, everyone, x, v), trial.time)]
    hardest = np.argsort(np.where(chosen > 0, tau, math.inf), kind="stable")[:PASSAGES]
    later = [np.sort(hardest[chosen[hardest] == look]) for look in np.unique(chosen[hardest]) if look]
    starts = [trial.time + span / GLANCES * chosen[own[0]] for own in later]
    return [trial, *(Trial(_picked(trial.world, own, x[own], v[own]), t) for own, t in zip(later, starts, strict=True))]


def _flown(trial, piece, simulate, radius):
    """States at all looks, and the least time in which each particle's pull changed, and when that was."""
    simulation = simulate(trial.world, Radau(), time=trial.time)
    scout = simulation.radau
    looks = [(_joined(simulation.positions), _joined(simulation.velocities))]
    tau = when = np.full(len(looks[0][0]), math.inf)
    inside = np.ones(len(tau), dtype=bool)
    for look in range(1, AHEAD * GLANCES + 1):
        scout.advance(trial.time + piece * look)
        looks.append(scout.at(trial.time + piece * look))
        tau, when = (np.where(inside, new, old) for new, old in zip(scout.closest, (tau, when), strict=True))
        inside &= ~(np.linalg.norm(looks[-1][0], axis=1) > radius)
    return looks, tau, when


def foreseen(trial, integrator, span, tolerance, budget, simulate) -> tuple[float, bool, Trial | None]:
    """Fly ahead for AHEAD spans, or `budget` pieces of span / GLANCES if those are less.

    Returns until when the tolerance is kept, whether that is the end of the flight, and a trial from shortly before it
    is lost, or None.
    """
    run = Watched(trial, integrator, simulate)
    earlier = latest = trial
    # Two runs, one of them with half the step, take three times as long.
    for look in range(1, min(AHEAD * GLANCES, budget // 3 if run.compared else budget) + 1):
        if not run.error(trial.time + span / GLANCES * look) <= tolerance:
            return latest.time, False, earlier if _starts(earlier, simulate) else None
        earlier, latest = latest, run.trial()
        if look % GLANCES == 0:
            run.meet(latest)
    return latest.time, True, None


def _starts(trial, simulate):
    """Whether a run can begin with a trial: free bodies that touch may not."""
    try:
        simulate(trial.world, Leapfrog(), time=trial.time)
    except InputError:
        return False
    return True


def quietly(function, *arguments):
    """`function(*arguments)` without fieldsim's warnings: what a trial run has to say, the run itself says."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FieldsimWarning)
        return function(*arguments)
