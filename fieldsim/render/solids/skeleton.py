"""Skeletons drawn as hard shapes: each primitive as its offset by the material's radius, or as thin lines.

Points become balls, segments capsules, arcs tubes, triangles prisms with round edges, planes slabs; as lines, triangles
become their edges.
"""

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from fieldsim.potentials import registry
from fieldsim.potentials.elements import concatenate
from fieldsim.potentials.primitives.base import Volume
from fieldsim.potentials.row import (
    ANGLE,
    CENTER,
    CORNER_A,
    CORNER_B,
    CORNER_C,
    END,
    FIRST,
    NORMAL,
    POINT,
    POSITIONS,
    RADIUS,
    START,
)
from fieldsim.render.solids.packing import Solids, joined, solids_of
from fieldsim.sources.elements import surface_of
from fieldsim.world import shapes

MODES = ("soft", "hard", "skeleton")
# Half the width of a skeleton's lines, and the radius of its points, in pixels.
LINE, DOT = 1.25, 3.0


def drawn(snapshot, mode: str, eye: np.ndarray, pixel: float):
    """(soft `Surface`, hard `Solids`) of a snapshot in a mode of drawing.

    eye (3,); pixel: angular size of a pixel, the unit of the width of a skeleton's lines.
    """
    surface = surface_of(snapshot)
    if mode == "soft" or not len(surface.elements):
        return surface, solids_of(snapshot)
    if mode == "hard":
        hard = offset_solids(surface, _radii(surface))
    else:
        hard = _lines(surface, eye, pixel)
    nothing = dataclasses.replace(surface, elements=concatenate([]), owner=surface.owner[:0])
    # The world's own shapes keep their numbers: they come first.
    return nothing, joined([solids_of(snapshot), hard])


def offset_solids(surface, radius: np.ndarray) -> Solids:
    """Everything within `radius` (N,) of each of the N elements."""
    return _solids(surface, radius, lambda rows, radii: [_prisms(rows, radii)])


def _radii(surface):
    """Radius (N,) of each element's material."""
    return np.array([material.radius for material in surface.materials])[surface.owner]


def _lines(surface, eye, pixel):
    """Elements as lines of one width in pixels (at their middles), at most as thick as the material's radius."""
    rows = surface.elements.rows
    corners = rows[:, POSITIONS].reshape(-1, 3, 3)
    middle = 0.5 * (corners[:, 0] + np.where(_filling(surface, Volume.CAPSULE)[:, None], corners[:, 1], corners[:, 0]))
    distance = np.linalg.norm(middle - eye, axis=1)
    width = np.where(_filling(surface, Volume.BALL), DOT, LINE)
    return _solids(surface, np.minimum(width * pixel * distance, _radii(surface)), _edges)


def _filling(surface, volume):
    """Which elements' primitives have the volume, (N,)."""
    kinds = [c.kind for c in registry.FORMULAS.values() if c.primitive.volume is volume]
    return np.isin(surface.elements.kinds, kinds)


def _solids(surface, radius, draw_triangles):
    """Elements as hard shapes; draw_triangles(rows, radii) gives lists of what `_balls` and its like return."""
    parts, owners = [], []
    draws: dict[Volume, Callable] = {**_DRAWN, Volume.PRISM: draw_triangles}
    for volume, draw in draws.items():
        where = _filling(surface, volume)
        if where.any():
            for part in draw(surface.elements.rows[where], radius[where]):
                parts.append(part)
                owners.append(surface.owner[where])
    kinds, origins, axes, sizes = (np.concatenate(column) for column in zip(*parts, strict=True))
    count = len(kinds)
    owner = np.concatenate(owners).astype(np.int32)
    # A ball turns with its body; other shapes have axes of their own.
    balls = kinds == shapes.BALL
    axes[balls] = np.array([pose.matrix for pose in surface.poses])[owner[balls]]
    nothing = np.zeros((count, 3)), (None,) * count
    return Solids(kinds, origins, axes, sizes, *nothing, surface.materials, owner, surface.poses)


def _packed(kind, origins, axes, *sizes):
    """(kinds, origins, axes, sizes) of shapes of one kind."""
    table = np.zeros((len(origins), shapes.SIZES))
    for column, values in enumerate(sizes):
        table[:, column] = values
    return np.full(len(origins), kind, dtype=np.int32), origins, axes, table


def _balls(rows, radius):
    return [_packed(shapes.BALL, rows[:, POINT], np.broadcast_to(np.eye(3), (len(rows), 3, 3)), radius)]


def _capsules(rows, radius):
    return [_rods(rows[:, START], rows[:, END], radius)]


def _rods(start, end, radius):
    """Capsules from start to end."""
    length = np.linalg.norm(end - start, axis=1)
    axes = shapes.frame_along((end - start) / length[:, None])
    return _packed(shapes.CAPSULE, 0.5 * (start + end), axes, radius, 0.5 * length)


def _tubes(rows, radius):
    half = 0.5 * rows[:, ANGLE]
    start, normal = rows[:, FIRST], rows[:, NORMAL]
    middle = np.cos(half)[:, None] * start + np.sin(half)[:, None] * np.cross(normal, start)
    axes = np.stack([middle, np.cross(normal, middle), normal], axis=2)
    half = np.where(rows[:, ANGLE] > 2 * math.pi - 1e-6, math.pi, half)
    return [_packed(shapes.TUBE, rows[:, CENTER], axes, rows[:, RADIUS], radius, half)]


def _prisms(rows, radius):
    a, b, c = rows[:, CORNER_A], rows[:, CORNER_B], rows[:, CORNER_C]
    length = np.linalg.norm(b - a, axis=1)
    x, z = (b - a) / length[:, None], rows[:, NORMAL]
    y = np.cross(z, x)
    along, across = (np.einsum("ij,ij->i", c - a, axis) for axis in (x, y))
    return _packed(shapes.PRISM, a, np.stack([x, y, z], axis=2), length, along, across, radius)


def _edges(rows, radius):
    corners = [rows[:, CORNER_A], rows[:, CORNER_B], rows[:, CORNER_C]]
    return [_rods(corners[k], corners[(k + 1) % 3], radius) for k in range(3)]


def _slabs(rows, radius):
    return [_packed(shapes.SLAB, rows[:, POINT], shapes.frame_along(rows[:, NORMAL]), radius)]


# In the order in which hard shapes are numbered. How prisms are drawn is the caller's.
_DRAWN = {
    Volume.BALL: _balls,
    Volume.CAPSULE: _capsules,
    Volume.TUBE: _tubes,
    Volume.SLAB: _slabs,
}
