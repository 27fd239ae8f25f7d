"""Hard objects beside the soft surfaces: balls, boxes, cylinders, meshes, ground planes.

They are seen and cast shadows; they neither pull nor collide.
"""

import dataclasses
import functools
import math
import typing
from collections.abc import Callable, Iterable

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.numerics import quaternion
from fieldsim.potentials.meshes.mesh import TriangleMesh
from fieldsim.types import ArrayLike, ColorLike, RealLike, VectorLike
from fieldsim.world.color import color_rgb
from fieldsim.world.material import Material
from fieldsim.world.motion import IDENTITY, Pose, pose_at

# What a row of `render.solids.packing.Solids.sizes` means, for each kind, in the shape's own frame.
BALL = 0  # radius
ELLIPSOID = 1  # semi-axes along x, y, z
CYLINDER = 2  # radius, half length along z
CAPSULE = 3  # radius, half length of the axis along z
BOX = 4  # half sizes
TUBE = 5  # radius of the arc, radius of the tube, half the angle; the arc's middle is on x, its normal is z
PRISM = 6  # b_x, c_x, c_y, radius: all within the radius of the triangle (0, 0, 0), (b_x, 0, 0), (c_x, c_y, 0)
SLAB = 7  # half thickness, half sizes along x and y (0: without end), tile of the checker (0: none)
MESH = 8  # unit of length of its vertices
SIZES = 4

# Default material of shapes.
PLAIN = Material()


def frame_along(z: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) whose third columns are the unit vectors z (..., 3).

    The shortest turn takes the z axis there; of those that take it straight down, the one about x.
    """
    z = np.asarray(z, dtype=float)
    down = z[..., 2] < -0.999999
    k = np.where(down, 0.0, z[..., 0] / np.where(down, 1.0, 1.0 + z[..., 2]))
    x = np.stack([1.0 - z[..., 0] * k, -z[..., 1] * k, -z[..., 0]], axis=-1)
    x -= np.sum(x * z, axis=-1, keepdims=True) * z
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


@dataclasses.dataclass(frozen=True, eq=False)
class Shape:
    """A hard object, in the frame that its motion moves."""

    kind: typing.ClassVar[int]

    @property
    def sizes(self) -> tuple[float, ...]:
        """Up to `SIZES` numbers, as the kind's row takes them."""
        raise NotImplementedError

    @property
    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """Origin (3,) and axes (3, 3), in columns, of the frame that `sizes` refer to."""
        raise NotImplementedError

    def _check(self, name, check, **limits):
        """Check a field in place."""
        validate.fields(self, check, name, **limits)


@dataclasses.dataclass(frozen=True)
class Ball(Shape):
    """A ball."""

    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 1.0

    if typing.TYPE_CHECKING:

        def __init__(self, center: VectorLike = ..., radius: RealLike = ...) -> None: ...

    kind = BALL

    def __post_init__(self):
        self._check("center", validate.vector)
        self._check("radius", validate.number, above=0.0)

    @property
    def sizes(self) -> tuple[float, ...]:
        """The radius."""
        return (self.radius,)

    @property
    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """The centre; axes as they are."""
        return np.asarray(self.center), np.eye(3)


@dataclasses.dataclass(frozen=True)
class Ellipsoid(Shape):
    """An ellipsoid. radii: semi-axes along x, y and z."""

    radii: tuple[float, float, float]
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    if typing.TYPE_CHECKING:

        def __init__(self, radii: VectorLike, center: VectorLike = ...) -> None: ...

    kind = ELLIPSOID

    def __post_init__(self):
        self._check("center", validate.vector)
        self._check("radii", _lengths)

    @property
    def sizes(self) -> tuple[float, ...]:
        """The semi-axes."""
        return self.radii

    @property
    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """The centre; axes as they are."""
        return np.asarray(self.center), np.eye(3)


@dataclasses.dataclass(frozen=True)
class Box(Shape):
    """A box with edges along x, y and z. size: lengths of the edges."""

    size: tuple[float, float, float]
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    if typing.TYPE_CHECKING:

        def __init__(self, size: VectorLike, center: VectorLike = ...) -> None: ...

    kind = BOX

    def __post_init__(self):
        self._check("center", validate.vector)
        self._check("size", _lengths)

    @property
    def sizes(self) -> tuple[float, ...]:
        """Half the edges."""
        return tuple(0.5 * length for length in self.size)

    @property
    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """The centre; axes as they are."""
        return np.asarray(self.center), np.eye(3)


