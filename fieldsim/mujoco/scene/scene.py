"""A MuJoCo model in the picture: a world together with a model's geoms and skins."""

import dataclasses
import warnings
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from fieldsim import validate
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.mujoco.models import ModelLike, alike, listed, model_of, seen, seen_geoms
from fieldsim.mujoco.scene.geoms import material_of, shape_of
from fieldsim.mujoco.scene.planet import PlanetGeom
from fieldsim.mujoco.scene.skins import Skin
from fieldsim.mujoco.scene.undrawn import undrawn
from fieldsim.numerics import quaternion
from fieldsim.world.snapshot import Snapshot
from fieldsim.world.world import World, given_world

# What shapes and materials are made of.
LOOKS = (
    *("geom_type", "geom_size", "geom_rgba", "geom_matid", "geom_group", "geom_dataid"),
    *("site_type", "site_size", "site_rgba", "site_matid", "site_group"),
    *("mat_rgba", "mat_specular", "mat_shininess", "mat_reflectance", "mat_texid", "mat_texrepeat", "mat_texuniform"),
)


@dataclasses.dataclass(frozen=True, eq=False)
class ModelSnapshot(Snapshot):
    """A moment that knows the model's state, too: the model's own time, positions and those of mocap bodies."""

    state: tuple[float, np.ndarray, np.ndarray, np.ndarray] | None = None


class Scene:
    """A world and a MuJoCo model in one picture, for a loop of your own around `mujoco.mj_step`.

        scene = fs.mujoco.Scene(world, model, skins=[fs.mujoco.skin(model, "torso")])
        picture = renderer.frame(scene.snapshot(data), camera)

    Geoms and sites of groups 0 to 2 are drawn as hard shapes in their colours; geoms that a skin stands for as it is,
    and the geoms of `planets` (PlanetGeoms) not at all, for their bodies in the world are. What MuJoCo shows besides
    (height fields, tendons, flexible bodies, skins of its own, range finders, textures but checkers on planes) is not
    drawn; one FieldsimWarning names them. Lights and background are the world's, not the model's.
    world: what a snapshot is of: the given world's bodies, particles, shapes, and these.
    """

    def __init__(
        self,
        world: World,
        model: ModelLike,
        *,
        skins: Skin | Sequence[Skin] = (),
        planets: PlanetGeom | Sequence[PlanetGeom] = (),
    ):
        given_world("Scene", world)
        self.given = world
        self.model = model_of(model)
        self.skins = _all("skins", skins, Skin, "fs.mujoco.skin(model)")
        self.planets = _all("planets", planets, PlanetGeom, "fs.mujoco.planet_geom(body)")
        for index, one in enumerate(self.skins):
            one.refuse_other(self.model, f"Scene: skins[{index}]")
        self._left_out: list[str] = []
        self._compose()

    def _compose(self):
        """Make the world of what the model is now, and warn of what is left out."""
        self._looks = _looks_of(self.model), self.given.frozen()
        _, world = self._looks
        stood_for = {geom for skin in self.skins for geom in skin.geoms}
        stood_for |= {g for g in range(self.model.ngeom) if self.model.geom(g).name in {p.name for p in self.planets}}
        self.geoms, geoms = self._shapes([g for g in seen_geoms(self.model) if g not in stood_for], "geom")
        self.sites, sites = self._shapes(seen(self.model, "site"), "site")
        whole = world.replace(bodies=[*world.bodies, *(body for skin in self.skins for body in skin.bodies)])
        if geoms or sites:
            shapes, materials = zip(*geoms, *sites, strict=True)
            whole.add_shape(shapes, materials, name="MuJoCo")
        self.world = whole.frozen()
        self._tell_what_is_left_out()

    def _changed(self):
        looks, world = self._looks
        return world is not self.given.frozen() or looks != _looks_of(self.model)

    def _shapes(self, numbers, of):
        """The numbers of those that have a shape, and pairs of their shapes and materials."""
        shapes = {k: shape_of(self.model, k, of) for k in numbers}
        found = [k for k, shape in shapes.items() if shape is not None]
        return found, [(shapes[k], material_of(self.model, k, of)) for k in found]

    def _tell_what_is_left_out(self):
        before, left_out = self._left_out, undrawn(self.model, self.geoms)
        self._left_out = left_out
        if left_out and left_out != before:
            warnings.warn(
                f"Scene: of the model these are not drawn: {listed(left_out)}; add bodies or shapes to "
                "the world for what is to be seen, or see mujoco.Renderer (--beside) for MuJoCo's own picture",
                FieldsimWarning,
                stacklevel=4,
            )

    def snapshot(self, data: mujoco.MjData, base: Snapshot | None = None) -> ModelSnapshot:
        """The moment of an MjData whose kinematics are up to date (mujoco.mj_kinematics after a step).

        base: a snapshot of the given world, for all but the model; default that world at data.time.
        Sizes and colours are the model's as they are now, and the world has what it has now.
        Raises InputError for data of another model, or of a copy that looks otherwise, and for a state that is not
        finite.
        """
        alike(self.model, data, "Scene.snapshot")
        if not np.isfinite(data.xpos).all():
            raise InputError(
                "Scene.snapshot: the model's positions are not finite, for its motion blew up; give it a shorter "
                "timestep, or ask before"
            )
        if self._changed():
            self._compose()
        if data.model._address != self.model._address and _looks_of(data.model) != self._looks[0]:
            raise InputError(
                "Scene.snapshot: this data's model is a copy that looks otherwise, in sizes or colours, say; make a "
                "Scene of it"
            )
        if base is None:
            base = self.given.at(data.time)
        else:
            validate.instance("Scene.snapshot", "base", base, Snapshot, "give a fs.Snapshot of the world, or None")
        poses = base.poses + tuple(pose for skin in self.skins for pose in skin.poses(data))
        shapes = base.shape_poses or tuple(group.poses_at(base.time) for group in self.given.shapes)
        if self.geoms or self.sites:
            parts = [self._placed(data, "geom", self.geoms), self._placed(data, "site", self.sites)]
            places, turns = (np.concatenate(part) for part in zip(*parts, strict=True))
            shapes += ((places, turns),)
        state = data.time, data.qpos.copy(), data.mocap_pos.copy(), data.mocap_quat.copy()
        kept: dict[str, Any] = {field.name: getattr(base, field.name) for field in dataclasses.fields(Snapshot)}
        told: dict[str, Any] = {"world": self.world, "poses": poses, "shape_poses": shapes or None, "state": state}
        return ModelSnapshot(**kept | told)

    def _placed(self, data, of, numbers):
        """Positions (n, 3) and rotations (n, 4) of geoms or sites."""
        owners = getattr(self.model, f"{of}_bodyid")[numbers]
        turns = quaternion.product(data.xquat[owners], getattr(data.model, f"{of}_quat")[numbers])
        return getattr(data, f"{of}_xpos")[numbers], turns


def _looks_of(model):
    """The numbers of which shapes and materials are made."""
    return [getattr(model, name).tobytes() for name in LOOKS]


def _all(name, value, kind, remedy):
    """A tuple of one or several."""
    values = (value,) if isinstance(value, kind) else value
    return validate.instances("Scene", name, values, kind, f"give {remedy}")
