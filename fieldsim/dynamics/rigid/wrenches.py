"""Forces and torques that free bodies exert on each other, added up so that action is reaction."""

import warp as wp


@wp.func
def act_on_both(
    b: int,
    other: int,
    pull: wp.vec3d,
    turn: wp.vec3d,
    back: wp.vec3d,
    force: wp.array(dtype=wp.vec3d),
    torque: wp.array(dtype=wp.vec3d),
):
    """Add a force on body b and its torques, `turn` on b and `back` on the other, about their centres of mass."""
    force[b] = force[b] + pull
    torque[b] = torque[b] + turn
    force[other] = force[other] - pull
    torque[other] = torque[other] + back
