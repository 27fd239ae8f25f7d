"""Energies of a MuJoCo model in a field."""

import dataclasses

import mujoco


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
