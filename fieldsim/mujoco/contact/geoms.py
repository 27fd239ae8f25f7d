"""Contact geoms: a MuJoCo body's geoms as convex sets for the contact potential (see `potential`)."""

import dataclasses
import math
import typing
import warnings
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.mujoco import checks
from fieldsim.mujoco.contact import shapes
from fieldsim.mujoco.contact.rows import (
    BOUND,
    FACE_COUNT,
    FACES,
    FIRST_FACE,
    FIRST_SAMPLE,
    FRAME,
    GEOM,
    GEOMS,
    HARDNESS,
    KIND,
    MOST_DEEPEST,
    ORIGIN,
    ROUND,
    SAMPLE_COUNT,
    SIZES,
    SLIGHT,
)
from fieldsim.mujoco.models import label, listed, named
from fieldsim.mujoco.points import frame_of
from fieldsim.numerics import quaternion
from fieldsim.types import RealLike

# A step as long as this share of 1 / (angular frequency of a hit) resolves it.
RESOLVED = 0.5


@dataclasses.dataclass(frozen=True)
class Contact:
    """Contact of MuJoCo's bodies with the surfaces F = 1 of the sources, by a potential: no mesh, no solver.

    speed: the fastest hit to expect, in lengths per unit of time; it presses a geom in by `depth`, a share of half its
    thickness, or of the radius of the surface that it hits, if that is less. damping: 0 keeps the energy; a hit at
    `speed` loses about 4/3 damping of it. friction: Coulomb's coefficient against the surface as it moves; where a body
    sticks it creeps, as fast as the pull on it would make it in a few time steps.
    Spheres, capsules, ellipsoids, cylinders, boxes and meshes (as their convex hulls, as in MuJoCo) touch as what they
    are, with faces, edges and corners; a flex with its vertices, balls of its radius.
    """

    speed: float
    depth: float = 0.02
    damping: float = 0.0
    friction: float = 0.0

    if TYPE_CHECKING:

        def __init__(
            self,
            speed: RealLike,
            depth: RealLike = ...,
            damping: RealLike = ...,
            friction: RealLike = ...,
        ) -> None: ...

    def __post_init__(self):
        for name in ("speed", "depth"):
            object.__setattr__(self, name, validate.number("Contact", name, getattr(self, name), above=0.0))
        for name in ("damping", "friction"):
            object.__setattr__(self, name, validate.number("Contact", name, getattr(self, name), at_least=0.0))

    def stiffness(self, mass: float, size: float) -> float:
        """Such that a hit of `mass` at `speed` goes `depth` times `size` deep: m v^2 / 2 = stiffness d^3 / 3.

        Raises InputError where that is no number above 0.
        """
        mass = validate.number("Contact.stiffness", "mass", mass, above=0.0)
        size = validate.number("Contact.stiffness", "size", size, above=0.0)
        with np.errstate(over="ignore", under="ignore", divide="ignore", invalid="ignore"):
            found = float(1.5 * mass * np.float64(self.speed) ** 2 / np.float64(self.depth * size) ** 3)
        if not 0.0 < found < np.inf:
            raise InputError(
                f"Contact: speed {self.speed:g} and depth {self.depth:g} give a stiffness of {found:g} for mass "
                f"{mass:g} and size {size:g}; give the speed of the fastest hit in the model's units, and a share"
            )
        return found


class Touching(typing.NamedTuple):
    """Tables of contact: rows of geoms, samples and faces (see `mujoco.contact.rows`)."""

    geoms: np.ndarray
    samples: np.ndarray
    faces: np.ndarray


def joined(parts: "list[Touching]") -> Touching:
    """Several tables as one."""
    geoms = [np.zeros((0, GEOMS.width))]
    samples, faces = 0, 0
    for part in parts:
        moved = part.geoms.copy()
        moved[:, FIRST_SAMPLE] += samples
        moved[:, FIRST_FACE] += faces
        samples, faces = samples + len(part.samples), faces + len(part.faces)
        geoms.append(moved)
    return Touching(
        np.concatenate(geoms),
        np.concatenate([np.zeros((0, 3)), *(part.samples for part in parts)]),
        np.concatenate([np.zeros((0, FACES.width)), *(part.faces for part in parts)]),
    )


def contacts_at_most(geoms: np.ndarray) -> np.ndarray:
    """How many contacts each row of `geoms` may have."""
    return (MOST_DEEPEST + 1 + geoms[:, SAMPLE_COUNT]).astype(np.int64)


