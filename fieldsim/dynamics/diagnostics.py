"""What motion ought to keep: energy, angular momentum, the Jacobi integral; and how well a run kept it.

All quantities are per unit of a particle's mass, in the world's frame, and cover the particles of all sets in order.
"""

import dataclasses
import warnings

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.integrators import Splitting
from fieldsim.dynamics.repulsion import contact_energy
from fieldsim.dynamics.sources import Sources, field_and_gradient, upload
from fieldsim.dynamics.work import Work
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.world.contact import Status
from fieldsim.world.motion import Spin

# A drift beyond this share of a particle's energies is no rounding: its steps were too long for what it passed.
LOST = 1e-2


@dataclasses.dataclass(frozen=True)
class Energy:
    """Energies per unit mass of N particles, each (N,); `sum(energy.total)` is that of all particles of mass 1."""

    kinetic: np.ndarray
    potential: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Kinetic plus potential energy, (N,)."""
        return self.kinetic + self.potential


def energy(snapshot) -> Energy:
    """Energies of a snapshot's particles at that time; potential = -F of gravity, plus that of a `Repulsion`."""
    x, v = _state(snapshot)
    sources = Sources(snapshot.world, "gravity", snapshot.time, snapshot.poses_at)
    points = wp.array(x, dtype=wp.vec3d, device="cpu")
    field, _ = field_and_gradient(sources, upload(sources, np.array([snapshot.time]), "cpu"), points)
    return Energy(0.5 * np.einsum("ij,ij->i", v, v), contact_energy(snapshot) - field.numpy())


def angular_momentum(snapshot, center=(0.0, 0.0, 0.0)) -> np.ndarray:
    """(x - center) x v of each particle, (N, 3)."""
    x, v = _state(snapshot)
    return np.cross(x - np.array(validate.vector("angular_momentum", "center", center)), v)


def jacobi(snapshot, spin: Spin) -> np.ndarray:
    """The Jacobi integral E - omega . L about the spin's centre, (N,): kept where all that pulls turns with `spin`."""
    if not isinstance(spin, Spin):
        raise InputError(f"jacobi: spin is {spin!r}; give the fs.Spin with which the bodies turn")
    momentum = angular_momentum(snapshot, spin.center)
    return energy(snapshot).total - momentum @ (spin.rate * np.array(spin.axis))


def _state(snapshot):
    """Positions and velocities of all particles, each (N, 3)."""
    nothing = np.zeros((0, 3))
    return np.concatenate([nothing, *snapshot.positions]), np.concatenate([nothing, *snapshot.velocities])


def common_spin(world) -> Spin | None:
    """The spin with which everything in `world` that pulls turns, whatever the phases, or None."""
    pulling = [body for body in world.bodies if body.gravity is not None]
    if not all(isinstance(body.motion, Spin) and not _changing(body) for body in pulling):
        return None
    spins = {dataclasses.replace(body.motion, phase=0.0) for body in pulling}
    return spins.pop() if len(spins) == 1 else None


def _changing(body):
    """Whether a body's pull changes in its own frame."""
    return callable(body.mass) or any(primitive.animated for primitive in body.skeleton)


@dataclasses.dataclass(frozen=True)
class EnergyReport:
    """How well a run kept its invariant.

    invariant: "energy", "Jacobi integral", "energy less work", or "" where nothing is judged; largest, rms: drift since
    the start relative to each particle's kinetic plus absolute potential energy there, over all moments recorded;
    particles: how many never touched a surface and so were judged, of `total`; work: what moving sources did on those,
    per unit mass, in sum.
    """

    invariant: str
    largest: float
    rms: float
    particles: int
    total: int
    work: float = 0.0

    def __str__(self):
        if not self.total:
            return "no particles"
        if not self.invariant:
            return "no invariant to judge by: what pulls moves by functions of time"
        if not self.particles:
            return f"{self.invariant} not judged: all {self.total} particles touched a surface"
        judged = f"{self.particles} of {self.total} particles, those that never touched a surface"
        work = f"; the moving bodies did work {self.work:.3g}" if self.work else ""
        return f"{self.invariant} drift at most {self.largest:.1e}, rms {self.rms:.1e} ({judged}){work}"


