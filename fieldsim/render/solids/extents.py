"""How large hard shapes are: their smallest lengths, and boxes around them."""

import numpy as np

from fieldsim.render.solids.packing import Solids
from fieldsim.world import shapes


def smallest(kinds, sizes):
    """The smallest length of each shape, that of its tile for a plane."""
    result = np.where(sizes > 0.0, sizes, np.inf)
    columns = {shapes.TUBE: [1], shapes.PRISM: [3], shapes.SLAB: [1, 2, 3]}
    for kind, used in columns.items():
        where = kinds == kind
        result[where] = np.where(np.isin(np.arange(shapes.SIZES), used), result[where], np.inf)
    least = result.min(axis=1, initial=np.inf)
    return np.where(np.isfinite(least), least, 0.0)


def boxes(solids: Solids, which, sizes) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coordinates (n, 3), in their own frames, of the shapes `which` with `sizes` (n, SIZES)."""
    kinds, s = solids.kinds[which], sizes[: len(which)]
    zero = np.zeros(len(which))
    round_ = np.stack([s[:, 0], s[:, 0], s[:, 1]], axis=1)
    halves = {
        shapes.BALL: np.repeat(s[:, :1], 3, axis=1),
        shapes.ELLIPSOID: s[:, :3],
        shapes.CYLINDER: round_,
        shapes.CAPSULE: round_ + s[:, :1] * (0, 0, 1),
        shapes.BOX: s[:, :3],
        shapes.TUBE: np.stack([s[:, 0] + s[:, 1], s[:, 0] + s[:, 1], s[:, 1]], axis=1),
        shapes.PRISM: np.repeat(s[:, 3:], 3, axis=1),
        shapes.SLAB: np.stack([s[:, 1], s[:, 2], s[:, 0]], axis=1),
    }
    high = np.select([(kinds == kind)[:, None] for kind in halves], list(halves.values()), 0.0)
    low = -high
    prisms = (kinds == shapes.PRISM)[:, None]
    corners = np.stack([np.stack([zero, s[:, 0], s[:, 1]]), np.stack([zero, zero, s[:, 2]]), np.zeros((3, len(which)))])
    low = np.where(prisms, low + corners.min(axis=1).T, low)
    high = np.where(prisms, high + corners.max(axis=1).T, high)
    for row in np.flatnonzero(kinds == shapes.MESH):
        half = solids.surfaces[which[row]].box[1] / solids.sizes[which[row], 0] * s[row, 0]
        low[row], high[row] = -half, half
    return low, high
