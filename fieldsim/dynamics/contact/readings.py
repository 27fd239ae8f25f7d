"""What particles did at surfaces, as a simulation tells it."""

import numpy as np

from fieldsim.dynamics.contact.events import Events, events_of
from fieldsim.dynamics.contact.particle_state import ContactParticles
from fieldsim.dynamics.state import split_by_sets
from fieldsim.world.contact import Status


class ContactReadings:
    """Counts, states and events of a simulation's particles; copies on the host to read only."""

    _balls: ContactParticles
    _sizes: list[int]

    @property
    def bounces(self) -> int:
        """Number of contacts made so far by all particles: bounces and landings."""
        return int(self._balls.bounces.numpy().sum())

    @property
    def bounce_counts(self) -> tuple[np.ndarray, ...]:
        """Contacts made so far, (N,) int32 per set of particles."""
        return split_by_sets(self._balls.bounces, self._sizes)

    @property
    def states(self) -> tuple[np.ndarray, ...]:
        """What each particle does, (N,) int32 of `Status` per set of particles."""
        return split_by_sets(self._balls.states, self._sizes)

    @property
    def spins(self) -> tuple[np.ndarray, ...]:
        """Angular velocities of particles that roll, world frame, (N, 3) per set of particles."""
        return split_by_sets(self._balls.spins, self._sizes)

    def census(self) -> dict[str, int]:
        """How many particles are moving, resting, absorbed and escaped; together, all of them."""
        counts = np.bincount(self._balls.states.numpy(), minlength=len(Status))
        return {state.name.lower(): int(counts[state]) for state in Status}

    @property
    def events(self) -> Events:
        """What happened to the particles at surfaces so far: the latest `log` events of each."""
        return events_of(self._balls)