@dataclasses.dataclass
class History:
    """A drift against time: the largest and the rms over particles, one entry per moment recorded."""

    times: list[float] = dataclasses.field(default_factory=list)
    largest: list[float] = dataclasses.field(default_factory=list)
    rms: list[float] = dataclasses.field(default_factory=list)


class EnergyLog:
    """Follows the invariant of a simulation: call `record()` now and then, read `report()` at the end.

    Still bodies keep each particle's energy; bodies that all turn with one Spin keep its Jacobi integral; for other
    motions the work that they do is followed and taken off (see `Work`), at some cost; under Radau, whose steps are
    each particle's own, it is not, and nothing is judged, nor where bodies move freely or particles pull each other.
    Particles that touched a surface lose or gain energy there and are left out from then on. The first particle whose
    drift exceeds LOST is told of in a FieldsimWarning.
    """

    def __init__(self, simulation):
        self._simulation = simulation
        pulling = [body for body in simulation.world.bodies if body.gravity is not None]
        self._spin = common_spin(simulation.world)
        still = not any(body.moving or _changing(body) for body in pulling)
        pulls = any(particles.gravity is not None for particles in simulation.world.particles)
        if pulls or any(body.free for body in pulling):
            still, self._spin = False, None
        follows = not (still or self._spin or pulls or simulation.bodies) and isinstance(
            simulation.integrator, Splitting
        )
        self._work = Work(simulation) if follows else None
        kept = "energy" if still else "Jacobi integral" if self._spin else ""
        self.invariant = "energy less work" if self._work else kept
        self.history = History()
        self._squares = 0.0
        self._count = 0
        self._warned = False
        self._total = sum(len(particles) for particles in simulation.world.particles)
        if self.invariant and self._total:
            start = energy(simulation.snapshot())
            self._scale = np.maximum(start.kinetic + np.abs(start.potential), np.finfo(float).tiny)
            self._start = self._values()

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
        if not (self.invariant and self._total):
            return
        drift = np.where(self._judged, np.abs(self._values() - self._start) / self._scale, 0.0)
        self._warn_of_losses(drift)
        drift = drift[self._judged]
        squares = float(np.sum(drift**2))
        self._squares += squares
        self._count += len(drift)
        self.history.times.append(self._simulation.time)
        self.history.largest.append(float(drift.max(initial=0.0)))
        self.history.rms.append((squares / max(1, len(drift))) ** 0.5)

    def _warn_of_losses(self, drift):
        worst = int(np.argmax(drift))
        if self._warned or not drift[worst] > LOST:
            return
        self._warned = True
        sizes = [len(particles) for particles in self._simulation.world.particles]
        index = int(np.searchsorted(np.cumsum(sizes), worst, side="right"))
        warnings.warn(
            f"at time {self._simulation.time:g} the {self.invariant} of particle {worst - sum(sizes[:index])} of set "
            f"{index} has drifted by {drift[worst]:.1e} of its size: steps are too long for what it passes closely; "
            f"give {self._simulation.integrator} a shorter dt, soften the body's gravity, or use fs.Radau()",
            FieldsimWarning,
            stacklevel=3,
        )

    def report(self) -> EnergyReport:
        """The drift over all moments recorded so far."""
        judged = int(self._judged.sum()) if self._total else 0
        rms = (self._squares / self._count) ** 0.5 if self._count else 0.0
        work = float(self._work.values()[self._judged].sum()) if self._work and self._total else 0.0
        largest = max(self.history.largest, default=0.0)
        return EnergyReport(self.invariant, largest, rms, judged, self._total, work)