@dataclasses.dataclass(frozen=True)
class Cylinder(Shape):
    """A cylinder with flat ends. start, end: the middles of its ends."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float = 1.0

    if typing.TYPE_CHECKING:

        def __init__(self, start: VectorLike, end: VectorLike, radius: RealLike = ...) -> None: ...

    kind = CYLINDER

    def __post_init__(self):
        for name in ("start", "end"):
            self._check(name, validate.vector)
        self._check("radius", validate.number, above=0.0)
        if self.start == self.end:
            name = type(self).__name__
            raise InputError(f"{name}: start and end are both {self.start}; give two different points, or use Ball")

    @property
    def sizes(self) -> tuple[float, ...]:
        """Radius and half the length."""
        return self.radius, 0.5 * math.dist(self.start, self.end)

    @property
    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """The middle, and axes with z from start to end."""
        return 0.5 * np.add(self.start, self.end), frame_along(_unit(np.subtract(self.end, self.start)))


@dataclasses.dataclass(frozen=True)
class Capsule(Cylinder):
    """A cylinder with a half ball on each end. start, end: the centres of the half balls."""

    if typing.TYPE_CHECKING:

        def __init__(self, start: VectorLike, end: VectorLike, radius: RealLike = ...) -> None: ...

    kind = CAPSULE


@dataclasses.dataclass(frozen=True)
class Ground(Shape):
    """A plane, seen from both sides.

    point: any point on it, or one number: its height along the normal. extent: (x, y) half sizes of a rectangle about
    the point, None for a plane without end. checker: a second colour, in squares of side `tile` (None: plain).
    """

    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    checker: ColorLike | None = None
    tile: float = 1.0
    extent: tuple[float, float] | None = None

    if typing.TYPE_CHECKING:

        def __init__(
            self,
            point: VectorLike | RealLike = ...,
            normal: VectorLike = ...,
            checker: ColorLike | None = ...,
            tile: RealLike = ...,
            extent: VectorLike | None = ...,
        ) -> None: ...

    kind = SLAB

    def __post_init__(self):
        self._check("normal", validate.direction)
        point = validate.numbers("Ground", "point", self.point, remedy="give a point (x, y, z), or a height")
        if point.ndim == 0:
            object.__setattr__(self, "point", tuple(float(point) * c for c in self.normal))
        self._check("point", validate.vector)
        self._check("tile", validate.number, above=0.0)
        if self.checker is not None:
            color_rgb("Ground", self.checker, field="checker")
        if self.extent is not None:
            remedy = "give two half sizes (x, y) above 0, or None for no end"
            extent = validate.numbers("Ground", "extent", self.extent, shape=(2,), remedy=remedy)
            object.__setattr__(self, "extent", _lengths("Ground", "extent", (*extent, 1.0))[:2])

    @property
    def sizes(self) -> tuple[float, ...]:
        """No thickness; the extent; the tile."""
        return 0.0, *(self.extent or (0.0, 0.0)), 0.0 if self.checker is None else self.tile

    @property
    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """The point, and axes with z along the normal; a plane that lies flat keeps x and y."""
        return np.asarray(self.point), frame_along(np.asarray(self.normal))


@dataclasses.dataclass(frozen=True, eq=False)
class TriangleSurface(Shape):
    """The triangles of a mesh (`fs.mesh(...)`). smooth: shade with normals that change evenly across its faces."""

    mesh: TriangleMesh
    smooth: bool = False

    if typing.TYPE_CHECKING:

        def __init__(self, mesh: TriangleMesh, smooth: bool = ...) -> None: ...

    kind = MESH

    def __post_init__(self):
        self._check(
            "mesh", validate.instance, kinds=TriangleMesh, remedy="give fs.mesh(path) or fs.mesh(vertices, faces)"
        )
        self._check("smooth", validate.flag)

    @functools.cached_property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Middle and half sizes, each (3,), of the box around its vertices."""
        used = self.mesh.vertices[np.unique(self.mesh.faces)]
        low, high = used.min(axis=0), used.max(axis=0)
        return 0.5 * (low + high), 0.5 * (high - low)

    @property
    def sizes(self) -> tuple[float, ...]:
        """The unit of length."""
        return (float(np.max(self.box[1])),)

    @property
    def frame(self) -> tuple[np.ndarray, np.ndarray]:
        """The middle; axes as they are."""
        return self.box[0], np.eye(3)


