"""Files of STL, of text or numbers."""

import re

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials.meshes.readers.common import coordinates

STL_ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("color", "<u2")])


def read_stl(data):
    """Vertices (V, 3) and faces (F, 3) of files of STL, of text or numbers."""
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
    corners = coordinates(re.findall(rb"(?im)^[ \t]*vertex\s+(\S+)\s+(\S+)\s+(\S+)", data))
    begun, ended = (len(re.findall(rb"(?im)^[ \t]*" + word, data)) for word in (rb"facet\s", rb"endfacet\b"))
    last = data.rstrip().rpartition(b"\n")[2].lower()
    if begun != ended or last.split()[:1] != [b"endsolid"]:
        raise InputError("it is cut off")
    if len(corners) != 3 * begun:
        raise InputError(f"its {begun} facets should have three corners each, but it has {len(corners)}")
    return corners.reshape(-1, 3, 3)
