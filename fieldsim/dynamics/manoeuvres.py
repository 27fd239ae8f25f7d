"""What a manoeuvre gives: rows of particles, the motion of a free body (see `Simulation.set_particles`, `set_body`)."""

import warnings

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.contact.particle_state import MOVING, ContactParticles
from fieldsim.dynamics.refusals import body_name
from fieldsim.dynamics.state import State, renew
from fieldsim.errors import FieldsimWarning, InputError


def rows_of_set(who: str, sizes, index) -> slice:
    """Where the particles of the set `index` are among those of all sets, which have so many each."""
    if not sizes:
        raise InputError(f"{who}: its world has no particles; give it some, world.add_particles(...)")
    index = validate.whole(who, "index", index, at_least=0, at_most=len(sizes) - 1)
    end = sum(sizes[: index + 1])
    return slice(end - sizes[index], end)


def rows_given(who: str, now: dict, rows: slice, given: dict) -> tuple[dict, np.ndarray]:
    """Arrays of all particles with what is given put in, and which particles have changed (N,).

    now: Warp arrays (N,) of vec3d by name; rows: those of the set; given: by name, (M, 3) each, None: they stay.
    Raises InputError for what does not fit the set.
    """
    given = {name: value for name, value in given.items() if value is not None}
    if not given:
        raise InputError(f"{who}: nothing is given; give positions=, velocities= or spins=")
    arrays = {name: array.numpy().copy() for name, array in now.items()}
    for name, value in given.items():
        value = validate.numbers(who, name, value, shape=(rows.stop - rows.start, 3))
        arrays[name][rows] = validate.not_far(who, name, value)
    return arrays, np.any([arrays[name] != array.numpy() for name, array in now.items()], axis=(0, 2))


def motion_given(who: str, *, position, rotation, velocity, angular_velocity) -> dict:
    """The fields of `Rigid` that are given, checked."""
    given = {"position": position, "velocity": velocity, "angular_velocity": angular_velocity}
    given = {name: validate.near_vector(who, name, v) for name, v in given.items() if v is not None}
    if rotation is not None:
        given["rotation"] = tuple(validate.numbers(who, "rotation", rotation, shape=(4,)).tolist())
    if not given:
        raise InputError(f"{who}: nothing is given; give position=, rotation=, velocity= or angular_velocity=")
    return given


def restart(state: State, particles: ContactParticles, motions: wp.array, changed, fresh: State, spins) -> None:
    """Let the particles `changed` (N,) start anew as in `fresh`, moving, with the given spins (N, 3).

    motions (N,) of `Motion`: what is known of contacts, and of these no more.
    """
    renew(State, state, fresh, changed)
    device, anew = fresh.x.device, ContactParticles()
    anew.spins = wp.array(spins, dtype=wp.vec3d, device=device)
    anew.states = wp.full(len(fresh.x), MOVING, dtype=wp.int32, device=device)
    renew(ContactParticles, particles, anew, changed, ("spins", "states"))
    if len(motions):
        known = motions.numpy()
        known[changed] = 0
        motions.assign(known)


def warn_of_choice(integrator) -> None:
    """Warn the user of a manoeuvre that `Auto` did not foresee it."""
    warnings.warn(
        f"Simulation: {integrator} was chosen for the motion as it started, not for what a manoeuvre makes of it; make "
        "another Simulation from here to have it chosen anew, or give an integrator",
        FieldsimWarning,
        stacklevel=5,
    )


def free_index(who: str, world, index) -> int:
    """`index`, that of a body of `world` that moves freely."""
    if not any(body.free for body in world.bodies):
        raise InputError(f"{who}: no body of its world moves freely; give one motion=fs.Rigid()")
    index = validate.whole(who, "index", index, at_least=0, at_most=len(world.bodies) - 1)
    body = world.bodies[index]
    if not body.free:
        raise InputError(f"{who}: {body_name(index, body)} moves as it is told; give it motion=fs.Rigid()")
    return index
