"""Triangle meshes: from arrays, or from files (see `meshes.readers`)."""

import dataclasses
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeGuard, cast

import numpy as np

from fieldsim import files, validate
from fieldsim.errors import InputError
from fieldsim.potentials.meshes.readers.read import read
from fieldsim.potentials.meshes.writers import WRITERS, doubled_areas
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.types import ArrayLike, PathLike

# Beyond, areas and volumes would not be numbers.
MOST = 1e70


@dataclasses.dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A triangle mesh: vertices (V, 3) in scene units, faces (F, 3) indices into them, right-handed about the outside.

    Checked when made; its arrays are read-only. Raises InputError for coordinates that are not finite, indices that are
    not there and faces without area, each named by its index.
    """

    vertices: np.ndarray
    faces: np.ndarray

    if TYPE_CHECKING:

        def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None: ...

    def __post_init__(self):
        vertices = validate.points("TriangleMesh", "vertices", self.vertices).copy()
        far = np.flatnonzero((np.abs(vertices) > MOST).any(axis=1))
        if far.size:
            place = tuple(vertices[far[0]].tolist())
            raise InputError(f"TriangleMesh: vertices[{far[0]}] is {place}; give coordinates of at most {MOST:g}")
        faces = _indices(self.faces, len(vertices))
        _refuse_degenerate(vertices, faces)
        for name, array in (("vertices", vertices), ("faces", faces)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __reduce__(self):
        # Through the constructor, which makes the arrays read-only.
        return TriangleMesh, (self.vertices, self.faces)

    @property
    def corners(self) -> np.ndarray:
        """The corners of every face, (F, 3, 3)."""
        return self.vertices[self.faces]

    @property
    def area(self) -> float:
        """Area of all faces together."""
        return float(np.linalg.norm(doubled_areas(self.corners), axis=1).sum() / 2.0)

    @property
    def volume(self) -> float:
        """Enclosed volume, negative for a closed mesh turned inside out; without meaning for an open one."""
        a, b, c = np.moveaxis(self.corners - self.vertices.mean(axis=0), 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    def save(self, path: PathLike) -> None:
        """Write to a file whose ending names the format: .stl, .obj, .ply, .off or .glb.

        Coordinates keep all their digits, in .stl and .glb the 7 that these can hold: InputError for a mesh that would
        lose its shape by that, such as a small one far from the origin.
        """
        path = validate.path("TriangleMesh", "path", path)
        kind = path.suffix.lower()
        if kind not in WRITERS:
            raise InputError(f"TriangleMesh: {str(path)!r} ends in no format of meshes; known: {', '.join(WRITERS)}")
        path = files.checked_target("TriangleMesh", path)
        try:
            data = WRITERS[kind](self.vertices, self.faces)
        except InputError as reason:
            raise InputError(f"TriangleMesh: {str(path)!r} cannot be written: {reason}") from None
        files.write("TriangleMesh", path, data)

    def triangles(self) -> tuple[Triangle, ...]:
        """The faces as primitives: the skeleton of a hollow shell."""
        return tuple(Triangle(a, b, c) for a, b, c in self.corners)

    def flipped(self) -> "TriangleMesh":
        """The same mesh with its inside out: every face turned over."""
        return TriangleMesh(self.vertices, self.faces[:, ::-1])

    def __repr__(self):
        return f"<TriangleMesh of {len(self.vertices)} vertices and {len(self.faces)} faces>"


def mesh(path_or_vertices: PathLike | ArrayLike | Sequence[Triangle], faces: ArrayLike | None = None) -> TriangleMesh:
    """A triangle mesh from a file, from vertices (V, 3) and faces (F, 3), or from Triangles.

    A file may be STL, OBJ, PLY, OFF or GLB, as its ending says; a scene of several parts becomes one mesh, polygons are
    split about their first corners, and lines and points are left out. Extensions that change shapes, and weights that
    bend them, are refused. No other file is opened for it. Vertices of a file or of Triangles at the same place become
    one, which closes their surface.
    Raises InputError for a file that cannot be read, and as TriangleMesh does.
    """
    if isinstance(path_or_vertices, str | os.PathLike):
        path = str(validate.path("mesh", "the file", path_or_vertices))
        if faces is not None:
            raise InputError(f"mesh: faces are given beside the file {path!r}; give one of them")
        return _read(path)
    if faces is None and _are_triangles(path_or_vertices):
        corners = np.array([(t.a, t.b, t.c) for t in path_or_vertices]).reshape(-1, 3)
        return TriangleMesh(*_merged(corners, np.arange(len(corners)).reshape(-1, 3)))
    if faces is None:
        raise InputError("mesh: vertices are given without faces; give mesh(vertices, faces) or the path of a file")
    return TriangleMesh(cast(ArrayLike, path_or_vertices), faces)


def _are_triangles(things) -> TypeGuard[Sequence[Triangle]]:
    return isinstance(things, list | tuple) and bool(things) and all(isinstance(t, Triangle) for t in things)


def _read(path):
    """The mesh of a file."""
    vertices, faces = read(path)
    try:
        return TriangleMesh(*_merged(vertices, faces))
    except InputError as reason:
        raise InputError(f"mesh: {path!r}: {str(reason).removeprefix('TriangleMesh: ')}") from None


def _merged(vertices, faces):
    """The mesh with vertices at the same place made one."""
    unique, inverse = np.unique(vertices, axis=0, return_inverse=True)
    return unique, inverse.reshape(-1)[faces]


def _indices(faces, count):
    """`faces` as an (F, 3) array of checked indices."""
    remedy = "give integers of shape (F, 3)"
    validate.numbers("TriangleMesh", "faces", faces, shape=(None, 3), remedy=remedy)
    array = np.asarray(faces)
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in "iu":
        raise InputError(f"TriangleMesh: faces are an array of {array.dtype} with shape {array.shape}; {remedy}")
    if not len(array):
        raise InputError("TriangleMesh: there are no faces; give at least one")
    bad = np.flatnonzero(((array < 0) | (array >= count)).any(axis=1))
    if bad.size:
        raise InputError(
            f"TriangleMesh: faces[{bad[0]}] is {array[bad[0]].tolist()}; give indices from 0 to {count - 1}, "
            f"there are {count} vertices"
        )
    return array.astype(np.int64)


def _refuse_degenerate(vertices, faces):
    """Raise InputError for a face whose area rounding of its coordinates can fake (as `Triangle` does)."""
    corners = vertices[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    rounding = 4 * np.finfo(float).eps * np.maximum(longest, np.abs(corners).max(axis=(1, 2)))
    bad = np.flatnonzero(~(np.linalg.norm(doubled_areas(corners), axis=1) > rounding * longest))
    if bad.size:
        k = bad[0]
        raise InputError(
            f"TriangleMesh: faces[{k}] is {faces[k].tolist()} with corners {corners[k].tolist()}, without area; "
            f"leave it out ({bad.size} of {len(faces)} are such)"
        )
