"""The laws of free bodies' contacts and the memory of what touches, as the tables that kernels read."""

import numpy as np
import warp as wp

from fieldsim.dynamics.contact.laws import damping, joint_friction, joint_restitution
from fieldsim.dynamics.rigid.losses import Losses
from fieldsim.dynamics.rigid.touches import Touches

# What of the tables one kick leaves to the next.
KEPT_OF_TOUCHES = ("now", "counts", "bodies", "others", "points", "speeds", "rubs")
KEPT_OF_LOSSES = ("lost", "lost_rest")


def losses_of(starts, capacity: int, device) -> Losses:
    """The laws of free bodies; capacity: how many points may touch.

    What is prescribed takes the law of the free body that it touches.
    """
    laws = [(start.motion.restitution, start.motion.friction) for start in starts]
    restitutions = [[joint_restitution(e, other) for other, _ in laws] + [e] for e, _ in laws]
    frictions = [[joint_friction(mu, other) for _, other in laws] + [mu] for _, mu in laws]
    losses = Losses()
    losses.frictions = wp.array(frictions, dtype=wp.float64, device=device)
    known = {e: damping(e) for e in {e for row in restitutions for e in row}}
    dampings = [[known[e] for e in row] for row in restitutions]
    losses.dampings = wp.array(dampings, dtype=wp.float64, device=device)
    losses.axes = wp.array([1.0 - start.idle for start in starts], dtype=wp.vec3d, device=device)
    for names, size, dtype in (
        ("lost lost_rest", 1, wp.float64),
        ("velocities rates old_velocities old_rates pushes turns", len(starts), wp.vec3d),
        ("answers", len(starts), wp.mat33d),
        ("yields sums winds eases befores drags", capacity, wp.float64),
        ("ways levers rears", capacity, wp.vec3d),
    ):
        for name in names.split():
            setattr(losses, name, wp.zeros(size, dtype=dtype, device=device))
    return losses


def touches_of(ranges, capacity: int, device) -> Touches:
    """Two empty lists; ranges (B,): how far a patch of each body extends."""
    touches = Touches()
    for names, shape, dtype in (
        ("now", 1, wp.int32),
        ("counts", 2, wp.int32),
        ("bodies others points", (2, capacity), wp.int32),
        ("speeds", (2, capacity), wp.float64),
        ("rubs", (2, capacity), wp.vec3d),
        ("places normals grounds", capacity, wp.vec3d),
        ("presses depths deepest", capacity, wp.float64),
        ("patches heads", capacity, wp.int32),
    ):
        for name in names.split():
            setattr(touches, name, wp.zeros(shape, dtype=dtype, device=device))
    touches.ranges = wp.array(np.asarray(ranges, dtype=float), dtype=wp.float64, device=device)
    return touches
