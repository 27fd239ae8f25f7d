"""Files of OFF."""

import re

from fieldsim.errors import InputError
from fieldsim.potentials.meshes.readers.common import coordinates, expect_end, expect_lines, fans, whole_numbers


def read_off(data):
    """Vertices (V, 3) and faces (F, 3) of files of OFF."""
    lines = [line.split() for line in (line.partition(b"#")[0] for line in data.splitlines()) if line.strip()]
    if not lines or not re.fullmatch(rb"(ST)?C?N?OFF", lines[0][0]) or b"BINARY" in lines[0]:
        raise InputError("it does not begin with OFF")
    # Counts stand in the first line, or in the next.
    rows = [lines[0][1:], *lines[1:]] if lines[0][1:] else lines[1:]
    (vertex_count, face_count), rows = map(int, rows[0][:2]), rows[1:]
    expect_lines(vertex_count, "vertices", len(rows))
    expect_lines(face_count, "faces", len(rows) - vertex_count)
    faces = rows[vertex_count : vertex_count + face_count]
    expect_end(rows[vertex_count + face_count :])
    return coordinates(rows[:vertex_count]), fans([whole_numbers(row, 0)[0] for row in faces])
