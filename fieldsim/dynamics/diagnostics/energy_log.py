"""How well a run keeps what it ought to: each particle's invariant, and the totals of what moves together."""

import dataclasses
import math
import warnings

import numpy as np

from fieldsim import validate
from fieldsim.copies import Uncopied
from fieldsim.dynamics.bare_sources import particle_name
from fieldsim.dynamics.diagnostics.followed import Followed
from fieldsim.dynamics.diagnostics.invariants import acting, changing, common_spin, energy, jacobi, repels
from fieldsim.dynamics.diagnostics.totals import BODIES, Drift, totals_of
from fieldsim.dynamics.diagnostics.work import Work
from fieldsim.dynamics.integrators.splittings import Splitting
from fieldsim.errors import FieldsimWarning
from fieldsim.world.contact import Status

# A drift beyond this share of the energies is no rounding: steps were too long for what was passed, or hit.
LOST = 1e-2


@dataclasses.dataclass(frozen=True)
class EnergyReport:
    """How well a run kept its invariants.

    invariant: "energy", "Jacobi integral", "energy less work", or "" where no particle is judged by itself; largest,
    rms: drift since the start relative to each particle's kinetic plus absolute potential energy there, over all
    moments recorded; particles: how many neither touched a surface nor escaped and so were judged, of `total`; work:
    what moving sources did on those, per unit mass, in sum. totals: drifts of what free bodies, or particles that pull
    each other, keep together (see `Drift`). manoeuvres: what manoeuvres gave to those particles, per unit mass, in sum.
    """

    invariant: str
    largest: float
    rms: float
    particles: int
    total: int
    work: float = 0.0
    totals: tuple[Drift, ...] = ()
    manoeuvres: float = 0.0

    def __str__(self):
        sentences = [] if self.totals and not (self.total and self.invariant) else [self._of_each()]
        return "; ".join(sentences + self._of_all())

    def _of_each(self):
        if not self.total:
            return "no particles"
        if not self.invariant:
            return "no invariant to judge particles by: what pulls them moves in ways of its own"
        if not self.particles:
            return f"{self.invariant} not judged: all {self.total} particles touched a surface or escaped"
        judged = f"{self.particles} of {self.total} particles, those that neither touched a surface nor escaped"
        work = f"; the moving bodies did work {self.work:.3g}" if self.work else ""
        given = f"; manoeuvres gave {self.manoeuvres:.3g}" if self.manoeuvres else ""
        return f"{self.invariant} drift at most {self.largest:.1e}, rms {self.rms:.1e} ({judged}){work}{given}"

    def _of_all(self):
        """One sentence for each group of what moves together."""
        groups = {}
        for drift in self.totals:
            groups.setdefault(drift.whose, []).append(f"{drift.quantity} {drift.largest:.1e}")
        return [f"{whose}: drift of {', '.join(parts)}" for whose, parts in groups.items()]


@dataclasses.dataclass
class History:
    """Drifts against time: of the particles the largest and the rms, one entry per moment recorded."""

    times: list[float] = dataclasses.field(default_factory=list)
    largest: list[float] = dataclasses.field(default_factory=list)
    rms: list[float] = dataclasses.field(default_factory=list)


