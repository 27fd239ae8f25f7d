"""Files of OBJ."""

from fieldsim.errors import InputError
from fieldsim.potentials.meshes.readers.common import coordinates, fans


def read_obj(data):
    """Vertices (V, 3) and faces (F, 3) of files of OBJ."""
    vertices, polygons = [], []
    for number, line in enumerate(data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines(), start=1):
        word, *rest = line.partition(b"#")[0].split() or [b""]
        if word == b"v":
            vertices.append(rest)
        elif word == b"f":
            polygons.append(_obj_corners(rest, len(vertices), number))
    return coordinates(vertices), fans(polygons)


def _obj_corners(words, count, line):
    """Numbers of vertices, from 0; the file counts from 1, or, below 0, back from the last one so far."""
    corners = [int(word.partition(b"/")[0]) for word in words]
    if len(corners) < 3 or 0 in corners or min(corners) < -count:
        raise InputError(f"its line {line} is no face: {b' '.join(words)[:60].decode(errors='replace')!r}")
    return [c - 1 if c > 0 else count + c for c in corners]
