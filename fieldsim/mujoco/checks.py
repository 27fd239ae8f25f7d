"""What FieldForces refuses, with the reason and the remedy."""

import mujoco
import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.mujoco.models import named_body


def model_and_data(model, data) -> None:
    """Refuse what is no model, and data that belong to another one."""
    validate.instance("FieldForces", "model", model, mujoco.MjModel, "give a mujoco.MjModel")
    own_data(model, data)
    if not model.nv:
        raise InputError("FieldForces: the model has no degree of freedom; give it a joint, or nothing can move")


def own_data(model, data) -> None:
    """Refuse what is no MjData of this model."""
    validate.instance("FieldForces", "data", data, mujoco.MjData, "give a mujoco.MjData of the model")
    if data.model._address != model._address:
        raise InputError(
            "FieldForces: this data belongs to another model; make one of this model: data = mujoco.MjData(model)"
        )


def state(data) -> None:
    """Refuse a state that is not finite."""
    for name in ("time", "qpos", "qvel", "mocap_pos", "mocap_quat"):
        value = np.ravel(getattr(data, name))
        bad = np.flatnonzero(~np.isfinite(value))
        if bad.size:
            raise InputError(
                f"FieldForces: data.{name}[{bad[0]}] is {value[bad[0]]}; give a finite state, such as that after "
                "mujoco.mj_resetData(model, data)"
            )


def masses(model, bodies) -> None:
    """Refuse masses that were set to what no body has."""
    bad = [int(body) for body in bodies if not 0.0 < model.body_mass[body] < np.inf]
    if bad:
        name = model.body(bad[0]).name or bad[0]
        raise InputError(f"FieldForces: body {name!r} has mass {model.body_mass[bad[0]]:g}; give it a mass above 0")


def timestep(model, backwards: bool = True) -> None:
    """Refuse a time step with which no step ends anywhere else; backwards: allow one below 0."""
    step = model.opt.timestep
    if not np.isfinite(step) or step == 0.0 or (step < 0.0 and not backwards):
        raise InputError(f"the model's timestep is {step:g}; give a finite one above 0")


def without_passive_forces(model) -> str | None:
    """What to do about an option under which MuJoCo would not call the callback; None where it does."""
    bits = mujoco.mjtDisableBit
    off = ("mjDSBL_PASSIVE",) if hasattr(bits, "mjDSBL_PASSIVE") else ("mjDSBL_SPRING", "mjDSBL_DAMPER")
    if all(model.opt.disableflags & getattr(bits, name) for name in off):
        return "enable springs or dampers (<flag passive/spring/damper='enable'/>)"
    return None


def options(model) -> None:
    """Refuse options of the model under which MuJoCo would not call the callback."""
    remedy = without_passive_forces(model)
    if remedy:
        raise InputError(
            "FieldForces: the model's option disables passive forces, and MuJoCo then asks for no forces at all; "
            f"{remedy}"
        )
    if lets_sleep(model):
        raise InputError(
            "FieldForces: the model lets bodies sleep, and what sleeps does not feel a field; disable the flag sleep"
        )


def lets_sleep(model) -> bool:
    """Whether bodies of the model may sleep."""
    return bool(model.opt.enableflags & getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0))


def gravity(model, keep) -> None:
    """Refuse a model whose own gravity is on, unless an option says what to do with it."""
    off = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
    if keep is None and not off and np.any(model.opt.gravity):
        raise InputError(
            f"FieldForces: the model has its own gravity {tuple(model.opt.gravity.tolist())}, on top of the field; "
            "give keep_gravity=True for both, keep_gravity=False to switch it off while in the field, or "
            "<option gravity='0 0 0'/>"
        )


