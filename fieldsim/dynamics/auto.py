"""A method and a step for an asked accuracy, found by short trial runs."""

import dataclasses
import functools
import math
import warnings

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.diagnostics import EnergyLog, energy
from fieldsim.dynamics.integrators import (
    BlanesMoan6,
    Integrator,
    KahanLi8,
    Leapfrog,
    Omelyan4,
    Omelyan6,
    Omelyan8,
    SofroniouSpaletta10,
    Splitting,
)
from fieldsim.dynamics.sources import Sources, field_and_gradient, upload
from fieldsim.errors import FieldsimError, FieldsimWarning, InputError
from fieldsim.world.world import World

# An evaluation with the Hessian takes about so many times one without.
HESSIAN_COST = 1.5
# A trial moves at most so many particles, looks at them so often, and evaluates so often; a method gets so many trials.
SAMPLE = 64
LOOKS = 16
WORK = 4_000_000
ROUNDS = 8
# A step's trial error is wanted between these parts of the tolerance.
LEAST, MOST = 0.1, 0.5
# A trial lasts so many dynamical times (speed over acceleration), of which an orbit takes about two and a half.
SPAN = 3.0


@dataclasses.dataclass(frozen=True)
class Auto(Integrator):
    """The cheapest method and step that keep each particle's energy to `tolerance`, found by trial when a run starts.

    tolerance: of the energy, or the Jacobi integral where all that pulls turns, relative to kinetic plus absolute
    potential energy at the start. span: duration of the trial, about an orbit unless told: what a run meets only
    later, such as a closer passage, is not foreseen (`EnergyLog` tells of it). candidates: the methods to choose from.
    """

    tolerance: float = 1e-8
    span: float | None = None
    candidates: tuple[type[Splitting], ...] = (
        Omelyan6,
        BlanesMoan6,
        Omelyan4,
        Leapfrog,
        Omelyan8,
        KahanLi8,
        SofroniouSpaletta10,
    )

    def __post_init__(self):
        object.__setattr__(self, "tolerance", validate.number("Auto", "tolerance", self.tolerance, above=0.0))
        if self.span is not None:
            object.__setattr__(self, "span", validate.number("Auto", "span", self.span, above=0.0))


@dataclasses.dataclass(frozen=True)
class Choice:
    """What `Auto` chose. error: of the energy, relative, in the trial; cost: evaluations a unit of time."""

    auto: Auto
    integrator: Splitting
    error: float
    cost: float

    def __str__(self):
        return (
            f"{self.integrator}, chosen for a tolerance of {self.auto.tolerance:.1e}, with {self.error:.1e} in a trial"
        )


def integrator_of(owner: str, value) -> Integrator:
    """`value` as an integrator: None is `Leapfrog()`, "auto" is `Auto()`."""
    if value is None:
        return Leapfrog()
    if isinstance(value, str) and value == "auto":
        return Auto()
    if not isinstance(value, Integrator):
        raise InputError(f'{owner}: integrator is {value!r}; give fs.Leapfrog(dt) or another, "auto" or None')
    return value


def choose(auto: Auto, world, time: float, simulate) -> Choice:
    """Try the candidates on a sample of the world's particles. simulate: (world, integrator) -> Simulation at `time`.

    Raises FieldsimError where none meets the tolerance.
    """
    sample = _sample(world)
    pace = _pace(sample, time)
    if not math.isfinite(pace):  # nothing moves, or nothing pulls
        return Choice(auto, Leapfrog(), 0.0, 1.0 / Leapfrog().dt)
    span = SPAN * pace if auto.span is None else auto.span
    best = None
    for method in auto.candidates:
        best = _better(best, method, auto, pace, span, functools.partial(simulate, sample))
    if best is None:
        names = ", ".join(method.__name__ for method in auto.candidates)
        raise FieldsimError(
            f"Auto: none of {names} keeps the energy to {auto.tolerance:g} over {span:.3g} from time {time:g} at a "
            "reasonable cost; give a larger tolerance, soften what the particles pass closely, or use fs.Radau()"
        )
    return best


