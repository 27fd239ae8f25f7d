"""From a MuJoCo model to the plan of its callback: who feels the fields, at which points, with which contact balls."""

import mujoco
import numpy as np

from fieldsim.mujoco import checks
from fieldsim.mujoco.callback.tables import Plan, SourceTable
from fieldsim.mujoco.contact.geoms import Contact, body_balls, slope_of
from fieldsim.mujoco.contact.rows import BALL, CENTER, RADIUS
from fieldsim.mujoco.points import SIX, geom_points
from fieldsim.world.material import Material


def plan_of(
    model: mujoco.MjModel,
    bodies: np.ndarray,
    accuracy: str,
    contact: Contact | None,
    materials: list[Material],
    gravity: SourceTable,
    surface: SourceTable,
    *,
    weighing: bool,
) -> Plan:
    """The plan for `bodies` (n,) of a model.

    materials: of the sources' surfaces now; weighing: whether gravcomp is left out of account.
    """
    points, balls, law = _mass_points(model, bodies, accuracy), _balls(model, bodies, contact, materials), np.zeros(4)
    if contact:
        law[:3] = slope_of(materials), contact.damping, contact.friction
    law[3] = not weighing
    places = np.full(model.nbody, -1, dtype=np.int64)
    places[bodies] = np.arange(len(bodies))
    return Plan(
        bodies,
        places,
        model.body_rootid.astype(np.int64),
        model.body_parentid.astype(np.int64),
        np.cumsum([0, *model.body_dofnum], dtype=np.int64),
        _firsts(points),
        np.concatenate([np.zeros((0, 4)), *points]),
        _firsts(balls),
        np.concatenate([np.zeros((0, BALL.width)), *balls]),
        np.array([_reach(rows) for rows in balls]),
        law,
        gravity.arrays,
        surface.arrays,
    )


def at_centers(plan: Plan) -> Plan:
    """The plan with every body's mass at its centre."""
    count = len(plan.bodies)
    points = np.tile((0.0, 0.0, 0.0, 1.0), (count, 1))
    return plan._replace(first_point=np.arange(count + 1, dtype=np.int64), points=points)


def _mass_points(model, bodies, accuracy):
    """Points and shares of the mass (m, 4) of each body."""
    if accuracy == "geoms":
        return [geom_points(model, body) for body in bodies]
    if accuracy == "points":
        return [SIX] * len(bodies)
    return [np.zeros((0, 4))] * len(bodies)


def _balls(model, bodies, contact, materials):
    """Contact balls (m, BALL.width) of each body; none of those that cannot move."""
    if not contact:
        return [np.zeros((0, BALL.width))] * len(bodies)
    radius = min(material.radius for material in materials)
    moves = checks.last_dofs(model)[bodies] >= 0
    return [
        body_balls(model, body, contact, radius) if free else np.zeros((0, BALL.width))
        for body, free in zip(bodies, moves, strict=True)
    ]


def _reach(balls):
    """How far balls (n, BALL.width) reach from the centre of mass; -inf of none."""
    return np.max(np.linalg.norm(balls[:, CENTER], axis=1) + balls[:, RADIUS], initial=-np.inf)


def _firsts(parts):
    return np.cumsum([0, *(len(part) for part in parts)]).astype(np.int64)
