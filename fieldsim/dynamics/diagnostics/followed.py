"""What diagnostics need of the run that they follow."""

from typing import Any, Protocol

import numpy as np

from fieldsim.dynamics.integrators.splittings import Integrator
from fieldsim.dynamics.rigid.bodies import FreeBodies
from fieldsim.dynamics.splitting.mutual_gravity import MutualGravity
from fieldsim.world.run import Run
from fieldsim.world.world import World


class Ledger(Protocol):
    """What keeps account of a motion, such as an `EnergyLog`, and gets manoeuvres (see `Simulation.account`)."""

    def measured(self) -> Any:
        """What a manoeuvre may change, now."""
        ...

    def manoeuvred(self, before: Any, /) -> None:
        """There was a manoeuvre; before: what was measured ahead of it."""
        ...


class Followed(Run, Protocol):
    """A run whose energy and other invariants can be followed: a `Simulation`, or one like it."""

    @property
    def world(self) -> World:
        """What there is."""
        ...

    @property
    def integrator(self) -> Integrator:
        """How it moves."""
        ...

    @property
    def bodies(self) -> FreeBodies:
        """The free bodies."""
        ...

    @property
    def mutual(self) -> MutualGravity:
        """The pull of the particles on each other."""
        ...

    @property
    def states(self) -> tuple[np.ndarray, ...]:
        """What each particle does, (N,) of `Status` per set of particles."""
        ...

    @property
    def bounce_counts(self) -> tuple[np.ndarray, ...]:
        """Contacts so far, (N,) per set of particles."""
        ...

    def account(self, ledger: Ledger, /) -> None:
        """Tell a ledger of manoeuvres (see `Simulation.account`)."""
        ...
