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


def cylinder(count: int, *, radius, height, velocity=(0, 0, 0), center=(0, 0, 0), seed: int) -> dict:
    """`count` points spread evenly over an upright cylinder, height = (low, high), all with `velocity`.

    radius: of the cylinder, or (inner, outer) of a pipe.
    """
    low, high = _pair("cylinder", "height", height)
    outer = radius if np.ndim(radius) else (0.0, radius)
    start = disk(count, radius=outer, thickness=high - low, velocity=velocity, center=center, seed=seed)
    start["positions"][:, 2] += 0.5 * (low + high)
    return start


def orbits(
    count: int,
    *,
    radius,
    mass: float,
    G: float = 1.0,
    tilt: float = 0.0,
    normal=(0, 0, 1),
    center=(0, 0, 0),
    seed: int,
) -> dict:
    """`count` points on circular orbits about a point mass, right-handed about `normal`, radius = (inner, outer).

    tilt: largest angle (radians) between `normal` and an orbit's own axis. About a body that is no point the orbits are
    nearly circles where they are wide against it.
    """
    mass = validate.number("orbits", "G mass", validate.number("orbits", "G", G) * mass, at_least=0.0)
    tilt = validate.number("orbits", "tilt", tilt, at_least=0.0)
    flat = disk(count, radius=radius, normal=normal, speed=lambda r: np.sqrt(mass / r), seed=seed)
    # Turn each orbit about a line of nodes in the disk's plane; the tips of the axes fill a cap evenly.
    random = _generator("orbits", (0, seed))
    axis = np.array(validate.direction("orbits", "normal", normal))
    nodes = _directions(random, count)
    nodes -= (nodes @ axis)[:, None] * axis
    nodes /= np.linalg.norm(nodes, axis=1, keepdims=True)
    angle = np.arccos(random.uniform(np.cos(min(tilt, np.pi)), 1.0, count))
    return {
        "positions": _turned(flat["positions"], nodes, angle) + validate.vector("orbits", "center", center),
        "velocities": _turned(flat["velocities"], nodes, angle),
    }


def _turned(vectors, axes, angles):
    """Rodrigues' formula, row by row."""
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    along = np.einsum("ij,ij->i", axes, vectors)[:, None] * axes
    return cos * vectors + sin * np.cross(axes, vectors) + (1.0 - cos) * along


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
    inner, outer = _pair(owner, "radius", (radius, radius) if np.ndim(radius) == 0 else radius)
    if inner < 0.0:
        raise InputError(f"{owner}: radius is {inner:g}; give numbers of at least 0")
    return inner, outer


def _pair(owner, name, value):
    """Two numbers, the lower first."""
    if np.ndim(value) != 1 or len(value) != 2:
        raise InputError(f"{owner}: {name} is {value!r}; give two numbers, the lower first")
    low, high = (validate.number(owner, name, v) for v in value)
    if low > high:
        raise InputError(f"{owner}: {name} is ({low:g}, {high:g}); give the lower number first")
    return low, high


def _directions(random, count):
    """Unit vectors, spread evenly over the sphere, (count, 3)."""
    vectors = random.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