def body_geoms(model, body: int, law: Contact) -> Touching:
    """The tables of all geoms of a body, and of the flexes' vertices on it."""
    geoms = range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
    # Others are only to be seen.
    parts = [_geom(model, geom, law) for geom in geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]]
    return joined(parts + _vertices(model, body, law))


def tree_mass(model, body: int) -> float:
    """The mass of the whole tree that a body belongs to."""
    return float(model.body_mass[model.body_rootid == model.body_rootid[body]].sum())


def _geom(model, geom, law):
    shape = shapes.of_geom(model, geom)
    if not shape.thickness > 0.0:
        raise InputError(
            f"FieldForces: geom {label(model, geom)} has no thickness (size {model.geom_size[geom].tolist()}); "
            "give it one for contact, or contype='0' conaffinity='0' to be seen alone"
        )
    return _tables(shape, *frame_of(model, geom), geom, law, tree_mass(model, model.geom_bodyid[geom]))


def _tables(shape, turn, move, number, law, mass):
    law.stiffness(mass, shape.thickness)  # refuses what is no number
    row = np.zeros((1, GEOMS.width))
    row[0, ORIGIN], row[0, FRAME] = move, turn.ravel()
    row[0, [KIND, ROUND, BOUND]] = shape.kind, shape.round, shape.bound
    row[0, SIZES] = shape.sizes
    row[0, [HARDNESS, SLIGHT, GEOM]] = law.stiffness(mass, 1.0), shape.thickness**-3.0, number
    row[0, [SAMPLE_COUNT, FACE_COUNT]] = len(shape.samples), len(shape.faces)
    return Touching(row, shape.samples, shape.faces)


def _vertices(model, body, law):
    """Vertices of flexes on a body, as balls."""
    parts = []
    for flex in np.flatnonzero(_collides(model, "flex")).tolist():
        first, count = model.flex_vertadr[flex], model.flex_vertnum[flex]
        turn = quaternion.matrices(model.body_iquat[body]).T
        for vertex in first + np.flatnonzero(model.flex_vertbodyid[first : first + count] == body):
            shape = shapes.ball(float(model.flex_radius[flex]))
            move = turn @ (model.flex_vert[vertex] - model.body_ipos[body])
            if shape.thickness > 0.0:
                parts.append(_tables(shape, turn, move, -1 - flex, law, tree_mass(model, body)))
    return parts


def longest_step(geoms: np.ndarray, mass: float, law: Contact, radius: float) -> float:
    """The longest time step that resolves a hit at `law.speed`: RESOLVED / sqrt(2 stiffness d / m) for depth d.

    geoms: rows; radius: of the thinnest surface.
    """
    stiffness = float((geoms[:, HARDNESS] * np.maximum(geoms[:, SLIGHT], radius**-3.0)).max())
    depth = (1.5 * mass * law.speed**2 / stiffness) ** (1.0 / 3.0)
    return RESOLVED / math.sqrt(2.0 * stiffness * depth / mass)


def warn_of_untouched(model, bodies) -> None:
    """Warn of what moves and collides in MuJoCo, but not with surfaces: geoms of massless bodies, some flexes."""
    moves = checks.last_dofs(model)[model.geom_bodyid] >= 0
    loose = _collides(model, "geom") & moves & ~np.isin(model.geom_bodyid, bodies)
    names = [f"geom {label(model, geom)} (its body has no mass)" for geom in np.flatnonzero(loose).tolist()]
    flexes = np.flatnonzero(_collides(model, "flex")).tolist()
    names += [f"flex {named(model, 'flex', k)}" for k in flexes if not _has_vertices(model, k, bodies)]
    if names:
        warnings.warn(
            f"FieldForces: surfaces of the sources do not touch {listed(names)}; give bodies a "
            "mass, or planets as geoms for MuJoCo's own contact (fs.mujoco.planet_geom)",
            FieldsimWarning,
            stacklevel=3,
        )


def _has_vertices(model, flex, bodies):
    """Whether all vertices of a flex that move are those of bodies that feel the fields, and balls."""
    first, count = model.flex_vertadr[flex], model.flex_vertnum[flex]
    owners = model.flex_vertbodyid[first : first + count]
    moving = owners[(owners < 0) | (checks.last_dofs(model)[np.maximum(owners, 0)] >= 0)]
    return model.flex_radius[flex] > 0.0 and bool(np.isin(moving, bodies).all())


def _collides(model, of):
    """Which geoms or flexes are there for collisions."""
    return (getattr(model, f"{of}_contype") != 0) | (getattr(model, f"{of}_conaffinity") != 0)
