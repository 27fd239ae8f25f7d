"""What a simulation needs of its methods: the tables of a splitting, or a propagator that flies by itself."""

from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np


@runtime_checkable
class StepTables(Protocol):
    """A splitting as the loops over its steps read it (see `Splitting`): every `Splitting` is one.

    One step is kick 0, drift 0, kick 1, ..., drift s - 1, kick s, each with its gradient, in units of the step.
    """

    # Shares of the step (s + 1) and (s); factors of the force gradient in the kicks (s + 1), all 0 where there is none.
    kicks: ClassVar[tuple[float, ...]]
    drifts: ClassVar[tuple[float, ...]]
    gradients: ClassVar[tuple[float, ...]]
    # Times of the stages within a step (s + 1); evaluations of the acceleration in a step.
    nodes: ClassVar[tuple[float, ...]]
    evaluations: ClassVar[int]

    def steps(self, duration: float) -> tuple[int, float]:
        """Number and length of the equal steps that fill `duration`."""
        ...


@runtime_checkable
class Propagator(Protocol):
    """Particles under a method with steps of their own: a `RadauRun`. Arrays are Warp's, (N,) of vec3d."""

    @property
    def steps(self) -> int:
        """Steps of all particles so far."""
        ...

    def advance(self, until: float) -> None:
        """Fly every particle to the time `until`, or beyond it."""
        ...

    def read(self, times: np.ndarray) -> tuple[Any, Any]:
        """Positions and velocities at `times` (N,), each within its particle's last step."""
        ...

    def restart(self, which: np.ndarray, positions: Any, velocities: Any, time: float) -> None:
        """Let the particles `which` (N,) start anew at `time`; the others fly on."""
        ...
