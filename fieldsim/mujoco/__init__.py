"""MuJoCo models in fields: forces, contact, planets as geoms, many worlds. Loaded when first asked for."""

from fieldsim.mujoco.balls import Contact
from fieldsim.mujoco.energy import ModelEnergy
from fieldsim.mujoco.forces import FieldForces
from fieldsim.mujoco.planet import PlanetGeom, follow, planet_geom
from fieldsim.mujoco.rollouts import rollout, state_of, state_size

__all__ = [
    "Contact",
    "FieldForces",
    "ModelEnergy",
    "PlanetGeom",
    "follow",
    "planet_geom",
    "rollout",
    "state_of",
    "state_size",
]
