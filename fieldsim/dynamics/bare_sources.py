"""Starts on bare sources: where a potential is infinite no motion is defined, and rounding alone would decide on it."""

import numpy as np

from fieldsim.dynamics.refusals import body_name
from fieldsim.errors import InputError
from fieldsim.potentials.row import STRENGTH
from fieldsim.sources.field import field_of_elements

# A place is on a bare source if so many roundings of its coordinates change the potential by this share.
ROUNDINGS = 4.0 * np.finfo(float).eps
SHARE = 0.1


def on_source(body, pose, time: float, points) -> np.ndarray:
    """Which of the points (N, 3), world frame, lie on the bare source of a body at `pose`, but for rounding: indices.

    Only those within the skeleton's box are looked at closely; a body without gravity, or with softened, has none.
    """
    if getattr(body.gravity, "softening", 1.0) > 0.0:
        return np.zeros(0, dtype=int)
    elements = body.gravity_elements(time)
    skeleton = [primitive.at(time) for primitive in body.skeleton]
    local = (points - pose.position) @ pose.matrix
    grain = ROUNDINGS * (np.abs(points).max(axis=1, initial=0.0) + np.abs(pose.position).max())
    near = np.full(len(points), bool(elements.rows[:, STRENGTH].any()))
    if not any(primitive.endless for primitive in skeleton):
        low, high = zip(*(primitive.box for primitive in skeleton), strict=True)
        low, high = np.min(low, axis=0), np.max(high, axis=0)
        grain += ROUNDINGS * np.abs([low, high]).max()
        near &= ((local >= low - grain[:, None]) & (local <= high + grain[:, None])).all(axis=1)
    close = np.flatnonzero(near)
    field, gradient = field_of_elements(elements, local[close])
    with np.errstate(all="ignore"):  # of infinities
        steep = np.linalg.norm(gradient, axis=1) * grain[close] > SHARE * np.abs(field)
        return close[steep | ~np.isfinite(field) | ~np.isfinite(gradient).all(axis=1)]


def refuse_on_sources(world, poses, time: float, points, owners, named) -> None:
    """Raise InputError where a point (N, 3) lies on the bare source of a body that is not its owner.

    poses: of all bodies at `time`; owners (N,): the body of the world that each belongs to, or -1; named: function of a
    point's index giving what messages call it.
    """
    for index, (body, pose) in enumerate(zip(world.bodies, poses, strict=True)):
        found = on_source(body, pose, time, points)
        found = found[owners[found] != index]
        if len(found):
            raise InputError(
                f"Simulation: {named(found[0])} is at {tuple(points[found[0]].tolist())} at time {time:g}, on the bare "
                f"skeleton of {body_name(index, body)}, where the potential is infinite; put it elsewhere, or soften "
                f"the body's gravity, such as gravity=fs.{type(body.gravity).__name__}(softening=0.01)"
            )


def refuse_particles_on_sources(world, poses, time: float, sets) -> None:
    """Raise InputError where a particle starts on a bare source, of a body or of another particle; sets: positions."""
    points = np.concatenate([np.zeros((0, 3)), *sets])
    refuse_on_sources(world, poses, time, points, np.full(len(points), -1), lambda k: particle_name(sets, k))
    refuse_bare_pairs(world, sets)


def refuse_bodies_on_sources(world, poses, time: float, starts) -> None:
    """Raise InputError where mass of a free body starts on the bare source of another body."""
    parts = [start.mass_points()[0] @ start.frame.matrix.T + start.frame.position for start in starts]
    places = [part @ poses[s.index].matrix.T + poses[s.index].position for part, s in zip(parts, starts, strict=True)]
    owners = np.repeat([start.index for start in starts], [len(part) for part in parts])
    names = {start.index: f"mass of {start.name}" for start in starts}
    refuse_on_sources(world, poses, time, np.concatenate(places), owners, lambda k: names[owners[k]])


def refuse_bare_pairs(world, sets) -> None:
    """Raise InputError where a particle that pulls without softening is at the place of another; sets: positions."""
    pulling = [
        k for k, p in enumerate(world.particles) if getattr(p.gravity, "softening", 1.0) == 0.0 and np.any(p.G * p.mass)
    ]
    if not pulling:
        return
    owner = np.repeat(np.arange(len(sets)), [len(rows) for rows in sets])
    places = np.concatenate(sets)
    _, which, counts = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    together = np.flatnonzero((counts[which.ravel()] > 1) & np.isin(owner, pulling))
    if len(together):
        one, other = np.flatnonzero(which.ravel() == which.ravel()[together[0]])[:2]
        raise InputError(
            f"Simulation: {particle_name(sets, one)} and {particle_name(sets, other)} pull each other at one place, "
            f"{tuple(places[one].tolist())}, where their potential is infinite; put them elsewhere, or give them "
            "gravity with a softening"
        )


def particle_name(sets, index) -> str:
    """What messages call a particle; index: in all sets together."""
    ends = np.cumsum([len(rows) for rows in sets])
    k = int(np.searchsorted(ends, index, side="right"))
    return f"particle {index - (ends[k] - len(sets[k]))} of set {k}"
