"""A method and a step for an asked accuracy, found by short trial runs."""

import dataclasses
import functools
import math
import warnings

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.diagnostics import energy
from fieldsim.dynamics.energy_log import EnergyLog
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
from fieldsim.dynamics.radau import Radau
from fieldsim.dynamics.refusals import method_refusal
from fieldsim.dynamics.sources import Sources, field_and_gradient, upload
from fieldsim.errors import FieldsimError, FieldsimWarning, InputError

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
# A scout flies ahead for so many trials, and is looked at so many times during each.
AHEAD = 30
GLANCES = 4
# An adaptive step's evaluation takes about so many times one of a splitting.
RADAU_COST = 1.5


@dataclasses.dataclass(frozen=True)
class Auto(Integrator):
    """The cheapest method and step that keep each particle's energy to `tolerance`, found by trial when a run starts.

    tolerance: of the energy, or the Jacobi integral where all that pulls turns, relative to kinetic plus absolute
    potential energy at the start. span: duration of a trial, about an orbit unless told. candidates: the methods to
    choose from; Radau is tried with its own tolerance, and only where it knows all that is in the world.

    Where Radau can fly, a sample of the particles first flies ahead with it for 30 spans, and the trials start shortly
    before the closest passage that each of them meets there. A passage closer still, later or by a particle not in the
    sample, is not foreseen (`EnergyLog` tells of it).
    """

    tolerance: float = 1e-8
    span: float | None = None
    candidates: tuple[type[Integrator], ...] = (
        Omelyan6,
        BlanesMoan6,
        Omelyan4,
        Leapfrog,
        Omelyan8,
        KahanLi8,
        SofroniouSpaletta10,
        Radau,
    )

    def __post_init__(self):
        validate.fields(self, validate.number, "tolerance", above=0.0)
        object.__setattr__(self, "span", validate.optional(validate.number, "Auto", "span", self.span, above=0.0))
        remedy = "give a list of methods, such as (fs.Leapfrog, fs.BlanesMoan6)"
        methods = validate.instances("Auto", "candidates", self.candidates, type, remedy)
        known = [m for m in methods if issubclass(m, Splitting | Radau) and m is not Splitting]
        if not methods or len(known) < len(methods):
            raise InputError(f"Auto: candidates is {validate.shown(self.candidates)}; {remedy}")
        object.__setattr__(self, "candidates", methods)


@dataclasses.dataclass(frozen=True)
class Choice:
    """What `Auto` chose. error: of the energy, relative, in the trial; cost: evaluations a unit of time."""

    auto: Auto
    integrator: Integrator
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
    return validate.instance(
        owner, "integrator", value, Splitting | Radau | Auto, 'give one such as fs.Leapfrog(dt), "auto" or None'
    )


def integrator_named(text: str) -> Integrator:
    """The integrator called `text`: a method's name in any case, and after a colon its step or tolerance if told.

    Such as "auto", "auto:1e-6", "radau", "leapfrog:1e-3", "kahanli8:0.05". Raises InputError for others.
    """
    name, colon, number = text.strip().partition(":")
    known = {method.__name__: method for method in (Auto, Radau, *Splitting.__subclasses__())}
    found = [method for title, method in known.items() if title.lower() == name.lower()]
    if not found:
        raise InputError(f"{name!r} is no integrator; give one of {', '.join(sorted(known))}, such as radau")
    if not colon:
        return found[0]()
    first = dataclasses.fields(found[0])[0].name
    try:
        given = float(number)
    except ValueError:
        raise InputError(f"{found[0].__name__}: {first} is {number!r}; give a number, such as {name}:1e-3") from None
    return found[0](validate.number(found[0].__name__, first, given, above=0.0))


