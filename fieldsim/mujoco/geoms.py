"""MuJoCo's geoms as hard shapes, each in its geom's frame."""

import warnings

import mujoco
import numpy as np

from fieldsim.errors import FieldsimWarning
from fieldsim.mujoco.models import color_of, label
from fieldsim.mujoco.points import mesh_of
from fieldsim.potentials.mesh import TriangleMesh
from fieldsim.world.material import Material
from fieldsim.world.shapes import Ball, Box, Capsule, Cylinder, Ellipsoid, Ground, Shape, TriangleSurface

Kind = mujoco.mjtGeom
# MuJoCo's shininess 1 as an exponent, as its own renderer takes it.
SHINE = 128.0
# Faces whose area is below this share of their longest edge squared are left out: MuJoCo's vertices are float32.
FLAT = 1e-7


def shape_of(model, geom: int) -> Shape | None:
    """The shape of a geom; None, with a FieldsimWarning, of a kind that has none (height fields)."""
    kind, size = Kind(int(model.geom_type[geom])), model.geom_size[geom].tolist()
    if kind == Kind.mjGEOM_PLANE:
        return Ground(extent=(size[0], size[1]) if size[0] > 0.0 and size[1] > 0.0 else None)
    if kind == Kind.mjGEOM_SPHERE:
        return Ball(radius=size[0])
    if kind == Kind.mjGEOM_ELLIPSOID:
        return Ellipsoid(tuple(size))
    if kind == Kind.mjGEOM_BOX:
        return Box(tuple(2.0 * half for half in size))
    if kind in (Kind.mjGEOM_CAPSULE, Kind.mjGEOM_CYLINDER):
        long = Capsule if kind == Kind.mjGEOM_CAPSULE else Cylinder
        return long((0.0, 0.0, -size[1]), (0.0, 0.0, size[1]), size[0])
    if kind in (Kind.mjGEOM_MESH, Kind.mjGEOM_SDF) and model.geom_dataid[geom] >= 0:
        return TriangleSurface(_mesh(*mesh_of(model, model.geom_dataid[geom])))
    name = kind.name.removeprefix("mjGEOM_").lower()
    warnings.warn(
        f"geom {label(model, geom)} is not drawn: its type {name} is none of plane, sphere, capsule, ellipsoid, "
        "cylinder, box and mesh",
        FieldsimWarning,
        stacklevel=2,
    )
    return None


def _mesh(vertices, faces):
    """The mesh without faces that have no area."""
    corners = vertices[faces]
    edges = corners - np.roll(corners, 1, axis=1)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return TriangleMesh(vertices, faces[area > FLAT * longest**2])


def material_of(model, geom: int) -> Material:
    """What a geom looks like: its colour and its material's gloss; opaque, whatever its opacity."""
    color = tuple(color_of(model, geom)[:3].tolist())
    material = model.geom_matid[geom]
    if material < 0:
        return Material(color)
    specular, shine = float(model.mat_specular[material]), float(model.mat_shininess[material])
    return Material(color, specular=specular, shininess=max(1.0, SHINE * shine))
