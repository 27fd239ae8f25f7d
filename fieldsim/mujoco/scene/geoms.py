"""MuJoCo's geoms and sites as hard shapes, each in its own frame."""

import mujoco
import numpy as np

from fieldsim.mujoco.models import color_of
from fieldsim.mujoco.points import mesh_of
from fieldsim.potentials.meshes.mesh import TriangleMesh
from fieldsim.world.material import Material
from fieldsim.world.shapes import Ball, Box, Capsule, Cylinder, Ellipsoid, Ground, Shape, TriangleSurface

Kind = mujoco.mjtGeom
# MuJoCo's shininess 1 as an exponent, as its own renderer takes it.
SHINE = 128.0
# Faces whose area is below this share of their longest edge squared are left out: MuJoCo's vertices are float32.
FLAT = 1e-7


def shape_of(model, number: int, of: str = "geom") -> Shape | None:
    """The shape of a geom or site; None of a kind that has none (height fields)."""
    kind, size = Kind(int(getattr(model, f"{of}_type")[number])), getattr(model, f"{of}_size")[number].tolist()
    if kind == Kind.mjGEOM_PLANE:
        return _ground(model, number, size)
    if kind == Kind.mjGEOM_SPHERE:
        return Ball(radius=size[0])
    if kind == Kind.mjGEOM_ELLIPSOID:
        return Ellipsoid(tuple(size))
    if kind == Kind.mjGEOM_BOX:
        return Box(tuple(2.0 * half for half in size))
    if kind in (Kind.mjGEOM_CAPSULE, Kind.mjGEOM_CYLINDER):
        long = Capsule if kind == Kind.mjGEOM_CAPSULE else Cylinder
        return long((0.0, 0.0, -size[1]), (0.0, 0.0, size[1]), size[0])
    if kind in (Kind.mjGEOM_MESH, Kind.mjGEOM_SDF) and model.geom_dataid[number] >= 0:
        return TriangleSurface(_mesh(*mesh_of(model, model.geom_dataid[number])))
    return None


def _ground(model, geom, size):
    """A plane, checkered where its texture is."""
    extent = (size[0], size[1]) if size[0] > 0.0 and size[1] > 0.0 else None
    second = checker_of(model, geom)
    if second is None:
        return Ground(extent=extent)
    material = model.geom_matid[geom]
    # As MuJoCo draws it: so many squares per unit of length, or on half the plane.
    repeat = max(float(model.mat_texrepeat[material, 0]), 1e-6)
    tile = 1.0 / repeat if model.mat_texuniform[material] or extent is None else size[0] / repeat
    return Ground(extent=extent, checker=tuple(second.tolist()), tile=tile)


def texture_of(model, geom: int) -> np.ndarray | None:
    """The flat colour texture (h, w, 3) of a geom, sRGB in 0..1; None where it has none."""
    material = model.geom_matid[geom]
    texture = model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB] if material >= 0 else -1
    if texture < 0 or model.tex_type[texture] != mujoco.mjtTexture.mjTEXTURE_2D or model.tex_nchannel[texture] < 3:
        return None
    shape = model.tex_height[texture], model.tex_width[texture], model.tex_nchannel[texture]
    first = model.tex_adr[texture]
    return model.tex_data[first : first + np.prod(shape)].reshape(shape)[:, :, :3] / 255.0


def _quarters(picture):
    """Mean colours (2, 2, 3) of the quarters of a picture."""
    rows = np.array_split(picture, 2, axis=0)
    return np.array([[quarter.mean(axis=(0, 1)) for quarter in np.array_split(row, 2, axis=1)] for row in rows])


def checker_of(model, geom: int) -> np.ndarray | None:
    """The second colour (3,), sRGB, of a geom whose texture is a checker; None of others.

    It is that of the texture's first quarter: so the squares lie as MuJoCo has them.
    """
    picture = texture_of(model, geom)
    if picture is None or min(picture.shape[:2]) < 2:
        return None
    quarters = _quarters(picture)
    alike = np.abs(quarters - quarters[::-1, ::-1]).max()
    apart = np.abs(quarters[0, 0] - quarters[0, 1]).max()
    return quarters[0, 0] * color_of(model, geom)[:3] if apart > 4.0 * alike else None


def _mesh(vertices, faces):
    """The mesh without faces that have no area."""
    corners = vertices[faces]
    edges = corners - np.roll(corners, 1, axis=1)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return TriangleMesh(vertices, faces[area > FLAT * longest**2])


def material_of(model, number: int, of: str = "geom") -> Material:
    """What a geom or site looks like: its colour, its opacity, its material's gloss and mirror (of planes and boxes).

    What is not opaque lets light straight through, as in MuJoCo.
    Of a texture it has the mean, or a checker's first colour; cube maps count as white.
    """
    rgba = color_of(model, number, of)
    color, picture = rgba[:3], texture_of(model, number) if of == "geom" else None
    kind = getattr(model, f"{of}_type")[number]
    if picture is not None:
        first = kind == Kind.mjGEOM_PLANE and checker_of(model, number) is not None
        color = color * (_quarters(picture)[0, 1] if first else picture.mean(axis=(0, 1)))
    clear = {"transmission": 1.0 - float(rgba[3]), "ior": 1.0}
    color = tuple(color.tolist())
    material = getattr(model, f"{of}_matid")[number]
    if material < 0:
        return Material(color, **clear)
    specular, shine = float(model.mat_specular[material]), float(model.mat_shininess[material])
    flat = Kind(int(kind)) in (Kind.mjGEOM_PLANE, Kind.mjGEOM_BOX)
    mirror = float(model.mat_reflectance[material]) if flat else 0.0
    return Material(color, specular=specular, shininess=max(1.0, SHINE * shine), reflection=mirror, **clear)
