"""MuJoCo models in fields: forces, contact, planets as geoms, many worlds, films. Loaded when first asked for."""

from fieldsim.mujoco.contact.geoms import Contact
from fieldsim.mujoco.energy import ModelEnergy
from fieldsim.mujoco.experiment import Experiment
from fieldsim.mujoco.forces import FieldForces
from fieldsim.mujoco.rollouts import rollout, state_of, state_size
from fieldsim.mujoco.scene.planet import PlanetGeom, follow, planet_geom
from fieldsim.mujoco.scene.scene import Scene
from fieldsim.mujoco.scene.skins import Skin, skin

__all__ = [
    "Contact",
    "Experiment",
    "FieldForces",
    "ModelEnergy",
    "PlanetGeom",
    "Scene",
    "Skin",
    "follow",
    "planet_geom",
    "rollout",
    "skin",
    "state_of",
    "state_size",
]
