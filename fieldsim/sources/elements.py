"""What acts: the elements of a world's bodies in one role, over time.

Bodies that neither move nor deform share one table of rows for all times; the rows of the others are computed for
every moment asked for, on the host. All rows are in the world's frame, so kernels know nothing of bodies and poses.
"""

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials.elements import Elements, concatenate, place
from fieldsim.potentials.row import ROW_WIDTH
from fieldsim.sources.poses import body_poses

ROLES = {
    "gravity": lambda body, time: body.gravity_elements(time),
    "surface": lambda body, time: body.surface_elements(time),
}


class Sources:
    """What a world's bodies contribute in one role ("gravity" or "surface").

    free: function (index of a free body, times) -> its rotation matrices (stages, 3, 3) and positions (stages, 3),
    default where they start. prescribed: leave the free bodies out.
    """

    def __init__(self, world, role: str, time: float, free=None, *, prescribed: bool = False):
        self._elements = ROLES[role]
        self._free = free
        bodies = [(index, body) for index, body in enumerate(world.bodies) if not (prescribed and body.free)]
        self._changing = [
            (index, body)
            for index, body in bodies
            if (body.moving or body.deforming) and len(self._elements(body, time))
        ]
        still = [body for _, body in bodies if not (body.moving or body.deforming)]
        self.fixed = concatenate(self._placed(body, time) for body in still).grouped()[0]
        shapes = [self._elements(body, time) for _, body in self._changing]
        self.moving_kinds = concatenate(shapes).kinds
        self._shapes = shapes

    @property
    def kinds_used(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """The formulas of the still and of the changing elements: the key under which code is compiled."""
        return self.fixed.kinds_used, tuple(np.unique(self.moving_kinds).tolist())

    @property
    def moving(self) -> bool:
        """Whether some element moves or deforms."""
        return len(self.moving_kinds) > 0

    def __len__(self) -> int:
        return len(self.fixed) + len(self.moving_kinds)

    def rows_at(self, times: np.ndarray) -> np.ndarray:
        """Rows of the changing elements, (stages, elements, WIDTH)."""
        parts = [
            _rows_of(index, body, shape, self._elements, times, self.poses_of)
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

    def _placed(self, body, time):
        local = self._elements(body, time)
        pose = body.pose_at(time)
        return Elements(place(local.rows, pose.matrix, np.array(pose.position)), local.kinds, local.order)


def _rows_of(index, body, shape, elements, times, poses_of):
    """Rows (stages, elements, WIDTH) of one moving or deforming body."""
    try:
        if body.deforming:
            local = np.stack([elements(body, time).rows for time in times])
        else:
            local = np.broadcast_to(shape.rows, (len(times), *shape.rows.shape))
        rotations, positions = poses_of(index, body, times)
        return place(local, rotations[:, None], positions[:, None])
    except InputError as reason:
        name = f" ({body.name})" if body.name else ""
        raise InputError(f"Body {index}{name}, between times {min(times):g} and {max(times):g}: {reason}") from None
