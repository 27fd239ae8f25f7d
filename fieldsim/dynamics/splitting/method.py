"""A splitting's tables as kernels read them."""

import functools

import warp as wp

from fieldsim.dynamics.integrators.propagator import StepTables


@wp.struct
class Method:
    """A splitting's tables (see `Splitting`): its drifts, kicks and gradients (stages,) from 1 to s, in units of dt.

    dt: the step. opening: stage 0's kick, whose acceleration is the last of the step before. evaluations: of a step.
    """

    dt: wp.float64
    opening: wp.float64
    drifts: wp.array(dtype=wp.float64)
    kicks: wp.array(dtype=wp.float64)
    gradients: wp.array(dtype=wp.float64)
    stages: int
    evaluations: int


def method_of(splitting: StepTables, dt: float, device) -> Method:
    """The `Method` of a splitting for steps of length dt."""
    method = Method()
    method.dt = dt
    method.opening = dt * splitting.kicks[0]
    method.stages = len(splitting.drifts)
    method.evaluations = splitting.evaluations
    method.drifts, method.kicks, method.gradients = _tables(
        splitting.drifts, splitting.kicks[1:], splitting.gradients[1:], device.alias
    )
    return method


@functools.lru_cache(maxsize=64)
def _tables(*tables_and_device):
    """A method's tables on a device, kept: short calls take no longer than they must."""
    *tables, device = tables_and_device
    return [wp.array(table, dtype=wp.float64, device=device) for table in tables]


@wp.struct
class SubStep:
    """What of a `Method` leads to one stage: a kick by the old acceleration, a drift, a kick by the new one.

    factor: of the force gradient in the new kick; evaluating: whether there is a new kick.
    """

    opening: wp.float64
    drift: wp.float64
    kick: wp.float64
    factor: wp.float64
    evaluating: bool


@wp.func
def substep_of(method: Method, j: int):
    """The part of a step from stage j to stage j + 1."""
    part = SubStep()
    if j == 0:
        part.opening = method.opening
    part.drift = method.dt * method.drifts[j]
    part.kick = method.dt * method.kicks[j]
    part.factor = method.dt * (method.dt * (method.dt * method.gradients[j]))
    part.evaluating = part.kick != wp.float64(0.0) or part.factor != wp.float64(0.0)
    return part
