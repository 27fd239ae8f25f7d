"""From a MuJoCo model to the plan of its callback: who feels the fields, at which points, with which contact geoms."""

import mujoco
import numpy as np

from fieldsim.mujoco import checks
from fieldsim.mujoco.callback.rows import COMPENSATED, DAMPING, FRICTION, HEAVIEST, LAW, LIGHTEST, WEIGHT
from fieldsim.mujoco.callback.tables import Plan, SourceTable
from fieldsim.mujoco.contact.geoms import Contact, body_geoms, contacts_at_most, joined
from fieldsim.mujoco.contact.rows import BOUND, ORIGIN
from fieldsim.mujoco.points import SIX, geom_points
from fieldsim.portable.lanes.words import filled

# All of a body's mass at its centre.
CENTER = np.array([[0.0, 0.0, 0.0, 1.0]])


def plan_of(
    model: mujoco.MjModel,
    bodies: np.ndarray,
    accuracy: str,
    contact: Contact | None,
    gravity: SourceTable,
    surface: SourceTable,
    *,
    weighing: bool,
) -> Plan:
    """The plan for `bodies` (n,) of a model; weighing: whether gravcomp is left out of account."""
    points, touching, law = (
        _mass_points(model, bodies, accuracy),
        _touching(model, bodies, contact),
        np.zeros(LAW.width),
    )
    if contact:
        law[[DAMPING, FRICTION]] = contact.damping, contact.friction
        weights = surface.arrays.rows[:, WEIGHT]
        law[[LIGHTEST, HEAVIEST]] = weights.min(), weights.max()
    law[COMPENSATED] = not weighing
    geoms, samples, faces = joined(touching)
    most = contacts_at_most(geoms)
    places = np.full(model.nbody, -1, dtype=np.int64)
    places[bodies] = np.arange(len(bodies))
    return Plan(
        bodies,
        places,
        model.body_rootid.astype(np.int64),
        model.body_parentid.astype(np.int64),
        np.cumsum([0, *model.body_dofnum], dtype=np.int64),
        *_packed(points),
        _firsts([part.geoms for part in touching]),
        geoms,
        samples,
        faces,
        np.array([_reach(part.geoms) for part in touching]),
        law,
        _alone(model),
        np.array([1 + most.sum(), most.max(initial=0)]),
        gravity.arrays,
        surface.arrays,
    )


def at_centers(plan: Plan) -> Plan:
    """The plan with every body's mass at its centre."""
    count = len(plan.bodies)
    first, points, bodies = _packed([CENTER] * count)
    return plan._replace(first_point=first, points=points, point_bodies=bodies)


def _packed(points):
    """Points (m, 4) of each body as a plan has them: first_point, points and point_bodies."""
    counts = [len(part) for part in points]
    more = filled(sum(counts)) - sum(counts)
    columns = np.pad(np.concatenate(points).T, ((0, 0), (0, more)), mode="edge")
    bodies = np.pad(np.repeat(np.arange(len(points)), counts), (0, more), mode="edge")
    return _firsts(points), np.ascontiguousarray(columns), bodies.astype(np.int32)


def _mass_points(model, bodies, accuracy):
    """Points and shares of the mass (m, 4) of each body."""
    if accuracy == "geoms":
        return [geom_points(model, body) for body in bodies]
    if accuracy == "points":
        return [SIX] * len(bodies)
    return [CENTER] * len(bodies)


def _touching(model, bodies, contact):
    """Tables of contact of each body; empty ones of those that cannot move."""
    if not contact:
        return [joined([])] * len(bodies)
    moves = checks.last_dofs(model)[bodies] >= 0
    return [body_geoms(model, body, contact) if free else joined([]) for body, free in zip(bodies, moves, strict=True)]


def _reach(geoms):
    """How far rows of `geoms` reach from the centre of mass; -inf of none."""
    return np.max(np.linalg.norm(geoms[:, ORIGIN], axis=1) + geoms[:, BOUND], initial=-np.inf)


def _alone(model):
    """Which bodies move freely, without any other that is joined to them or inertia of the joint, (nbody,)."""
    free = np.zeros(model.nbody, dtype=np.int64)
    parents = set(model.body_parentid[1:].tolist())
    for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).tolist():
        body, first = int(model.jnt_bodyid[joint]), model.jnt_dofadr[joint]
        free[body] = body not in parents and not model.dof_armature[first : first + 6].any()
    return free


def _firsts(parts):
    return np.cumsum([0, *(len(part) for part in parts)]).astype(np.int64)
