"""Adding the forces of a plan to MuJoCo's data: by native code, without Python's lock, or in Python, to debug."""

import functools

import mujoco
import numpy as np

from fieldsim.mujoco.callback import memory
from fieldsim.mujoco.callback.generalised_forces import actor
from fieldsim.mujoco.callback.rows import FOUND_WIDTH
from fieldsim.mujoco.callback.tables import Plan, Room, SourceTable, room_shapes

NOTHING = np.empty((0, FOUND_WIDTH))
NO_HEAD = np.empty((0, 3), dtype=np.int64)


class Evaluator:
    """Adds forces of plans in fields of these tables; head: what native code knows the present plan by."""

    def __init__(self, accuracy: str, touching: bool, native: bool, gravity: SourceTable, surface: SourceTable):
        self.gravity, self.surface = gravity, surface
        self._kind = accuracy, touching
        self._function = memory.acting(accuracy, touching) if native else None
        self._locked = memory.LOCKED(self._function.address) if self._function else None
        self.head = NO_HEAD

    @functools.cached_property
    def _act_in_python(self):
        return actor(*self._kind, False)

    @property
    def free_of_python(self) -> bool:
        """Whether native code alone can do it."""
        return self._function is not None and not (self.gravity.timed or self.surface.timed)

    @property
    def native(self) -> tuple[int, int]:
        """Addresses of the native function and of the head, for an entry; zeros where Python is needed."""
        if self._function is None or not self.free_of_python:
            return 0, 0
        return self._function.address, self.head.ctypes.data

    def take(self, model: mujoco.MjModel, plan: Plan) -> None:
        """Have a plan, and room to work in."""
        self.plan, self._sizes = plan, (model.nbody, model.nv)
        self._room = Room(*map(np.empty, room_shapes(plan, *self._sizes)))
        self.head = memory.head_of(plan) if self._function else NO_HEAD

    def add(self, model: int, data: int, found: np.ndarray = NOTHING, plan: Plan | None = None) -> None:
        """Add the forces of a plan, its own by default, to the data at an address; found: see `actor`."""
        now = memory.time_of(data)
        self.gravity.at(now)
        self.surface.at(now)
        if self._locked:
            head = self.head if plan is None else memory.head_of(plan)
            self._locked(head.ctypes.data, model, data, found.ctypes.data if len(found) else 0)
        else:
            views = memory.views_at(model, data, *self._sizes)
            self._act_in_python(plan or self.plan, views, self._room, found)

    def spoil(self, model: int, data: int) -> None:
        """Let the state at an address blow up."""
        memory.views_at(model, data, *self._sizes).qfrc_passive[:] = np.nan
