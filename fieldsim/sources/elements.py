"""What acts: the elements of a world's bodies in one role, over time.

Bodies that neither move nor deform share one table of rows for all times; the rows of the others are computed for
every moment asked for, on the host. All rows are in the world's frame, so kernels know nothing of bodies and poses.
"""

import dataclasses
import weakref

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials.elements import Elements, concatenate, place, with_strengths
from fieldsim.potentials.row import ROW_WIDTH
from fieldsim.sources.poses import body_poses
from fieldsim.world.body import Body
from fieldsim.world.material import Material
from fieldsim.world.motion import Pose
from fieldsim.world.snapshot import Snapshot, WorldValue


def elements_of(body: Body, role: str, time: float) -> Elements:
    """A body's elements in one role, "gravity" or "surface", in its own frame; none where it has none."""
    return body.gravity_elements(time) if role == "gravity" else body.surface_elements(time)


@dataclasses.dataclass(frozen=True, eq=False)
class Acting:
    """What of a world acts in one role, whatever the time.

    fixed: the elements of the bodies that stay as they are, in the world's frame, grouped by formula. changing: the
    other bodies, each with its index in the world.
    """

    fixed: Elements
    changing: tuple[tuple[int, Body], ...]


_ACTING: weakref.WeakKeyDictionary[WorldValue, dict[str, Acting]] = weakref.WeakKeyDictionary()


def acting(world: WorldValue, role: str) -> Acting:
    """What of a world acts in one role. Made once for a world's frozen value, and kept as long as that lives."""
    known = _ACTING.setdefault(world.frozen(), {})
    if role not in known:
        still = [body for body in world.bodies if not (body.moving or body.deforming)]
        poses = [body.pose_at(0.0) for body in still]
        placed = [
            elements_of(body, role, 0.0).placed(pose.matrix, pose.position)
            for body, pose in zip(still, poses, strict=True)
        ]
        changing = tuple((k, body) for k, body in enumerate(world.bodies) if body.moving or body.deforming)
        known[role] = Acting(concatenate(placed).grouped()[0], changing)
    return known[role]