def _sample(world):
    """The world with at most SAMPLE of its particles, evenly spread over them."""
    total = sum(len(particles) for particles in world.particles)
    chosen = np.unique(np.linspace(0, total - 1, min(SAMPLE, total)).astype(int)) if total else np.zeros(0, int)
    sample = World(lights=world.lights, background=world.background)
    sample.bodies = list(world.bodies)
    first = 0
    for particles in world.particles:
        own = chosen[(chosen >= first) & (chosen < first + len(particles))] - first
        first += len(particles)
        fields = {"positions": particles.positions[own], "velocities": particles.velocities[own]}
        sample.particles.append(dataclasses.replace(particles, **fields))
    return sample


def _pace(world, time):
    """Median dynamical time of a world's particles: (|v| + sqrt(2 |F|)) / |acceleration|; inf where nothing pulls."""
    snapshot = world.at(time)
    sources = Sources(world, "gravity", time)
    points = wp.array(np.concatenate([np.zeros((0, 3)), *snapshot.positions]), dtype=wp.vec3d, device="cpu")
    _, pull = field_and_gradient(sources, upload(sources, np.array([time]), "cpu"), points)
    parts = energy(snapshot)
    speed = np.sqrt(2.0 * parts.kinetic) + np.sqrt(2.0 * np.abs(parts.potential))
    size = np.linalg.norm(pull.numpy(), axis=1)
    times = np.divide(speed, size, out=np.full(len(speed), math.inf), where=size > 0.0)
    return float(np.median(times)) if len(times) else math.inf


def _better(best, method, auto, pace, span, simulate):
    """The choice of a method with the longest step that meets the tolerance where that is cheaper than `best`."""
    cost = method.evaluations + (HESSIAN_COST - 1.0) * sum(map(bool, method.gradients))
    piece = span / LOOKS
    # Only steps that would make it cheaper are of interest.
    least = max(cost / best.cost if best else 0.0, SAMPLE * span * method.evaluations / WORK)
    dt = max(0.01 * cost * pace, 1.1 * least)
    tried = set()
    for _ in range(ROUNDS):
        # Whole steps between the looks, as in the trial.
        dt = piece / math.ceil(piece / dt)
        if dt in tried or dt <= least:
            break
        tried.add(dt)
        error = _error(method(dt), piece, simulate)
        if error <= auto.tolerance:
            best, least = Choice(auto, method(dt), error, cost / dt), dt
        if LEAST * auto.tolerance <= error <= MOST * auto.tolerance:
            break
        ratio = MOST * LEAST**0.5 * auto.tolerance / error if error > 0.0 else math.inf
        dt *= min(max(ratio ** (1.0 / method.order), 0.2), 3.0)
    return best


def _error(integrator, piece, simulate):
    """Largest relative error of energy in a trial; where nothing is kept, of the difference to half the step."""
    simulation = simulate(integrator)
    log = EnergyLog(simulation)
    times = simulation.time + piece * np.arange(1.0, LOOKS + 1.0)
    finer = None if log.invariant else simulate(dataclasses.replace(integrator, dt=integrator.dt / 2))
    error = 0.0
    try:
        for moment in times:
            simulation.advance(moment)
            if finer is None:
                with warnings.catch_warnings():  # a trial may fail
                    warnings.simplefilter("ignore", FieldsimWarning)
                    log.record()
            else:
                finer.advance(moment)
                error = max(error, _difference(simulation, finer))
    except InputError:
        raise
    except FieldsimError:  # it flew apart
        return math.inf
    return error if finer else log.report().largest


def _difference(simulation, finer):
    """Largest relative difference of energy between two runs, of particles that touched nothing in either."""
    one, other = energy(simulation.snapshot()), energy(finer.snapshot())
    free = np.concatenate(simulation.bounce_counts) + np.concatenate(finer.bounce_counts) == 0
    scale = np.maximum(other.kinetic + np.abs(other.potential), np.finfo(float).tiny)
    return float((np.abs(one.total - other.total) / scale)[free].max(initial=0.0))
