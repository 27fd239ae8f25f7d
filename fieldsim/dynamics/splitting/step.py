"""A group of particles taken through steps of a splitting, or parts of one, as a Warp function."""

import functools

import warp as wp

from fieldsim.dynamics.splitting.groups import ROWS, group_of
from fieldsim.dynamics.splitting.method import Method
from fieldsim.dynamics.splitting.substeps import substeps_of
from fieldsim.portable.lanes.functions import group_function
from fieldsim.sources.stages import Stages

_INPUTS = (f"rows {ROWS}", "real", "table", *("int",) * 4, "table", "indices", "int", "table", "indices", "int")


@functools.cache
def advance_of(kinds_used, gradients: bool, lanes: int, measured: bool = False):
    """Warp function (group, method, begin, end, steps, stage, gravity) -> the group after parts of steps.

    These are the sub-steps begin to end - 1 of `steps` steps, from a stage on. gradients: whether the method has any.
    measured: the result has one row more than a group, how far each particle has come at most (see `group_in`).
    """
    Group = group_of(lanes)
    portable, outputs = substeps_of(kinds_used, gradients), tuple(range(ROWS + measured))
    substeps = group_function(portable, wp.float64, _INPUTS, outputs, lanes)

    @wp.func
    def advance(group: Group, method: Method, begin: int, end: int, steps: int, stage: int, gravity: Stages):
        return substeps(
            group, method.dt, method.table, begin, end, steps, stage,
            gravity.rows, gravity.kinds, gravity.kinds.shape[0],
            gravity.moving_rows, gravity.moving_kinds, gravity.moving,
        )  # fmt: skip

    return advance


@functools.cache
def group_in(lanes: int):
    """Warp function (result of `advance_of`, measured) -> the group."""
    Group, Results = group_of(lanes), wp.types.matrix((ROWS + 1, lanes), wp.float64)

    @wp.func
    def group(results: Results):
        found = Group()
        for c in range(wp.int32(ROWS)):
            found[c] = results[c]
        return found

    return group
