"""Bodies: a skeleton that pulls, collides and is seen; and sets of particles."""

import dataclasses
import functools
from collections.abc import Iterable
from typing import TYPE_CHECKING

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.elements import Elements, concatenate, pack
from fieldsim.potentials.field import Field, skeleton
from fieldsim.potentials.gravity import spread
from fieldsim.potentials.kernels import Kernel
from fieldsim.potentials.meshes.mesh import TriangleMesh
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.row import STRENGTH
from fieldsim.types import RealLike, Timed, WholeLike
from fieldsim.world.material import Material
from fieldsim.world.motion import IDENTITY, Motion, MotionLike, Pose, pose_at
from fieldsim.world.rigid import Rigid

KERNEL = "give a kernel such as fs.Newtonian(), or None"


@dataclasses.dataclass(frozen=True)
class Body:
    """A skeleton with its roles.

    skeleton: a primitive or a sequence, in the body's frame; their fields may be functions of time.
    gravity: the kernel with which the body pulls (None: it does not); mass: spread evenly over the skeleton's measure,
    may be negative (antigravity) or a function of time; G: gravitational constant.
    surface: the Material of the surface that is seen and collides (None: invisible and intangible).
    motion: a Pose, a Spin, Keyframes of positions, or any function of time giving a Pose or a position; or Rigid: a
    free body, which the simulation moves by the forces on it.
    """

    skeleton: tuple[Primitive, ...]
    gravity: Kernel | None = None
    mass: float = 1.0
    G: float = 1.0
    surface: Material | None = None
    motion: Motion = IDENTITY
    name: str = ""

    if TYPE_CHECKING:

        def __init__(
            self,
            skeleton: Primitive | Iterable[Primitive],
            gravity: Kernel | None = ...,
            mass: Timed[RealLike] = ...,
            G: RealLike = ...,
            surface: Material | None = ...,
            motion: MotionLike = ...,
            name: str = ...,
        ) -> None: ...

    def __post_init__(self):
        object.__setattr__(self, "skeleton", skeleton("Body", self.skeleton))
        validate.text("Body", "name", self.name)
        validate.instance("Body", "gravity", self.gravity, Kernel | None, KERNEL)
        validate.instance("Body", "surface", self.surface, Material | None, "give a fs.Material, or None")
        validate.fields(self, validate.number, *(("G",) if callable(self.mass) else ("mass", "G")))
        if self.gravity is None and self.surface is not None and self.surface.level is not None:
            raise InputError("Body: its surface is an equipotential of its gravity, but it has none; give gravity=")
        if not callable(self.motion):
            object.__setattr__(self, "motion", self.pose_at(0.0))
        if self.gravity is not None:
            self.gravity_field()
        if self.free and self.deforming:
            raise InputError("Body: a free body's skeleton, mass and material are constant; give another motion")

    @property
    def label(self) -> str:
        """What messages call the body."""
        return f"Body {self.name!r}" if self.name else "Body"

    def pose_at(self, time: RealLike) -> Pose:
        """The pose that the body's motion gives at `time`; that of a free body's start."""
        return pose_at(self.motion, time, self.label)

    @property
    def free(self) -> bool:
        """Whether forces move the body."""
        return isinstance(self.motion, Rigid)

    @property
    def moving(self) -> bool:
        """Whether the pose changes with time."""
        return self.free or callable(self.motion)

    @property
    def deforming(self) -> bool:
        """Whether the skeleton, the mass or the material is a function of time."""
        material = self.surface is not None and self.surface.animated
        return material or callable(self.mass) or any(p.animated for p in self.skeleton)

    def gravity_field(self) -> Field | None:
        """The gravitational field in the body's frame (maybe animated), or None."""
        if self.gravity is None:
            return None
        return spread("Body", self.skeleton, self.mass, self.G, self.gravity)

    def gravity_elements(self, time: RealLike) -> Elements:
        """Packed gravity elements at `time`, in the body's frame."""
        time = validate.number(self.label, "time", time)
        return self._pack_gravity(time) if self.deforming else self._fixed_gravity

    def surface_elements(self, time: RealLike) -> Elements:
        """Packed surface elements at `time`, in the body's frame, scaled so that the surface is F = 1."""
        time = validate.number(self.label, "time", time)
        return self._pack_surface(time) if self.deforming else self._fixed_surface

    def surface_field(self, time: RealLike = 0.0) -> Field:
        """The field whose level 1 is the body's surface at `time`, in the body's frame."""
        if self.surface is None:
            raise InputError(f"Body {self.name or repr(self.skeleton)}: it has no surface; give it a fs.Material")
        return Field.of_elements(self.surface_elements(time))

    def surface_mesh(
        self, time: RealLike = 0.0, *, resolution: WholeLike | None = None, tolerance: RealLike | None = None
    ) -> TriangleMesh:
        """The surface at `time`, alone and in the body's frame, as a closed `TriangleMesh`; see `Field.mesh`."""
        time = validate.number(self.label, "time", time)
        return self.surface_field(time).mesh(1.0, resolution=resolution, tolerance=tolerance)

    @functools.cached_property
    def _fixed_gravity(self):
        return self._pack_gravity(0.0)

    @functools.cached_property
    def _fixed_surface(self):
        return self._pack_surface(0.0)

    def _pack_gravity(self, time):
        field = self.gravity_field()
        return concatenate([]) if field is None else field.at(time).elements

    def _pack_surface(self, time):
        if self.surface is None:
            return concatenate([])
        material = self.surface.at(time)
        if material.level is not None:
            elements = self._pack_gravity(time)
            elements.rows[:, STRENGTH] /= material.level
            return elements
        primitives = [primitive.at(time) for primitive in self.skeleton]
        strengths, folds = zip(*(material.strength_on(p) for p in primitives), strict=True)
        return pack(primitives, [material.surface_kernel] * len(primitives), strengths, folds)
