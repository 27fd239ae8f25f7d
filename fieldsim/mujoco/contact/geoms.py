"""Contact geoms: a MuJoCo body's geoms as ellipsoids and points for the contact potential (see `potential`)."""

import dataclasses
import math
import warnings
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from fieldsim import validate
from fieldsim.dynamics.rigid.body import log_slope
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.mujoco import checks
from fieldsim.mujoco.contact.rows import BALL, CENTER, LARGE, RADIUS, SHAPE, STIFFNESS
from fieldsim.mujoco.models import label, listed, named
from fieldsim.mujoco.points import frame_of, mesh_of
from fieldsim.types import RealLike

Kind = mujoco.mjtGeom
# Distance at most of a geom's points and balls, in radii of the thinnest surface; how many spaces there are along a
# side, and vertices of a mesh, at most.
SPACING = 0.5
SPACES = 8
MOST = 128
# A step as long as this share of 1 / (angular frequency of a hit) resolves it.
RESOLVED = 0.5


@dataclasses.dataclass(frozen=True)
class Contact:
    """Contact of MuJoCo's bodies with the surfaces F = 1 of the sources, by a potential: no mesh, no solver.

    speed: the fastest hit to expect, in lengths per unit of time; it presses a ball in by `depth`, a share of its
    radius (or of the surface's, if that is less). damping: 0 keeps the energy; a hit at `speed` loses about
    4/3 damping of it. friction: Coulomb's coefficient against the surface as it moves; where a body sticks it creeps,
    by less than the pull on it in four time steps. Spheres and ellipsoids touch as what they are, capsules as rows of
    balls, boxes and cylinders with points all over, meshes with their vertices.
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


def longest_step(rows, mass: float, law: Contact) -> float:
    """The longest time step that resolves a hit at `law.speed`: RESOLVED / sqrt(2 stiffness d / m) for depth d."""
    stiffness = rows[:, STIFFNESS].max()
    depth = (1.5 * mass * law.speed**2 / stiffness) ** (1.0 / 3.0)
    return RESOLVED / math.sqrt(2.0 * stiffness * depth / mass)


def slope_of(materials) -> float:
    """How fast log F falls at the surfaces, at least."""
    return min(log_slope(material) for material in materials)


def body_balls(model, body: int, law: Contact, radius: float) -> np.ndarray:
    """Rows (n, BALL.width) of all geoms of a body; radius: of the thinnest surface."""
    parts = [np.zeros((0, BALL.width))]
    mass = model.body_mass[model.body_rootid == model.body_rootid[body]].sum()
    for geom in range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body]):
        if not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            continue  # only to be seen
        size = min(_thickness(model, geom), radius)
        if not size > 0.0:
            raise InputError(
                f"FieldForces: geom {label(model, geom)} has no thickness (size {model.geom_size[geom].tolist()}); "
                "give it one for contact, or contype='0' conaffinity='0' to be seen alone"
            )
        centers, axes = _shape(model, geom, _spacing(size, radius, law))
        turn, move = frame_of(model, geom)
        rows = np.zeros((len(centers), BALL.width))
        rows[:, CENTER] = centers @ turn.T + move
        rows[:, SHAPE] = (turn @ np.diag(axes)).ravel()
        rows[:, RADIUS] = axes.max()
        rows[:, STIFFNESS] = law.stiffness(mass, size)
        rows[:, LARGE] = axes.max() > 0.5 * radius
        parts.append(rows)
    return np.concatenate(parts)


def warn_of_untouched(model, bodies) -> None:
    """Warn of what moves and collides in MuJoCo, but not with surfaces: flexible bodies, geoms of massless bodies."""
    moves = checks.last_dofs(model)[model.geom_bodyid] >= 0
    loose = _collides(model, "geom") & moves & ~np.isin(model.geom_bodyid, bodies)
    names = [f"geom {label(model, geom)} (its body has no mass)" for geom in np.flatnonzero(loose).tolist()]
    names += [f"flex {named(model, 'flex', k)}" for k in np.flatnonzero(_collides(model, "flex")).tolist()]
    if names:
        warnings.warn(
            f"FieldForces: surfaces of the sources do not touch {listed(names)}; give bodies a "
            "mass, or planets as geoms for MuJoCo's own contact (fs.mujoco.planet_geom)",
            FieldsimWarning,
            stacklevel=3,
        )


def _collides(model, of):
    """Which geoms or flexes are there for collisions."""
    return (getattr(model, f"{of}_contype") != 0) | (getattr(model, f"{of}_conaffinity") != 0)


def _spacing(size, radius, law):
    """Distance of points: between four of them a round surface rises no farther than a hit at `law.speed` goes deep."""
    return min(SPACING * radius, 2.0 * math.sqrt(radius * law.depth * size))


def _thickness(model, geom):
    """Half the least extent of a geom; of what is no known shape 0."""
    kind, size = Kind(int(model.geom_type[geom])), model.geom_size[geom]
    if kind in (Kind.mjGEOM_SPHERE, Kind.mjGEOM_CAPSULE):
        return size[0]
    if kind == Kind.mjGEOM_CYLINDER:
        return size[:2].min()
    if kind in (Kind.mjGEOM_BOX, Kind.mjGEOM_ELLIPSOID):
        return size.min()
    if model.geom_dataid[geom] < 0:
        return 0.0
    vertices, _ = mesh_of(model, model.geom_dataid[geom])
    return max(0.5 * np.ptp(vertices, axis=0).min(), 1e-3 * np.ptp(vertices, axis=0).max())


def _shape(model, geom, spacing):
    """Centres (n, 3), in the geom's frame, and semi-axes (3,) of its ellipsoids; of points they are 0."""
    kind, size = Kind(int(model.geom_type[geom])), model.geom_size[geom]
    none = np.zeros(3)
    if kind == Kind.mjGEOM_SPHERE:
        return np.zeros((1, 3)), size[[0, 0, 0]]
    if kind == Kind.mjGEOM_ELLIPSOID:
        return np.zeros((1, 3)), size.copy()
    if kind == Kind.mjGEOM_CAPSULE:
        along = _spread(size[1], spacing)
        return along[:, None] * (0.0, 0.0, 1.0), size[[0, 0, 0]]
    if kind == Kind.mjGEOM_CYLINDER:
        return _cylinder(size[0], size[1], spacing), none
    if kind == Kind.mjGEOM_BOX:
        return _box(size, spacing), none
    if kind in (Kind.mjGEOM_MESH, Kind.mjGEOM_SDF) and model.geom_dataid[geom] >= 0:
        return _far_apart(mesh_of(model, model.geom_dataid[geom])[0]), none
    raise InputError(
        f"FieldForces: geom {label(model, geom)} is of a type that the contact potential does not know; "
        "give spheres, capsules, ellipsoids, cylinders, boxes or meshes, or contact=None"
    )


