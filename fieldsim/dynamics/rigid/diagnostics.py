"""What free bodies ought to keep, and what acts on them. All in the world's frame; B free bodies, S bodies in all."""

import dataclasses

import numpy as np

from fieldsim import validate


@dataclasses.dataclass(frozen=True, eq=False)
class BodyEnergy:
    """translation, rotation (B,): kinetic energies of the free bodies; potential: of all of them together.

    The potential energy is that in the gravity of the prescribed bodies, of each other, and in contacts. lost: what
    friction and damping in contacts have taken so far; where prescribed bodies move, less what they gave by friction.
    """

    translation: np.ndarray
    rotation: np.ndarray
    potential: float
    lost: float = 0.0

    @property
    def total(self) -> float:
        """All energy of all free bodies: with what was lost it is kept where prescribed bodies stand still."""
        return float(self.translation.sum() + self.rotation.sum()) + self.potential


def body_energy(bodies) -> BodyEnergy:
    """Energies of a simulation's free bodies (`simulation.bodies`) now."""
    rotation = 0.5 * np.sum(bodies.spins * bodies.angular_velocities, axis=1)
    return BodyEnergy(bodies.kinetic_energies - rotation, rotation, bodies.potential_energy(), bodies.lost)


def body_momentum(bodies) -> np.ndarray:
    """Momenta of the free bodies, (B, 3)."""
    return bodies.momenta


def body_angular_momentum(bodies, center=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Angular momenta of the free bodies about `center`, (B, 3): of their motion and of their turning."""
    center = np.array(validate.vector("body_angular_momentum", "center", center))
    return np.cross(bodies.centers - center, bodies.momenta) + bodies.spins


@dataclasses.dataclass(frozen=True, eq=False)
class Wrenches:
    """forces, torques (S, B, 3): of body s of the world on free body b, about the latter's centre of mass.

    Gravity and contact together. free (B,): which of the world's bodies the free ones are.
    """

    free: tuple[int, ...]
    forces: np.ndarray
    torques: np.ndarray


def wrenches(bodies) -> Wrenches:
    """Forces and torques of every body on every free one, now."""
    return Wrenches(tuple(start.index for start in bodies.starts), *bodies.wrenches())
