"""Impact: the greatest speed at which bodies can hit a planet, and the time step that such hits need."""

import mujoco
import numpy as np

from fieldsim.errors import InputError
from fieldsim.mujoco.contact.geoms import Contact, body_geoms, longest_step
from fieldsim.potentials.field import Field
from fieldsim.world.motion import pose_at

# Grid on which a surface is searched: points along each side, and the values of F that count as on it.
GRID = 24
NEAR = (0.5, 1.0)
# Safety factor on the longest step that resolves a hit.
MARGIN = 0.9


def hit_speed(world, model) -> float:
    """The fastest at which bodies of a MuJoCo model can hit surfaces of `world`, falling from where the model has them.

    By energy, down to where the surfaces lie deepest, which are looked for on a grid.
    Raises InputError if that is undefined: nothing moves, no surface has an end, or it is above all bodies.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    gravity = _gravity(world)
    places = _surface_points(world)
    movable = np.flatnonzero((model.body_mass > 0.0) & (model.body_weldid != 0))
    if not len(movable):
        raise InputError("no body of the model has mass and can move; give one a joint and a mass")
    if gravity is None or not len(places):
        raise InputError("no fall onto a surface from which to tell the speed of hits; give --speed, or --no-contact")
    start = np.min(gravity.value(data.xipos[movable]))
    drop = float(np.max(gravity.value(places)) - start)
    if not drop > 0.0:
        raise InputError("the bodies start lower than all surfaces, so no speed of hits is known; give --speed")
    return float(np.sqrt(2.0 * drop))


def resolving_timestep(world, model, contact: Contact | None) -> float:
    """The model's time step, or a shorter one that resolves hits of its bodies on the surfaces of `world`."""
    steps = [model.opt.timestep]
    if contact:
        radius = min(body.surface.at(0.0).radius for body in world.bodies if body.surface is not None)
        for body in np.flatnonzero((model.body_mass > 0.0) & (model.body_weldid != 0)).tolist():
            geoms = body_geoms(model, body, contact).geoms
            if len(geoms):
                steps.append(MARGIN * longest_step(geoms, model.body_mass[body], contact, radius))
    return float(min(steps))


def _gravity(world):
    """The field of all bodies that pull, at the start, in the world's frame; None where none does."""
    parts = []
    for body in world.bodies:
        local, pose = body.gravity_elements(0.0), pose_at(body.motion, 0.0)
        if len(local):
            parts.append(Field.of_elements(local.placed(pose.matrix, pose.position)))
    return sum(parts[1:], parts[0]) if parts else None


def _surface_points(world):
    """Points (n, 3) near the surfaces of bodies, alone, at the start."""
    found = [np.zeros((0, 3))]
    for body in world.bodies:
        if body.surface is None:
            continue
        low, high = (np.array(ends) for ends in zip(*(p.at(0.0).box for p in body.skeleton), strict=True))
        radius = body.surface.at(0.0).radius
        low, high = low.min(axis=0) - 2 * radius, high.max(axis=0) + 2 * radius
        if not np.isfinite(low + high).all():
            continue
        grid = np.stack(np.meshgrid(*np.linspace(low, high, GRID).T, indexing="ij"), axis=-1).reshape(-1, 3)
        value = body.surface_field().value(grid)
        found.append(pose_at(body.motion, 0.0).apply(grid[(value > NEAR[0]) & (value < NEAR[1])]))
    return np.concatenate(found)
