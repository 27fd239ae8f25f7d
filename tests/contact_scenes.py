"""Random scenes of balls thrown at bodies, on straight lines: what they touch first is geometry alone.

A *family* fixes the kernels and the primitives of a scene, since each set of formulas is compiled anew; all else is
drawn: bodies that lie apart or melt together, thick or thin, soft or hard, still or moving, and balls of 0.01 to 10
*features*, a feature being the radius of a body's material. `contact_oracle` knows what they touch, and when.
"""

import dataclasses
import functools
from collections.abc import Callable

import numpy as np

import fieldsim as fs

DURATION = 1.0
# Ball radii, in features.
SMALLEST, LARGEST = 0.01, 10.0
# Side of the part of a plane that balls meet.
PATCH = 20.0


@dataclasses.dataclass(frozen=True)
class Family:
    """Scenes of one set of formulas: the kernels of its bodies in turn, makers of primitives, whether bodies move.

    Every body has a primitive of every maker, so that all scenes of a family share their compiled kernels.
    """

    name: str
    kernels: tuple[type, ...]
    makers: tuple[Callable, ...]
    moving: bool = False
    plane: bool = False

    @property
    def full_name(self) -> str:
        """The name, and whether bodies move."""
        return f"{self.name}, moving" if self.moving else self.name


@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """Bodies, and balls on straight lines from the time 0 to `duration`.

    starts, velocities (N, 3); radii (N,); features (N,): radius of the material that each ball was thrown at.
    """

    name: str
    bodies: tuple[fs.Body, ...]
    starts: np.ndarray
    velocities: np.ndarray
    radii: np.ndarray
    features: np.ndarray
    duration: float = DURATION

    def world(self, law=None) -> fs.World:
        """The scene as a world, each ball a set of its own; the law is what happens at surfaces (default: Absorb)."""
        world = fs.World()
        for body in self.bodies:
            world.add_body(body)
        law = law or fs.Absorb()
        for start, velocity, radius in zip(self.starts, self.velocities, self.radii, strict=True):
            world.add_particles([start], [velocity], radius=radius, contact=law)
        return world


def direction(rng):
    """A random unit vector (3,)."""
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def across(rng, axis):
    """A random unit vector across an axis."""
    vector = np.cross(axis, direction(rng))
    return vector / np.linalg.norm(vector)


# Makers of primitives: each takes a generator and returns a list of some, about the origin.


def point(rng):
    """One point."""
    return [fs.Point(rng.uniform(-0.6, 0.6, 3))]


def segment(rng):
    """One segment."""
    middle, half = rng.uniform(-0.4, 0.4, 3), rng.uniform(0.15, 0.8) * direction(rng)
    return [fs.Segment(middle - half, middle + half)]


def polyline(rng):
    """Two or three segments in a row."""
    steps = [rng.uniform(0.3, 0.7) * direction(rng) for _ in range(rng.integers(2, 4))]
    corners = rng.uniform(-0.4, 0.4, 3) + np.cumsum([np.zeros(3), *steps], axis=0)
    return list(fs.polyline(corners))


def tapered(rng):
    """A segment of linear density."""
    middle, half = rng.uniform(-0.4, 0.4, 3), rng.uniform(0.2, 0.8) * direction(rng)
    return [fs.TaperedSegment(middle - half, middle + half, rng.uniform(0.4, 1.0), rng.uniform(1.0, 1.6))]


def _wave(rng):
    """A profile that begins and ends evenly."""
    return fs.Profile((1.0, rng.uniform(-0.4, 0.8)), "sine")


def profiled_segment(rng):
    """A segment that swells or thins in its middle."""
    return [fs.profiled(segment(rng)[0], _wave(rng))]


def profiled_arc(rng):
    """An arc that swells or thins in its middle."""
    return [fs.profiled(arc(rng)[0], _wave(rng))]


def arc(rng):
    """An arc."""
    normal = direction(rng)
    center, radius, angle = rng.uniform(-0.3, 0.3, 3), rng.uniform(0.3, 0.8), rng.uniform(1.0, 5.0)
    return [fs.Arc(center, normal, across(rng, normal), radius, angle)]


def circle(rng):
    """A circle."""
    return [fs.Circle(rng.uniform(-0.3, 0.3, 3), direction(rng), rng.uniform(0.3, 0.8))]


def triangle(rng):
    """A triangle without needle-like corners."""
    middle, u = rng.uniform(-0.3, 0.3, 3), direction(rng)
    v = across(rng, u)
    turns = np.arange(3) * (2 * np.pi / 3) + rng.uniform(-0.5, 0.5, 3)
    sizes = rng.uniform(0.35, 0.8, 3)
    return [fs.Triangle(*(middle + s * (np.cos(t) * u + np.sin(t) * v) for s, t in zip(sizes, turns, strict=True)))]


