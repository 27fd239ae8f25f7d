"""One step of a splitting for a group of particles: the one loop over its stages, as a Warp function.

The last acceleration is carried along, from step to step and from launch to launch, so that a run cut into launches
anywhere gives the same bytes.
"""

import functools

import warp as wp

from fieldsim.dynamics.splitting.groups import group_of, kicked_of
from fieldsim.dynamics.splitting.method import SubStep
from fieldsim.dynamics.state import drifted
from fieldsim.sources.field import bends_at, bent_along, pulls_at
from fieldsim.sources.stages import Stages


@functools.cache
def advance_of(kinds_used, gradients: bool, lanes: int):
    """Warp function (group, part, gravity, stage) -> the group after the part of a step that ends at a stage.

    gradients: whether the method has any.
    """
    Group = group_of(lanes)
    kicked = kicked_of(lanes)
    pull = pulls_at(kinds_used, lanes)
    bends = bends_at(kinds_used, lanes)

    @wp.func
    def plain(p: Group, part: SubStep, gravity: Stages, stage: int):
        kick = part.opening * p.a
        x, x_rest = drifted(p.x, p.x_rest, p.v, p.v_rest, kick, part.drift)
        p.x = x
        p.x_rest = x_rest
        if part.evaluating:
            p.a = pull(x, gravity, stage)
            p = kicked(p, kick + part.kick * p.a)
        return p

    @wp.func
    def with_gradient(p: Group, part: SubStep, gravity: Stages, stage: int):
        if part.factor == wp.float64(0.0):
            return plain(p, part, gravity, stage)
        kick = part.opening * p.a
        x, x_rest = drifted(p.x, p.x_rest, p.v, p.v_rest, kick, part.drift)
        p.x = x
        p.x_rest = x_rest
        a, bent = bends(x, gravity, stage)
        p.a = a
        return kicked(p, kick + part.factor * bent_along(bent, a) + part.kick * a)

    return with_gradient if gradients else plain