def choose(auto: Auto, world, time: float, simulate) -> Choice:
    """Try the candidates on a sample of the world's particles. simulate: (world, integrator) -> Simulation at `time`.

    Raises FieldsimError where none meets the tolerance.
    """
    sample = _sample(world)
    pace = _pace(sample, time)
    if not math.isfinite(pace):  # nothing moves, or nothing pulls
        return Choice(auto, Leapfrog(), 0.0, 1.0 / Leapfrog().dt)
    span = SPAN * pace if auto.span is None else auto.span
    flyable = not method_refusal(Radau(), sample)
    if flyable:
        sample = _closest(sample, time, span, simulate)
    best = None
    for method in auto.candidates:
        if method_refusal(method(), sample):
            continue
        if method is not Radau:
            best = _better(best, method, auto, pace, span, functools.partial(simulate, sample))
        else:
            best = _adaptive(best, auto, span, functools.partial(simulate, sample))
    if best is None:
        names = ", ".join(method.__name__ for method in auto.candidates)
        raise FieldsimError(
            f"Auto: none of {names} keeps the energy to {auto.tolerance:g} over {span:.3g} from time {time:g} at a "
            "reasonable cost; give a larger tolerance, or soften what the particles pass closely"
        )
    return best


def _closest(world, time, span, simulate):
    """The world with each particle where it is shortly before its closest passage of the next AHEAD spans."""
    simulation = simulate(world, Radau())
    scout, piece = simulation.radau, span / GLANCES
    positions, velocities = (np.concatenate(sets) for sets in (simulation.positions, simulation.velocities))
    looks = [(positions, velocities)]
    for look in range(1, AHEAD * GLANCES + 1):
        scout.advance(time + piece * look)
        looks.append(scout.at(time + piece * look))
    tau, when = scout.closest
    # At least a glance before it, so that a trial has it within its first half; where nothing changes, at the start.
    chosen = np.where(np.isfinite(tau), np.maximum((when - time) // piece - 1, 0), 0).astype(int)
    x, v = (np.stack(parts)[chosen, np.arange(len(chosen))] for parts in zip(*looks, strict=True))
    return _with_states(world, x, v)


def _with_states(world, x, v):
    """The world with its particles at x (N, 3) with velocities v (N, 3)."""
    ends = np.cumsum([len(particles) for particles in world.particles])[:-1]
    sets = zip(world.particles, np.split(x, ends), np.split(v, ends), strict=True)
    return world.replace(particles=[dataclasses.replace(p, positions=here, velocities=to) for p, here, to in sets])


def _sample(world):
    """The world with at most SAMPLE of its particles, evenly spread over them."""
    total = sum(len(particles) for particles in world.particles)
    chosen = np.unique(np.linspace(0, total - 1, min(SAMPLE, total)).astype(int)) if total else np.zeros(0, int)
    sets, first = [], 0
    for particles in world.particles:
        own = chosen[(chosen >= first) & (chosen < first + len(particles))] - first
        first += len(particles)
        fields = {"positions": particles.positions[own], "velocities": particles.velocities[own]}
        sets.append(dataclasses.replace(particles, **fields))
    return world.replace(particles=sets)


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


def _adaptive(best, auto, span, simulate):
    """Radau where it meets the tolerance and is cheaper than `best`."""
    simulations = []

    def kept(integrator):
        simulations.append(simulate(integrator))
        return simulations[-1]

    error = _error(Radau(), span / LOOKS, kept)
    run = simulations[0].radau
    cost = RADAU_COST * run.evaluations / (span * max(1, len(run.span[0])))
    if error > auto.tolerance or (best and best.cost <= cost):
        return best
    return Choice(auto, Radau(), error, cost)


def _finer(integrator):
    """The same method with half the step."""
    if isinstance(integrator, Radau):
        return dataclasses.replace(integrator, tolerance=integrator.tolerance / 2**7)
    return dataclasses.replace(integrator, dt=integrator.dt / 2)


def _error(integrator, piece, simulate):
    """Largest relative error of energy in a trial; where nothing is kept, of the difference to half the step."""
    simulation = simulate(integrator)
    log = EnergyLog(simulation)
    times = simulation.time + piece * np.arange(1.0, LOOKS + 1.0)
    finer = None if log.invariant else simulate(_finer(integrator))
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