STILL = (
    Family("Gaussian points and polylines", (fs.Gaussian,), (point, polyline)),
    Family("Gaussian circles and arcs", (fs.Gaussian,), (circle, arc)),
    Family("Gaussian triangles", (fs.Gaussian,), (triangle,)),
    Family("Gaussian profiles", (fs.Gaussian,), (profiled_segment, profiled_arc)),
    Family("Gaussian segments on a plane", (fs.Gaussian,), (segment,), plane=True),
    Family("Cauchy points, segments and arcs", (fs.Cauchy,), (point, segment, arc)),
    Family("Cauchy triangles and segments", (fs.Cauchy,), (triangle, segment)),
    Family("Newtonian and tapered segments", (fs.Newtonian,), (segment, tapered)),
    Family("InverseSquare segments and circles", (fs.InverseSquare,), (segment, circle)),
    Family("Metaball points and segments", (fs.Metaball,), (point, segment)),
    Family("SoftObject polylines and triangles", (fs.SoftObject,), (polyline, triangle)),
    Family("Quartic circles and segments", (fs.Quartic,), (circle, segment)),
    Family("Gaussian, Metaball and Cauchy segments", (fs.Gaussian, fs.Metaball, fs.Cauchy), (segment,)),
)
MOVING = tuple(
    Family(family.name, family.kernels, family.makers, True)
    for family in STILL
    if family.name
    in {
        "Gaussian points and polylines",
        "Gaussian circles and arcs",
        "Cauchy triangles and segments",
        "Newtonian and tapered segments",
        "Metaball points and segments",
        "Quartic circles and segments",
    }
)
FAMILIES = STILL + MOVING


def _material(rng, kernel):
    return fs.Material(radius=10 ** rng.uniform(-1.1, -0.5), blobbiness=-(10 ** rng.uniform(0.3, 0.9)), kernel=kernel)


def _motion(rng, place):
    """A spin, a path, or a path with turns."""
    kind = rng.integers(3)
    if kind == 0:
        return functools.partial(_spun, fs.Spin(direction(rng), rng.uniform(0.5, 2.0), rng.uniform(0, 6)), place)
    times = np.array([-0.5, 0.0, 0.5, 1.0, 1.5]) * DURATION
    places = [place + rng.uniform(-0.4, 0.4, 3) for _ in times]
    if kind == 1:
        return fs.Keyframes(times, places)
    axis, turns = direction(rng), np.cumsum(rng.uniform(-1.0, 1.0, len(times)))
    return fs.Keyframes(times, [fs.Pose.turned(axis, t, p) for t, p in zip(turns, places, strict=True)])


def _spun(spin, place, time):
    """The pose of what spins about a place."""
    return fs.Pose(place, spin(time).rotation)


def skeleton_points(primitive, u, v) -> np.ndarray:
    """Points (n, 3) of a primitive for parameters u, v (n,) in 0..1."""
    if isinstance(primitive, fs.Point):
        return np.tile(primitive.position, (len(u), 1))
    if isinstance(primitive, fs.Segment):
        start, end = np.array(primitive.start), np.array(primitive.end)
        return start + u[:, None] * (end - start)
    if isinstance(primitive, fs.Triangle):
        a, b, c = np.array([primitive.a, primitive.b, primitive.c])
        s = np.sqrt(u)[:, None]
        return (1 - s) * a + s * (1 - v)[:, None] * b + s * v[:, None] * c
    normal = np.array(primitive.normal)
    if isinstance(primitive, fs.Plane):
        first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        first /= np.linalg.norm(first)
        sides = np.stack([first, np.cross(normal, first)])
        return np.array(primitive.point) + PATCH * (np.stack([u, v], axis=1) - 0.5) @ sides
    if isinstance(primitive, fs.Circle):
        start = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        start /= np.linalg.norm(start)
        angle = 2 * np.pi * u
    else:
        start, angle = np.array(primitive.start), u * primitive.angle
    around = np.cos(angle)[:, None] * start + np.sin(angle)[:, None] * np.cross(normal, start)
    return np.array(primitive.center) + primitive.radius * around


def make_scene(family: Family, seed: int, balls: int = 8) -> Scene:
    """The scene of a family and a number, always the same."""
    rng = np.random.default_rng([seed, FAMILIES.index(family) if family in FAMILIES else 1000])
    count = len(family.kernels) if len(family.kernels) > 1 else int(rng.integers(2 if family.moving else 1, 4))
    bodies = []
    for k in range(count):
        kernel = family.kernels[k % len(family.kernels)]
        skeleton = [p for maker in family.makers for p in maker(rng)]
        place = rng.uniform(-0.6, 0.6, 3) if k else np.zeros(3)
        pose = fs.Pose.turned(direction(rng), rng.uniform(0, 6), place)
        motion = _motion(rng, place) if family.moving and k else pose
        bodies.append(fs.Body(skeleton, surface=_material(rng, kernel), motion=motion))
    if family.plane:
        plane = fs.Plane((0, 0, -0.8), (0.2 * rng.normal(), 0.2 * rng.normal(), 1.0))
        bodies.append(fs.Body(plane, surface=_material(rng, family.kernels[0])))
    thrown = [_throw(rng, bodies[:count], family.plane) for _ in range(balls)]
    columns = (np.array(column) for column in zip(*thrown, strict=True))
    return Scene(f"{family.full_name}, number {seed}", tuple(bodies), *columns)


def _throw(rng, bodies, from_above):
    """Start, velocity, radius and feature of a ball that comes close to the skeleton of one of the bodies."""
    body = bodies[rng.integers(len(bodies))]
    feature = body.surface.radius
    radius = feature * SMALLEST * (LARGEST / SMALLEST) ** rng.random()
    target = skeleton_points(body.skeleton[rng.integers(len(body.skeleton))], rng.random(1), rng.random(1))
    meeting = DURATION * rng.uniform(0.4, 0.7)
    target = body.pose_at(meeting).apply(target)[0]
    heading = direction(rng)
    if from_above:
        heading = heading - (0.0, 0.0, 2.0)
        heading /= np.linalg.norm(heading)
    aside = 1.2 * np.sqrt(rng.random()) * (radius + feature) * across(rng, heading)
    # From beyond all that there is: bodies are less than 2.5 from the origin.
    speed = (4.0 + radius + rng.uniform(0.0, 2.0)) / meeting
    return target + aside - speed * meeting * heading, speed * heading, radius, feature
