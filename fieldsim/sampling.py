"""Where particles start: seeded random positions and velocities, as keywords for `World.add_particles`.

Every function returns `dict(positions=..., velocities=...)`, two (N, 3) float64 arrays. The same seed gives the same
particles. Common options:

- speed: a number, or a function of the (N,) distances from the centre, such as `lambda r: np.sqrt(mass / r)`. The speed
  is across the line to the centre; which way, each function says.
- velocity: (x, y, z), added to every particle.
"""

from collections.abc import Callable, Sequence
from typing import TypeAlias, TypedDict

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.numerics.rotations import turned
from fieldsim.types import ArrayLike, RealLike, VectorLike, WholeLike

# Lengths whose cubes are finite.
FARTHEST = 1e100
# Particles at most: two gigabytes.
MOST = 20_000_000

# A radius, or (inner, outer).
RangeLike: TypeAlias = ArrayLike
# A speed, one per particle, or a function of the (N,) distances.
Speed: TypeAlias = RealLike | np.ndarray | Callable[[np.ndarray], float | np.ndarray]


class Start(TypedDict):
    """Where particles start: positions and velocities, (N, 3) each, the keywords of `World.add_particles`."""

    positions: np.ndarray
    velocities: np.ndarray


def shell(
    count: WholeLike,
    *,
    radius: RangeLike,
    speed: Speed = 0.0,
    velocity: VectorLike = (0, 0, 0),
    center: VectorLike = (0, 0, 0),
    seed: WholeLike,
) -> Start:
    """`count` points spread evenly over the volume between two spheres, radius = (inner, outer), or on one, radius = r.

    `speed` goes in a random direction across the line to the centre.
    """
    return _shell("shell", count, _range("shell", radius), speed, velocity, center, seed)


def _shell(owner, count, radii, speed, velocity, center, seed):
    """`shell` in the name of `owner`."""
    inner, outer = radii
    random = _generator(owner, seed)
    outward = _directions(random, _count(owner, count))
    distance = np.cbrt(random.uniform(inner**3, outer**3, len(outward)))
    across = np.cross(outward, _directions(random, len(outward)))
    return _start(owner, distance[:, None] * outward, distance, across, speed, velocity, center)


def ball(
    count: WholeLike,
    *,
    radius: RealLike,
    speed: Speed = 0.0,
    velocity: VectorLike = (0, 0, 0),
    center: VectorLike = (0, 0, 0),
    seed: WholeLike,
) -> Start:
    """`count` points spread evenly over the inside of a sphere; otherwise as `shell`."""
    outer = validate.number("ball", "radius", radius, above=0.0, at_most=FARTHEST)
    return _shell("ball", count, (0.0, outer), speed, velocity, center, seed)


def disk(
    count: WholeLike,
    *,
    radius: RangeLike,
    thickness: RealLike = 0.0,
    normal: VectorLike = (0, 0, 1),
    speed: Speed = 0.0,
    velocity: VectorLike = (0, 0, 0),
    center: VectorLike = (0, 0, 0),
    seed: WholeLike,
) -> Start:
    """`count` points spread evenly over a disk with a hole, radius = (inner, outer), or on a ring, radius = r.

    thickness: of the disk along `normal`. `speed` goes right-handed about `normal`, as in an orbit; its distances are
    those from the axis.
    """
    return _disk("disk", count, _range("disk", radius), thickness, normal, speed, velocity, center, seed)


def _disk(owner, count, radii, thickness, normal, speed, velocity, center, seed):
    """`disk` in the name of `owner`."""
    inner, outer = radii
    thickness = validate.number(owner, "thickness", thickness, at_least=0.0, at_most=FARTHEST)
    random = _generator(owner, seed)
    axis = np.array(validate.direction(owner, "normal", normal))
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    distance = np.sqrt(random.uniform(inner**2, outer**2, _count(owner, count)))
    angle = random.uniform(0.0, 2 * np.pi, len(distance))[:, None]
    height = random.uniform(-0.5, 0.5, len(distance))[:, None] * thickness
    outward = np.cos(angle) * first + np.sin(angle) * second
    places = distance[:, None] * outward + height * axis
    return _start(owner, places, distance, np.cross(axis, outward), speed, velocity, center)


def cylinder(
    count: WholeLike,
    *,
    radius: RangeLike,
    height: Sequence[RealLike] | np.ndarray,
    velocity: VectorLike = (0, 0, 0),
    center: VectorLike = (0, 0, 0),
    seed: WholeLike,
) -> Start:
    """`count` points spread evenly over an upright cylinder, height = (low, high), all with `velocity`.

    radius: of the cylinder, or (inner, outer) of a pipe.
    """
    low, high = _pair("cylinder", "height", height)
    inner, outer = _range("cylinder", radius)
    radii = (inner, outer) if validate.numbers("cylinder", "radius", radius).ndim else (0.0, outer)
    start = _disk("cylinder", count, radii, high - low, (0, 0, 1), 0.0, velocity, center, seed)
    start["positions"][:, 2] += 0.5 * (low + high)
    return start


