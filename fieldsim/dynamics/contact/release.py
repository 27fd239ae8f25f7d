"""Particles that start inside a surface are moved out of it."""

import functools
import warnings

import numpy as np
import warp as wp

from fieldsim.dynamics.contact.contacts import Contacts, touching
from fieldsim.dynamics.contact.particle_state import ContactParticles, contact_particle, makes_events
from fieldsim.dynamics.contact.placing import push_out
from fieldsim.dynamics.contact.search import contacts_at
from fieldsim.dynamics.contact.surfaces import Surfaces
from fieldsim.errors import FieldsimWarning
from fieldsim.launch import launch
from fieldsim.sources.margins import margin_at
from fieldsim.sources.moments import Moment
from fieldsim.sources.stages import Stages


def released(
    surfaces: Surfaces | None, balls: ContactParticles, x: wp.array, time: float, which=True, *, threads=None
) -> wp.array:
    """Positions x (N,) of vec3d, those of the particles `which` that lie inside a surface moved out, with a warning.

    surfaces: those of the world at `time`; None: nothing is inside. which: a mask (N,), or True for all.
    """
    if not surfaces:
        return x
    device, given = x.device, x.numpy().copy()
    inside = wp.empty(len(x), dtype=wp.int32, device=device)
    # Two equal stages: the world as it is now, standing still.
    stages = surfaces.upload(np.array([time, time]), device)
    kernel = release_kernel(surfaces.sources.kinds_used)
    launch(kernel, len(x), [stages, balls], [x, inside], device=device, threads=threads)
    out = (inside.numpy() != 0) & which
    if out.any():
        warnings.warn(
            f"{out.sum()} of {len(x)} particles start inside a surface and were moved out of it; "
            "start them farther away or give them contact=None",
            FieldsimWarning,
            stacklevel=4,
        )
    return wp.array(np.where(out[:, None], x.numpy(), given), dtype=wp.vec3d, device=device)


@functools.cache
def release_kernel(surface_kinds):
    """Kernel that moves colliding particles found inside a surface out of it; `inside` (N,) marks them."""
    find = contacts_at(surface_kinds)
    push = push_out(surface_kinds)
    margin = margin_at(surface_kinds)

    @wp.kernel(module="unique", enable_backward=False)
    def release(
        start: int,
        surfaces: Stages,
        balls: ContactParticles,
        positions: wp.array(dtype=wp.vec3d),
        inside: wp.array(dtype=wp.int32),
    ):
        i = start + wp.tid()
        x = positions[i]
        ball = contact_particle(balls, i)
        moment = Moment()
        moment.dt = wp.float64(1.0)
        inside[i] = 0
        if makes_events(ball.law) and margin(x, surfaces, 0, wp.float64(0.0)) < ball.radius:
            close = touching(x, ball.radius, ball.grain)
            here = Contacts()
            find(x, ball.radius, close, ball.grain, surfaces, moment, wp.float64(0.0), here)
            if here.least < -close:
                inside[i] = 1
                positions[i] = push(x, ball, surfaces, moment, wp.float64(0.0))

    return release
