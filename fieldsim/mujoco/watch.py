"""Detects changes of the model's numbers from which tables were made."""

import ctypes

import numpy as np

from fieldsim.mujoco.callback import layout
from fieldsim.mujoco.callback.rows import OWN, WATCHED_WIDTH

MASSES = ("body_mass", "body_inertia")
SHAPES = ("body_ipos", "body_iquat", "geom_type", "geom_size", "geom_pos", "geom_quat", "geom_dataid")
TOUCHING = ("geom_contype", "geom_conaffinity", "flex_contype", "flex_conaffinity", "flex_radius", "flex_vert")
# Too long to be compared at every stage of a step.
LONG = ("mesh_vert",)


class Watch:
    """Arrays of a model, with copies of what they were when it was made.

    rows (n, WATCHED_WIDTH), int64, of all but LONG ones: see `mujoco.callback.rows`.
    """

    def __init__(self, model, accuracy: str, contact: bool):
        shapes = accuracy == "geoms" or contact
        names = MASSES + SHAPES * shapes + TOUCHING * contact
        places = layout.places_of("mjModel", names)
        self._model, self._timestep = model, model.opt.timestep if contact else None
        # Of a model without geoms, say, some are empty.
        self._short = [(getattr(model, name), getattr(model, name).copy(), places[name]) for name in names]
        self._short = [watched for watched in self._short if watched[0].size]
        self._long = [(getattr(model, name), getattr(model, name).copy()) for name in LONG * shapes]
        rows = [(place, copy.ctypes.data, copy.nbytes, not shapes) for _, copy, place in self._short]
        self.rows = np.array(rows, dtype=np.int64).reshape(-1, WATCHED_WIDTH)

    def changed(self, thorough: bool = True) -> bool:
        """Whether a number is another now; thorough: look at long arrays, and the time step, too."""
        if thorough and self._timestep not in (None, self._model.opt.timestep):
            return True
        watched = self._short + thorough * self._long
        return any(array.tobytes() != copy.tobytes() for array, copy, *_ in watched)

    def differs(self, model: int) -> bool:
        """Whether the model at an address, a copy, has other numbers than the tables were made of."""
        return any(
            ctypes.string_at(ctypes.c_void_p.from_address(model + place), copy.nbytes) != copy.tobytes()
            for (_, copy, place), row in zip(self._short, self.rows, strict=True)
            if not row[OWN]
        )
