"""Snapshots: what a world looks like at one moment."""

import dataclasses
import functools
import typing
from collections.abc import Iterable

import numpy as np

from fieldsim import validate
from fieldsim.arrays import kept, read_only
from fieldsim.errors import InputError
from fieldsim.potentials.field import Field
from fieldsim.potentials.meshes.mesh import TriangleMesh
from fieldsim.types import ArrayLike, RealLike, WholeLike
from fieldsim.world.body import Body
from fieldsim.world.color import color_rgb
from fieldsim.world.light import Background, Fog, Light
from fieldsim.world.motion import Pose
from fieldsim.world.particles import Particles
from fieldsim.world.shapes import ShapeGroup, checked_poses


class WorldValue(typing.Protocol):
    """What a snapshot, and all that computes, may read of a world: a `World` without the steps that build one."""

    @property
    def bodies(self) -> tuple[Body, ...]:
        """All bodies."""

    @property
    def particles(self) -> tuple[Particles, ...]:
        """All sets of particles, as they start."""

    @property
    def shapes(self) -> tuple[ShapeGroup, ...]:
        """All groups of hard shapes."""

    @property
    def lights(self) -> tuple[Light, ...]:
        """All lights."""

    @property
    def background(self) -> Background:
        """What is seen where nothing is."""

    @property
    def fog(self) -> Fog | None:
        """The fog, or None."""

    @property
    def escape_radius(self) -> float | None:
        """Where particles have escaped, or None."""

    def at(self, time: float) -> "Snapshot":
        """The world at `time`."""

    def replace(self, **changes) -> typing.Self:
        """A world of its own with changes."""

    def frozen(self) -> typing.Self:
        """The world as it is now, a value that refuses changes."""


@dataclasses.dataclass(frozen=True, eq=False)
class Snapshot:
    """One moment: all that a frame needs.

    poses: one per body; positions, velocities: one (N, 3) array per set of particles, world frame; shape_poses: one
    pair of positions (N, 3) and rotations ((N, 4) or (N, 3, 3)) per group of hard shapes, None: as their motions say.
    Arrays are kept as copies to read only, the world as its frozen value: what it is given later changes no moment.
    Raises InputError for what does not fit the world.
    """

    world: WorldValue
    time: float
    poses: tuple[Pose, ...]
    positions: tuple[np.ndarray, ...]
    velocities: tuple[np.ndarray, ...]
    shape_poses: tuple[tuple[np.ndarray, np.ndarray], ...] | None = None

    if typing.TYPE_CHECKING:

        def __init__(
            self,
            world: WorldValue,
            time: RealLike,
            poses: Iterable[Pose],
            positions: Iterable[ArrayLike],
            velocities: Iterable[ArrayLike],
            shape_poses: Iterable[tuple[ArrayLike, ArrayLike]] | None = ...,
        ) -> None: ...

    def __post_init__(self):
        world = validate.having("Snapshot", "world", self.world, ("frozen", "replace", "bodies"), "give a fs.World")
        object.__setattr__(self, "world", world.frozen())
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
        """Raise InputError where there are more or fewer rows than the world has things."""
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

    def poses_at(self, index: WholeLike, times: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (n, 3, 3) and positions (n, 3) of body `index`: those of this moment, at each of the n `times`."""
        owner = "Snapshot.poses_at"
        index = validate.whole(owner, "index", index, at_least=0, at_most=len(self.poses) - 1)
        pose, count = self.poses[index], len(validate.numbers(owner, "times", times, shape=(None,)))
        return np.broadcast_to(pose.matrix, (count, 3, 3)), np.broadcast_to(pose.position, (count, 3))

    def surface_field(self) -> Field:
        """The field whose level 1 is the surface of all bodies together, in the world's frame."""
        parts = [
            body.surface_elements(self.time).placed(pose.matrix, pose.position)
            for body, pose in zip(self.world.bodies, self.poses, strict=True)
            if body.surface is not None
        ]
        if not parts:
            raise InputError("Snapshot: no body of the world has a surface; give one a fs.Material")
        return Field.of_terms((), parts)

    def surface_mesh(self, *, resolution: WholeLike | None = None, tolerance: RealLike | None = None) -> TriangleMesh:
        """The surface of all bodies together as a closed `TriangleMesh`; see `Field.mesh`."""
        return self.surface_field().mesh(1.0, resolution=resolution, tolerance=tolerance)

    @functools.cached_property
    def spheres(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """All particles: centres (N, 3), radii (N,), linear RGB colours (N, 3)."""
        sets = self.world.particles
        if not sets:
            return read_only(np.zeros((0, 3))), read_only(np.zeros(0)), read_only(np.zeros((0, 3)))
        radii = np.concatenate([np.full(len(p), p.radius) for p in sets])
        colors = np.concatenate([np.tile(color_rgb("Particles", p.color), (len(p), 1)) for p in sets])
        return read_only(np.concatenate(self.positions)), read_only(radii), read_only(colors)


def _pair(name, value, remedy):
    """Two arrays to read only."""
    arrays = validate.listed("Snapshot", name, value, remedy)
    if len(arrays) != 2:
        raise InputError(f"Snapshot: {name} has {len(arrays)} parts; {remedy}")
    return tuple(kept(validate.numbers("Snapshot", f"{name}[{k}]", array)) for k, array in enumerate(arrays))
