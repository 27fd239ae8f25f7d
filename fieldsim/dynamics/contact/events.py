"""Contact of particles on the host: their laws and states for the kernels, and the log of events."""

import dataclasses
import math

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.arrays import read_only
from fieldsim.dynamics.contact.particle_state import ABSORB, BOUNCE, KINDS, NOTHING, REPULSION, ContactParticles
from fieldsim.world.contact import Absorb, Bounce, Repulsion

_LAWS = {type(None): NOTHING, Bounce: BOUNCE, Absorb: ABSORB, Repulsion: REPULSION}
# A tangential impulse J on a solid sphere (inertia 2/5 m r^2) changes its lowest point's velocity by (1 + 5/2) J / m.
TURNING = 3.5


@dataclasses.dataclass(frozen=True)
class Events:
    """What happened to particles at surfaces, M events sorted by time, then particle.

    times (M,); particles (M,): index over all sets in order; kinds (M,): "bounce", "land" (it rests, or slides),
    "absorb" or "escape"; positions (M, 3): of the contact point, or of the particle that escaped; impulses (M, 3):
    change of velocity, of a landing only its part along the normal. made: events that happened; a particle's oldest are
    forgotten where it made more than the log keeps of each.
    """

    times: np.ndarray
    particles: np.ndarray
    kinds: np.ndarray
    positions: np.ndarray
    impulses: np.ndarray
    made: int

    def __len__(self) -> int:
        return len(self.times)


# Events in the log of all particles at most: some gigabytes.
MOST_EVENTS = 50_000_000


def contact_particles(sets, escape_radius: float | None, grain: float, kept: int, device) -> ContactParticles:
    """The particles of all sets for kernels, all in the state MOVING; the log keeps `kept` events of each."""
    counts = [len(particles) for particles in sets]
    total = sum(counts)
    validate.bounded("Simulation", "events in its log", kept * total, MOST_EVENTS, "give a smaller log")
    balls = ContactParticles()

    def column(dtype, value):
        values = [value(particles) for particles in sets]
        return wp.array(np.repeat(values, counts), dtype=dtype, device=device)

    def of_law(name, other):
        def value(particles):
            given = getattr(particles.contact, name, other)
            return other if given is None else float(given)

        return column(wp.float64, value)

    balls.laws = column(wp.int32, lambda p: _LAWS[type(p.contact)])
    balls.radii = column(wp.float64, lambda p: p.radius)
    balls.restitutions = of_law("restitution", 0.0)
    balls.frictions = of_law("friction", 0.0)
    balls.mobilities = column(wp.float64, lambda p: TURNING if getattr(p.contact, "rolling", False) else 1.0)
    balls.stiffnesses = of_law("stiffness", 0.0)
    balls.reaches = of_law("reach", grain)
    for name, dtype in (("states", wp.int32), ("spins", wp.vec3d), ("bounces", wp.int32), ("logged", wp.int32)):
        setattr(balls, name, wp.zeros(total, dtype=dtype, device=device))
    balls.grain = grain
    balls.escape2 = math.inf if escape_radius is None else escape_radius**2
    balls.kept = kept
    log = (("times", wp.float64), ("kinds", wp.int32), ("places", wp.vec3d), ("impulses", wp.vec3d))
    for name, dtype in log:
        setattr(balls, name, wp.empty(total * kept, dtype=dtype, device=device))
    return balls


def events_of(balls: ContactParticles) -> Events:
    """The events in the log."""
    made = balls.logged.numpy()
    slots = np.arange(balls.kept)
    particles, slot = np.nonzero(slots < np.minimum(made, balls.kept)[:, None])
    # The ring buffer holds the latest events; events of one time are sorted by age.
    age = (made[particles] - 1 - slot) % balls.kept
    times = balls.times.numpy()[particles * balls.kept + slot]
    order = np.lexsort((-age, particles, times))
    index = (particles * balls.kept + slot)[order]
    return Events(
        read_only(times[order]),
        read_only(particles[order]),
        read_only(np.array(KINDS)[balls.kinds.numpy()[index]]),
        read_only(balls.places.numpy()[index]),
        read_only(balls.impulses.numpy()[index]),
        int(made.sum(dtype=np.int64)),
    )
