"""What motion ought to keep: energy, angular momentum, the Jacobi integral; and how well a run kept it.

All quantities are per unit of a particle's mass, in the world's frame, and cover the particles of all sets in order.
"""

import dataclasses
import warnings

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.sources import Sources, field_and_gradient, upload
from fieldsim.errors import FieldsimWarning, InputError
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
    """Energies of a snapshot's particles in the gravity of its bodies at that time; potential = -F."""
    x, v = _state(snapshot)
    sources = Sources(snapshot.world, "gravity", snapshot.time)
    points = wp.array(x, dtype=wp.vec3d, device="cpu")
    field, _ = field_and_gradient(sources, upload(sources, np.array([snapshot.time]), "cpu"), points)
    return Energy(0.5 * np.einsum("ij,ij->i", v, v), -field.numpy())


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

    invariant: "energy", "Jacobi integral" or "" where there is none; largest, rms: drift since the start relative to
    each particle's kinetic plus absolute potential energy there, over all moments recorded; particles: how many never
    touched a surface and so were judged, of `total`.
    """

    invariant: str
    largest: float
    rms: float
    particles: int
    total: int

    def __str__(self):
        if not self.total:
            return "no particles"
        if not self.invariant:
            return "no invariant to judge by: what pulls moves by functions of time"
        if not self.particles:
            return f"{self.invariant} not judged: all {self.total} particles touched a surface"
        judged = f"{self.particles} of {self.total} particles, those that never touched a surface"
        return f"{self.invariant} drift at most {self.largest:.1e}, rms {self.rms:.1e} ({judged})"


class EnergyLog:
    """Follows the invariant of a simulation: call `record()` now and then, read `report()` at the end.

    Still bodies keep each particle's energy; bodies that all turn with one Spin keep its Jacobi integral; other motions
    keep nothing. Particles that touched a surface lose or gain energy there and are left out from then on. The first
    particle whose drift exceeds LOST is told of in a FieldsimWarning.
    """

    def __init__(self, simulation):
        self._simulation = simulation
        pulling = [body for body in simulation.world.bodies if body.gravity is not None]
        self._spin = common_spin(simulation.world)
        still = not any(body.moving or _changing(body) for body in pulling)
        self.invariant = "energy" if still else "Jacobi integral" if self._spin else ""
        self._largest = 0.0
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
        return jacobi(snapshot, self._spin) if self._spin else energy(snapshot).total

    @property
    def _judged(self):
        return np.concatenate(self._simulation.bounce_counts) == 0

    def record(self) -> None:
        """Take the present moment into account."""
        if not (self.invariant and self._total):
            return
        drift = np.where(self._judged, np.abs(self._values() - self._start) / self._scale, 0.0)
        self._warn_of_losses(drift)
        drift = drift[self._judged]
        self._largest = max(self._largest, float(drift.max(initial=0.0)))
        self._squares += float(np.sum(drift**2))
        self._count += len(drift)

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
        return EnergyReport(self.invariant, self._largest, rms, judged, self._total)
