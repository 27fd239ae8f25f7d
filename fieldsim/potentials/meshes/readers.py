"""Files of triangle meshes, which may come from anyone: STL, OBJ, PLY, OFF and GLB.

A reader takes the bytes of a file and gives vertices (V, 3) and faces (F, 3). It opens no other file, and holds counts
that the file names against its size before it takes memory for them. It raises InputError with the end of a sentence
about the file, or whatever Python does on nonsense.
"""

import json
import os
import re
import struct
from typing import Any

import numpy as np

from fieldsim.errors import InputError

# Of a scene that shows its parts again and again; files themselves are as large as what they hold.
MOST_TRIANGLES = 1 << 25
MOST_PARTS = 1 << 16


def read(path: str):
    """Vertices (V, 3) and faces (F, 3) of a file; InputError, naming it, for one that is no sound mesh."""
    bad = f"mesh: {path!r} cannot be read as a triangle mesh"
    if not os.path.isfile(path):
        raise InputError(f"mesh: there is no file {path!r}; give the path of one")
    reader = READERS.get(os.path.splitext(path)[1].lower())
    if reader is None:
        raise InputError(f"{bad}: its name should end in one of {', '.join(READERS)}; save it as one of them")
    try:
        with open(path, "rb") as file, np.errstate(all="ignore"):
            # Some editors put a mark of three bytes before a text.
            vertices, faces = reader(file.read().removeprefix(b"\xef\xbb\xbf"))
            return vertices, _checked(vertices, faces)
    except InputError as reason:
        raise InputError(f"{bad}: {reason}") from None
    except OSError as reason:
        raise InputError(f"{bad}: {reason.strerror}") from None
    except Exception:  # whatever comes of taking nonsense for numbers, names and counts
        raise InputError(f"{bad}: it is damaged, or no {os.path.splitext(path)[1][1:].upper()}") from None


def _checked(vertices, faces):
    """The faces, whose numbers of vertices are there."""
    bad = np.flatnonzero(((faces < 0) | (faces >= len(vertices))).any(axis=1))
    if bad.size:
        raise InputError(
            f"its face {bad[0]} is {faces[bad[0]].tolist()}, counted from 0, but there are {len(vertices)} vertices"
        )
    far = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if far.size:
        raise InputError(f"its vertex {far[0]} is {tuple(vertices[far[0]].tolist())}, counted from 0")
    return faces


def _coordinates(rows):
    """The first three words of each row as numbers."""
    short = next((k for k, row in enumerate(rows) if len(row) < 3), None)
    if short is not None:
        raise InputError(f"its vertex {short}, counted from 0, has {len(rows[short])} coordinates")
    return np.fromiter((float(word) for row in rows for word in row[:3]), dtype=float).reshape(-1, 3)


def _fans(polygons):
    """Triangles of polygons, each about its first corner."""
    if isinstance(polygons, np.ndarray) and polygons.shape[1] == 3:
        return polygons.astype(np.int64)
    short = next((k for k, polygon in enumerate(polygons) if len(polygon) < 3), None)
    if short is not None:
        raise InputError(f"its face {short} has {len(polygons[short])} corners")
    fans = [(p[0], p[k], p[k + 1]) for p in polygons for k in range(1, len(p) - 1)]
    return np.array(fans, dtype=np.int64).reshape(-1, 3)


# STL

STL_ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("color", "<u2")])


def _stl(data):
    count = int.from_bytes(data[80:84], "little")
    size = 84 + 50 * count
    if len(data) == size:
        corners = np.frombuffer(data, STL_ROW, count, offset=84)["corners"]
    elif data.lstrip()[:5].lower() == b"solid":
        corners = _stl_text(data)
    elif len(data) < 84:
        raise InputError(f"an STL has at least 84 bytes, it has {len(data)}")
    else:
        raise InputError(f"it should hold {count} triangles, which take {size} bytes, but it has {len(data)}")
    return corners.reshape(-1, 3).astype(float), np.arange(3 * len(corners)).reshape(-1, 3)


