"""What a `FieldForces` warns of: steps too long for its contacts, where the field was off. Words, "" for nothing."""

import math

import mujoco
import numpy as np

from fieldsim.mujoco import checks
from fieldsim.mujoco.callback.rows import CONTACT_ENERGY, DEEP, DEEPEST, HEAVIEST
from fieldsim.mujoco.callback.tables import Plan
from fieldsim.mujoco.contact.geoms import Contact, longest_step, tree_mass
from fieldsim.mujoco.models import label, named

# A start in a surface is told of where it throws a body out at this many times the speed of the hits expected: about
# twice as deep as they go.
TOO_FAST = 3.0


def too_long_steps(model: mujoco.MjModel, plan: Plan, contact: Contact | None) -> str:
    """Of the first body for whose contacts the time step is too long."""
    if not contact:
        return ""
    step, thinnest = model.opt.timestep, plan.law[HEAVIEST] ** (-1.0 / 3.0)
    for k, body in enumerate(plan.bodies):
        geoms = plan.geoms[plan.first_geom[k] : plan.first_geom[k + 1]]
        longest = longest_step(geoms, model.body_mass[body], contact, thinnest) if len(geoms) else step
        if step > longest:
            name = model.body(int(body)).name or int(body)
            return (
                f"a timestep of {step:g} is too long for body {name!r} in a hit at speed "
                f"{contact.speed:g}: contact would not keep the energy; give one below {longest:.2g}, or a "
                "larger Contact(depth=...)"
            )
    return ""


def start_inside(model: mujoco.MjModel, plan: Plan, found: np.ndarray, contact: Contact | None) -> str:
    """Of the body that starts so deep in a surface that its contact will throw it out faster than hits at its speed.

    found (n, FOUND_WIDTH): at the start.
    """
    if not contact or not len(found):
        return ""
    speeds = [
        math.sqrt(2.0 * max(energy, 0.0) / tree_mass(model, body))
        for body, energy in zip(plan.bodies.tolist(), found[:, CONTACT_ENERGY].tolist(), strict=True)
    ]
    worst = int(np.argmax(speeds))
    if not speeds[worst] > TOO_FAST * contact.speed:
        return ""
    geom, deep = int(found[worst, DEEPEST]), float(found[worst, DEEP])
    name = f"geom {label(model, geom)}" if geom >= 0 else f"a vertex of flex {named(model, 'flex', -1 - geom)}"
    return (
        f"{name} starts {deep:.3g} deep in a surface: contact will throw it out at about speed {speeds[worst]:.3g}, "
        f"where hits of {contact.speed:g} are expected; start it outside (data.qpos), or give a faster or softer one"
    )


def field_off(model: mujoco.MjModel, *, displaced: bool, others: bool, strangers: bool) -> str:
    """Why the field was not felt within the block.

    displaced: another callback was set; others: a world got other bodies; strangers: a twin or an heir of the model
    moved without the field.
    """
    off = checks.without_passive_forces(model)
    if displaced:
        return "the field was off: MuJoCo's passive callback was set within the block, in its place; set it before"
    if off:
        return f"the field was off: an option set within the block disables passive forces; {off}"
    if others:
        return "its world got other bodies within the block, which were not felt; make another FieldForces"
    if checks.lets_sleep(model):
        return "bodies that slept did not feel the field: the flag sleep was enabled within the block; disable it"
    if strangers:
        return (
            "within the block another model moved without the field, of the same structure or on from the same "
            "time, but no copy made after this FieldForces; give what was compiled anew (MjSpec.recompile makes a "
            "new model) or copied before a FieldForces of its own"
        )
    return ""


def unlike_copies(unlike: int, heavy: int) -> list[str]:
    """What copies of the model had of their own, by how often they had it: other numbers, and gravity."""
    words = []
    if unlike:
        words.append(
            "copies of the model had other masses or shapes, and felt the field as the model itself would; "
            "give each a FieldForces of its own, or contact=None and another accuracy than 'geoms'"
        )
    if heavy:
        words.append(
            "copies of the model had gravity of their own, on top of the field, where keep_gravity=False "
            "switches the model's off; copy it within the block, or set their opt.gravity to 0"
        )
    return words
