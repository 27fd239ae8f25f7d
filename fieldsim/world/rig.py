"""Rigs: hierarchies of bones that carry pieces of a skeleton (forward kinematics)."""

import dataclasses
import functools
from collections.abc import Iterable
from typing import TYPE_CHECKING

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.types import RealLike
from fieldsim.world.motion import IDENTITY, Motion, MotionLike, Pose, pose_at


@dataclasses.dataclass(frozen=True)
class Bone:
    """One frame of a rig, fixed to its parent's frame by a joint.

    parent: the name of another bone, or None: the body's own frame. joint: the Pose of the joint in the parent's frame.
    motion: how the bone moves about the joint: a Pose, Keyframes of poses, a Spin, or any function of time for one.
    """

    name: str
    parent: str | None = None
    joint: Pose = IDENTITY
    motion: Motion = IDENTITY

    if TYPE_CHECKING:

        def __init__(
            self,
            name: str,
            parent: str | None = ...,
            joint: Pose = ...,
            motion: MotionLike = ...,
        ) -> None: ...

    def __post_init__(self):
        validate.fields(self, validate.text, "name")
        validate.optional(validate.text, "Bone", "parent", self.parent)
        validate.instance("Bone", "joint", self.joint, Pose, "give a fs.Pose")
        if not callable(self.motion):
            object.__setattr__(self, "motion", pose_at(self.motion, 0.0, f"Bone {self.name!r}"))


class Rig:
    """Bones, each after its parent, and the pieces of skeleton that they carry.

        rig = fs.Rig([fs.Bone("thigh", motion=swing), fs.Bone("shin", "thigh", fs.Pose((0, 0, -1)), motion=bend)])
        leg = fs.Body([rig.carry("thigh", fs.Segment((0, 0, 0), (0, 0, -1))), ...], surface=skin)

    Raises InputError for a bone whose name is taken, or whose parent does not come before it.
    """

    def __init__(self, bones: Iterable[Bone]):
        self.bones: dict[str, Bone] = {}
        for bone in validate.instances("Rig", "bones", bones, Bone, "give fs.Bone(name, parent, joint, motion)"):
            if bone.name in self.bones:
                raise InputError(f"Rig: two bones are called {bone.name!r}; give each a name of its own")
            if bone.parent is not None and bone.parent not in self.bones:
                raise InputError(f"Rig: bone {bone.name!r} hangs on {bone.parent!r}, which is {self._missing()}")
            self.bones[bone.name] = bone
        self._time: float | None = None
        self._poses: dict[str, Pose] = {}

    def _missing(self):
        return "not among the bones before it: " + (", ".join(self.bones) or "there are none")

    def pose(self, name: str, time: RealLike) -> Pose:
        """The pose of a bone's frame in the body's frame at `time`."""
        time = validate.number("Rig.pose", "time", time)
        if not isinstance(name, str) or name not in self.bones:
            raise InputError(f"Rig: no bone is called {validate.shown(name)}; there are {', '.join(self.bones)}")
        if time != self._time:
            self._time, self._poses = time, {}
        if name not in self._poses:
            bone = self.bones[name]
            pose = bone.joint @ pose_at(bone.motion, time, f"Bone {name!r}")
            self._poses[name] = pose if bone.parent is None else self.pose(bone.parent, time) @ pose
        return self._poses[name]

    def carry(self, name: str, primitive: Primitive) -> Primitive:
        """`primitive`, given in the frame of a bone, as an animated primitive in the body's frame."""
        self.pose(name, 0.0)
        remedy = "give one such as fs.Segment, in the bone's frame"
        validate.instance("Rig.carry", "primitive", primitive, Primitive, remedy)
        fields = {
            key: functools.partial(_moved, self, name, primitive, key)
            for key in (*primitive.points, *primitive.directions)
        }
        return dataclasses.replace(primitive, **fields)


def _moved(rig, name, primitive, key, time):
    """The field `key` of a primitive, moved along with a bone where it is a point, turned where a direction."""
    owner = type(primitive).__name__
    vector = functools.partial(validate.vector, owner, key)
    own = validate.at_time(owner, lambda **v: vector(v[key]), {key: getattr(primitive, key)}, time)
    pose = rig.pose(name, time)
    return tuple((pose.apply(own) if key in primitive.points else pose.matrix @ own).tolist())