def _stl_text(data):
    corners = _coordinates(re.findall(rb"(?im)^[ \t]*vertex\s+(\S+)\s+(\S+)\s+(\S+)", data))
    begun, ended = (len(re.findall(rb"(?im)^[ \t]*" + word, data)) for word in (rb"facet\s", rb"endfacet\b"))
    last = data.rstrip().rpartition(b"\n")[2].lower()
    if begun != ended or last.split()[:1] != [b"endsolid"]:
        raise InputError("it is cut off")
    if len(corners) != 3 * begun:
        raise InputError(f"its {begun} facets should have three corners each, but it has {len(corners)}")
    return corners.reshape(-1, 3, 3)


# OBJ


def _obj(data):
    vertices, polygons = [], []
    for number, line in enumerate(data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines(), start=1):
        word, *rest = line.partition(b"#")[0].split() or [b""]
        if word == b"v":
            vertices.append(rest)
        elif word == b"f":
            polygons.append(_obj_corners(rest, len(vertices), number))
    return _coordinates(vertices), _fans(polygons)


def _obj_corners(words, count, line):
    """Numbers of vertices, from 0; the file counts from 1, or, below 0, back from the last one so far."""
    corners = [int(word.partition(b"/")[0]) for word in words]
    if len(corners) < 3 or 0 in corners or min(corners) < -count:
        raise InputError(f"its line {line} is no face: {b' '.join(words)[:60].decode(errors='replace')!r}")
    return [c - 1 if c > 0 else count + c for c in corners]


# OFF


def _off(data):
    lines = [line.split() for line in (line.partition(b"#")[0] for line in data.splitlines()) if line.strip()]
    if not lines or not re.fullmatch(rb"(ST)?C?N?OFF", lines[0][0]) or b"BINARY" in lines[0]:
        raise InputError("it does not begin with OFF")
    # Counts stand in the first line, or in the next.
    rows = [lines[0][1:], *lines[1:]] if lines[0][1:] else lines[1:]
    (vertex_count, face_count), rows = map(int, rows[0][:2]), rows[1:]
    _expect_lines(vertex_count, "vertices", len(rows))
    _expect_lines(face_count, "faces", len(rows) - vertex_count)
    faces = rows[vertex_count : vertex_count + face_count]
    _expect_end(rows[vertex_count + face_count :])
    return _coordinates(rows[:vertex_count]), _fans([_listed(row, 0)[0] for row in faces])


def _expect_lines(count, noun, there):
    if not 0 <= count <= there:
        raise InputError(f"it should hold {count} {noun}, but has lines for {max(there, 0)}")


def _expect_end(rest):
    if rest:
        raise InputError("it holds more than it says")


def _listed(words, at):
    """Whole numbers of a list of words that begins with their count, and where it ends."""
    end = at + 1 + int(words[at])
    if not at < end <= len(words):
        raise InputError(f"it has a list of {int(words[at])} numbers in a line of {len(words)}")
    return list(map(int, words[at + 1 : end])), end


# PLY

_PLY_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    **{f"{name}{8 * size}": f"{name[0]}{size}" for name in ("int", "uint") for size in (1, 2, 4)},
    "float32": "f4",
    "float64": "f8",
}
_CORNERS = ("vertex_indices", "vertex_index")


def _ply(data):
    head = re.match(rb"(?s)ply\s.*?\nend_header *\r?\n", data)
    if not head:
        raise InputError("it has no header of a PLY")
    form, elements = _ply_header(head[0].decode("latin-1").splitlines())
    body: Any = data[head.end() :]
    if form == "ascii":
        read, body = _ply_lines, [line.split() for line in body.splitlines() if line.strip()]
    else:
        read, body = _PlyBytes({"binary_little_endian": "<", "binary_big_endian": ">"}[form]), memoryview(body)
    found, at = {}, 0
    for name, count, properties in elements:
        if properties:
            found[name], at = read(name, count, properties, body, at)
    rest = body[at:]
    _expect_end(rest.tobytes().strip(b"\0 \r\n") if isinstance(rest, memoryview) else rest)
    if "tristrips" in found:
        raise InputError("it holds strips of triangles; save it with single ones")
    corners = next((found["face"][n] for n in _CORNERS if n in found.get("face", {})), [])
    return np.stack([np.asarray(found["vertex"][axis], dtype=float) for axis in "xyz"], axis=1), _fans(corners)


