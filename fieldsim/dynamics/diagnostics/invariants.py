"""What motion ought to keep: energy, angular momentum, the Jacobi integral.

All quantities are per unit of a particle's mass, in the world's frame, and cover the particles of all sets in order.
"""

import dataclasses

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.contact.repulsion import contact_energy
from fieldsim.dynamics.refusals import refuse_mixture
from fieldsim.dynamics.splitting.mutual_gravity import MutualGravity
from fieldsim.sources.elements import Sources
from fieldsim.sources.field import field_and_gradient
from fieldsim.sources.stages import upload
from fieldsim.types import VectorLike
from fieldsim.world.contact import Repulsion
from fieldsim.world.motion import Pose, Spin
from fieldsim.world.snapshot import Snapshot
from fieldsim.world.world import World, given_world


@dataclasses.dataclass(frozen=True)
class Energy:
    """Energies per unit mass of N particles, each (N,); `sum(energy.total)` is that of all particles of mass 1.

    Particles that pull each other share the energy of each pair by halves, so that `sum(w * energy.total)`, w = G m of
    each, is what they keep together; one that only feels them (gravity=None, or no mass) has all of its own, and w = 0.
    """

    kinetic: np.ndarray
    potential: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Kinetic plus potential energy, (N,)."""
        return self.kinetic + self.potential


def energy(snapshot: Snapshot) -> Energy:
    """Energies of a snapshot's particles at that time, in all that acts on them.

    potential = -F of the gravity of all bodies, free ones where the snapshot has them, that of a `Repulsion`, and that
    in the pull of the other particles (see `Energy`). Free bodies have their own: `body_energy(simulation.bodies)`.
    """
    x, v = _state("energy", snapshot)
    sources = Sources(snapshot.world, "gravity", snapshot.time, snapshot.poses_at)
    points = wp.array(x, dtype=wp.vec3d, device="cpu")
    field, _ = field_and_gradient(sources, upload(sources, np.array([snapshot.time]), "cpu"), points)
    potential = contact_energy(snapshot) - field.numpy() + _shared(snapshot.world, x)
    return Energy(0.5 * np.einsum("ij,ij->i", v, v), potential)


def _shared(world, x):
    """Each particle's share of the energy in the pull of the others, (N,)."""
    refuse_mixture("energy", world)
    mutual = MutualGravity(world, "cpu")
    if not mutual:
        return 0.0
    return np.where(mutual.strengths, 0.5, 1.0) * mutual.potential_energies(x)


def angular_momentum(snapshot: Snapshot, center: VectorLike = (0.0, 0.0, 0.0)) -> np.ndarray:
    """(x - center) x v of each particle, (N, 3)."""
    x, v = _state("angular_momentum", snapshot)
    return np.cross(x - np.array(validate.vector("angular_momentum", "center", center)), v)


def jacobi(snapshot: Snapshot, spin: Spin) -> np.ndarray:
    """The Jacobi integral E - omega . L about the spin's centre, (N,): kept where all that pulls turns with `spin`."""
    _state("jacobi", snapshot)
    validate.instance("jacobi", "spin", spin, Spin, "give the fs.Spin with which the bodies turn")
    momentum = angular_momentum(snapshot, spin.center)
    return energy(snapshot).total - momentum @ (spin.rate * np.array(spin.axis))


def _state(owner, snapshot):
    """Positions and velocities of all particles, each (N, 3)."""
    validate.instance(owner, "snapshot", snapshot, Snapshot, "give simulation.snapshot() or world.at(time)")
    nothing = np.zeros((0, 3))
    return np.concatenate([nothing, *snapshot.positions]), np.concatenate([nothing, *snapshot.velocities])


def acting(world: World) -> list:
    """The bodies whose potential particles feel: all that pull, and where a `Repulsion` is felt, all surfaces."""
    repelled = repels(world)
    return [body for body in world.bodies if body.gravity is not None or (repelled and body.surface is not None)]


def repels(world: World) -> bool:
    """Whether surfaces repel some particle."""
    return any(isinstance(particles.contact, Repulsion) for particles in world.particles)


def common_spin(world: World) -> Spin | None:
    """The spin with which everything in `world` that pulls (or repels) turns, whatever the phases, or None.

    Two spins are one where their axes are one line and their rates about it agree, however they are written. What lies
    evenly about that line turns with any spin, also while it stands still or turns faster.
    """
    world = given_world("common_spin", world)
    bodies = acting(world)
    if any(changing(world, body) for body in bodies) or any(
        particles.gravity is not None for particles in world.particles
    ):
        return None
    spins = [body.motion for body in bodies if isinstance(body.motion, Spin)]
    found = (spin for spin in spins if all(_turns_with(body, spin) for body in bodies))
    return next((dataclasses.replace(spin, phase=0.0) for spin in found), None)


def _turns_with(body, spin):
    """Whether a body moves with `spin`, or does not show whether it does."""
    motion = body.motion
    if isinstance(motion, Spin) and motion.same_as(spin):
        return True
    if isinstance(motion, Spin):
        if motion.rate and not motion.same_line(spin):
            return False
        motion = motion(0.0)
    if type(motion) is not Pose:
        return False
    # The axis in the body's frame: it stays there, for the body stands still or turns about it.
    point, axis = motion.matrix.T @ (np.array(spin.center) - motion.position), motion.matrix.T @ spin.axis
    return all(primitive.turns_about(point, axis) for primitive in body.skeleton)


def changing(world, body) -> bool:
    """Whether what acts on particles changes in the frame of a body: its skeleton, its mass, a surface that repels."""
    if repels(world) and body.surface is not None:
        return body.deforming
    return callable(body.mass) or any(primitive.animated for primitive in body.skeleton)
