"""MuJoCo models in fields: forces, contact, planets as geoms, many worlds. Loaded when first asked for."""

from fieldsim.mujoco.balls import Contact
from fieldsim.mujoco.energy import ModelEnergy
from fieldsim.mujoco.forces import FieldForces

__all__ = ["Contact", "FieldForces", "ModelEnergy"]