def _ply_header(lines):
    """The form, and elements (name, count, properties); a property is (name, type) or (name, type, type of count)."""
    form, elements = "", []
    for line in lines:
        match line.split():
            case ["format", form, *_]:
                pass
            case ["element", name, count]:
                elements.append((name, int(count), []))
            case ["property", "list", count, kind, name]:
                if "f" in _PLY_TYPES[count] + _PLY_TYPES[kind] * (name in _CORNERS):
                    raise InputError(f"its {name} are no whole numbers")
                elements[-1][2].append((name, _PLY_TYPES[kind], _PLY_TYPES[count]))
            case ["property", kind, name]:
                elements[-1][2].append((name, _PLY_TYPES[kind]))
    return form, elements


def _ply_lines(name, count, properties, lines, at):
    """Columns of an element by their names, of a file of text, and where the next begins."""
    _expect_lines(count, f"elements {name!r}", len(lines) - at)
    columns = {name: [] for name, *_ in properties}
    for words in lines[at : at + count]:
        place = 0
        for column, _, *listed in properties:
            if listed:
                value, place = _listed(words, place)
            else:
                value, place = float(words[place]), place + 1
            columns[column].append(value)
        _expect_end(words[place:])
    return columns, at + count


class _PlyBytes:
    """The same of a file of numbers in bytes of this order."""

    def __init__(self, order):
        self.order = order

    def __call__(self, name, count, properties, body, at):
        least = sum(np.dtype(listed[0] if listed else kind).itemsize for _, kind, *listed in properties)
        if not 0 <= count * least <= len(body) - at:
            raise InputError(f"it should hold {count} elements {name!r}, but ends before")
        if not count:
            return {name: [] for name, *_ in properties}, at
        return self._alike(count, properties, body, at) or self._one_by_one(count, properties, body, at)

    def _alike(self, count, properties, body, at):
        """Where all lists are as long as those of the first element, which is common."""
        first, end = self._one(properties, body, at)
        if count * (end - at) > len(body) - at:
            return None
        fields: list[tuple] = []
        for (name, kind, *listed), value in zip(properties, first, strict=True):
            if listed:
                fields.append((f"count of {name}", self.order + listed[0]))
            fields.append((name, self.order + kind, (len(value),) if listed else ()))
        rows = np.frombuffer(body, np.dtype(fields), count, offset=at)
        for (name, _, *listed), value in zip(properties, first, strict=True):
            if listed and (rows[f"count of {name}"] != len(value)).any():
                return None
        return {name: rows[name] for name, *_ in properties}, at + rows.nbytes

    def _one_by_one(self, count, properties, body, at):
        rows = []
        for _ in range(count):
            row, at = self._one(properties, body, at)
            rows.append(row)
        return {name: column for (name, *_), column in zip(properties, zip(*rows, strict=True), strict=True)}, at

    def _one(self, properties, body, at):
        """Values of the element at a place, and where it ends."""
        values = []
        for _, kind, *listed in properties:
            many = 1
            if listed:
                many = int(np.frombuffer(body, self.order + listed[0], 1, offset=at)[0])
                at += np.dtype(listed[0]).itemsize
            size = np.dtype(kind).itemsize
            if not 0 <= many * size <= len(body) - at:
                raise InputError("it has a list that goes on beyond its end")
            value = np.frombuffer(body, self.order + kind, many, offset=at).tolist()
            values.append(value if listed else value[0])
            at += many * size
        return values, at


# GLB

_GLB_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TRIANGLES, _STRIPS = 4, (5, 6)

# Extensions that change no shape, and the one that shows a mesh in many places.
_LOOKS = ("KHR_materials_", "KHR_texture_", "EXT_texture_")
_COPIES = "EXT_mesh_gpu_instancing"


def _glb(data):
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
            yield points, _checked(points, corners)

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


READERS = {".stl": _stl, ".obj": _obj, ".ply": _ply, ".off": _off, ".glb": _glb}
