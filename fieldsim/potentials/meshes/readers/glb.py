"""Files of GLB, of version 2."""

import json
import struct

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials.meshes.readers.common import checked

# Limits of a scene, which may show one mesh in very many places and be far larger than its file.
MOST_TRIANGLES = 1 << 25
MOST_PARTS = 1 << 16

_GLB_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TRIANGLES, _STRIPS = 4, (5, 6)

# Extensions that change no shape, and the one that shows a mesh in many places.
_LOOKS = ("KHR_materials_", "KHR_texture_", "EXT_texture_")
_COPIES = "EXT_mesh_gpu_instancing"


def read_glb(data):
    """Vertices (V, 3) and faces (F, 3) of files of GLB, of version 2."""
    mark, version, size = struct.unpack_from("<4sII", data)
    if mark != b"glTF" or version != 2:
        raise InputError("it is no GLB of version 2")
    if size != len(data):
        raise InputError(f"it should have {size} bytes, but has {len(data)}")
    chunks, at = {}, 12
    while at < size:
        length, kind = struct.unpack_from("<I4s", data, at)
        if at + 8 + length > size:
            raise InputError("it is cut off")
        chunks.setdefault(kind, data[at + 8 : at + 8 + length])
        at += 8 + length
    return _Scene(json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b"")).mesh()


class _Scene:
    """The nodes of a GLB and what they show."""

    def __init__(self, tree, content):
        self.tree, self.content = tree, content

    def mesh(self):
        """All that the scene shows, in its frame."""
        self._refuse_extensions()
        vertices, faces, count, triangles, shown = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0, 0, 0
        for number, place in self._shown():
            parts = self._item("meshes", number)["primitives"]
            shown += len(parts)
            if shown > MOST_PARTS:
                raise InputError(f"it shows more than {MOST_PARTS} parts")
            for points, corners in self._shapes(parts):
                triangles += len(corners)
                if max(triangles, count + len(points)) > MOST_TRIANGLES:
                    raise InputError(f"it shows more than {MOST_TRIANGLES} triangles or vertices")
                vertices.append(points @ place[:3, :3].T + place[:3, 3])
                # A mirror turns faces over.
                faces.append(count + (corners[:, ::-1] if np.linalg.det(place[:3, :3]) < 0.0 else corners))
                count += len(points)
        return np.concatenate(vertices), np.concatenate(faces)

    def _refuse_extensions(self):
        """Refuse what the file says cannot be left out, and what would be shown more than once."""
        required = [name for name in self.tree.get("extensionsRequired", ()) if not name.startswith(_LOOKS)]
        named = required + [name for name in self.tree.get("extensionsUsed", ()) if name == _COPIES]
        if named:
            raise InputError(f"it needs {str(named[0])[:60]}, which is not read here; save it without")

    def _item(self, kind, number):
        items = self.tree[kind]
        if not isinstance(number, int) or not 0 <= number < len(items):
            raise InputError(f"it asks for {kind} {number} of {len(items)}")
        return items[number]

    def _shown(self):
        """Numbers of meshes, and where they are (4, 4)."""
        nodes = self.tree.get("nodes", [])
        inner = {child for node in nodes for child in node.get("children", ())}
        roots = [k for k in range(len(nodes)) if k not in inner]
        if "scenes" in self.tree:
            roots = self._item("scenes", self.tree.get("scene", 0)).get("nodes", [])
        waiting, seen = [(root, np.eye(4)) for root in reversed(roots)], set()
        while waiting:
            number, outer = waiting.pop()
            if number in seen:
                raise InputError(f"its node {number} is in two places")
            seen.add(number)
            node = self._item("nodes", number)
            place = outer @ _placed(node)
            if "mesh" in node:
                self._refuse_bent(node)
                yield node["mesh"], place
            waiting += [(child, place) for child in reversed(node.get("children", ()))]

    def _refuse_bent(self, node):
        """Refuse a mesh whose vertices are moved by weights."""
        weights = node.get("weights", self._item("meshes", node["mesh"]).get("weights", ()))
        if any(weights):
            raise InputError(f"it is bent by the weights {str(weights)[:60]}; save it as it is shown")

    def _shapes(self, parts):
        """Vertices and faces of the parts of a mesh; lines and points have none."""
        for part in parts:
            mode = part.get("mode", _TRIANGLES)
            if mode in _STRIPS or "KHR_draco_mesh_compression" in part.get("extensions", {}):
                raise InputError("it holds strips of triangles or compressed ones; save it with plain ones")
            if mode != _TRIANGLES:
                continue
            points = self._numbers(part["attributes"]["POSITION"], 3, "f").astype(float)
            if "indices" in part:
                corners = self._numbers(part["indices"], 1, "u").astype(np.int64).reshape(-1, 3)
            else:
                corners = np.arange(len(points)).reshape(-1, 3)
            yield points, checked(points, corners)

    def _numbers(self, number, width, sort):
        """The rows of an accessor, (N, width)."""
        about = self._item("accessors", number)
        if "sparse" in about or "bufferView" not in about:
            raise InputError("it leaves out numbers that are zero; save it with all")
        view = self._item("bufferViews", about["bufferView"])
        if view["buffer"] != 0 or "uri" in self._item("buffers", 0):
            raise InputError("a part of it is in another file; save it in one")
        kind = np.dtype(_GLB_TYPES[about["componentType"]])
        step = view.get("byteStride", width * kind.itemsize)
        start, count = view.get("byteOffset", 0) + about.get("byteOffset", 0), about["count"]
        if kind.kind != sort or about["type"] != {1: "SCALAR", 3: "VEC3"}[width] or step < width * kind.itemsize:
            raise InputError("it has coordinates or numbers of vertices of an unknown kind")
        end = min(len(self.content), view.get("byteOffset", 0) + view["byteLength"])
        if min(start, count) < 0 or start + count * step > end + step - width * kind.itemsize:
            raise InputError(f"it should hold {count} rows of numbers, but ends before")
        return np.ndarray((count, width), kind, self.content, start, (step, kind.itemsize))


def _placed(node):
    """Where a node is in the one around it, (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    if abs(x * x + y * y + z * z + w * w - 1.0) > 0.01:
        raise InputError(f"it has the rotation {(x, y, z, w)}, which is no unit quaternion")
    turn = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    place = np.eye(4)
    place[:3, :3] = np.array(turn) * np.array(node.get("scale", (1, 1, 1)), dtype=float)
    place[:3, 3] = node.get("translation", (0, 0, 0))
    return place
