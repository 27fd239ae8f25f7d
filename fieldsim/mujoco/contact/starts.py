"""Places inside elements where searches begin that find no field at a foot: beside zeros of profiles, and in craters.

Where a profile is 0, or an element of negative strength or profile takes the field away, an element leaves no surface
at its nearest point, though a geom may touch what is left of it: the tip of a spindle, the rims of a hole. Such an
element falls into pieces along which the field of its group is above 0; in each piece the place of greatest field is
kept.
"""

import numpy as np

from fieldsim.potentials import registry
from fieldsim.potentials.row import STRENGTH

# Pieces of an element that are kept at most, and places along it at which the field is looked at.
MOST_STARTS, PLACES = 3, 65
# Rows of places on a surface, along each of its two parameters.
GRID = 12


def starts_of(rows: np.ndarray, kinds: np.ndarray, field) -> tuple[np.ndarray, np.ndarray]:
    """How many starts each element has (N,), and these (N, MOST_STARTS, 3), in the frame of its rows.

    rows (N, >= ROW_WIDTH), kinds (N,): of one group; field: function (points (n, 3)) -> its field there (n,).
    """
    counts, starts = np.zeros(len(rows)), np.zeros((len(rows), MOST_STARTS, 3))
    parts = registry.parts_of(kinds) if len(kinds) else []
    # A profile may be negative, too.
    if not (rows[:, STRENGTH] < 0.0).any() and not any(formula.primitive.profiled for formula, _ in parts):
        return counts, starts
    for formula, which in parts:
        primitive = formula.primitive
        if not primitive.feet or primitive.dimension not in (1, 2):
            continue
        for i in np.arange(len(rows))[which]:
            if rows[i, STRENGTH] > 0.0:
                found = _inside(primitive, rows[i], field)
                counts[i], starts[i, : len(found)] = len(found), found
    return counts, starts


def _inside(primitive, row, field):
    """Places (n, 3) of one element; none where the field is above 0 all over it."""
    u, v, pieces = _parameters(primitive.dimension)
    places = primitive.row_places(np.tile(row, (len(u), 1)), u[:, None], v[:, None])
    values = field(places)
    if (values > 0.0).all():
        return np.zeros((0, 3))
    pieces = pieces(values > 0.0)
    best = [piece[np.argmax(values[piece])] for piece in pieces]
    best.sort(key=lambda k: -values[k])
    return places[best[:MOST_STARTS]]


def _parameters(dimension):
    """Parameters u and v (n,) of places on an element, and a function: which of them have a field -> pieces of these.

    Pieces are indices: of a curve runs of neighbours, of a surface what is nearest to the same corner.
    """
    if dimension == 1:
        u = np.linspace(0.0, 1.0, PLACES)
        return u, np.zeros(PLACES), _runs
    u, v = (np.ravel(part) for part in np.meshgrid(*[np.linspace(0.0, 1.0, GRID)] * 2))
    u, v = u[u + v <= 1.0], v[u + v <= 1.0]
    corner = np.argmax([1.0 - u - v, u, v], axis=0)
    return u, v, lambda filled: [k for k in (np.flatnonzero(filled & (corner == c)) for c in range(3)) if len(k)]


def _runs(filled):
    places = np.flatnonzero(filled)
    return [run for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if len(run)]
