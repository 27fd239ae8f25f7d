"""Shapes of geoms for contact: a convex core and all within a distance of it; samples of the core, and its faces."""

import dataclasses
import itertools

import mujoco
import numpy as np

from fieldsim.errors import InputError
from fieldsim.mujoco.contact.rows import CYLINDER, ELLIPSOID, FACES, MOST_SAMPLES, POINT, POLYTOPE, SEGMENT
from fieldsim.mujoco.models import label
from fieldsim.mujoco.points import mesh_of

Kind = mujoco.mjtGeom
# Samples on each rim of a cylinder.
RIM = 8
# A mesh is no thinner than this share of its extent.
THINNEST = 1e-3
# Faces of a box, by its corners (-, -, -), (-, -, +), ..., (+, +, +).
_SQUARES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclasses.dataclass(frozen=True, eq=False)
class Shape:
    """A geom in its own frame: all within `round` of its core.

    kind, sizes: of the core, see `mujoco.contact.rows`; bound: how far it reaches from the origin; thickness: half its
    least extent, 0 where that is unknown. samples (n, 3), faces (m, FACES.width): of the core.
    """

    kind: int
    sizes: tuple[float, float, float]
    round: float
    bound: float
    thickness: float
    samples: np.ndarray
    faces: np.ndarray


NO_SAMPLES, NO_FACES = np.zeros((0, 3)), np.zeros((0, FACES.width))


def of_geom(model, geom: int) -> Shape:
    """The shape of a geom; raises InputError for a type that contact does not know."""
    kind, size = Kind(int(model.geom_type[geom])), model.geom_size[geom].astype(float)
    if kind == Kind.mjGEOM_SPHERE:
        return ball(size[0])
    if kind == Kind.mjGEOM_CAPSULE:
        ends = np.array([[0.0, 0.0, -size[1]], [0.0, 0.0, size[1]]])
        return Shape(SEGMENT, (0.0, 0.0, size[1]), size[0], size[0] + size[1], size[0], ends, NO_FACES)
    if kind == Kind.mjGEOM_ELLIPSOID:
        return Shape(ELLIPSOID, tuple(size), 0.0, size.max(), size.min(), NO_SAMPLES, NO_FACES)
    if kind == Kind.mjGEOM_CYLINDER:
        sizes, bound = (size[0], size[0], size[1]), float(np.hypot(size[0], size[1]))
        return Shape(CYLINDER, sizes, 0.0, bound, size[:2].min(), _rims(size[0], size[1]), NO_FACES)
    if kind == Kind.mjGEOM_BOX:
        corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * size
        triangles = [square[:3] for square in _SQUARES] + [(a, c, d) for a, _, c, d in _SQUARES]
        return _polytope(corners, np.array(triangles), size.min())
    if kind in (Kind.mjGEOM_MESH, Kind.mjGEOM_SDF) and model.geom_dataid[geom] >= 0:
        return _hull(model, model.geom_dataid[geom])
    raise InputError(
        f"FieldForces: geom {label(model, geom)} is of a type that the contact potential does not know; "
        "give spheres, capsules, ellipsoids, cylinders, boxes or meshes, or contact=None"
    )


def ball(radius: float) -> Shape:
    """A ball."""
    return Shape(POINT, (0.0, 0.0, 0.0), radius, radius, radius, NO_SAMPLES, NO_FACES)


def _rims(radius, half):
    angles = 2.0 * np.pi * np.arange(RIM) / RIM
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.concatenate([np.column_stack([ring, np.full(RIM, z)]) for z in (-half, half)])


def _hull(model, mesh):
    """The convex hull that MuJoCo found of a mesh; all its triangles where it looked for none."""
    vertices, triangles = mesh_of(model, mesh)
    graph = model.mesh_graphadr[mesh]
    if graph >= 0:
        count, faces = model.mesh_graph[graph : graph + 2]
        first = graph + 2 + 3 * (count + faces)
        triangles = model.mesh_graph[first : first + 3 * faces].reshape(-1, 3)
    extent = np.ptp(vertices, axis=0)
    return _polytope(vertices, triangles, max(0.5 * extent.min(), THINNEST * extent.max()))


def _polytope(vertices, triangles, thickness):
    corners = vertices[triangles]
    faces = np.concatenate([corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=1)
    used = vertices[np.unique(triangles)]
    bound = float(np.linalg.norm(used, axis=1).max())
    return Shape(POLYTOPE, (0.0, 0.0, 0.0), 0.0, bound, float(thickness), _far_apart(used), faces)


def _far_apart(vertices):
    """At most MOST_SAMPLES of the vertices, each as far as can be from those before it."""
    if len(vertices) <= MOST_SAMPLES:
        return vertices
    chosen = [int(np.argmax(np.linalg.norm(vertices - vertices.mean(axis=0), axis=1)))]
    distance = np.full(len(vertices), np.inf)
    while len(chosen) < MOST_SAMPLES:
        distance = np.minimum(distance, np.linalg.norm(vertices - vertices[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(distance)))
    return vertices[chosen]
