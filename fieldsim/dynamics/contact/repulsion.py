"""Repulsion by surfaces: a potential of the ball's gaps, one term for each nearest point of the surface.

Per unit mass it is the sum of stiffness * max(0, 1 - gap / reach)^3 over all contacts within reach, each twice
continuously differentiable; of a ball whose centre is inside a body, the term of the nearest way out alone.
"""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics.contact.contacts import Contacts
from fieldsim.dynamics.contact.event_detection import Motion
from fieldsim.dynamics.contact.laws import pressed
from fieldsim.dynamics.contact.particle_state import ContactParticle, ContactParticles
from fieldsim.dynamics.contact.placing import violated
from fieldsim.dynamics.contact.search import contacts_at
from fieldsim.dynamics.contact.selection import entry, row
from fieldsim.dynamics.contact.sliding import pull_between
from fieldsim.dynamics.contact.surfaces import Surfaces
from fieldsim.launch import launch
from fieldsim.sources.moments import Moment
from fieldsim.sources.stages import Stages
from fieldsim.world.contact import Repulsion

_pressed = pressed.warp(wp.float64)


@functools.cache
def repulsion_at(surface_kinds):
    """Warp function (point, radius, stiffness, reach, grain, surfaces, moment) -> (energy, force) per unit mass."""
    find = contacts_at(surface_kinds)

    @wp.func
    def repulsion(
        p: wp.vec3d,
        radius: wp.float64,
        stiffness: wp.float64,
        reach: wp.float64,
        grain: wp.float64,
        surfaces: wp.ref[Stages],
        moment: Moment,
    ):
        here = Contacts()
        find(p, radius, reach, grain, surfaces, moment, wp.float64(0.0), here)
        # The law's depth^3 / 3 with a depth of 1 on the surface.
        strength = wp.float64(3.0) * stiffness / (reach * reach * reach)
        energy = wp.float64(0.0)
        force = wp.vec3d()
        if here.count > 0:
            k = violated(here, radius)
            if entry(here.gaps, k) + radius < wp.float64(0.0):
                u, push = _pressed(reach - entry(here.gaps, k), strength)
                return u, push * row(here.normals, k)
        for k in range(here.count):
            u, push = _pressed(reach - entry(here.gaps, k), strength)
            energy += u
            force += push * row(here.normals, k)
        return energy, force

    return repulsion


@functools.cache
def repelled_step(gravity_kinds, surface_kinds):
    """Warp function: one leapfrog step of a ball that surfaces repel; m.a is the acceleration by gravity alone."""
    repulsion = repulsion_at(surface_kinds)
    pull = pull_between(gravity_kinds)

    @wp.func
    def step(
        m: wp.ref[Motion],
        stage: int,
        ball: wp.ref[ContactParticle],
        balls: wp.ref[ContactParticles],
        gravity: wp.ref[Stages],
        surfaces: wp.ref[Stages],
        dt: wp.float64,
    ):
        stiffness = balls.stiffnesses[ball.index]
        reach = balls.reaches[ball.index]
        half = wp.float64(0.5) * dt
        moment = Moment()
        moment.stage = stage
        moment.dt = dt
        _u, push = repulsion(m.x, ball.radius, stiffness, reach, ball.grain, surfaces, moment)
        m.v = m.v + half * (m.a + push)
        m.x = m.x + dt * m.v
        a = pull(m.x, gravity, stage, wp.float64(1.0))
        m.a = a
        moment.t = dt
        _e, back = repulsion(m.x, ball.radius, stiffness, reach, ball.grain, surfaces, moment)
        m.v = m.v + half * (m.a + back)

    return step


@functools.cache
def _energy_kernel(surface_kinds):
    repulsion = repulsion_at(surface_kinds)

    @wp.kernel(module="unique", enable_backward=False)
    def energies(
        start: int,
        points: wp.array(dtype=wp.vec3d),
        radii: wp.array(dtype=wp.float64),
        stiffness: wp.float64,
        reach: wp.float64,
        grain: wp.float64,
        surfaces: Stages,
        energy: wp.array(dtype=wp.float64),
    ):
        i = start + wp.tid()
        moment = Moment()
        moment.dt = wp.float64(1.0)
        u, _force = repulsion(points[i], radii[i], stiffness, reach, grain, surfaces, moment)
        energy[i] = u

    return energies


def contact_energy(snapshot) -> np.ndarray:
    """Potential energy per unit mass in the repulsion of surfaces, (N,) over all sets; 0 for other contact laws."""
    energies = [np.zeros(len(x)) for x in snapshot.positions]
    repelled = [k for k, particles in enumerate(snapshot.world.particles) if isinstance(particles.contact, Repulsion)]
    if not repelled:
        return np.concatenate([np.zeros(0), *energies])
    surfaces = Surfaces(snapshot.world, snapshot.time)
    # Two equal stages: the world as it is now, standing still.
    stages = surfaces.upload(np.array([snapshot.time, snapshot.time]), "cpu")
    kernel = _energy_kernel(surfaces.sources.kinds_used)
    for k in repelled:
        particles = snapshot.world.particles[k]
        law = particles.contact
        points = wp.array(snapshot.positions[k], dtype=wp.vec3d, device="cpu")
        radii = np.broadcast_to(np.asarray(particles.radius, dtype=float), len(points))
        energy = wp.empty(len(points), dtype=wp.float64, device="cpu")
        inputs = [points, wp.array(radii, dtype=wp.float64, device="cpu"), wp.float64(law.stiffness)]
        reach = surfaces.grain if law.reach is None else law.reach
        inputs += [wp.float64(reach), wp.float64(surfaces.grain), stages]
        launch(kernel, len(points), inputs, [energy], device="cpu")
        energies[k] = energy.numpy()
    return np.concatenate(energies)
