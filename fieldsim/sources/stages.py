"""The elements of sources on a device, for launches that span many steps.

A *stage* is a moment at which forces are evaluated: the nodes of each step of a launch (leapfrog: start and end).
Rows that never change are uploaded once, those of what moves or deforms for every stage.
"""

import numpy as np
import warp as wp

from fieldsim.sources.elements import Sources


@wp.struct
class Stages:
    """Elements during one launch, on its device.

    rows (N, >= WIDTH), kinds (N,): of the bodies that stay as they are. moving_rows (stages * moving, >= WIDTH),
    moving_kinds: of the others, stage after stage, `moving` rows each. sweep (stages,): see `margins`.
    """

    rows: wp.array2d(dtype=wp.float64)
    kinds: wp.array(dtype=wp.int32)
    moving_rows: wp.array2d(dtype=wp.float64)
    moving_kinds: wp.array(dtype=wp.int32)
    moving: int
    sweep: wp.array(dtype=wp.float64)


def upload(sources: Sources, times: np.ndarray, device, fixed=None) -> Stages:
    """The tables of a launch whose stages are at `times`; `fixed`: an earlier upload to share the still rows with."""
    moving_rows = sources.rows_at(times)
    return tables(sources, sources.fixed.rows, moving_rows, device, fixed)


def tables(sources: Sources, fixed_rows, moving_rows, device, earlier=None, sweep=()) -> Stages:
    """`Stages` of given rows: fixed_rows (N, width), moving_rows (stages, M, width)."""
    stages = Stages()
    stages.moving = moving_rows.shape[1]
    if earlier is None:
        stages.rows = wp.array(fixed_rows, dtype=wp.float64, device=device)
        stages.kinds = wp.array(sources.fixed.kinds, dtype=wp.int32, device=device)
    else:
        stages.rows, stages.kinds = earlier.rows, earlier.kinds
    flat = moving_rows.reshape(-1, moving_rows.shape[-1])
    stages.moving_rows = wp.array(flat, dtype=wp.float64, device=device)
    stages.moving_kinds = wp.array(np.tile(sources.moving_kinds, len(moving_rows)), dtype=wp.int32, device=device)
    if len(sweep):
        stages.sweep = wp.array(np.asarray(sweep, dtype=float), dtype=wp.float64, device=device)
    return stages
