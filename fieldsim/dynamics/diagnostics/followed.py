"""What diagnostics need of the run that they follow."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
import warp as wp

from fieldsim import validate
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


class Watched:
    """A simulation as those see it who follow it: told of launches, and of manoeuvres."""

    _watchers: list[Callable[..., object]]
    _sums: list[wp.array]
    _ledgers: list[Ledger]

    def account(self, ledger: Ledger) -> None:
        """Call `ledger.manoeuvred(ledger.measured())`, the latter ahead of each manoeuvre and the former after it."""
        self._ledgers.append(ledger)

    def watch(self, watcher: Callable[..., object], *, sums: Sequence[wp.array] = ()) -> None:
        """Call `watcher(sources, state, steps, start, dt)` ahead of every launch of `steps` from time `start` on.

        sums: the Warp arrays that it writes, which are as before where the launch is broken off.
        """
        self._watchers.append(validate.function("Simulation.watch", "watcher", watcher))
        self._sums += validate.instances("Simulation.watch", "sums", sums, wp.array, "give Warp arrays")


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
