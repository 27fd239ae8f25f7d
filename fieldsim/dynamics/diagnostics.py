"""What motion ought to keep: energy, angular momentum, the Jacobi integral.

All quantities are per unit of a particle's mass, in the world's frame, and cover the particles of all sets in order.
"""

import dataclasses

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.repulsion import contact_energy
from fieldsim.dynamics.sources import Sources, field_and_gradient, upload
from fieldsim.errors import InputError
from fieldsim.world.motion import Spin


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
    if not all(isinstance(body.motion, Spin) and not changing(body) for body in pulling):
        return None
    spins = {dataclasses.replace(body.motion, phase=0.0) for body in pulling}
    return spins.pop() if len(spins) == 1 else None


def changing(body) -> bool:
    """Whether what a body is made of changes in its own frame."""
    return callable(body.mass) or any(primitive.animated for primitive in body.skeleton)
