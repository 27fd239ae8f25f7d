"""What a `FieldForces` warns of: steps too long for its contacts, where the field was off. Words, "" for nothing."""

import mujoco

from fieldsim.mujoco import checks
from fieldsim.mujoco.callback.tables import Plan
from fieldsim.mujoco.contact.geoms import Contact, longest_step


def too_long_steps(model: mujoco.MjModel, plan: Plan, contact: Contact | None) -> str:
    """Of the first body for whose contacts the time step is too long."""
    if not contact:
        return ""
    step = model.opt.timestep
    for k, body in enumerate(plan.bodies):
        rows = plan.balls[plan.first_ball[k] : plan.first_ball[k + 1]]
        longest = longest_step(rows, model.body_mass[body], contact) if len(rows) else step
        if step > longest:
            name = model.body(int(body)).name or int(body)
            return (
                f"a timestep of {step:g} is too long for body {name!r} in a hit at speed "
                f"{contact.speed:g}: contact would not keep the energy; give one below {longest:.2g}, or a "
                "larger Contact(depth=...)"
            )
    return ""


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