def bodies(model, chosen) -> np.ndarray:
    """Ids of the chosen bodies (names or ids), or of all that have mass and move; refuses those that cannot feel."""
    dofs = last_dofs(model)
    if chosen is None:
        found = np.flatnonzero((model.body_mass > 0.0) & (dofs >= 0))
        if not len(found):
            raise InputError("FieldForces: no body of the model has mass and can move; give one a joint and a mass")
        return found.astype(np.int64)
    if isinstance(chosen, str | int | np.integer):
        chosen = [chosen]
    chosen = validate.listed("FieldForces", "bodies", chosen, "give names or numbers of bodies")
    found = [_body(model, one) for one in chosen]
    if not found:
        raise InputError("FieldForces: bodies is empty; name at least one, or leave it out for all")
    if len(set(found)) < len(found):
        raise InputError(f"FieldForces: bodies {chosen} names one twice; name each once")
    for body in found:
        name = model.body(body).name or body
        if dofs[body] < 0:
            raise InputError(f"FieldForces: body {name!r} is fixed to the world and cannot move; give it a joint")
        if not model.body_mass[body] > 0.0:
            raise InputError(f"FieldForces: body {name!r} has no mass, so no field pulls it; give it a mass")
    return np.array(found, dtype=np.int64)


def _body(model, one):
    if isinstance(one, str):
        found = named_body(model, one)
        if found < 0:
            names = ", ".join(repr(model.body(b).name) for b in range(1, model.nbody) if model.body(b).name)
            raise InputError(
                f"FieldForces: the model has no body {validate.shown(one)}; it has {names or 'none with a name'}"
            )
        return found
    if isinstance(one, bool) or not isinstance(one, int | np.integer) or not 0 < one < model.nbody:
        raise InputError(
            f"FieldForces: bodies has {validate.shown(one)}; give names, or numbers from 1 to {model.nbody - 1} "
            "(0 is the world)"
        )
    return int(one)


def last_dofs(model) -> np.ndarray:
    """The last degree of freedom that moves each body, (nbody,); -1 for what is fixed."""
    found = np.full(model.nbody, -1, dtype=np.int64)
    for body in range(1, model.nbody):
        own = model.body_dofnum[body]
        found[body] = model.body_dofadr[body] + own - 1 if own else found[model.body_parentid[body]]
    return found


def numbers(model, touching: bool) -> None:
    """Refuse masses, inertias and (where geoms count) sizes that MuJoCo's compiler would not have taken."""
    for name, what in (("body_mass", "body"), ("body_inertia", "body"), ("geom_size", "geom")):
        values = getattr(model, name)
        bad = np.argwhere(~(np.isfinite(values) & (values >= 0.0)))
        if len(bad) and (what == "body" or touching):
            first = int(bad[0, 0])
            named = getattr(model, what)(first).name or first
            raise InputError(
                f"FieldForces: the model's {name} of {what} {named!r} is {values[first].tolist()}; give finite numbers "
                "of at least 0"
            )


def finite(model, bodies, forces) -> None:
    """Refuse a start at which a force or energy of a body, a row of (n, .), is not finite."""
    strange = np.flatnonzero(~np.isfinite(model.body_gravcomp))
    if strange.size:
        raise InputError(
            f"FieldForces: body {model.body(int(strange[0])).name or int(strange[0])!r} has gravcomp "
            f"{model.body_gravcomp[strange[0]]:g}; give a finite number"
        )
    bad = np.flatnonzero(~np.isfinite(forces).all(axis=1))
    if bad.size:
        name = model.body(int(bodies[bad[0]])).name or int(bodies[bad[0]])
        raise InputError(
            f"FieldForces: the field is singular where body {name!r} starts ({bad.size} such bodies); start it "
            "elsewhere, or soften the kernel, such as fs.Newtonian(softening=0.01)"
        )


def something_acts(gravity, surface, touching: bool) -> None:
    """Raise InputError where no source pulls or touches; gravity, surface: the sources' elements in each role."""
    if touching and not len(surface):
        raise InputError("FieldForces: contact is given but no source has a surface; give a Body a fs.Material")
    if not len(gravity) and not len(surface):
        raise InputError("FieldForces: no source pulls or touches; give a Body gravity=fs.Newtonian(), or contact=...")