class Sources:
    """What a world's bodies contribute in one role ("gravity" or "surface").

    free: function (index of a free body, times) -> its rotation matrices (stages, 3, 3) and positions (stages, 3),
    default where they start. prescribed: leave the free bodies out.
    """

    def __init__(self, world: WorldValue, role: str, time: float, free=None, *, prescribed: bool = False):
        self._role, self._free = role, free
        known = acting(world, role)
        self.fixed = known.fixed
        changing = [(k, body) for k, body in known.changing if not (prescribed and body.free)]
        shapes = [elements_of(body, role, time) for _, body in changing]
        self._changing = [one for one, shape in zip(changing, shapes, strict=True) if len(shape)]
        self._shapes = [shape for shape in shapes if len(shape)]
        self.moving_kinds = concatenate(self._shapes).kinds

    @property
    def kinds_used(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The formulas of the still and of the changing elements: the key under which code is compiled."""
        return self.fixed.kinds_used, tuple(np.unique(self.moving_kinds).tolist())

    @property
    def moving(self) -> bool:
        """Whether some element moves or deforms."""
        return len(self.moving_kinds) > 0

    @property
    def deforming(self) -> np.ndarray:
        """Whether the body of each changing element deforms, (elements,)."""
        pairs = zip(self._changing, self._shapes, strict=True)
        return np.concatenate([np.zeros(0, dtype=bool), *(np.full(len(s), b.deforming) for (_, b), s in pairs)])

    def __len__(self) -> int:
        return len(self.fixed) + len(self.moving_kinds)

    @property
    def changing(self) -> list[tuple[Body, int]]:
        """The bodies that move or deform, each with how many of the changing elements are its."""
        return [(body, len(shape)) for (_, body), shape in zip(self._changing, self._shapes, strict=True)]

    def rows_at(self, times: np.ndarray) -> np.ndarray:
        """Rows of the changing elements, (stages, elements, ROW_WIDTH)."""
        parts = [
            _rows_of(index, body, shape, self._role, times, self.poses_of)
            for (index, body), shape in zip(self._changing, self._shapes, strict=True)
        ]
        return np.concatenate(parts, axis=1) if parts else np.zeros((len(times), 0, ROW_WIDTH))

    def poses_of(self, index, body, times) -> tuple[np.ndarray, np.ndarray]:
        """Rotation matrices (stages, 3, 3) and positions (stages, 3) of a body at the given times."""
        return self._free(index, times) if body.free and self._free else body_poses(body, times)

    def poses_at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (stages, elements, 3, 3) and positions (stages, elements, 3) of the changing elements' bodies."""
        rotations, positions = [np.zeros((len(times), 0, 3, 3))], [np.zeros((len(times), 0, 3))]
        for (index, body), shape in zip(self._changing, self._shapes, strict=True):
            turned, moved = self.poses_of(index, body, times)
            rotations.append(np.repeat(turned[:, None], len(shape), axis=1))
            positions.append(np.repeat(moved[:, None], len(shape), axis=1))
        return np.concatenate(rotations, axis=1), np.concatenate(positions, axis=1)


def _rows_of(index, body, shape, role, times, poses_of):
    """Rows (stages, elements, ROW_WIDTH) of one moving or deforming body."""
    try:
        if body.deforming:
            local = _shapes_of(body, shape, role, times)
        else:
            local = np.broadcast_to(shape.rows, (len(times), *shape.rows.shape))
        rotations, positions = poses_of(index, body, times)
        return place(local, rotations[:, None], positions[:, None])
    except InputError as reason:
        name = f" ({body.name})" if body.name else ""
        raise InputError(f"Body {index}{name}, between times {min(times):g} and {max(times):g}: {reason}") from None


def _shapes_of(body, shape, role, times):
    """Rows (stages, elements, ROW_WIDTH) of a deforming body in its own frame."""
    if role != "gravity" or any(primitive.animated for primitive in body.skeleton):
        return np.stack([elements_of(body, role, time).rows for time in times])
    # The mass alone changes, which is spread evenly: all elements have one strength, and what else they are stays.
    term = body.gravity_field().terms[0]
    return with_strengths(shape.rows, np.array([term.strength_at(time) for time in times]))


@dataclasses.dataclass(frozen=True, eq=False)
class Surface:
    """Surface elements in the world's frame, grouped by formula; owner: each one's material and pose, (N,)."""

    elements: Elements
    owner: np.ndarray
    materials: tuple[Material, ...]
    poses: tuple[Pose, ...]


_SURFACES: weakref.WeakKeyDictionary[Snapshot, Surface] = weakref.WeakKeyDictionary()


def surface_of(snapshot: Snapshot) -> Surface:
    """All bodies' surfaces at a moment; the surface is where the sum of the elements is 1. Made once for a snapshot."""
    if snapshot not in _SURFACES:
        _SURFACES[snapshot] = _packed_surface(snapshot)
    return _SURFACES[snapshot]


def _packed_surface(snapshot):
    pairs = zip(snapshot.world.bodies, snapshot.poses, strict=True)
    seen = [(body, pose) for body, pose in pairs if body.surface is not None]
    parts = [elements_of(body, "surface", snapshot.time) for body, _ in seen]
    owners = np.repeat(np.arange(len(parts), dtype=np.int32), np.array([len(part) for part in parts], dtype=int))
    placed = [
        part if pose.is_identity else part.placed(pose.matrix, pose.position)
        for part, (_, pose) in zip(parts, seen, strict=True)
    ]
    grouped, order = concatenate(placed).grouped()
    materials = tuple(body.surface.at(snapshot.time) for body, _ in seen)
    return Surface(grouped, owners[order], materials, tuple(pose for _, pose in seen))
