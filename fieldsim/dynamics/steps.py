"""The fused kernels: one thread per particle, all steps of a launch inside."""

import functools

import warp as wp

from fieldsim.dynamics.sources import Stages, field_at


@functools.cache
def leapfrog_kernel(kinds_used):
    """Kernel (positions, velocities, accelerations; steps, dt, gravity): leapfrog in the given cells of gravity.

    The acceleration is carried along, also from launch to launch, so each step evaluates the field once, and a run cut
    into launches anywhere gives the same bytes.
    """
    field = field_at(kinds_used)

    @wp.kernel(module="unique", enable_backward=False)
    def leapfrog(
        start: int,
        steps: int,
        dt: wp.float64,
        gravity: Stages,
        positions: wp.array(dtype=wp.vec3d),
        velocities: wp.array(dtype=wp.vec3d),
        accelerations: wp.array(dtype=wp.vec3d),
    ):
        i = start + wp.tid()
        x = positions[i]
        v = velocities[i]
        a = accelerations[i]
        half = wp.float64(0.5) * dt
        for step in range(steps):
            v = v + half * a
            x = x + dt * v
            _f, g = field(x, gravity, step + 1)
            a = g
            v = v + half * a
        positions[i] = x
        velocities[i] = v
        accelerations[i] = a

    return leapfrog
