"""A method and a step for a given accuracy, found by short trial runs."""

import dataclasses
import math
import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeAlias

from fieldsim import validate
from fieldsim.dynamics.diagnostics.invariants import repels
from fieldsim.dynamics.integrators.splittings import (
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
from fieldsim.dynamics.radau.radau import Radau
from fieldsim.dynamics.refusals import method_refusal
from fieldsim.dynamics.trials import (
    AHEAD,
    GLANCES,
    LOOKS,
    SHORTEST,
    Trial,
    evaluation_cost,
    foreseen,
    pace,
    quietly,
    sampled,
    scouted,
    worst,
)
from fieldsim.errors import FieldsimError, FieldsimWarning, InputError
from fieldsim.types import RealLike

# An evaluation with the Hessian takes about so many times one without.
HESSIAN_COST = 1.5
# A trial evaluates the pull of so many particles at most, a flight ahead that of so many; a method gets so many trials.
WORK = 4_000_000
FLIGHT = 12_000_000
ROUNDS = 8
# A step's trial error is wanted between these parts of the tolerance.
LEAST, MOST = 0.1, 0.5
# A trial lasts so many dynamical times (speed over acceleration), of which an orbit takes about two and a half.
SPAN = 3.0
# So many flights ahead: what one met is among the trials before the next.
FLIGHTS = 4
# Trials of more that pull each other would take minutes.
MOST_PULLING = 500
# An adaptive step's evaluation takes about so many times one of a splitting.
RADAU_COST = 1.5


@dataclasses.dataclass(frozen=True)
class Auto(Integrator):
    """The cheapest method and step that keep the energy to `tolerance`, found by trial when a run starts.

    tolerance: of the energy, or the Jacobi integral where all that pulls turns, of each particle that touches nothing,
    and of that of free bodies together and of particles that pull each other together, relative to kinetic plus
    absolute potential energy; where nothing is kept, of the difference to half the step, as it may grow in 30 spans.
    span: duration of a trial, default about an orbit. candidates: the methods to choose from; only those that know
    all that is in the world are tried, Radau with its own tolerance.

    A sample of the particles (64, and all that pull each other) first flies ahead for 30 spans, and the trials begin
    shortly before the closest passages that it meets there: with Radau, where that can fly; else with the method chosen
    first, and what fails on the way is tried, too. A passage closer still, later or by a particle not in the sample is
    not foreseen (`EnergyLog` warns of it). Where the flight ends early, or the tolerance cannot be kept on it, a
    FieldsimWarning and the `Choice` say until when the choice is good.
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

    if TYPE_CHECKING:

        def __init__(
            self,
            tolerance: RealLike = ...,
            span: RealLike | None = ...,
            candidates: Iterable[type[Splitting]] = ...,
        ) -> None: ...

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
    """What `Auto` chose. error: of the energy, relative, in the trials; cost: evaluations a unit of time.

    until: the time up to which passages were foreseen; caveat: what is not vouched for, or "".
    """

    auto: Auto
    integrator: Integrator
    error: float
    cost: float
    until: float = math.inf
    caveat: str = ""

    def __str__(self):
        words = (
            f"{self.integrator}, chosen for a tolerance of {self.auto.tolerance:.1e}, with {self.error:.1e} in a trial"
        )
        return f"{words}; {self.caveat}" if self.caveat else words


# What stands for an integrator: "auto" for `Auto()`.
IntegratorLike: TypeAlias = Integrator | str


def integrator_of(owner: str, value: IntegratorLike | None) -> Integrator:
    """`value` as an integrator: None is `Leapfrog()`, "auto" is `Auto()`."""
    if value is None:
        return Leapfrog()
    if isinstance(value, str) and value == "auto":
        return Auto()
    return validate.instance(
        owner, "integrator", value, Splitting | Radau | Auto, 'give one such as fs.Leapfrog(dt), "auto" or None'
    )


def integrator_named(text: str) -> Integrator:
    """The integrator called `text`: a method's name in any case, optionally a colon and its step or tolerance.

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
    """Try the candidates on a sample of the world's particles. simulate: (world, integrator, time=) -> Simulation.

    Raises FieldsimError where none meets the tolerance.
    """
    return quietly(_Search(auto, world, time, simulate).choice)


def warn_of_caveat(choice: Choice) -> None:
    """Warn the user who makes a simulation of what is not vouched for."""
    if choice.caveat:
        advice = "give a longer Auto(span=...), or follow the run with fs.EnergyLog"
        warnings.warn(f"{choice}; {advice}", FieldsimWarning, stacklevel=3)


class _Search:
    """The search for a method and a step for one world."""

    def __init__(self, auto, world, time, simulate):
        self.auto, self.simulate, self.aim = auto, simulate, auto.tolerance
        # In trials nothing escapes: what a bad step throws out would no longer be judged.
        self.start, self.radius = Trial(sampled(world.replace(escape_radius=None)), time), world.escape_radius
        refusals = {method: method_refusal(method(), world) for method in auto.candidates}
        self.methods = [method for method in auto.candidates if not refusals[method]]
        if not self.methods:
            raise InputError(f"Auto: no candidate can move this world: {refusals[auto.candidates[0]]}")

    def choice(self) -> Choice:
        """The best method and step, and until when they are."""
        simulation = self.simulate(self.start.world, Leapfrog(), time=self.start.time)
        if len(simulation.mutual) > MOST_PULLING:
            raise InputError(
                f"Auto: {len(simulation.mutual)} particles pull each other, and trials of more than {MOST_PULLING} "
                "would take too long; give a method with its step, such as fs.BlanesMoan6(dt)"
            )
        self.pace, self.longest = pace(simulation), simulation.bodies.longest_step
        self.load = evaluation_cost(simulation)
        if not math.isfinite(self.pace):
            return self._unmoved()
        self.span = SPAN * self.pace if self.auto.span is None else self.auto.span
        trials = scouted(self.start, self.span, self.simulate, self.radius)
        best = self._best(trials or [self.start])
        if best is None:
            names = ", ".join(method.__name__ for method in self.auto.candidates)
            raise FieldsimError(
                f"Auto: none of {names} keeps the energy to {self.auto.tolerance:g} over {self.span:.3g} from time "
                f"{self.start.time:g} at a reasonable cost; give a larger tolerance, or soften what the particles pass "
                "closely"
            )
        return dataclasses.replace(best, until=self._end) if trials else self._ahead(best)

    @property
    def _end(self):
        """When a flight ahead ends."""
        return self.start.time + AHEAD * self.span

    def _unmoved(self):
        """Nothing moves, or nothing pulls at the start."""
        steps = Leapfrog(min(Leapfrog().dt, self.longest))
        untried = math.isfinite(self.longest) or repels(self.start.world)
        caveat = "nothing pulls at the start, so that steps through contacts were not tried" if untried else ""
        return Choice(self.auto, steps, 0.0, 1.0 / steps.dt, self.start.time if untried else math.inf, caveat)

    def _ahead(self, choice):
        """The choice, or another, that also keeps the tolerance on a flight ahead, as far as one is found."""
        trials, kept, lost = [self.start], dataclasses.replace(choice, until=-math.inf), True
        for _ in range(FLIGHTS):
            looks = int(FLIGHT * GLANCES / (choice.cost * self.load * self.span))
            flight = self.start, choice.integrator, self.span, self.auto.tolerance, looks
            until, well, missed = foreseen(*flight, self.simulate)
            farther = until > kept.until
            if farther:
                kept, lost = dataclasses.replace(choice, until=until), not well
            if missed is None:
                break
            if farther:
                trials = [missed, *trials]  # what failed last fails first
            else:
                self.aim *= LEAST  # no passage, then, but small errors that add up
            choice = self._best(trials)
            if choice is None:
                break
        caveat = ""
        if lost:
            caveat = f"after time {kept.until:.4g} it keeps the tolerance no more in a flight ahead"
        elif kept.until < self._end - 0.5 * self.span / GLANCES:
            caveat = f"a flight ahead would take long, so that what comes after time {kept.until:.4g} is not foreseen"
        return dataclasses.replace(kept, caveat=caveat)

    def _best(self, trials):
        """The cheapest choice that keeps the tolerance in all trials, or None."""
        best = None
        for method in self.methods:
            best = self._adaptive(best, trials) if method is Radau else self._better(best, method, trials)
        return best

    def _better(self, best, method, trials):
        """The choice of a method with the longest step that meets the tolerance where that is cheaper than `best`."""
        tolerance, piece = self.aim, self.span / LOOKS
        cost = method.evaluations + (HESSIAN_COST - 1.0) * sum(map(bool, method.gradients))
        # Only steps that would make it cheaper are of interest.
        least = max(cost / best.cost if best else 0.0, self.load * self.span * method.evaluations / WORK)
        dt = min(max(0.01 * cost * self.pace, 1.1 * least), self.longest)
        tried = set()
        for _ in range(ROUNDS):
            # Whole steps between the looks, as in the trial.
            dt = piece / math.ceil(piece / dt)
            if dt in tried or dt <= least:
                break
            tried.add(dt)
            error = worst(trials, method(dt), self.span, tolerance, self.simulate)
            if error <= tolerance:
                best, least = Choice(self.auto, method(dt), error, cost / dt), dt
            if LEAST * tolerance <= error <= MOST * tolerance:
                break
            ratio = MOST * LEAST**0.5 * tolerance / error if error > 0.0 else math.inf
            dt = min(dt * min(max(ratio ** (1.0 / method.order), SHORTEST), 3.0), self.longest)
        return best

    def _adaptive(self, best, trials):
        """Radau where it meets the tolerance and is cheaper than `best`."""
        simulations = []

        def kept(*arguments, **options):
            simulations.append(self.simulate(*arguments, **options))
            return simulations[-1]

        error = worst(trials, Radau(), self.span, self.aim, kept)
        run = simulations[0].radau
        cost = RADAU_COST * run.evaluations / (self.span * max(1, len(run.span[0])))
        if error > self.aim or (best and best.cost <= cost):
            return best
        return Choice(self.auto, Radau(), error, cost)
