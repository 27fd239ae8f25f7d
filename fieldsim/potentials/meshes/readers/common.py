"""What readers of several formats share."""

import numpy as np

from fieldsim.errors import InputError


def checked(vertices, faces):
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


def coordinates(rows):
    """The first three words of each row as numbers."""
    short = next((k for k, row in enumerate(rows) if len(row) < 3), None)
    if short is not None:
        raise InputError(f"its vertex {short}, counted from 0, has {len(rows[short])} coordinates")
    return np.fromiter((float(word) for row in rows for word in row[:3]), dtype=float).reshape(-1, 3)


def fans(polygons):
    """Triangles of polygons, each about its first corner."""
    if isinstance(polygons, np.ndarray) and polygons.shape[1] == 3:
        return polygons.astype(np.int64)
    short = next((k for k, polygon in enumerate(polygons) if len(polygon) < 3), None)
    if short is not None:
        raise InputError(f"its face {short} has {len(polygons[short])} corners")
    fans = [(p[0], p[k], p[k + 1]) for p in polygons for k in range(1, len(p) - 1)]
    return np.array(fans, dtype=np.int64).reshape(-1, 3)


def expect_lines(count, noun, there):
    """Raise InputError unless there are lines enough for a count that the file names."""
    if not 0 <= count <= there:
        raise InputError(f"it should hold {count} {noun}, but has lines for {max(there, 0)}")


def expect_end(rest):
    """Raise InputError for anything left over."""
    if rest:
        raise InputError("it holds more than it says")


def whole_numbers(words, at):
    """Whole numbers of a list of words that begins with their count, and where it ends."""
    end = at + 1 + int(words[at])
    if not at < end <= len(words):
        raise InputError(f"it has a list of {int(words[at])} numbers in a line of {len(words)}")
    return list(map(int, words[at + 1 : end])), end
