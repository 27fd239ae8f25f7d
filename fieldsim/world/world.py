"""Worlds: bodies, particles, hard shapes, lights and a background; and what they look like at one moment."""

import copy
import dataclasses
import functools
import warnings

import numpy as np

from fieldsim import validate
from fieldsim.arrays import kept, read_only
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.potentials.elements import Elements, concatenate, place
from fieldsim.potentials.field import Field
from fieldsim.potentials.meshes.mesh import TriangleMesh
from fieldsim.world.body import Body
from fieldsim.world.color import color_rgb
from fieldsim.world.light import DEFAULT_LIGHTS, Background, Fog, Light
from fieldsim.world.material import Material
from fieldsim.world.motion import IDENTITY, Pose
from fieldsim.world.particles import Particles
from fieldsim.world.shapes import PLAIN, ShapeGroup, Solids, checked_poses, joined


class World:
    """What there is. Plain values: physics and pictures read them.

    escape_radius: a particle farther than this from the origin has escaped: it stays where it is. None: none ever does.
    bodies, particles, shapes: lists of what was added. What is assigned to these, and to the options, is checked as
    what is given; what is put into a list is when the world is used.
    """

    def __init__(
        self,
        *,
        lights=DEFAULT_LIGHTS,
        background: Background | None = None,
        fog: Fog | None = None,
        escape_radius: float | None = None,
    ):
        self.bodies: list[Body] = []
        self.particles: list[Particles] = []
        self.shapes: list[ShapeGroup] = []
        self.lights, self.background, self.fog, self.escape_radius = lights, background, fog, escape_radius
        if not self.lights:
            words = "World: there are no lights, only the background's own; give lights=[fs.DirectionalLight(...)]"
            warnings.warn(words, FieldsimWarning, stacklevel=2)

    def __setattr__(self, name, value):
        if name in _LISTS:
            value = list(_things("World", name, value))
        elif name in _OPTIONS:
            value = _OPTIONS[name](value)
        object.__setattr__(self, name, value)

    def add_body(self, body: Body) -> Body:
        """Add a body and return it."""
        validate.instance("World.add_body", "body", body, Body, "write world.add_body(fs.Body(...))")
        self.bodies.append(body)
        return body

    def add_particles(self, positions, velocities, **options) -> Particles:
        """Add a set of particles (see `Particles`) and return it."""
        particles = Particles(positions, velocities, **options)
        self.particles.append(particles)
        return particles

    def add_shape(self, shape, material=PLAIN, motion=IDENTITY, *, name: str = "") -> ShapeGroup:
        """Add a hard object, or several that share a motion, which are seen but do not act; return their group.

        shape: `Ball`, `Ellipsoid`, `Box`, `Cylinder`, `Capsule`, `Ground`, `TriangleSurface`, or a list of such;
        material: its colour and lighting factors count; motion: see `ShapeGroup`.
        """
        group = ShapeGroup(shape, material, motion, name)
        self.shapes.append(group)
        return group

    def replace(self, **changes) -> "World":
        """A copy that loses nothing, with `changes`: bodies, particles, shapes (lists), lights, background, fog, ...

            quick = world.replace(particles=[p for p in world.particles if p.name == "dust"], escape_radius=None)

        The copy has lists of its own, of the same bodies, particles and shapes. Raises InputError as World does.
        """
        for name in changes:
            if name not in _LISTS and name not in _OPTIONS:
                raise InputError(f"World.replace: a world has no {name!r}; give {', '.join([*_LISTS, *_OPTIONS])}")
        if "lights" in changes:
            World(lights=changes["lights"])  # which warns where there are none
        copied = copy.copy(self)
        for name in _LISTS:
            setattr(copied, name, _things("World.replace", name, changes.get(name, getattr(self, name))))
        for name in _OPTIONS:
            setattr(copied, name, changes.get(name, getattr(self, name)))
        return copied

    def at(self, time: float) -> "Snapshot":
        """The world at `time`: bodies with a motion as they are then, free ones and particles as they start."""
        time = validate.number("World.at", "time", time)
        given_world("World.at", self)
        return Snapshot(
            self,
            time,
            tuple(body.pose_at(time) for body in self.bodies),
            tuple(p.positions for p in self.particles),
            tuple(p.velocities for p in self.particles),
        )


