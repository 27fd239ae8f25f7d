"""Adaptive cross approximation (Bebendorf 2000) of a kernel between two cells of nodes."""

from collections.abc import Callable

import numpy as np

from fieldsim.potentials.fast_summation import chebyshev

# It ends when so many crosses in a row are small, and what is left of so many columns is, too.
SMALL_ONES, PROBES = 3, 24
# Crosses are chosen among the nodes of a grid that is coarser by this share, but of enough nodes along an edge, and
# filled in on the fine one.
COARSER, ENOUGH = 0.7, 8


def crosses(values: Callable, shift: np.ndarray, order: int, error: float) -> tuple[np.ndarray, np.ndarray]:
    """values(squares) between nodes shifted by (3,) and nodes, as a sum of crosses: factors (order^3, rank) each.

    error: about what is left at any two nodes. Both factors are as large.
    """
    coarse, fine = chebyshev.grid(max(min(order, ENOUGH), round(COARSER * order))), chebyshev.grid(order)
    targets, sources, lower, upper = _chosen(values(_squares(coarse + shift, coarse)), error)
    columns = values(_squares(fine + shift, coarse[sources]))
    rows = values(_squares(coarse[targets] + shift, fine))
    # K is columns (lower upper)^-1 rows; both triangles have ones on their diagonals, and no larger numbers.
    sizes = np.diag(upper)
    columns = columns @ np.linalg.inv(upper / sizes[:, None])
    rows = np.linalg.inv(lower) @ rows
    scale = np.sqrt(np.abs(sizes))
    return columns * (np.sign(sizes) / scale), (rows / scale[:, None]).T


def _squares(points, others):
    """Squared distances (N, M) of points (N, 3) and others (M, 3)."""
    return sum((points[:, axis, None] - others[None, :, axis]) ** 2 for axis in range(3))


def _chosen(matrix, error):
    """Rows and columns (rank,) of the crosses of a matrix (N, N), and its triangular factors there (rank, rank)."""
    most = len(matrix)
    columns, rows = np.zeros((most, most)), np.zeros((most, most))
    unused = np.ones(most, dtype=bool)
    targets, sources = [], []
    probes = np.linspace(0, most - 1, min(most, PROBES)).astype(int)
    left = matrix[:, probes].copy()
    pivot, small = 0, 0
    while len(targets) < most and small < SMALL_ONES:
        rank = len(targets)
        row = matrix[pivot] - columns[:rank, pivot] @ rows[:rank]
        other = int(np.argmax(np.abs(row)))
        if row[other] == 0.0:
            break
        column = (matrix[:, other] - rows[:rank, other] @ columns[:rank]) / row[other]
        columns[rank], rows[rank] = column, row
        targets.append(pivot)
        sources.append(other)
        unused[pivot] = False
        left -= column[:, None] * row[probes]
        small = small + 1 if np.abs(column).max() * np.abs(row[other]) < error else 0
        # The next row is where the last column was large; where it seems that all is done, where most is left.
        sizes = np.abs(left).max(axis=1) if small else np.abs(column)
        pivot = int(np.argmax(np.where(unused, sizes, -1.0)))
        if small and sizes[pivot] > error:
            small = 0
    rank = len(targets)
    lower, upper = columns[:rank, targets].T, rows[:rank][:, sources]
    return np.array(targets), np.array(sources), np.tril(lower), np.triu(upper)
