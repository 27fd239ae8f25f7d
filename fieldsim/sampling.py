"""Where particles start: seeded random positions and velocities, as keywords for `World.add_particles`.

Every function returns `dict(positions=..., velocities=...)`, two (N, 3) float64 arrays. The same seed gives the same
particles. Common options:

- speed: a number, or a function of the (N,) distances from the centre, such as `lambda r: np.sqrt(mass / r)`. The speed
  is across the line to the centre; which way, each function says.
- velocity: (x, y, z), added to every particle.
"""

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError


def shell(count: int, *, radius, speed=0.0, velocity=(0, 0, 0), center=(0, 0, 0), seed: int) -> dict:
    """`count` points spread evenly over the volume between two spheres, radius = (inner, outer), or on one, radius = r.

    `speed` goes in a random direction across the line to the centre.
    """
    inner, outer = _range("shell", radius)
    random = _generator("shell", seed)
    outward = _directions(random, _count("shell", count))
    distance = np.cbrt(random.uniform(inner**3, outer**3, len(outward)))
    across = np.cross(outward, _directions(random, len(outward)))
    return _start("shell", distance[:, None] * outward, distance, across, speed, velocity, center)


def ball(count: int, *, radius: float, speed=0.0, velocity=(0, 0, 0), center=(0, 0, 0), seed: int) -> dict:
    """`count` points spread evenly over the inside of a sphere; otherwise as `shell`."""
    outer = validate.number("ball", "radius", radius, above=0.0)
    return shell(count, radius=(0.0, outer), speed=speed, velocity=velocity, center=center, seed=seed)


def disk(
    count: int,
    *,
    radius,
    thickness: float = 0.0,
    normal=(0, 0, 1),
    speed=0.0,
    velocity=(0, 0, 0),
    center=(0, 0, 0),
    seed: int,
) -> dict:
    """`count` points spread evenly over a disk with a hole, radius = (inner, outer), or on a ring, radius = r.

    thickness: of the disk along `normal`. `speed` goes right-handed about `normal`, as in an orbit; its distances are
    those from the axis.
    """
    inner, outer = _range("disk", radius)
    thickness = validate.number("disk", "thickness", thickness, at_least=0.0)
    random = _generator("disk", seed)
    axis = np.array(validate.direction("disk", "normal", normal))
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    distance = np.sqrt(random.uniform(inner**2, outer**2, _count("disk", count)))
    angle = random.uniform(0.0, 2 * np.pi, len(distance))[:, None]
    height = random.uniform(-0.5, 0.5, len(distance))[:, None] * thickness
    outward = np.cos(angle) * first + np.sin(angle) * second
    return _start(
        "disk",
        distance[:, None] * outward + height * axis,
        distance,
        np.cross(axis, outward),
        speed,
        velocity,
        center,
    )


def box(count: int, *, low, high, velocity=(0, 0, 0), seed: int) -> dict:
    """`count` points spread evenly over the box between the corners `low` and `high`, all with `velocity`."""
    low, high = (np.array(validate.vector("box", name, value)) for name, value in (("low", low), ("high", high)))
    if (low > high).any():
        raise InputError(f"box: low {tuple(low.tolist())} is above high {tuple(high.tolist())}; swap the coordinates")
    positions = _generator("box", seed).uniform(low, high, (_count("box", count), 3))
    return {"positions": positions, "velocities": np.tile(validate.vector("box", "velocity", velocity), (count, 1))}


def _start(owner, positions, distance, across, speed, velocity, center):
    """Positions about `center`, and velocities of the given speeds along `across` (normalised here)."""
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    try:
        speeds = np.broadcast_to(np.asarray(speed(distance) if callable(speed) else speed, dtype=float), distance.shape)
    except (TypeError, ValueError):
        raise InputError(f"{owner}: speed is {speed!r}; give a number, or a function of the distances") from None
    bad = np.flatnonzero(~np.isfinite(speeds))
    if bad.size:
        raise InputError(f"{owner}: speed is {speeds[bad[0]]} at distance {distance[bad[0]]:g}; give finite speeds")
    return {
        "positions": positions + validate.vector(owner, "center", center),
        "velocities": speeds[:, None] * across + validate.vector(owner, "velocity", velocity),
    }


def _count(owner, count):
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 0:
        raise InputError(f"{owner}: count is {count!r}; give a whole number of particles")
    return int(count)


def _generator(owner, seed):
    try:
        return np.random.default_rng(seed)
    except (TypeError, ValueError):
        raise InputError(f"{owner}: seed is {seed!r}; give a whole number of at least 0") from None


def _range(owner, radius):
    """(inner, outer) from a pair or one number."""
    pair = (radius, radius) if np.ndim(radius) == 0 else tuple(radius)
    if len(pair) != 2:
        raise InputError(f"{owner}: radius is {radius!r}; give (inner, outer), or one number")
    inner = validate.number(owner, "radius[0]", pair[0], at_least=0.0)
    outer = validate.number(owner, "radius[1]", pair[1], at_least=0.0)
    if inner > outer:
        raise InputError(f"{owner}: radius is ({inner:g}, {outer:g}); give the inner one first")
    return inner, outer


def _directions(random, count):
    """Unit vectors, spread evenly over the sphere, (count, 3)."""
    vectors = random.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