_LISTS = {"bodies": Body, "particles": Particles, "shapes": ShapeGroup}


def _lights(value):
    return validate.instances("World", "lights", value, Light, "give fs.PointLight or fs.DirectionalLight")


def _background(value):
    remedy = "give fs.Background(top, bottom), or None"
    return validate.instance("World", "background", value, Background | None, remedy) or Background()


def _fog(value):
    return validate.instance("World", "fog", value, Fog | None, "give fs.Fog(density), or None")


def _escape_radius(value):
    return validate.optional(validate.number, "World", "escape_radius", value, above=0.0)


# How the options of a world are checked.
_OPTIONS = {"lights": _lights, "background": _background, "fog": _fog, "escape_radius": _escape_radius}


def _things(owner, name, value):
    """What is in one of a world's lists, checked."""
    kind = _LISTS[name]
    return validate.instances(owner, name, value, kind, f"give a list of {kind.__name__}, as world.{name} is")


def given_world(owner: str, value) -> World:
    """`value`, a world with nothing but bodies, particles and shapes in its lists."""
    validate.instance(owner, "world", value, World, "give a fs.World")
    for name in _LISTS:
        _things(owner, name, getattr(value, name))
    return value


@dataclasses.dataclass(frozen=True, eq=False)
class Snapshot:
    """One moment: all that a frame needs.

    poses: one per body; positions, velocities: one (N, 3) array per set of particles, world frame; shape_poses: one
    pair of positions (N, 3) and rotations ((N, 4) or (N, 3, 3)) per group of hard shapes, None: as their motions say.
    Arrays are kept as copies to read only. Raises InputError for what does not fit the world.
    """

    world: World
    time: float
    poses: tuple[Pose, ...]
    positions: tuple[np.ndarray, ...]
    velocities: tuple[np.ndarray, ...]
    shape_poses: tuple[tuple[np.ndarray, np.ndarray], ...] | None = None

    def __post_init__(self):
        given_world("Snapshot", self.world)
        object.__setattr__(self, "time", validate.number("Snapshot", "time", self.time))
        poses = validate.instances("Snapshot", "poses", self.poses, Pose, "give a fs.Pose for each body")
        object.__setattr__(self, "poses", poses)
        for name in ("positions", "velocities"):
            remedy = "give a list with an array (N, 3) for each set of particles"
            arrays = validate.listed("Snapshot", name, getattr(self, name), remedy)
            arrays = (validate.points("Snapshot", f"{name}[{k}]", array) for k, array in enumerate(arrays))
            object.__setattr__(self, name, tuple(map(kept, arrays)))
        if self.shape_poses is not None:
            remedy = "give a pair of positions and rotations for each World.add_shape"
            pairs = validate.listed("Snapshot", "shape_poses", self.shape_poses, remedy)
            pairs = tuple(_pair(f"shape_poses[{k}]", pair, remedy) for k, pair in enumerate(pairs))
            object.__setattr__(self, "shape_poses", pairs)
        self._refuse_misfit()

    def _refuse_misfit(self):
        """Raise InputError where there are more or fewer rows than the world has things: it may have got more since."""
        world, pairs = self.world, self.shape_poses
        self._fits("poses", len(self.poses), len(world.bodies), "bodies")
        for name in ("positions", "velocities"):
            arrays = getattr(self, name)
            self._fits(name, len(arrays), len(world.particles), "sets of particles")
            for k, (array, particles) in enumerate(zip(arrays, world.particles, strict=True)):
                self._fits(f"rows of {name}[{k}]", len(array), len(particles), "particles")
        if pairs is not None:
            self._fits("shape_poses", len(pairs), len(world.shapes), "groups of shapes")
            for k, (pair, group) in enumerate(zip(pairs, world.shapes, strict=True)):
                checked_poses("Snapshot", f"shape_poses[{k}]", pair, len(group.shapes))

    @staticmethod
    def _fits(name, count, wanted, things):
        if count != wanted:
            raise InputError(f"Snapshot: {count} {name} for {wanted} {things} of its world; give as many")

    def poses_at(self, index: int, times) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (n, 3, 3) and positions (n, 3) of body `index`: those of this moment, at each of the n `times`."""
        self._refuse_misfit()
        owner = "Snapshot.poses_at"
        index = validate.whole(owner, "index", index, at_least=0, at_most=len(self.poses) - 1)
        pose, count = self.poses[index], len(validate.numbers(owner, "times", times, shape=(None,)))
        return np.broadcast_to(pose.matrix, (count, 3, 3)), np.broadcast_to(pose.position, (count, 3))

    @functools.cached_property
    def surface(self) -> "Surface":
        """All bodies' surface elements in the world's frame; the surface is where their sum is 1."""
        self._refuse_misfit()
        parts, owners, materials, poses = [], [], [], []
        for body, pose in zip(self.world.bodies, self.poses, strict=True):
            if body.surface is None:
                continue
            local = body.surface_elements(self.time)
            rows = local.rows if pose.is_identity else place(local.rows, pose.matrix, np.array(pose.position))
            parts.append(dataclasses.replace(local, rows=rows))
            owners.append(np.full(len(local), len(materials), dtype=np.int32))
            materials.append(body.surface.at(self.time))
            poses.append(pose)
        grouped, order = concatenate(parts).grouped()
        owner = np.concatenate(owners)[order] if owners else np.zeros(0, dtype=np.int32)
        return Surface(grouped, owner, tuple(materials), tuple(poses))

    def surface_field(self) -> Field:
        """The field whose level 1 is the surface of all bodies together, in the world's frame."""
        elements = self.surface.elements
        if not len(elements):
            raise InputError("Snapshot: no body of the world has a surface; give one a fs.Material")
        return Field.of_elements(elements)

    def surface_mesh(self, *, resolution: int | None = None, tolerance: float | None = None) -> TriangleMesh:
        """The surface of all bodies together as a closed `TriangleMesh`; see `Field.mesh`."""
        return self.surface_field().mesh(1.0, resolution=resolution, tolerance=tolerance)

    @functools.cached_property
    def shapes(self) -> Solids:
        """All hard shapes in the world's frame."""
        self._refuse_misfit()
        groups = self.world.shapes
        if self.shape_poses is None:
            poses = [group.poses_at(self.time) for group in groups]
        else:
            poses = [
                checked_poses("Snapshot", f"shape_poses[{index}]", pair, len(group.shapes))
                for index, (group, pair) in enumerate(zip(groups, self.shape_poses, strict=True))
            ]
        return joined(group.solids(self.time).placed(*pose) for group, pose in zip(groups, poses, strict=True))

    @functools.cached_property
    def spheres(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """All particles: centres (N, 3), radii (N,), linear RGB colours (N, 3)."""
        self._refuse_misfit()
        sets = self.world.particles
        if not sets:
            return tuple(map(read_only, (np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3)))))
        radii = np.concatenate([np.full(len(p), p.radius) for p in sets])
        colors = np.concatenate([np.tile(color_rgb("Particles", p.color), (len(p), 1)) for p in sets])
        return tuple(map(read_only, (np.concatenate(self.positions), radii, colors)))


def _pair(name, value, remedy):
    """Two arrays to read only."""
    arrays = validate.listed("Snapshot", name, value, remedy)
    if len(arrays) != 2:
        raise InputError(f"Snapshot: {name} has {len(arrays)} parts; {remedy}")
    return tuple(kept(validate.numbers("Snapshot", f"{name}[{k}]", array)) for k, array in enumerate(arrays))


@dataclasses.dataclass(frozen=True)
class Surface:
    """Surface elements in the world's frame, grouped by formula; owner: each one's material and pose, (N,)."""

    elements: Elements
    owner: np.ndarray
    materials: tuple[Material, ...]
    poses: tuple[Pose, ...]
