"""Mass points of MuJoCo's bodies: places in the inertial frame of a body and shares of its mass.

Points spread evenly over the geoms are moved by the one affine map that gives them the body's centre of mass and
inertia, whatever densities or inertia the model states; where that is what the geoms have, nothing moves.
"""

import mujoco
import numpy as np

from fieldsim.numerics import quaternion
from fieldsim.numerics.quadrature import gauss_legendre

Kind = mujoco.mjtGeom
# Cells of the grid inside a mesh, along its longest side.
MESH_CELLS = 8
# Below this share of the greatest, a second moment counts as none.
FLAT = 1e-12


def second_moments(inertia: np.ndarray) -> np.ndarray:
    """Means of m x^2, m y^2, m z^2 (3,) of principal moments of inertia (3,)."""
    return np.maximum(0.5 * inertia.sum() - inertia, 0.0)


# Six equal points (6, 4) on the principal axes, in units of the spread of the mass along them, with shares of it.
SIX = np.column_stack([np.concatenate([np.eye(3), -np.eye(3)]), np.full(6, 1.0 / 6.0)])


def equal_points(mass: float, inertia: np.ndarray) -> np.ndarray:
    """Six equal points (6, 4) on the principal axes with the centre of mass and inertia of a body."""
    return SIX * [*np.sqrt(3.0 * second_moments(inertia) / mass), 1.0]


def geom_points(model, body: int) -> np.ndarray:
    """Points (n, 4) all over the geoms of a body: places in its inertial frame, shares of its mass."""
    parts = []
    for geom in range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body]):
        found = filled(model, geom)
        if found is not None:
            parts.append((into_inertial(model, geom, found[0]), found[1]))
    mass, inertia = model.body_mass[body], model.body_inertia[body]
    if not parts:
        return equal_points(mass, inertia)
    places, volumes = (np.concatenate(part) for part in zip(*parts, strict=True))
    shares = volumes / volumes.sum()
    return np.column_stack([_matched(places, shares, second_moments(inertia) / mass), shares])


def into_inertial(model, geom: int, places: np.ndarray) -> np.ndarray:
    """Places (n, 3) in the frame of a geom, in the inertial frame of its body."""
    turn, move = frame_of(model, geom)
    return places @ turn.T + move


def frame_of(model, geom: int) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and origin (3,) of a geom in the inertial frame of its body."""
    body = model.geom_bodyid[geom]
    inertial = quaternion.matrices(model.body_iquat[body])
    turn = inertial.T @ quaternion.matrices(model.geom_quat[geom])
    return turn, inertial.T @ (model.geom_pos[geom] - model.body_ipos[body])


def _matched(places, shares, wanted):
    """Places moved so that their mean is 0 and their second moments are diag(wanted) (per unit of mass).

    Of all linear maps that do so, the symmetric one: the shortest way from one distribution to the other.
    """
    places = places - shares @ places
    have = np.einsum("n,ni,nj->ij", shares, places, places)
    values, axes = np.linalg.eigh(have)
    if values[0] <= FLAT * values[2]:
        return places
    root, inverse = (axes @ np.diag(values**power) @ axes.T for power in (0.5, -0.5))
    values, axes = np.linalg.eigh(root @ np.diag(wanted) @ root)
    middle = axes @ np.diag(np.sqrt(np.maximum(values, 0.0))) @ axes.T
    return places @ (inverse @ middle @ inverse).T


def filled(model, geom):
    """Points (n, 3) inside a geom, in its frame, with their volumes (n,); None for one without volume."""
    kind, size = Kind(int(model.geom_type[geom])), model.geom_size[geom]
    if kind == Kind.mjGEOM_SPHERE:
        return _ellipsoid(size[[0, 0, 0]])
    if kind == Kind.mjGEOM_ELLIPSOID:
        return _ellipsoid(size)
    if kind == Kind.mjGEOM_CAPSULE:
        return _capsule(size[0], size[1])
    if kind == Kind.mjGEOM_CYLINDER:
        return _revolved([(-size[1], size[1], lambda z: np.full_like(z, size[0]))])
    if kind == Kind.mjGEOM_BOX:
        return _box(size)
    if kind in (Kind.mjGEOM_MESH, Kind.mjGEOM_SDF) and model.geom_dataid[geom] >= 0:
        return _meshed(model, model.geom_dataid[geom])
    return None


def _box(half):
    nodes, weights = zip(*(gauss_legendre(3, -h, h) for h in half), strict=True)
    places = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    return places, np.einsum("i,j,k->ijk", *weights).ravel()


def _revolved(pieces):
    """Of a solid of revolution about z, in pieces (low, high, radius(z)): discs of 12 points, exact to degree 5."""
    places, volumes = [], []
    angles = np.arange(6) * np.pi / 3
    squares, shares = gauss_legendre(2, 0.0, 1.0)
    for low, high, radius in pieces:
        for z, thickness in zip(*gauss_legendre(4, low, high), strict=True):
            r = float(radius(np.array(z)))
            for square, share in zip(squares, shares, strict=True):
                ring = r * np.sqrt(square) * np.column_stack([np.cos(angles), np.sin(angles)])
                places.append(np.column_stack([ring, np.full(6, z)]))
                volumes.append(np.full(6, np.pi * r * r * thickness * share / 6))
    return np.concatenate(places), np.concatenate(volumes)


def _ellipsoid(axes):
    places, volumes = _revolved([(-1.0, 1.0, lambda z: np.sqrt(1.0 - z * z))])
    return places * axes, volumes * np.prod(axes)


def _capsule(radius, half):
    def cap(z):
        return np.sqrt(radius**2 - (np.abs(z) - half) ** 2)

    ends = [(-half - radius, -half, cap), (half, half + radius, cap)]
    return _revolved([*ends, (-half, half, lambda z: np.full_like(z, radius))])


def mesh_of(model, mesh: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and faces (F, 3) of a mesh, in the frame of its geoms."""
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return model.mesh_vert[first : first + count].astype(float), model.mesh_face[face : face + faces]


def _meshed(model, mesh):
    """The middles of grid cells inside a mesh."""
    vertices, faces = mesh_of(model, mesh)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    cell = np.max(high - low) / MESH_CELLS
    counts = np.maximum(1, np.ceil((high - low) / cell).astype(int))
    axes = [low[k] + (high[k] - low[k]) * (np.arange(counts[k]) + 0.5) / counts[k] for k in range(3)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = places[_windings(vertices[faces], places) > 0.5]
    if not len(inside):
        inside = vertices.mean(axis=0)[None]
    return inside, np.full(len(inside), np.prod((high - low) / counts))


def _windings(corners, places):
    """How often closed triangles (F, 3, 3) wind round each place, (n,): solid angles (Van Oosterom & Strackee 1983)."""
    total = np.zeros(len(places))
    for k, place in enumerate(places):
        a, b, c = np.moveaxis(corners - place, 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        dots = (np.einsum("ij,ij->i", p, q) for p, q in ((a, b), (b, c), (c, a)))
        ab, bc, ca = dots
        total[k] = 2.0 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb).sum()
    return total / (4.0 * np.pi)
