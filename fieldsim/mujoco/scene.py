"""A MuJoCo model in the picture: a world together with a model's geoms and skins."""

import copy
import dataclasses

import numpy as np

from fieldsim.errors import InputError
from fieldsim.mujoco.geoms import material_of, shape_of
from fieldsim.mujoco.models import model_of, seen_geoms
from fieldsim.mujoco.planet import PlanetGeom
from fieldsim.mujoco.skins import Skin
from fieldsim.world import quaternion
from fieldsim.world.world import Snapshot, World


@dataclasses.dataclass(frozen=True, eq=False)
class ModelSnapshot(Snapshot):
    """A moment that knows the model's state, too: the model's own time, positions and those of mocap bodies."""

    state: tuple[float, np.ndarray, np.ndarray, np.ndarray] | None = None


class Scene:
    """A world and a MuJoCo model in one picture, for a loop of your own around `mujoco.mj_step`.

        scene = fs.mujoco.Scene(world, model, skins=[fs.mujoco.skin(model, "torso")])
        picture = renderer.frame(scene.snapshot(data), camera)

    Geoms of groups 0 to 2 are drawn as hard shapes in their colours; those that a skin stands for as it is, and the
    geoms of `planets` (PlanetGeoms) not at all, for their bodies in the world are. Tendons, sites and flexible bodies
    are not drawn. world: what a snapshot is of: the given world's bodies, particles, shapes, and these.
    """

    def __init__(self, world: World, model, *, skins=(), planets=()):
        self.model = model_of(model)
        self.skins = _all("skins", skins, Skin, "fs.mujoco.skin(model)")
        self.planets = _all("planets", planets, PlanetGeom, "fs.mujoco.planet_geom(body)")
        self.given = world
        stood_for = {geom for skin in self.skins for geom in skin.geoms}
        stood_for |= {g for g in range(self.model.ngeom) if self.model.geom(g).name in {p.name for p in self.planets}}
        shapes = {g: shape_of(self.model, g) for g in seen_geoms(self.model) if g not in stood_for}
        self.geoms = [geom for geom, shape in shapes.items() if shape is not None]
        self.world = copy.copy(world)
        self.world.bodies = [*world.bodies, *(body for skin in self.skins for body in skin.bodies)]
        self.world.particles, self.world.shapes = list(world.particles), list(world.shapes)
        if self.geoms:
            materials = [material_of(self.model, geom) for geom in self.geoms]
            self.world.add_shape([shapes[g] for g in self.geoms], materials, name="MuJoCo")

    def snapshot(self, data, base: Snapshot | None = None) -> ModelSnapshot:
        """The moment of an MjData whose kinematics are up to date (mujoco.mj_kinematics after a step).

        base: a snapshot of the given world, for all but the model; unless told that world at data.time.
        """
        base = base or self.given.at(data.time)
        poses = base.poses + tuple(pose for skin in self.skins for pose in skin.poses(data))
        shapes = base.shape_poses or tuple(group.poses_at(base.time) for group in self.given.shapes)
        if self.geoms:
            owners = self.model.geom_bodyid[self.geoms]
            turns = quaternion.product(data.xquat[owners], self.model.geom_quat[self.geoms])
            shapes += ((data.geom_xpos[self.geoms], turns),)
        state = data.time, data.qpos.copy(), data.mocap_pos.copy(), data.mocap_quat.copy()
        return ModelSnapshot(self.world, base.time, poses, base.positions, base.velocities, shapes or None, state)


def _all(name, value, kind, remedy):
    """A tuple of one or several."""
    values = (value,) if isinstance(value, kind) else tuple(value)
    for index, one in enumerate(values):
        if not isinstance(one, kind):
            raise InputError(f"{name}[{index}] is {one!r}; give {remedy}")
    return values
