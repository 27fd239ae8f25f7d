"""MuJoCo's own pictures, from the same camera, for comparison."""

import copy
import math

import mujoco
import numpy as np

from fieldsim.errors import FieldsimError, InputError
from fieldsim.mujoco.scene.scene import LOOKS, ModelSnapshot
from fieldsim.render.camera import Camera

NEAR, FAR = 0.01, 1000.0
FRAMES = tuple(f"{of}_{what}" for of in ("body", "geom", "site") for what in ("pos", "quat"))


class MujocoRenderer:
    """MuJoCo's own renderer as a drawer of frames: of the model alone, without what only the world holds.

    size: (width, height). Colours, sizes and frames that are changed in the model are seen. Raises FieldsimError where
    there is no OpenGL context for it.
    """

    def __init__(self, model, size):
        self._given, self.model = model, copy.copy(model)
        width, height = size
        self.model.vis.global_.offwidth, self.model.vis.global_.offheight = width, height
        try:
            self._renderer = mujoco.Renderer(self.model, height, width)
        except Exception as reason:
            raise FieldsimError(
                f"MuJoCo's own renderer finds no OpenGL context here ({reason}); set the environment variable "
                "MUJOCO_GL=egl or osmesa where one of them is installed, or leave --beside out"
            ) from None
        self._data = mujoco.MjData(self.model)

    def frame(self, snapshot: ModelSnapshot, camera: Camera) -> np.ndarray:
        """MuJoCo's picture of the model, (height, width, 3) uint8, seen as by `camera`."""
        state = getattr(snapshot, "state", None)
        if state is None:
            raise InputError("MuJoCo's own picture needs a snapshot of a run, not of a recording")
        data = self._data
        for name in (*LOOKS, *FRAMES):
            getattr(self.model, name)[:] = getattr(self._given, name)
        data.time, data.qpos[:], data.mocap_pos[:], data.mocap_quat[:] = state
        mujoco.mj_fwdPosition(self.model, data)
        self._renderer.update_scene(data)
        self._look(camera.at(snapshot.time))
        return self._renderer.render().copy()

    def _look(self, camera):
        _, up, forward = camera.axes()
        top = NEAR * math.tan(math.radians(camera.fov) / 2)
        for eye in self._renderer.scene.camera:
            eye.pos, eye.up, eye.forward = camera.eye, up, forward
            eye.frustum_center, eye.frustum_width, eye.frustum_near, eye.frustum_far = 0.0, 0.0, NEAR, FAR
            eye.frustum_bottom, eye.frustum_top = -top, top