def orbits(
    count: WholeLike,
    *,
    radius: RangeLike,
    mass: RealLike,
    G: RealLike = 1.0,
    tilt: RealLike = 0.0,
    normal: VectorLike = (0, 0, 1),
    center: VectorLike = (0, 0, 0),
    seed: WholeLike,
) -> Start:
    """`count` points on circular orbits about a point mass, right-handed about `normal`, radius = (inner, outer).

    tilt: largest angle (radians) between `normal` and an orbit's own axis. About a body that is no point the orbits are
    nearly circles where they are wide against it.
    """
    mass = validate.number("orbits", "mass", mass, at_least=0.0)
    mass *= validate.number("orbits", "G", G, at_least=0.0)
    tilt = validate.number("orbits", "tilt", tilt, at_least=0.0)
    radii, seed = _range("orbits", radius, above=0.0), validate.seed("orbits", seed)
    with np.errstate(over="ignore", divide="ignore"):  # speeds that are no numbers are refused
        flat = _disk("orbits", count, radii, 0.0, normal, lambda r: np.sqrt(mass / r), (0, 0, 0), (0, 0, 0), seed)
    # Turn each orbit about a line of nodes in the disk's plane; the tips of the axes fill a cap evenly.
    random = np.random.default_rng((0, seed))
    axis = np.array(validate.direction("orbits", "normal", normal))
    nodes = _directions(random, len(flat["positions"]))
    nodes -= (nodes @ axis)[:, None] * axis
    nodes /= np.linalg.norm(nodes, axis=1, keepdims=True)
    angle = np.arccos(random.uniform(np.cos(min(tilt, np.pi)), 1.0, len(nodes)))
    return {
        "positions": turned(flat["positions"], nodes, angle) + validate.vector("orbits", "center", center),
        "velocities": turned(flat["velocities"], nodes, angle),
    }


def box(
    count: WholeLike, *, low: VectorLike, high: VectorLike, velocity: VectorLike = (0, 0, 0), seed: WholeLike
) -> Start:
    """`count` points spread evenly over the box between the corners `low` and `high`, all with `velocity`."""
    # A zero without its sign: NumPy takes -0 for less than 0.
    low, high = (
        np.array(validate.near_vector("box", name, value)) + 0.0 for name, value in (("low", low), ("high", high))
    )
    if (low > high).any():
        raise InputError(f"box: low {tuple(low.tolist())} is above high {tuple(high.tolist())}; swap the coordinates")
    positions = _generator("box", seed).uniform(low, high, (_count("box", count), 3))
    velocity = validate.vector("box", "velocity", velocity)
    return {"positions": positions, "velocities": np.tile(velocity, (len(positions), 1))}


def _start(owner, positions, distance, across, speed, velocity, center):
    """Positions about `center`, and velocities of the given speeds along `across` (normalised here)."""
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    remedy = "give a number of at least 0, or a function of the (N,) distances"
    speeds = validate.answer(owner, "speed", speed, distance.copy()) if callable(speed) else speed
    speeds = validate.reals(owner, "speed", speeds, remedy)
    if speeds.shape not in ((), distance.shape):
        raise InputError(f"{owner}: speed has shape {speeds.shape}; {remedy}")
    speeds = np.broadcast_to(speeds, distance.shape)
    bad = np.flatnonzero(~(np.isfinite(speeds) & (speeds >= 0.0)))
    if bad.size:
        raise InputError(f"{owner}: speed is {speeds[bad[0]]} at distance {distance[bad[0]]:g}; {remedy}")
    return {
        "positions": positions + validate.vector(owner, "center", center),
        "velocities": speeds[:, None] * across + validate.vector(owner, "velocity", velocity),
    }


def _count(owner, count):
    return validate.whole(owner, "count", count, at_least=0, at_most=MOST)


def _generator(owner, seed):
    return np.random.default_rng(validate.seed(owner, seed))


def _range(owner, radius, **limits):
    """(inner, outer) from a pair or one number."""
    radii = validate.numbers(owner, "radius", radius, remedy="give a number, or two, the lower first")
    inner, outer = _pair(owner, "radius", np.tile(radii, 2) if radii.ndim == 0 else radii)
    return validate.number(owner, "radius", inner, **(limits or {"at_least": 0.0})), outer


def _pair(owner, name, value):
    """Two numbers, the lower first."""
    low, high = validate.numbers(owner, name, value, shape=(2,), remedy="give two numbers, the lower first").tolist()
    validate.number(owner, name, max(abs(low), abs(high)), at_most=FARTHEST)
    if low > high:
        raise InputError(f"{owner}: {name} is ({low:g}, {high:g}); give the lower number first")
    return low, high


def _directions(random, count):
    """Unit vectors, spread evenly over the sphere, (count, 3)."""
    vectors = random.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
