"""Repulsion by surfaces: U = stiffness * max(0, 1 + log(F) / reach)^3 per unit mass, F the surface field."""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics.contact.event_detection import Motion
from fieldsim.dynamics.contact.particle_state import ContactParticle, ContactParticles
from fieldsim.dynamics.contact.sliding import pull_between
from fieldsim.sources.elements import Sources
from fieldsim.sources.field import field_and_gradient, field_at
from fieldsim.sources.stages import Stages, upload
from fieldsim.world.contact import Repulsion


@functools.cache
def repelled_step(gravity_kinds, surface_kinds):
    """Warp function: one leapfrog step of a ball that surfaces repel; m.a is the acceleration by gravity alone."""
    field = field_at(surface_kinds)
    pull = pull_between(gravity_kinds)

    @wp.func
    def push(p: wp.vec3d, surfaces: Stages, stage: int, stiffness: wp.float64, reach: wp.float64):
        f, g = field(p, surfaces, stage)
        result = wp.vec3d()
        if f > wp.float64(0.0):
            near = wp.float64(1.0) + wp.log(f) / reach
            if near > wp.float64(0.0):
                result = -(wp.float64(3.0) * stiffness * near * near / (reach * f)) * g
        return result

    @wp.func
    def step(
        m: Motion,
        stage: int,
        ball: ContactParticle,
        balls: ContactParticles,
        gravity: Stages,
        surfaces: Stages,
        dt: wp.float64,
    ):
        stiffness = balls.stiffnesses[ball.index]
        reach = balls.reaches[ball.index]
        half = wp.float64(0.5) * dt
        m.v = m.v + half * (m.a + push(m.x, surfaces, stage, stiffness, reach))
        m.x = m.x + dt * m.v
        a = pull(m.x, gravity, stage, wp.float64(1.0))
        m.a = a
        m.v = m.v + half * (m.a + push(m.x, surfaces, stage + 1, stiffness, reach))
        return m

    return step


def contact_energy(snapshot) -> np.ndarray:
    """Potential energy per unit mass in the repulsion of surfaces, (N,) over all sets; 0 for other contact laws."""
    energies = [np.zeros(len(x)) for x in snapshot.positions]
    repelled = [k for k, particles in enumerate(snapshot.world.particles) if isinstance(particles.contact, Repulsion)]
    if not repelled:
        return np.concatenate([np.zeros(0), *energies])
    sources = Sources(snapshot.world, "surface", snapshot.time)
    stages = upload(sources, np.array([snapshot.time]), "cpu")
    for k in repelled:
        law = snapshot.world.particles[k].contact
        field, _ = field_and_gradient(sources, stages, wp.array(snapshot.positions[k], dtype=wp.vec3d, device="cpu"))
        with np.errstate(divide="ignore"):
            near = np.maximum(0.0, 1.0 + np.log(np.maximum(field.numpy(), 0.0)) / law.reach)
        energies[k] = law.stiffness * near**3
    return np.concatenate(energies)
