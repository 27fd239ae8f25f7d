"""A model's sensors in a field: which of them MuJoCo misreads, and what they would read.

MuJoCo treats the field as a passive force, like a spring's, but its own gravity not: an accelerometer in free fall
reads 0. A field is gravity, too. So sensors of proper acceleration get the field's acceleration at their place
subtracted; sensors of the force and torque that hold a body get those of field and contact on the body's subtree
subtracted. In a uniform field the result is what MuJoCo reads in its own gravity.
"""

import warnings

import mujoco
import numpy as np

from fieldsim.errors import FieldsimWarning, InputError

Sensor = mujoco.mjtSensor
ACCELERATIONS = (Sensor.mjSENS_ACCELEROMETER, Sensor.mjSENS_FRAMELINACC)
WRENCHES = (Sensor.mjSENS_FORCE, Sensor.mjSENS_TORQUE)
CORRECTED = (*ACCELERATIONS, *WRENCHES, Sensor.mjSENS_E_POTENTIAL)
# Sensors that detect surfaces of geoms only; and sensors that may compute anything from MuJoCo's state.
TOUCHING = ("mjSENS_TOUCH", "mjSENS_CONTACT", "mjSENS_TACTILE", "mjSENS_RANGEFINDER")
OWN = (Sensor.mjSENS_USER, Sensor.mjSENS_PLUGIN)


def _type(model, sensor) -> Sensor:
    return Sensor(int(model.sensor_type[sensor]))


def _corrected(model) -> list[int]:
    """The sensors that `readings` corrects: not those that read the past."""
    past = getattr(model, "sensor_history", np.zeros((model.nsensor, 2)))[:, 0] > 0
    return [k for k in range(model.nsensor) if _type(model, k) in CORRECTED and not past[k]]


def _beyond(model, contact: bool) -> list[int]:
    """The sensors that are wrong in a field or at its surfaces, and that `readings` cannot correct."""
    touching = [getattr(Sensor, name) for name in TOUCHING if contact and hasattr(Sensor, name)]
    # The compensation of a field is no work of actuators, as that of MuJoCo's gravity may be.
    compensating = bool(model.body_gravcomp.any())
    by_actuators = [compensating and bool(one) for one in model.jnt_actgravcomp]
    late = model.sensor_needstage == mujoco.mjtStage.mjSTAGE_ACC
    kinds, known = [_type(model, k) for k in range(model.nsensor)], _corrected(model)
    return [
        k
        for k, kind in enumerate(kinds)
        if kind in touching
        or (kind == Sensor.mjSENS_JOINTACTFRC and by_actuators[model.sensor_objid[k]])
        or (kind in OWN and late[k])
        or (kind in CORRECTED and k not in known)
    ]


def warn(model, contact: bool) -> None:
    """Tell of the sensors whose values in data.sensordata do not count the field, or its surfaces, as they should."""
    corrected, beyond = _corrected(model), _beyond(model, contact)
    if not corrected and not beyond:
        return
    words = []
    if corrected:
        words.append(
            f"in data.sensordata {_names(model, corrected)} count the field as a push, or not at all; "
            "forces.readings() gives what they read with the field as gravity"
        )
    if beyond:
        words.append(f"{_names(model, beyond)} take no account of the field or its surfaces, and cannot be corrected")
    warnings.warn(f"FieldForces: {'; '.join(words)}", FieldsimWarning, stacklevel=3)


def _names(model, sensors):
    """Sensors by name, or number, and type."""
    return ", ".join(f"sensor {model.sensor(k).name or k!r} ({_kind(model, k)})" for k in sensors)


def _kind(model, sensor):
    return _type(model, sensor).name.removeprefix("mjSENS_").lower()


def readings(forces, data, now) -> np.ndarray:
    """What the sensors of a FieldForces' model read (nsensordata,), at the state of `data`; now: an MjData to work in.

    As `mujoco.mj_forward` would give, with the field as gravity, and surfaces as what pushes. Of a copy's data the
    copy's own numbers count.
    """
    model = now.model
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_SENSOR:
        raise InputError("FieldForces.readings: the model's option disables sensors; enable the flag sensor")
    mujoco.mj_copyData(now, model, data)
    with forces.running():
        mujoco.mj_forward(model, now)
        mujoco.mj_rnePostConstraint(model, now)
        found = now.sensordata.copy()
        sensors = _corrected(model)
        values = _accelerations(forces, now, [k for k in sensors if _type(model, k) in ACCELERATIONS])
        values |= _holding(forces, now, [k for k in sensors if _type(model, k) in WRENCHES])
        for k in sensors:
            if _type(model, k) == Sensor.mjSENS_E_POTENTIAL:
                mujoco.mj_energyPos(model, now)
                values[k] = now.energy[0] + forces.potential_energy(now)
    for k, value in values.items():
        limit = model.sensor_cutoff[k] or np.inf
        first = model.sensor_adr[k]
        found[first : first + model.sensor_dim[k]] = np.clip(value, -limit, limit)
    return found


def _accelerations(forces, now, sensors):
    """Proper accelerations (3,) by sensor: of accelerometers in their frames, of frames in the world's."""
    if not sensors:
        return {}
    model, found = now.model, {}
    frames = [_frame(model, now, int(model.sensor_objtype[k]), int(model.sensor_objid[k])) for k in sensors]
    pulls = forces.gravity_at(np.array([place for _, place, _ in frames]), now.time)
    for k, (body, _, axes), pull in zip(sensors, frames, pulls, strict=True):
        local = _type(model, k) == Sensor.mjSENS_ACCELEROMETER
        result = np.empty(6)
        kind, number = int(model.sensor_objtype[k]), int(model.sensor_objid[k])
        mujoco.mj_objectAcceleration(model, now, kind, number, result, int(local))
        found[k] = result[3:] - forces.felt_by(body) * (axes.T @ pull if local else pull)
    return found


_FRAMES = {"BODY": ("xipos", "ximat"), "XBODY": ("xpos", "xmat")} | {
    kind.upper(): (f"{kind}_xpos", f"{kind}_xmat") for kind in ("geom", "site")
}
_FRAMES["CAMERA"] = "cam_xpos", "cam_xmat"


def _frame(model, now, kind, number):
    """Body, place (3,) and axes (3, 3) of an object with a frame."""
    name = mujoco.mjtObj(kind).name.removeprefix("mjOBJ_")
    place, axes = (getattr(now, field)[number] for field in _FRAMES[name])
    owners = {"GEOM": model.geom_bodyid, "SITE": model.site_bodyid, "CAMERA": model.cam_bodyid}
    body = int(owners[name][number]) if name in owners else number
    return body, place, axes.reshape(3, 3)


def _holding(forces, now, sensors):
    """Forces and torques (3,) by sensor, in its site's frame, that hold its body and its subtree."""
    if not sensors:
        return {}
    model, found = now.model, {}
    held = now.cfrc_int - forces.hanging(now)
    for k in sensors:
        site = int(model.sensor_objid[k])
        body, place, axes = _frame(model, now, mujoco.mjtObj.mjOBJ_SITE, site)
        torque, force = held[body, :3], held[body, 3:]
        if _type(model, k) == Sensor.mjSENS_TORQUE:
            found[k] = axes.T @ (torque - np.cross(place - now.subtree_com[model.body_rootid[body]], force))
        else:
            found[k] = axes.T @ force
    return found
