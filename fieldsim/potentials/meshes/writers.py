"""Triangle meshes as files: STL, OBJ, PLY, OFF and GLB.

A writer gives the bytes of a file, with all digits of the coordinates, or, in STL and GLB, which hold no more, with
the 7 of float32.
"""

import json
import struct

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials.meshes.readers.stl import STL_ROW

# Share of a mesh's area that may change when its coordinates are rounded.
_MOST_ROUNDED = 1e-3


def _singles(vertices, faces):
    """Vertices in float32, and the faces' normals, (F, 3)."""
    with np.errstate(over="ignore", invalid="ignore"):
        singles = vertices.astype("<f4")
        before, after = (doubled_areas(v.astype(float)[faces]) for v in (vertices, singles))
        changed = np.linalg.norm(after - before, axis=1).sum()
        whole = np.linalg.norm(before, axis=1).sum()
    if not changed <= _MOST_ROUNDED * whole:
        raise InputError("it would lose its shape in the 7 digits that this kind holds; save it as .ply, .obj or .off")
    return singles, before / np.linalg.norm(before, axis=1, keepdims=True)


def doubled_areas(corners):
    """Vectors across triangles (N, 3, 3), twice as long as their areas, (N, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _as_stl(vertices, faces):
    singles, normals = _singles(vertices, faces)
    rows = np.zeros(len(faces), STL_ROW)
    rows["normal"], rows["corners"] = normals, singles[faces]
    return b"fieldsim".ljust(80) + struct.pack("<I", len(faces)) + rows.tobytes()


def _as_obj(vertices, faces):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    return "\n".join(lines + [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()] + [""]).encode()


def _as_off(vertices, faces):
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0"] + [f"{x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    return "\n".join(lines + [f"3 {a} {b} {c}" for a, b, c in faces.tolist()] + [""]).encode()


def _as_ply(vertices, faces):
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    return "\n".join(lines).encode() + vertices.astype("<f8").tobytes() + rows.tobytes()


def _as_glb(vertices, faces):
    points, corners = _singles(vertices, faces)[0], faces.astype("<u4")
    content = points.tobytes() + corners.tobytes()
    box = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    tree = {
        "asset": {"version": "2.0", "generator": "fieldsim"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3", **box},
            {"bufferView": 1, "componentType": 5125, "count": corners.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": corners.nbytes},
        ],
        "buffers": [{"byteLength": len(content)}],
    }
    text = json.dumps(tree).encode()
    parts = ((b"JSON", text.ljust(-(-len(text) // 4) * 4)), (b"BIN\0", content))
    chunks = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in parts)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


WRITERS = {".stl": _as_stl, ".obj": _as_obj, ".ply": _as_ply, ".off": _as_off, ".glb": _as_glb}
