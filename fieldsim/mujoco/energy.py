"""Energies of a MuJoCo model in a field."""

import dataclasses

import mujoco
import numpy as np


@dataclasses.dataclass(frozen=True)
class ModelEnergy:
    """Energies of a model at one time, in its own units.

    kinetic; model: MuJoCo's own potential energy (springs, and its gravity where that is on); field: of the bodies in
    the fields; contact: of the contact potential. What MuJoCo's own contacts and constraints store is not known.
    """

    time: float
    kinetic: float
    model: float
    field: float
    contact: float

    @property
    def potential(self) -> float:
        """All that is not kinetic."""
        return self.model + self.field + self.contact

    @property
    def total(self) -> float:
        """The sum, which motion without loss keeps."""
        return self.kinetic + self.potential


def copy_state(model, source, target) -> None:
    """Bring `target`, another MjData of the model, to the state of `source`, without calling anyone's callback."""
    target.time = source.time
    target.qpos[:] = source.qpos
    target.qvel[:] = source.qvel
    target.mocap_pos[:] = source.mocap_pos
    target.mocap_quat[:] = source.mocap_quat
    mujoco.mj_fwdPosition(model, target)
    mujoco.mj_comVel(model, target)


def own_energies(model, data) -> tuple[float, float]:
    """MuJoCo's kinetic and potential energy of data that are up to date."""
    mujoco.mj_energyPos(model, data)
    mujoco.mj_energyVel(model, data)
    return float(data.energy[1]), float(data.energy[0])


def subtree_wrenches(data: mujoco.MjData, bodies: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Torque and force (nbody, 6) on each body and all that hangs on it, about the centre of mass of the whole tree.

    found (n, 6 or more): forces on `bodies` (n,) and torques about their centres of mass. World frame throughout.
    """
    model = data.model
    total = np.zeros((model.nbody, 6))
    arms = data.xipos[bodies] - data.subtree_com[model.body_rootid[bodies]]
    total[bodies, :3] = found[:, 3:6] + np.cross(arms, found[:, :3])
    total[bodies, 3:] = found[:, :3]
    for body in range(model.nbody - 1, 0, -1):
        total[model.body_parentid[body]] += total[body]
    return total