def _lengths(owner, name, value):
    """Three numbers above 0."""
    lengths = validate.vector(owner, name, value)
    if not all(length > 0.0 for length in lengths):
        raise InputError(f"{owner}: {name} is {lengths}; give numbers above 0")
    return lengths


def _unit(vector):
    vector = vector / np.max(np.abs(vector))
    return vector / np.linalg.norm(vector)


# How a group of shapes moves: as `Motion`, or a function of time that gives a pair of positions and rotations.
Poses: typing.TypeAlias = tuple[ArrayLike, ArrayLike]
GroupMotion: typing.TypeAlias = Pose | Poses | Callable[[float], Pose | VectorLike | Poses]
GroupMotionLike: typing.TypeAlias = GroupMotion | VectorLike


@dataclasses.dataclass(frozen=True, eq=False)
class ShapeGroup:
    """Hard objects that share a motion.

    shapes: one Shape or several; materials: one Material for all, or one each, of which colour and lighting count.
    motion: a Pose, a Spin, Keyframes, or any function of time giving a Pose or a position, which moves them all; or a
    function of time giving a pair: positions (N, 3) and rotations, (N, 4) quaternions (w, x, y, z) or (N, 3, 3)
    matrices, one of each per shape.
    """

    shapes: tuple[Shape, ...]
    materials: tuple[Material, ...] = (PLAIN,)
    motion: GroupMotion = IDENTITY
    name: str = ""

    if typing.TYPE_CHECKING:

        def __init__(
            self,
            shapes: Shape | Iterable[Shape],
            materials: Material | Iterable[Material] = ...,
            motion: GroupMotionLike = ...,
            name: str = ...,
        ) -> None: ...

    def __post_init__(self):
        for name, kind in (("shapes", Shape), ("materials", Material)):
            value = getattr(self, name)
            remedy = "give fs.Ball(...), fs.Box(...), ..." if kind is Shape else "give fs.Material(color)"
            one = isinstance(value, kind)
            values = (value,) if one else validate.instances("World.add_shape", name, value, kind, remedy)
            if not values:
                raise InputError(f"World.add_shape: {name} is empty; {remedy}, or a list of at least one")
            object.__setattr__(self, name, values)
        validate.text("World.add_shape", "name", self.name)
        if len(self.materials) not in (1, len(self.shapes)):
            raise InputError(
                f"World.add_shape: {len(self.materials)} materials for {len(self.shapes)} shapes; "
                "give one for all, or one each"
            )
        self.poses_at(0.0)

    def poses_at(self, time: RealLike) -> tuple[np.ndarray, np.ndarray]:
        """Positions (N, 3) and rotations (N, 3, 3) of the shapes at `time`."""
        count = len(self.shapes)

        def poses(motion):
            if isinstance(motion, tuple) and len(motion) == 2:
                return checked_poses("World.add_shape", "motion", motion, count)
            pose = pose_at(motion, time, "World.add_shape")
            return np.broadcast_to(pose.position, (count, 3)), np.broadcast_to(pose.matrix, (count, 3, 3))

        return validate.at_time("World.add_shape", poses, {"motion": self.motion}, time)


def checked_poses(owner: str, name: str, pair, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions (N, 3) and rotations (N, 3, 3) of `count` shapes; the rotations may be given as quaternions (N, 4)."""
    if len(pair := validate.listed(owner, name, pair)) != 2:
        raise InputError(f"{owner}: {name} has {len(pair)} parts; give a pair of positions and rotations")
    positions = validate.points(owner, f"{name}[0]", pair[0])
    rotations = given = validate.numbers(owner, f"{name}[1]", pair[1])
    if rotations.shape == (count, 4):
        rotations = quaternion.matrices(rotations)
    if len(positions) != count or rotations.shape != (count, 3, 3):
        raise InputError(
            f"{owner}: {name} has positions of shape {positions.shape} and rotations of shape {given.shape} for "
            f"{count} shapes; give ({count}, 3) and ({count}, 4) unit quaternions or ({count}, 3, 3) matrices"
        )
    return positions, rotations
