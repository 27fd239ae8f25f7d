"""Hard shapes packed into arrays, in one frame."""

import dataclasses
import weakref

import numpy as np

from fieldsim.world.color import color_rgb
from fieldsim.world.material import Material
from fieldsim.world.motion import Pose
from fieldsim.world.shapes import SIZES, SLAB, Ground, ShapeGroup, TriangleSurface, checked_poses
from fieldsim.world.snapshot import Snapshot


@dataclasses.dataclass(frozen=True, eq=False)
class Solids:
    """N hard shapes in one frame.

    kinds (N,); origins (N, 3) and axes (N, 3, 3), in columns; sizes (N, SIZES): what each kind needs; checkers (N, 3):
    linear rgb of the second colour; surfaces: the TriangleSurface, or None, of each; materials; owner (N,): the index
    in `materials` of each; poses: of the body that each material is of, which its solid texture follows, None: each
    shape carries its own.
    """

    kinds: np.ndarray
    origins: np.ndarray
    axes: np.ndarray
    sizes: np.ndarray
    checkers: np.ndarray
    surfaces: tuple[TriangleSurface | None, ...]
    materials: tuple[Material, ...]
    owner: np.ndarray
    poses: tuple[Pose | None, ...]

    def __len__(self) -> int:
        return len(self.kinds)

    @property
    def lengths(self) -> np.ndarray:
        """A length of each that says how large it is, (N,); 1 for planes."""
        return np.where(self.kinds == SLAB, 1.0, self.sizes[:, 0])

    def placed(self, positions: np.ndarray, rotations: np.ndarray) -> "Solids":
        """Moved by x -> rotations x + positions; positions (N, 3), rotations (N, 3, 3) (or what broadcasts)."""
        origins = np.einsum("...ij,...j->...i", rotations, self.origins) + positions
        return dataclasses.replace(self, origins=origins, axes=rotations @ self.axes)


def joined(parts) -> Solids:
    """Several `Solids` as one."""
    parts = list(parts)
    if not parts:
        none = np.zeros(0, dtype=np.int32)
        return Solids(
            none, np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, SIZES)), np.zeros((0, 3)), (), (), none, ()
        )
    arrays = {n: np.concatenate([getattr(p, n) for p in parts]) for n in ("kinds", "origins", "axes", "sizes")}
    firsts = np.cumsum([0] + [len(p.materials) for p in parts])
    return Solids(
        **arrays,
        checkers=np.concatenate([p.checkers for p in parts]),
        surfaces=sum((p.surfaces for p in parts), ()),
        materials=sum((p.materials for p in parts), ()),
        owner=np.concatenate([p.owner + first for p, first in zip(parts, firsts, strict=False)]).astype(np.int32),
        poses=sum((p.poses for p in parts), ()),
    )


_SOLIDS: weakref.WeakKeyDictionary[Snapshot, Solids] = weakref.WeakKeyDictionary()
_GROUPS: weakref.WeakKeyDictionary[ShapeGroup, Solids] = weakref.WeakKeyDictionary()


def solids_of(snapshot: Snapshot) -> Solids:
    """All hard shapes of a moment in the world's frame. Made once for a snapshot."""
    if snapshot not in _SOLIDS:
        groups, time = snapshot.world.shapes, snapshot.time
        if snapshot.shape_poses is None:
            poses = [group.poses_at(time) for group in groups]
        else:
            poses = [
                checked_poses("Snapshot", f"shape_poses[{index}]", pair, len(group.shapes))
                for index, (group, pair) in enumerate(zip(groups, snapshot.shape_poses, strict=True))
            ]
        parts = (_group_at(group, time).placed(*pose) for group, pose in zip(groups, poses, strict=True))
        _SOLIDS[snapshot] = joined(parts)
    return _SOLIDS[snapshot]


def _group_at(group, time):
    """The shapes of a group in their own frames, with their materials at `time`."""
    if group not in _GROUPS:
        _GROUPS[group] = _packed(group)
    return dataclasses.replace(_GROUPS[group], materials=tuple(material.at(time) for material in group.materials))


def _packed(group):
    count = len(group.shapes)
    frames = [shape.frame for shape in group.shapes]
    sizes = np.zeros((count, SIZES))
    checkers = np.zeros((count, 3))
    for index, shape in enumerate(group.shapes):
        sizes[index, : len(shape.sizes)] = shape.sizes
        if isinstance(shape, Ground) and shape.checker is not None:
            checkers[index] = color_rgb("Ground", shape.checker)
    return Solids(
        np.array([shape.kind for shape in group.shapes], dtype=np.int32),
        np.array([origin for origin, _ in frames]).reshape(-1, 3),
        np.array([axes for _, axes in frames]).reshape(-1, 3, 3),
        sizes,
        checkers,
        tuple(shape if isinstance(shape, TriangleSurface) else None for shape in group.shapes),
        group.materials,
        np.arange(count, dtype=np.int32) % len(group.materials),
        (None,) * len(group.materials),
    )