class EnergyLog(Uncopied):
    """Follows the invariants of a simulation: call `record()` now and then, read `report()` at the end.

    Still bodies keep each particle's energy; bodies that all turn with one Spin keep its Jacobi integral; for other
    motions the work that they do is followed and taken off (see `Work`), at some cost, for which functions of time are
    also called up to a sixteenth of a step before the start and after the end; under Radau, whose steps are each
    particle's own, it is not, and no particle is judged, nor where bodies move freely, particles pull each other, or
    moving surfaces repel them. Particles that touched a surface lose or gain energy there and are left out from then
    on, as are those that escaped.

    Free bodies together keep their energy, contacts included, where all prescribed bodies stand still, and where there
    are none also their momentum and angular momentum; so do, together, particles that pull each other. These are
    `totals`, each with its drifts at the moments of `history.times`. What manoeuvres give (`Simulation.set_particles`,
    `set_body`) is no drift.

    A FieldsimWarning names the first particle whose drift exceeds LOST, and the first total energy that does.
    """

    _remedy = "keep log.report() or log.history"

    def __init__(self, simulation: Followed):
        wanted = ("world", "mutual", "bodies", "integrator", "snapshot", "account")
        validate.having("EnergyLog", "simulation", simulation, wanted, "give a fs.Simulation")
        self._simulation = simulation
        self.totals = totals_of(simulation)
        bodies = acting(simulation.world)
        self._spin = common_spin(simulation.world)
        still = not (simulation.mutual or any(body.moving or changing(simulation.world, body) for body in bodies))
        # The work of gravity can be followed, that of surfaces cannot.
        follows = not (still or self._spin or simulation.mutual or simulation.bodies or repels(simulation.world))
        follows = follows and isinstance(simulation.integrator, Splitting)
        self._work = Work(simulation) if follows else None
        kept = "energy" if still else "Jacobi integral" if self._spin else ""
        self.invariant = "energy less work" if self._work else kept
        self.history = History()
        self._squares = 0.0
        self._count = 0
        self._warned = set()
        self._total = sum(len(particles) for particles in simulation.world.particles)
        if self.judging:
            self._scale = self._sizes()
            self._start = self._values()
            self._given = np.zeros(self._total)
        simulation.account(self)

    @property
    def judging(self) -> bool:
        """Whether there are particles, and an invariant to judge each by."""
        return bool(self.invariant and self._total)

    def _sizes(self):
        """Kinetic plus absolute potential energies, (N,)."""
        now = energy(self._simulation.snapshot())
        return np.maximum(now.kinetic + np.abs(now.potential), np.finfo(float).tiny)

    def measured(self) -> tuple:
        """What a manoeuvre may change: the totals, and of the particles the invariants and which of them are judged."""
        totals = [total.measured() for total in self.totals]
        return totals, (self._values(), self._judged) if self.judging else None

    def manoeuvred(self, before: tuple) -> None:
        """What a manoeuvre has given since `before` (as `measured`) is no drift; who was not judged begins anew."""
        totals, particles = before
        for total, value in zip(self.totals, totals, strict=True):
            total.shift(value)
        if particles:
            values, judged = particles
            now = self._values()
            with np.errstate(all="ignore"):  # what was on a bare source just then had an infinite potential
                given = now - values
            judged &= np.isfinite(given)
            self._start = np.where(judged, self._start + given, now)
            self._given += np.where(judged, given, 0.0)
            self._scale = np.maximum(self._scale, self._sizes())

    def _values(self):
        snapshot = self._simulation.snapshot()
        if self._spin:
            return jacobi(snapshot, self._spin)
        values = energy(snapshot).total
        return values - self._work.values() if self._work else values

    @property
    def _judged(self):
        """Which particles never touched a surface, nor escaped and were stopped."""
        escaped = np.concatenate(self._simulation.states) == Status.ESCAPED
        return (np.concatenate(self._simulation.bounce_counts) == 0) & ~escaped

    def record(self) -> None:
        """Take the present moment into account."""
        if not (self.judging or self.totals):
            return
        self.history.times.append(self._simulation.time)
        for total in self.totals:
            if total.record() > LOST and total.quantity == "energy":
                self._warn_of_total(total)
        if not self.judging:
            return
        with np.errstate(all="ignore"):  # what is on a bare source just now has an infinite potential
            drift = np.abs(self._values() - self._start) / self._scale
        drift = np.where(self._judged, np.nan_to_num(drift, nan=math.inf, posinf=math.inf), 0.0)
        if drift.max() > LOST:
            self._warn_of_particle(drift)
        drift = drift[self._judged]
        squares = float(np.sum(drift**2))
        self._squares += squares
        self._count += len(drift)
        self.history.largest.append(float(drift.max(initial=0.0)))
        self.history.rms.append((squares / max(1, len(drift))) ** 0.5)

    def _warn_of_particle(self, drift):
        worst = int(np.argmax(drift))
        if isinstance(self._simulation.integrator, Splitting):
            cause, remedy = "steps are too long for what it passes closely", "a shorter dt"
            last = ", soften the body's gravity, or use fs.Radau()"
        else:
            cause, remedy = "it passes something too closely even for short steps", "a smaller tolerance"
            last = ", or soften the body's gravity"
        self._warn(
            "particle",
            f"the {self.invariant} of {particle_name(self._simulation.world.particles, worst)}",
            f"{drift[worst]:.1e}",
            f"{cause}; give {self._simulation.integrator} {remedy}{last}",
        )

    def _warn_of_total(self, total):
        softer = "a lower Rigid(stiffness=...)" if total.whose == BODIES else "a larger softening"
        self._warn(
            total.whose,
            f"the energy of {total.whose}",
            f"{total.drifts[-1]:.1e}",
            f"steps are too long for what meets closely; give {self._simulation.integrator} a shorter dt, or {softer}",
        )

    def _warn(self, subject, what, size, advice):
        """One warning for each subject."""
        if subject not in self._warned:
            self._warned.add(subject)
            text = f"at time {self._simulation.time:g} {what} has drifted by {size} of its size: {advice}"
            warnings.warn(text, FieldsimWarning, stacklevel=4)

    def report(self) -> EnergyReport:
        """The drift over all moments recorded so far."""
        judged = int(self._judged.sum()) if self._total else 0
        rms = (self._squares / self._count) ** 0.5 if self._count else 0.0
        work = float(self._work.values()[self._judged].sum()) if self._work and self._total else 0.0
        given = float(self._given[self._judged].sum()) if self.judging else 0.0
        largest = max(self.history.largest, default=0.0)
        totals = tuple(total.drift for total in self.totals)
        return EnergyReport(self.invariant, largest, rms, judged, self._total, work, totals, given)
