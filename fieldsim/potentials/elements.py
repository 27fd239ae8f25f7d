"""Elements: primitives with their kernels, packed as rows of numbers (see `potentials.row`)."""

import dataclasses

import numpy as np

from fieldsim.potentials.registry import formula_of
from fieldsim.potentials.row import DIRECTIONS, FOLD, KERNEL_WIDTH, POSITIONS, ROW_WIDTH, STRENGTH

# Softenings below this are none: their powers are no numbers.
BARE = 1e-60


@dataclasses.dataclass(frozen=True)
class Elements:
    """Packed elements, grouped by formula. rows (N, ROW_WIDTH) float64; kinds, order: (N,) int32, whence each came."""

    rows: np.ndarray
    kinds: np.ndarray
    order: np.ndarray

    @property
    def kinds_used(self) -> tuple[int, ...]:
        """The kinds that occur, ascending: the key under which code is compiled."""
        return tuple(np.unique(self.kinds).tolist())

    def __len__(self) -> int:
        return len(self.kinds)

    def scaled(self, factor: float) -> "Elements":
        """The elements with their strengths multiplied."""
        rows = self.rows.copy()
        rows[:, STRENGTH] *= factor
        _quiet(rows)
        return dataclasses.replace(self, rows=rows)

    def placed(self, rotation: np.ndarray, position) -> "Elements":
        """The elements moved from the body's frame to the world's: x -> rotation x + position, for all of them."""
        return dataclasses.replace(self, rows=place(self.rows, rotation, np.array(position)))

    def grouped(self) -> tuple["Elements", np.ndarray]:
        """The elements sorted by formula, and the permutation that sorts them."""
        by = np.argsort(self.kinds, kind="stable")
        return Elements(self.rows[by], self.kinds[by], self.order[by]), by


def pack(primitives, kernels, strengths, folds=None) -> Elements:
    """Elements of concrete primitives, one kernel and one strength each, grouped by formula."""
    rows = np.zeros((len(primitives), ROW_WIDTH))
    kinds = np.zeros(len(primitives), dtype=np.int32)
    for row, (primitive, kernel) in enumerate(zip(primitives, kernels, strict=True)):
        kinds[row] = formula_of(kernel, primitive).kind
        rows[row, KERNEL_WIDTH] = kernel.width
        primitive.pack(rows[row])
    rows[:, STRENGTH] = strengths
    rows[:, FOLD] = 0.0 if folds is None else folds
    _quiet(rows)
    return Elements(rows, kinds, np.arange(len(kinds))).grouped()[0]


def with_strengths(rows: np.ndarray, strengths: np.ndarray) -> np.ndarray:
    """Rows (elements, ROW_WIDTH) with each of some strengths (N,), the same for all: (N, elements, ROW_WIDTH)."""
    rows = np.broadcast_to(rows, (len(strengths), *rows.shape)).copy()
    rows[..., STRENGTH] = strengths[:, None]
    _quiet(rows)
    return rows


def _quiet(rows):
    """Soften what has no strength: 0 times the infinite field of a bare source is 0, not nan."""
    rows[(rows[..., STRENGTH] == 0.0) & (rows[..., KERNEL_WIDTH] < BARE), KERNEL_WIDTH] = 1.0


def concatenate(parts) -> Elements:
    """Several `Elements` as one, kept in the given order (not grouped again)."""
    parts = list(parts)
    if not parts:
        return Elements(np.zeros((0, ROW_WIDTH)), np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.int64))
    return Elements(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("rows", "kinds", "order")))


def place(rows: np.ndarray, rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Rows moved from the body's frame to the world's: x -> rotation x + position.

    rows (..., ROW_WIDTH); rotation (..., 3, 3) and position (..., 3) may differ from row to row.
    """
    placed = rows.copy()
    shape = rows.shape[:-1]
    turn = np.swapaxes(rotation, -1, -2)
    positions = rows[..., POSITIONS].reshape(*shape, 3, 3) @ turn + position[..., None, :]
    placed[..., POSITIONS] = positions.reshape(*shape, 9)
    placed[..., DIRECTIONS] = (rows[..., DIRECTIONS].reshape(*shape, 2, 3) @ turn).reshape(*shape, 6)
    return placed
