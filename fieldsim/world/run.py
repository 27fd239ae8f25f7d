"""A run: what gives a world's moments, one after the other."""

from typing import Protocol, runtime_checkable

from fieldsim.world.world import Snapshot


@runtime_checkable
class Run(Protocol):
    """A world under way: a `Simulation`, the run of a MuJoCo experiment, or a `Replay` of a recording.

    Films, recordings and comparisons take any: they advance it, and draw or keep its snapshots.
    """

    @property
    def time(self) -> float:
        """The present time."""
        ...

    def advance(self, until: float, /) -> None:
        """Go on to the time `until`, which is not before the present one."""
        ...

    def snapshot(self) -> Snapshot:
        """The present moment."""
        ...
