"""The model's numbers that tables were made of, watched: whether one of them was changed since."""

import ctypes

import mujoco
import numpy as np

from fieldsim.errors import FieldsimError
from fieldsim.mujoco import layout

MASSES = ("body_mass", "body_inertia")
SHAPES = ("body_ipos", "body_iquat", "geom_type", "geom_size", "geom_pos", "geom_quat", "geom_dataid")
TOUCHING = ("geom_contype", "geom_conaffinity")
# Too long to be looked at in every stage of a step.
LONG = ("mesh_vert",)


class Watch:
    """Arrays of a model, with copies of what they were when it was made or last renewed.

    rows (n, 3), int64: the address of each array and of its copy, and their bytes: for native code, all but LONG ones.
    """

    def __init__(self, model, names, timestep: bool):
        short = [getattr(model, name) for name in names if name not in LONG]
        if timestep:
            short.append(_timestep(model))
        # Of a model without geoms, say, some are empty.
        self._short = [(array, array.copy()) for array in short if array.size]
        self._long = [(getattr(model, name), getattr(model, name).copy()) for name in names if name in LONG]
        rows = [(array.ctypes.data, copy.ctypes.data, array.nbytes) for array, copy in self._short]
        self.rows = np.array(rows, dtype=np.int64).reshape(-1, 3)

    def changed(self, thorough: bool = True) -> bool:
        """Whether a number is another now; thorough: look at long arrays, too."""
        return any(array.tobytes() != copy.tobytes() for array, copy in self._short + thorough * self._long)

    def renew(self) -> None:
        """Take what the numbers are now."""
        for array, copy in self._short + self._long:
            copy[...] = array


def names_of(accuracy: str, contact: bool) -> tuple[str, ...]:
    """What tables are made of: which bodies have mass; the points of the mass; what touches."""
    names = MASSES[:1] if accuracy == "torque" and not contact else MASSES
    if accuracy == "geoms" or contact:
        names += SHAPES + LONG
    return names + TOUCHING if contact else names


def _timestep(model) -> np.ndarray:
    """The model's time step (1,), where MuJoCo keeps it."""
    places = layout.places_of("mjOption", ("timestep", "gravity"))
    address = model.opt.gravity.ctypes.data - places["gravity"] + places["timestep"]
    found = np.frombuffer(ctypes.c_double.from_address(address), dtype=np.float64)
    if found[0] != model.opt.timestep:
        raise FieldsimError(f"MuJoCo {mujoco.__version__} keeps opt.timestep elsewhere than it says; use contact=None")
    return found
