"""A splitting's table as kernels read it."""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics.integrators.propagator import StepTables
from fieldsim.dynamics.splitting.substeps import DRIFT, GRADIENT, KICK, OPENING, SUBSTEP, substep

_substep = substep.warp(wp.float64)


@wp.struct
class Method:
    """A splitting and its step dt. table (stages, columns of SUBSTEP): what leads to each stage.

    continued: whether a step begins with the last acceleration of the step before. evaluations: of a step.
    """

    dt: wp.float64
    table: wp.array2d(dtype=wp.float64)
    stages: int
    evaluations: int
    continued: int


def method_of(splitting: StepTables, dt: float, device) -> Method:
    """The `Method` of a splitting for steps of length dt."""
    method = Method()
    method.dt = dt
    method.stages = len(splitting.drifts)
    method.evaluations = splitting.evaluations
    method.continued = int(splitting.kicks[0] != 0.0)
    method.table = _table(splitting.kicks, splitting.drifts, splitting.gradients, device.alias)
    return method


@functools.lru_cache(maxsize=64)
def _table(kicks, drifts, gradients, device):
    """A method's table on a device, kept: short calls take no longer than they must."""
    table = np.zeros((len(drifts), SUBSTEP.width))
    table[0, OPENING] = kicks[0]
    table[:, DRIFT] = drifts
    table[:, KICK] = kicks[1:]
    table[:, GRADIENT] = gradients[1:]
    return wp.array(table, dtype=wp.float64, device=device)


@wp.struct
class SubStep:
    """What leads to one stage (see SUBSTEP), with the step put in; evaluating: whether there is a new kick."""

    opening: wp.float64
    drift: wp.float64
    kick: wp.float64
    factor: wp.float64
    evaluating: bool


@wp.func
def substep_of(method: Method, j: int):
    """The part of a step from stage j to stage j + 1."""
    part = SubStep()
    opening, drift, kick, factor = _substep(method.table, j, method.dt)
    part.opening = opening
    part.drift = drift
    part.kick = kick
    part.factor = factor
    part.evaluating = part.kick != wp.float64(0.0) or part.factor != wp.float64(0.0)
    return part
