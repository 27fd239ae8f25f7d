"""Files of PLY, of text or numbers."""

import re
from typing import Any

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials.meshes.readers.common import expect_end, expect_lines, fans, whole_numbers

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


def read_ply(data):
    """Vertices (V, 3) and faces (F, 3) of files of PLY, of text or numbers."""
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
    expect_end(rest.tobytes().strip(b"\0 \r\n") if isinstance(rest, memoryview) else rest)
    if "tristrips" in found:
        raise InputError("it holds strips of triangles; save it with single ones")
    corners = next((found["face"][n] for n in _CORNERS if n in found.get("face", {})), [])
    return np.stack([np.asarray(found["vertex"][axis], dtype=float) for axis in "xyz"], axis=1), fans(corners)


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
    expect_lines(count, f"elements {name!r}", len(lines) - at)
    columns = {name: [] for name, *_ in properties}
    for words in lines[at : at + count]:
        place = 0
        for column, _, *listed in properties:
            if listed:
                value, place = whole_numbers(words, place)
            else:
                value, place = float(words[place]), place + 1
            columns[column].append(value)
        expect_end(words[place:])
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