def _spread(half, spacing):
    """Places from -half to half, the ends among them."""
    return np.linspace(-half, half, 1 + min(SPACES, max(1, math.ceil(2.0 * half / spacing))))


def _box(half, spacing):
    axes = [_spread(h, spacing) for h in half]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return places[(np.abs(places) == half).any(axis=1)]


def _cylinder(radius, half, spacing):
    count = min(4 * SPACES, max(12, math.ceil(2 * np.pi * radius / spacing)))
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    side = [np.column_stack([radius * ring, np.full(count, z)]) for z in _spread(half, spacing)]
    shares = np.linspace(0.0, 1.0, max(2, min(SPACES, math.ceil(radius / spacing))), endpoint=False)
    ends = [np.column_stack([share * radius * ring, np.full(count, z)]) for z in (-half, half) for share in shares]
    return np.unique(np.concatenate([*side, *ends]), axis=0)


def _far_apart(vertices):
    """At most MOST of the vertices, each as far as can be from those before it."""
    if len(vertices) <= MOST:
        return vertices
    chosen = [int(np.argmax(np.linalg.norm(vertices - vertices.mean(axis=0), axis=1)))]
    distance = np.full(len(vertices), np.inf)
    while len(chosen) < MOST:
        distance = np.minimum(distance, np.linalg.norm(vertices - vertices[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(distance)))
    return vertices[chosen]
