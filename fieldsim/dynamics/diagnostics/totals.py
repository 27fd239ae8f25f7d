"""What free bodies together, and particles that pull each other together, ought to keep.

Where all prescribed bodies stand still, the energies of contacts and of gravity add up with the kinetic ones and what
friction and damping have taken to a constant; where there are none, momentum and angular momentum are constants as
well.
"""

import dataclasses
import functools

import numpy as np

from fieldsim.dynamics.diagnostics.invariants import energy
from fieldsim.dynamics.rigid.diagnostics import body_angular_momentum, body_energy

BODIES, PARTICLES = "free bodies", "particles together"


@dataclasses.dataclass(frozen=True)
class Drift:
    """How far a total has drifted since the start, at most, relative to the largest sum of its parts' sizes so far.

    whose: "free bodies" or "particles together"; quantity: "energy", "momentum" or "angular momentum".
    """

    whose: str
    quantity: str
    largest: float


class Total:
    """One total of a simulation from now on: `record()` adds its relative drift to `drifts`."""

    def __init__(self, whose: str, quantity: str, measure):
        self.whose, self.quantity, self._measure = whose, quantity, measure
        self._start, self._scale = measure()
        self.drifts: list[float] = []

    def record(self) -> float:
        """Take the present moment into account and return its drift."""
        value, scale = self._measure()
        self._scale = max(self._scale, scale)
        self.drifts.append(float(np.linalg.norm(value - self._start) / max(self._scale, np.finfo(float).tiny)))
        return self.drifts[-1]

    def measured(self):
        """The total now."""
        return self._measure()[0]

    def shift(self, before) -> None:
        """What a manoeuvre has made of the total `before` it is no drift."""
        value, scale = self._measure()
        self._start = self._start + (value - before)
        self._scale = max(self._scale, scale)

    @property
    def drift(self) -> Drift:
        """What was seen so far."""
        return Drift(self.whose, self.quantity, max(self.drifts, default=0.0))


def totals_of(simulation) -> list[Total]:
    """The totals that a simulation ought to keep."""
    bodies = simulation.world.bodies
    found = []
    if simulation.bodies:
        acting = [body for body in bodies if not body.free and (body.gravity is not None or body.surface is not None)]
        found += _kept(BODIES, acting, BODY_MEASURES, simulation.bodies)
    if simulation.mutual:
        found += _kept(PARTICLES, [body for body in bodies if body.gravity is not None], PARTICLE_MEASURES, simulation)
    return found


def _kept(whose, acting, measures, subject):
    """Energy where what acts from outside stands still, the others where nothing does."""
    if any(body.moving or body.deforming for body in acting):
        return []
    quantities = ["energy"] if acting else list(measures)
    return [Total(whose, name, functools.partial(measures[name], subject)) for name in quantities]


def _energy_of_bodies(bodies):
    parts = body_energy(bodies)
    return np.array([parts.total + parts.lost]), bodies.kinetic_energies.sum() + abs(parts.potential)


def _momentum_of_bodies(bodies):
    return bodies.momenta.sum(axis=0), _size(bodies.momenta)


def _angular_momentum_of_bodies(bodies):
    return body_angular_momentum(bodies).sum(axis=0), _size(bodies.spins) + _size(body_angular_momentum(bodies))


def _energy_of_particles(simulation):
    _x, _v, weights = _weighted(simulation)
    parts = energy(simulation.snapshot())
    kinetic, potential = weights @ parts.kinetic, weights @ parts.potential
    return np.array([kinetic + potential]), np.abs(weights) @ parts.kinetic + abs(potential)


def _momentum_of_particles(simulation):
    _x, v, weights = _weighted(simulation)
    return weights @ v, _size(weights[:, None] * v)


def _angular_momentum_of_particles(simulation):
    x, v, weights = _weighted(simulation)
    turning = weights[:, None] * np.cross(x, v)
    return turning.sum(axis=0), _size(turning)


BODY_MEASURES = {
    "energy": _energy_of_bodies,
    "momentum": _momentum_of_bodies,
    "angular momentum": _angular_momentum_of_bodies,
}
PARTICLE_MEASURES = {
    "energy": _energy_of_particles,
    "momentum": _momentum_of_particles,
    "angular momentum": _angular_momentum_of_particles,
}


def _weighted(simulation):
    """Positions, velocities and weights G m of all particles; those that do not pull have none."""
    x, v = (np.concatenate(sets) for sets in (simulation.positions, simulation.velocities))
    return x, v, simulation.mutual.strengths


def _size(vectors):
    """Sum of the lengths of vectors (N, 3)."""
    return float(np.linalg.norm(vectors, axis=1).sum())
