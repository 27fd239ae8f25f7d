"""Repulsion by surfaces: U = stiffness * max(0, 1 + log(F) / reach)^3 per unit mass, F the surface field."""

import functools

import numpy as np
import warp as wp

from fieldsim.dynamics.balls import REPULSION, Balls
from fieldsim.dynamics.sources import Sources, Stages, field_and_gradient, field_at, upload
from fieldsim.launch import launch
from fieldsim.world.contact import Repulsion


@functools.cache
def repulsion_at(surface_kinds):
    """Warp function (point, surfaces, stage, balls, i) -> acceleration of particle i; None: nobody is repelled."""
    field = field_at(surface_kinds or ((), ()))

    @wp.func
    def nothing(p: wp.vec3d, surfaces: Stages, stage: int, balls: Balls, i: int):
        return wp.vec3d()

    @wp.func
    def repel(p: wp.vec3d, surfaces: Stages, stage: int, balls: Balls, i: int):
        result = wp.vec3d()
        if balls.laws[i] == REPULSION:
            f, g = field(p, surfaces, stage)
            if f > wp.float64(0.0):
                near = wp.float64(1.0) + wp.log(f) / balls.reaches[i]
                if near > wp.float64(0.0):
                    slope = wp.float64(3.0) * balls.stiffnesses[i] * near * near / balls.reaches[i]
                    result = (-slope / f) * g
        return result

    return repel if surface_kinds else nothing


@functools.cache
def _added(surface_kinds):
    """Kernel that adds the repulsion to accelerations."""
    repel = repulsion_at(surface_kinds)

    @wp.kernel(module="unique", enable_backward=False)
    def add(
        start: int,
        positions: wp.array(dtype=wp.vec3d),
        surfaces: Stages,
        balls: Balls,
        accelerations: wp.array(dtype=wp.vec3d),
    ):
        i = start + wp.tid()
        accelerations[i] = accelerations[i] + repel(positions[i], surfaces, 0, balls, i)

    return add


def add_repulsion(surface_kinds, positions, surfaces: Stages, balls: Balls, accelerations) -> None:
    """Add the repulsion at the first stage to `accelerations` (N,) of vec3d."""
    kernel = _added(surface_kinds)
    launch(kernel, len(positions), [positions, surfaces, balls], [accelerations], device=positions.device)


def contact_energy(snapshot) -> np.ndarray:
    """Potential energy per unit mass in the repulsion of surfaces, (N,) over all sets; 0 for other contact laws."""
    energies = [np.zeros(len(x)) for x in snapshot.positions]
    repelled = [k for k, particles in enumerate(snapshot.world.particles) if isinstance(particles.contact, Repulsion)]
    if repelled:
        sources = Sources(snapshot.world, "surface", snapshot.time)
        stages = upload(sources, np.array([snapshot.time]), "cpu")
    for k in repelled:
        law = snapshot.world.particles[k].contact
        field, _ = field_and_gradient(sources, stages, wp.array(snapshot.positions[k], dtype=wp.vec3d, device="cpu"))
        with np.errstate(divide="ignore"):
            near = np.maximum(0.0, 1.0 + np.log(np.maximum(field.numpy(), 0.0)) / law.reach)
        energies[k] = law.stiffness * near**3
    return np.concatenate([np.zeros(0), *energies])
