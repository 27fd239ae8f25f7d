"""What the tracer needs of a solver of primary rays."""

from typing import Any, Protocol, runtime_checkable

from fieldsim.potentials.elements import Elements


@runtime_checkable
class PrimarySolver(Protocol):
    """How primary rays find the surface F = 1: one of `by_name.SOLVERS`.

    options: of the tracing kernel (see `primary.trace_kernel`): the sweep through a ray's sorted intervals, and how far
    hits are polished on the true field.
    """

    name: str
    options: dict[str, Any]

    def check(self, elements: Elements) -> None:
        """Raise InputError for elements that the solver cannot do."""
        ...

    def lists(self, stage: Any) -> Any:
        """The `Candidates` that the tracing kernel goes through."""
        ...

    def finish(self, stage: Any, samples: Any, hits: Any) -> None:
        """What is done after the tracing kernel: samples, a Warp array (N,) of pixels; hits, theirs."""
        ...
